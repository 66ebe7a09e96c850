// Parts of a calibration picture: places in clip space, each with a part of the letters' texture.

@group(0) @binding(0) var letters: texture_2d<f32>;
@group(0) @binding(1) var letter_sampler: sampler;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) texel: vec2<f32>,
    @location(1) colour: vec4<f32>,
}

@vertex
fn vertex(
    @location(0) clip: vec4<f32>,
    @location(1) colour: vec4<f32>,
    @location(2) texel: vec2<f32>,
) -> Fragment {
    return Fragment(clip, texel, colour);
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let cover = textureSample(letters, letter_sampler, in.texel).r;
    return vec4(in.colour.rgb, in.colour.a * cover);
}
