// What every shader knows of the eye, the lights and the shadow map. Put before the others.
// Frame: workbench, metres, z up. Colours: linear.

struct Frame {
    clip_from_workbench: mat4x4<f32>,
    workbench_from_clip: mat4x4<f32>,
    shadow_from_workbench: mat4x4<f32>,
    eye: vec4<f32>,          // xyz; w: 1 when the state is stale
    key: vec4<f32>,          // unit, to the light; w: size of a shadow texel, m
    floor: vec4<f32>,        // centre; w: radius, m
    grid: vec4<f32>,         // x: spacing of the lines, m; y, z: nearer is not drawn, farther is drawn whole, m
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;

const KEY_COLOUR = vec3<f32>(1.0, 0.955, 0.88) * 1.40; // a light colour facing it stays below the bend of the tone curve
const FILL_COLOUR = vec3<f32>(0.62, 0.76, 1.0) * 0.26;
const FILL_DIRECTION = vec3<f32>(0.80, -0.52, 0.30); // unit, to the light: low, from the right
const SKY_COLOUR = vec3<f32>(0.44, 0.52, 0.64) * 0.62;
const MATT_SHARE = 0.80;         // of the light, the rest goes into the shine
const GROUND_COLOUR = vec3<f32>(0.30, 0.27, 0.25) * 0.40;

// Share of the key light that reaches a point: 2 x 2 samples, each filtered over 2 x 2 texels.
fn lit_by_key(position: vec3<f32>, normal: vec3<f32>) -> f32 {
    let off_surface = position + normal * (1.6 * frame.key.w);
    let clip = frame.shadow_from_workbench * vec4(off_surface, 1.0);
    let place = clip.xy * vec2(0.5, -0.5) + 0.5;
    if any(place < vec2(0.0)) || any(place > vec2(1.0)) || clip.z > 1.0 {
        return 1.0; // outside the map nothing casts
    }
    let texel = 1.0 / f32(textureDimensions(shadow_map).x);
    var lit = 0.0;
    for (var i = 0; i < 4; i++) {
        let corner = vec2(f32(i & 1), f32(i >> 1u)) - 0.5;
        lit += textureSampleCompareLevel(shadow_map, shadow_sampler, place + corner * (1.6 * texel), clip.z);
    }
    return 0.25 * lit;
}

// Light from all around: less of it near the floor, which hides half of the surroundings.
fn ambient(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let height = (position.z - frame.floor.z) / (0.28 * frame.floor.w);
    let open = mix(0.55, 1.0, smoothstep(0.0, 1.0, height + 0.5 * max(normal.z, 0.0)));
    return open * mix(GROUND_COLOUR, SKY_COLOUR, 0.5 + 0.5 * normal.z);
}

// The key light is strongest over the middle of the scene.
fn key_pool(position: vec3<f32>) -> f32 {
    let away = distance(position.xy, frame.floor.xy) / frame.floor.w;
    return mix(0.25, 1.0, 1.0 - smoothstep(0.12, 0.85, away));
}

// Light that falls on a surface; its share of the key light, for the highlight, in w.
fn falling_light(position: vec3<f32>, normal: vec3<f32>) -> vec4<f32> {
    let to_key = dot(normal, frame.key.xyz);
    let key_share = lit_by_key(position, normal) * smoothstep(0.0, 0.12, to_key) * key_pool(position);
    let light = ambient(position, normal)
        + KEY_COLOUR * (key_share * max(to_key, 0.0))
        + FILL_COLOUR * max(dot(normal, FILL_DIRECTION), 0.0);
    return vec4(light, key_share);
}

// Light leaving a surface towards the eye. `gloss`: x strength, y exponent of the highlight, w share of a metal.
fn surface_light(position: vec3<f32>, normal: vec3<f32>, colour: vec3<f32>, gloss: vec4<f32>) -> vec3<f32> {
    let to_eye = normalize(frame.eye.xyz - position);
    let falling = falling_light(position, normal);
    let away = 1.0 - max(dot(normal, to_eye), 0.0);
    let rim = away * away * away * away;
    let highlight = pow(max(dot(normal, normalize(frame.key.xyz + to_eye)), 0.0), gloss.y);
    let shine = KEY_COLOUR * (falling.w * highlight) + SKY_COLOUR * (0.9 * rim);
    let dielectric = MATT_SHARE * colour * falling.rgb + gloss.x * shine;
    if gloss.w == 0.0 {
        return dielectric;
    }
    // A metal has no colour below its surface: it reflects what is around it in its own, the blurrier the broader its highlight.
    let mirrored = reflect(-to_eye, normal);
    let sky = ambient(position, mirrored);
    let lamp = smoothstep(0.2, 1.0, dot(mirrored, frame.key.xyz));
    // Half of the sky's blue: the rest would turn gold to olive.
    let around = 1.8 * mix(sky, vec3(dot(sky, vec3(0.3333))), 0.5) + KEY_COLOUR * (0.5 * lamp * falling.w);
    let blur = 1.0 / (1.0 + 0.05 * gloss.y);
    let metal = colour * (mix(around, falling.rgb, blur) + gloss.x * KEY_COLOUR * (falling.w * highlight))
        + SKY_COLOUR * (0.5 * rim);
    return mix(dielectric, metal, gloss.w);
}

// Keeps bright parts from clipping and their hue from turning: about linear below 0.6.
fn tone(light: vec3<f32>) -> vec3<f32> {
    let peak = max(max(light.r, light.g), max(light.b, 1e-4));
    let kept = peak / sqrt(sqrt(1.0 + peak * peak * peak * peak));
    return mix(light / peak, vec3(1.0), 0.6 * smoothstep(1.2, 4.0, peak)) * kept;
}

// The colour that leaves a fragment; a stale picture loses its colours.
fn shown(light: vec3<f32>) -> vec3<f32> {
    let colour = tone(light);
    let grey = vec3(dot(colour, vec3(0.2126, 0.7152, 0.0722))) * vec3(0.75, 0.78, 0.85);
    return mix(colour, grey, 0.8 * frame.eye.w);
}

// A threshold between 0 and 1 that differs from pixel to pixel: spreads the steps of 8-bit colours.
fn dither(pixel: vec2<f32>) -> f32 {
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// Share of a fragment that is drawn: less than 1 only for what comes too near for comfort.
fn near_share(clip: vec4<f32>) -> f32 {
    let away = 1.0 / clip.w; // along the screen's normal, m
    return clamp((away - frame.grid.y) / max(frame.grid.z - frame.grid.y, 1e-6), 0.0, 1.0);
}

// The far surroundings in one direction: the same from both screens at their common edge.
fn surroundings(direction: vec3<f32>) -> vec3<f32> {
    let up = direction.z;
    let horizon = vec3(0.042, 0.049, 0.062);
    let above = mix(horizon, vec3(0.010, 0.013, 0.021), smoothstep(0.0, 0.8, up));
    let below = mix(horizon, vec3(0.016, 0.018, 0.023), smoothstep(0.0, 0.6, -up));
    return select(below, above, up > 0.0);
}
