// What every shader knows of the eye, the lights and the shadow map. Put before the others.
// Frame: workbench, metres, z up. Colours: linear. Before this stand SMOOTH, whether edges are worth their cost (pipeline.rs), and
// covering.wgsl.

struct Frame {
    clip_from_workbench: mat4x4<f32>,
    workbench_from_clip: mat4x4<f32>,
    shadow_from_workbench: mat4x4<f32>,
    eye: vec4<f32>,          // xyz; w: 1 when the state is stale
    key: vec4<f32>,          // unit, to the light; w: size of a shadow texel, m
    floor: vec4<f32>,        // centre; w: radius, m
    grid: vec4<f32>,         // x: spacing of the lines, m; y, z: nearer is not drawn, farther is drawn whole, m; w: 1 with reflections
    shade: vec4<f32>,        // x: discs of occlusion.wgsl from depth 0 to 1; y, z: level under the bodies and radius around them, m
    irradiance: array<vec4<f32>, 9>, // over pi: factors of 1, y, z, x, xy, yz, 3zz - 1, xz, xx - yy of the normal
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;

@group(0) @binding(3) var environment: texture_cube<f32>;
@group(0) @binding(4) var environment_sampler: sampler;
@group(0) @binding(5) var occlusion: texture_2d<f32>;

const PI = 3.14159265;
const KEY_COLOUR = vec3<f32>(1.0, 0.955, 0.88) * 1.10; // over pi; a light colour facing it stays below the bend of the tone curve
const MOST_SHINE = 1.1;          // of the lamp: beyond it there is nothing but white
const ROUGHEST_LEVEL = 4.0;      // of the environment
const NARROWEST = 0.07;          // alpha of the sharpest highlight: a narrower one, of a lamp without size, falls between the pixels
const OFF_SURFACE = 0.1;         // of the disc: more than the mean of its samples is off, so that a flat surface does not cover itself
const COVERED = 0.35;            // share of the surroundings that is hidden where the lamp sees nothing of what is around a point. Half of
                                 // them made shadows on the floor black
const DIELECTRIC = vec3<f32>(0.04); // share of light that plastic and glass mirror head-on

// A point in the shadow map, and the step of a texel's size along the normal there.
struct InMap {
    clip: vec3<f32>,
    step: vec3<f32>,
}

fn in_map(position: vec3<f32>, normal: vec3<f32>) -> InMap {
    let step = frame.shadow_from_workbench * vec4(normal * frame.key.w, 0.0);
    return InMap((frame.shadow_from_workbench * vec4(position, 1.0)).xyz, step.xyz);
}

// Share of the key light that reaches a point: 2 x 2 samples, each filtered over 2 x 2 texels; one where edges are not smooth.
fn lit_by_key(in_map: InMap) -> f32 {
    let clip = in_map.clip + in_map.step * 1.6;
    let place = clip.xy * vec2(0.5, -0.5) + 0.5;
    if any(place < vec2(0.0)) || any(place > vec2(1.0)) || clip.z > 1.0 {
        return 1.0; // outside the map nothing casts
    }
    if !SMOOTH {
        return textureSampleCompareLevel(shadow_map, shadow_sampler, place, clip.z);
    }
    let texel = 1.0 / f32(textureDimensions(shadow_map).x);
    var lit = 0.0;
    for (var i = 0; i < 4; i++) {
        let corner = vec2(f32(i & 1), f32(i >> 1u)) - 0.5;
        lit += textureSampleCompareLevel(shadow_map, shadow_sampler, place + corner * (1.6 * texel), clip.z);
    }
    return 0.25 * lit;
}

// Share of the surroundings that bodies around a point let through: as much of the disc around it (occlusion.wgsl) as lies no nearer to the
// lamp than it does, by Chebyshev's inequality. It takes the lamp, which is above, for all that is around. Where a surface turns away from the
// lamp the map shows the body's own other side and nothing of what is before the surface: all is let through there.
fn uncovered(in_map: InMap, to_key: f32) -> f32 {
    let known = smoothstep(0.0, 0.25, to_key);
    if known == 0.0 {
        return 1.0;
    }
    let clip = in_map.clip + in_map.step * (OFF_SURFACE * RADIUS);
    let place = clip.xy * vec2(0.5, -0.5) + 0.5;
    if any(place < vec2(0.0)) || any(place > vec2(1.0)) {
        return 1.0;
    }
    let around = textureSampleLevel(occlusion, environment_sampler, place, 0.0).xy; // mean, spread
    let deeper = max(below_middle(clip.z, frame.shade.x) - around.x, 0.0);
    let variance = around.y * around.y + 1e-4;
    let hidden = deeper * deeper / (variance + deeper * deeper);
    return 1.0 - COVERED * known * hidden;
}

// Share of the surroundings that is seen in a direction: near what the bodies stand on it hides half of them.
fn open_share(position: vec3<f32>, direction: vec3<f32>) -> f32 {
    let height = (position.z - frame.shade.y) / (1.26 * frame.shade.z);
    return mix(0.55, 1.0, smoothstep(0.0, 1.0, height + 0.5 * max(direction.z, 0.0)));
}

// Light of the surroundings that falls on a surface, over pi.
fn ambient(position: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let light = frame.irradiance[0] + frame.irradiance[1] * n.y + frame.irradiance[2] * n.z + frame.irradiance[3] * n.x
        + frame.irradiance[4] * (n.x * n.y) + frame.irradiance[5] * (n.y * n.z) + frame.irradiance[6] * (3.0 * n.z * n.z - 1.0)
        + frame.irradiance[7] * (n.x * n.z) + frame.irradiance[8] * (n.x * n.x - n.y * n.y);
    return open_share(position, n) * max(light.rgb, vec3(0.0));
}

// Light of the surroundings that a surface of this roughness mirrors from about a direction. Without reflections it is that which a
// matt surface would get from there.
fn mirrored_light(position: vec3<f32>, direction: vec3<f32>, roughness: f32) -> vec3<f32> {
    if frame.grid.w == 0.0 {
        return ambient(position, direction);
    }
    let light = textureSampleLevel(environment, environment_sampler, direction, roughness * ROUGHEST_LEVEL).rgb;
    return open_share(position, direction) * light;
}

// The key light is strongest over the middle of the scene.
fn key_pool(position: vec3<f32>) -> f32 {
    let away = distance(position.xy, frame.floor.xy) / frame.floor.w;
    return mix(0.25, 1.0, 1.0 - smoothstep(0.12, 0.85, away));
}

struct Falling {
    light: vec3<f32>,     // over pi
    key_share: f32,       // of the key light, for the highlight
    uncovered: f32,
}

fn falling_light(position: vec3<f32>, normal: vec3<f32>) -> Falling {
    let to_key = dot(normal, frame.key.xyz);
    let place = in_map(position, normal);
    let key_share = lit_by_key(place) * smoothstep(0.0, 0.12, to_key) * key_pool(position);
    let open = uncovered(place, to_key);
    return Falling(open * ambient(position, normal) + KEY_COLOUR * (key_share * max(to_key, 0.0)), key_share, open);
}

// Share of even light from all around that a surface mirrors, by the cosine to the eye: a fit of the split sum's second factor.
// Source: Karis 2014, "Physically based shading on mobile".
fn mirrored_share(head_on: vec3<f32>, roughness: f32, cosine: f32) -> vec3<f32> {
    let r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    let grazing = min(r.x * r.x, exp2(-9.28 * cosine)) * r.x + r.y;
    return head_on * (r.z - 1.04 * grazing) + vec3(r.w + 1.04 * grazing);
}

// What a surface mirrors of a lamp in the direction `to_lamp` that gives it light of 1: microfacets of GGX, whose shadowing is Hammon's,
// and Schlick's reflectance.
// Source: Walter et al. 2007, "Microfacet models for refraction"; Hammon 2017, "PBR diffuse lighting for GGX+Smith microsurfaces".
fn highlight(normal: vec3<f32>, to_eye: vec3<f32>, to_lamp: vec3<f32>, head_on: vec3<f32>, roughness: f32) -> vec3<f32> {
    let alpha = max(roughness * roughness, NARROWEST);
    let between = normalize(to_lamp + to_eye);
    let facing = max(dot(normal, between), 0.0);
    let spread = facing * facing * (alpha * alpha - 1.0) + 1.0;
    let lamp = max(dot(normal, to_lamp), 0.0);
    let eye = max(dot(normal, to_eye), 1e-3);
    let visible = 0.5 / mix(2.0 * lamp * eye + 1e-4, lamp + eye, alpha);
    let grazing = 1.0 - max(dot(to_eye, between), 0.0);
    let squared = grazing * grazing;
    let reflected = head_on + (1.0 - head_on) * (squared * squared * grazing);
    return reflected * (alpha * alpha * visible * lamp / (spread * spread)); // pi of the lobe is in the light
}

struct Leaving {
    matt: vec3<f32>,
    shine: vec3<f32>,
}

// Light leaving a surface towards the eye. `finish`: x roughness, z share of a metal.
fn surface_light(position: vec3<f32>, normal: vec3<f32>, colour: vec3<f32>, finish: vec4<f32>) -> Leaving {
    let to_eye = normalize(frame.eye.xyz - position);
    let falling = falling_light(position, normal);
    let head_on = mix(DIELECTRIC, colour, finish.z);
    let mirrored = mirrored_share(head_on, finish.x, max(dot(normal, to_eye), 0.0));
    // Squared: a metal has no matt light whose shadow could tell where a body stands on it.
    let around = falling.uncovered * falling.uncovered * mirrored * mirrored_light(position, reflect(-to_eye, normal), finish.x);
    var lamp = KEY_COLOUR * falling.key_share * highlight(normal, to_eye, frame.key.xyz, head_on, finish.x);
    lamp *= min(1.0, MOST_SHINE / max(max(lamp.r, lamp.g), max(lamp.b, 1e-4)));
    return Leaving(colour * falling.light * (1.0 - mirrored) * (1.0 - finish.z), around + lamp);
}

// Keeps bright parts from clipping and their hue from turning: about linear below 0.6.
fn tone(light: vec3<f32>) -> vec3<f32> {
    let peak = max(max(light.r, light.g), max(light.b, 1e-4));
    let kept = peak / sqrt(sqrt(1.0 + peak * peak * peak * peak));
    return mix(light / peak, vec3(1.0), 0.6 * smoothstep(1.2, 4.0, peak)) * kept;
}

// The colour that leaves a fragment; a stale picture loses its colours.
fn shown(light: vec3<f32>) -> vec3<f32> {
    return aged(tone(light));
}

fn aged(colour: vec3<f32>) -> vec3<f32> {
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

// The far surroundings in one direction, as they leave a fragment: the same from both screens at their common edge. Far below the bend of the tone curve.
fn surroundings(direction: vec3<f32>, pixel: vec2<f32>) -> vec3<f32> {
    let up = direction.z;
    let horizon = vec3(0.042, 0.049, 0.062);
    let end = select(vec3(0.016, 0.018, 0.023), vec3(0.010, 0.013, 0.021), up > 0.0);
    let light = mix(horizon, end, smoothstep(0.0, select(0.6, 0.8, up > 0.0), abs(up)));
    return aged(light + (dither(pixel) - 0.5) * 0.0025);
}
