// Lit bodies: obstacles, god-object, contact dots, force arrow.

struct Instance {
    @location(2) model_x: vec4<f32>,
    @location(3) model_y: vec4<f32>,
    @location(4) model_z: vec4<f32>,
    @location(5) model_w: vec4<f32>,
    @location(6) colour: vec4<f32>,
    @location(7) finish: vec4<f32>,  // x roughness, y own light, z share of a metal, w looks of triangles count
}

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
    @location(3) @interpolate(flat) finish: vec4<f32>,
}

// A unit vector out of its place on the octahedron |x| + |y| + |z| = 1, folded out to a square.
// Source: Cigolle et al. 2014, "A survey of efficient representations for independent unit vectors".
fn unfolded(place: vec2<f32>) -> vec3<f32> {
    let height = 1.0 - abs(place.x) - abs(place.y);
    let back = max(-height, 0.0);
    return vec3(place - select(vec2(-back), vec2(back), place >= vec2(0.0)), height);
}

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) folded: vec2<f32>,
    @location(8) look_colour: vec4<f32>,
    @location(9) look_finish: vec4<f32>,
    instance: Instance,
) -> Fragment {
    return placed(position, folded, look_colour, look_finish, instance);
}

fn placed(position: vec3<f32>, folded: vec2<f32>, look_colour: vec4<f32>, look_finish: vec4<f32>, instance: Instance) -> Fragment {
    let normal = unfolded(folded); // its length does not matter
    let model = mat4x4(instance.model_x, instance.model_y, instance.model_z, instance.model_w);
    let place = model * vec4(position, 1.0);
    // For a rotation times a scale along its axes the inverse transpose divides by scale squared.
    let squares = vec3(
        dot(instance.model_x.xyz, instance.model_x.xyz),
        dot(instance.model_y.xyz, instance.model_y.xyz),
        dot(instance.model_z.xyz, instance.model_z.xyz),
    );
    var fragment: Fragment;
    fragment.clip = frame.clip_from_workbench * place;
    fragment.position = place.xyz;
    fragment.normal = (model * vec4(normal / squares, 0.0)).xyz;
    // Of all three corners of a triangle the same.
    let has_look = instance.finish.w > 0.5 && look_colour.w > 0.5;
    fragment.colour = vec4(select(instance.colour.rgb, look_colour.rgb * look_colour.rgb, has_look), instance.colour.a);
    let finish = vec4(look_finish.x, instance.finish.y, look_finish.y, instance.finish.w);
    fragment.finish = select(instance.finish, finish, has_look);
    return fragment;
}

// Marks have light of their own, and a dark rim, so that they are seen before any colour: the outer tenth of a dot's radius, of an arrow's
// shaft on either side; soft over as much again.
fn within_rim(in: Fragment) -> f32 {
    let facing = dot(normalize(in.normal), normalize(frame.eye.xyz - in.position));
    return mix(0.04, 1.0, smoothstep(0.44, 0.6, facing)); // the cosines at 0.9 and 0.8 of the radius
}

// The colour of a fragment; in w how much of what is behind a translucent body its shine covers.
fn seen(in: Fragment) -> vec4<f32> {
    let light = surface_light(in.position, normalize(in.normal), in.colour.rgb, in.finish);
    var colour = shown(mix(light.matt + light.shine, in.colour.rgb, in.finish.y));
    if in.finish.y > 0.0 {
        colour *= within_rim(in);
    }
    return vec4(colour, clamp(max(light.shine.r, max(light.shine.g, light.shine.b)), 0.0, 1.0));
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    return vec4(seen(in).rgb, 1.0);
}

// The same of a body through which others are seen.
@fragment
fn translucent(in: Fragment) -> @location(0) vec4<f32> {
    let colour = seen(in);
    return vec4(colour.rgb, mix(in.colour.a, 1.0, colour.w) * near_share(in.clip));
}

// The same where near things fade away: dithered, so that they still hide what is behind them.
// Apart, because a fragment that may be dropped is not drawn as fast.
@fragment
fn fading(in: Fragment) -> @location(0) vec4<f32> {
    if near_share(in.clip) <= 0.999 * dither(in.clip.xy) {
        discard;
    }
    return vec4(seen(in).rgb, 1.0);
}
