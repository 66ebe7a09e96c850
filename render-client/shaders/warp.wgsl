// Brings an off-screen picture to the output along a mesh, and corrects its light for what shows it.

struct Correction {
    scene_from_target: mat4x4<f32>, // what a node shows, to the clip space of the picture
    red: vec4<f32>,                 // rows of the colour matrix
    green: vec4<f32>,
    blue: vec4<f32>,
    gamma: vec4<f32>,               // exponents of the responses, 0 for sRGB; w: 1 tints where the mask blends
}

@group(0) @binding(0) var<uniform> correction: Correction;
@group(0) @binding(1) var scene: texture_2d<f32>;
@group(0) @binding(2) var scene_sampler: sampler;
@group(0) @binding(3) var mask: texture_2d<f32>;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) place: vec2<f32>,   // shares of the output, from the lower left
    @location(1) target_point: vec3<f32>,
    @location(2) share: f32,
}

@vertex
fn vertex(
    @location(0) place: vec2<f32>,
    @location(1) target_point: vec3<f32>,
    @location(2) share: f32,
) -> Fragment {
    var fragment: Fragment;
    fragment.clip = vec4(2.0 * place - 1.0, 0.0, 1.0);
    fragment.place = place;
    fragment.target_point = target_point;
    fragment.share = share;
    return fragment;
}

// Share of light at a place of the output, between the middles of the mask's pixels.
fn masked(place: vec2<f32>) -> f32 {
    let size = vec2<i32>(textureDimensions(mask));
    let at = vec2(place.x, 1.0 - place.y) * vec2<f32>(size) - 0.5;
    let low = vec2<i32>(floor(at));
    let part = at - floor(at);
    let last = size - 1;
    let a = textureLoad(mask, clamp(low, vec2(0), last), 0).r;
    let b = textureLoad(mask, clamp(low + vec2(1, 0), vec2(0), last), 0).r;
    let c = textureLoad(mask, clamp(low + vec2(0, 1), vec2(0), last), 0).r;
    let d = textureLoad(mask, clamp(low + vec2(1, 1), vec2(0), last), 0).r;
    return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
}

// What the target encodes again: the light that an sRGB display shows for a signal.
fn srgb_light(signal: f32) -> f32 {
    return select(pow((signal + 0.055) / 1.055, 2.4), signal / 12.92, signal <= 0.04045);
}

// So that light comes out of a projector whose response has this exponent.
fn responded(light: f32, gamma: f32) -> f32 {
    if gamma <= 0.0 {
        return light;
    }
    return srgb_light(pow(light, 1.0 / gamma));
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let seen = correction.scene_from_target * vec4(in.target_point, 1.0);
    let at = 0.5 + vec2(0.5, -0.5) * seen.xy / seen.w;
    // What the picture does not reach is dark; so is what is behind the eye.
    let inside = seen.w > 0.0 && all(at >= vec2(0.0)) && all(at <= vec2(1.0));
    var light = textureSampleLevel(scene, scene_sampler, at, 0.0).rgb;
    light = select(vec3(0.0), light, inside);

    let kept = masked(in.place);
    if correction.gamma.w > 0.0 && kept > 0.001 && kept < 0.999 {
        light = mix(light, vec3(0.9, 0.45, 0.0), 0.35);
    }
    light *= kept * clamp(in.share, 0.0, 1.0);
    let mixed = vec3(
        dot(correction.red.xyz, light), dot(correction.green.xyz, light), dot(correction.blue.xyz, light),
    );
    let sent = clamp(mixed, vec3(0.0), vec3(1.0));
    let gamma = correction.gamma;
    return vec4(responded(sent.r, gamma.r), responded(sent.g, gamma.g), responded(sent.b, gamma.b), 1.0);
}
