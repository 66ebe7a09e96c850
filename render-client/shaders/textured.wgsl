// Bodies with pictures on them: the colour of mesh.wgsl, which stands before, is a factor on a picture's.

@group(1) @binding(0) var picture: texture_2d<f32>;
@group(1) @binding(1) var picture_sampler: sampler;

struct Pictured {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
    @location(3) @interpolate(flat) finish: vec4<f32>,
    @location(4) place: vec2<f32>,   // u along the rows of the picture, v down
}

@vertex
fn pictured(
    @location(0) position: vec3<f32>,
    @location(1) folded: vec2<f32>,
    @location(8) look_colour: vec4<f32>,
    @location(9) look_finish: vec4<f32>,
    @location(10) place: vec2<f32>,
    instance: Instance,
) -> Pictured {
    let plain = placed(position, folded, look_colour, look_finish, instance);
    return Pictured(plain.clip, plain.position, plain.normal, plain.colour, plain.finish, place);
}

// The fragment with the picture's colour; its opacity beside it.
struct Coloured {
    fragment: Fragment,
    opacity: f32,
}

fn coloured(in: Pictured) -> Coloured {
    let texel = textureSample(picture, picture_sampler, in.place);
    let colour = vec4(in.colour.rgb * texel.rgb, in.colour.a);
    return Coloured(Fragment(in.clip, in.position, in.normal, colour, in.finish), texel.a);
}

@fragment
fn textured(in: Pictured) -> @location(0) vec4<f32> {
    return vec4(seen(coloured(in).fragment).rgb, 1.0);
}

// Where nothing of a picture is seen there is no shine, either.
@fragment
fn textured_translucent(in: Pictured) -> @location(0) vec4<f32> {
    let all = coloured(in);
    let colour = seen(all.fragment);
    return vec4(colour.rgb, mix(in.colour.a, 1.0, colour.w) * all.opacity * near_share(in.clip));
}

@fragment
fn textured_fading(in: Pictured) -> @location(0) vec4<f32> {
    let all = coloured(in); // before anything is dropped: its size on the screen tells which of the picture's sizes is read
    if near_share(in.clip) <= 0.999 * dither(in.clip.xy) {
        discard;
    }
    return vec4(seen(all.fragment).rgb, 1.0);
}
