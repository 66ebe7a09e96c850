// Mean and spread of the depth of the shadow map over a disc around each place. Before it stand RADIUS, that of the disc in texels, and covering.wgsl.

const SAMPLES = 24;      // neighbours are a third of the radius apart
const TURN = mat2x2<f32>(-0.7373688, 0.6754903, -0.6754903, -0.7373688); // golden angle: the samples lie evenly on the disc (Vogel 1979)

struct Map {
    floor: vec3<f32>,    // its depth: factors of x, y and 1 in clip coordinates
    depth: f32,          // radii of the disc from depth 0 to 1
}

@group(0) @binding(0) var<uniform> map: Map;
@group(0) @binding(1) var shadow_map: texture_depth_2d;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) place: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Fragment {
    let place = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    return Fragment(vec4(place * 2.0 - 1.0, 0.0, 1.0), vec2(place.x, 1.0 - place.y));
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let size = vec2<f32>(textureDimensions(shadow_map));
    let middle = in.place * size;
    var direction = vec2(1.0, 0.0);
    var sum = 0.0;
    var squares = 0.0;
    for (var i = 0; i < SAMPLES; i++) {
        direction = TURN * direction;
        let away = RADIUS * sqrt((f32(i) + 0.5) / f32(SAMPLES));
        let texel = clamp(floor(middle + away * direction), vec2(0.0), size - 1.0);
        let clip = (texel + 0.5) / size * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
        let depth = min(textureLoad(shadow_map, vec2<i32>(texel), 0), dot(map.floor, vec3(clip, 1.0)));
        let below = below_middle(depth, map.depth);
        sum += below;
        squares += below * below;
    }
    let mean = sum / f32(SAMPLES);
    return vec4(mean, sqrt(max(squares / f32(SAMPLES) - mean * mean, 0.0)), 0.0, 0.0);
}
