// Both eyes' pictures over each other for red and cyan glasses.
// Source of the matrices: Dubois 2001, "A projection method to generate anaglyph stereo images".

@group(0) @binding(0) var left_eye: texture_2d<f32>;
@group(0) @binding(1) var right_eye: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let place = vec2(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    return vec4(place, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let left = textureLoad(left_eye, vec2<i32>(at.xy), 0).rgb;
    let right = textureLoad(right_eye, vec2<i32>(at.xy), 0).rgb;
    let from_left = mat3x3(0.437, -0.062, -0.048, 0.449, -0.062, -0.050, 0.164, -0.024, -0.017);
    let from_right = mat3x3(-0.011, 0.377, -0.026, -0.032, 0.761, -0.093, -0.007, 0.009, 1.234);
    return vec4(clamp(from_left * left + from_right * right, vec3(0.0), vec3(1.0)), 1.0);
}
