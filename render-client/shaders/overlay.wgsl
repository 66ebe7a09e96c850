// Letters and boxes in the plane of the screen: places are normalised device coordinates.

@group(0) @binding(0) var letters: texture_2d<f32>;
@group(0) @binding(1) var letter_sampler: sampler;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) texel: vec2<f32>,
    @location(1) colour: vec4<f32>,
}

@vertex
fn vertex(
    @builtin(vertex_index) index: u32,
    @location(0) place: vec4<f32>,   // left, bottom, right, top
    @location(1) part: vec4<f32>,    // of the letters' texture: left, top, right, bottom
    @location(2) colour: vec4<f32>,
) -> Fragment {
    let right = (index & 1u) == 1u;
    let top = (index & 2u) == 2u;
    var fragment: Fragment;
    fragment.clip = vec4(select(place.x, place.z, right), select(place.y, place.w, top), 0.0, 1.0);
    fragment.texel = vec2(select(part.x, part.z, right), select(part.w, part.y, top));
    fragment.colour = colour;
    return fragment;
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let cover = textureSample(letters, letter_sampler, in.texel).r;
    return vec4(in.colour.rgb, in.colour.a * cover);
}
