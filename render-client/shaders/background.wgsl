// The far surroundings, drawn where no body is.

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) place: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Fragment {
    let place = vec2(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    var fragment: Fragment;
    fragment.clip = vec4(place, 1.0, 1.0);
    fragment.place = place;
    return fragment;
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let far = frame.workbench_from_clip * vec4(in.place, 1.0, 1.0);
    let direction = normalize(far.xyz / far.w - frame.eye.xyz);
    return vec4(surroundings(direction, in.clip.xy), 1.0);
}
