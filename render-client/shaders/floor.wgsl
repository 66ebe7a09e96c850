// A grid under the obstacles that takes their shadow: height above it is read from the shadow.
// It fades out at its rim, so that it has no edge of its own.

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Fragment {
    let corner = vec2(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
    var fragment: Fragment;
    fragment.position = frame.floor.xyz + vec3(corner * frame.floor.w, 0.0);
    fragment.clip = frame.clip_from_workbench * vec4(fragment.position, 1.0);
    return fragment;
}

// Coverage of lines every `spacing`, a pixel or `width` wide, whichever is more.
fn lines(place: vec2<f32>, spacing: f32, width: f32) -> f32 {
    let cell = place / spacing;
    let pixel = max(fwidth(cell), vec2(1e-6));
    let wide = max(vec2(width / spacing), pixel);
    let away = abs(fract(cell - 0.5) - 0.5);
    let line = (1.0 - smoothstep(0.5 * wide, 0.5 * wide + pixel, away)) * min(width / spacing / pixel + 0.35, vec2(1.0));
    // Where lines are nearer than two pixels they melt into the plane.
    let open = 1.0 - smoothstep(vec2(0.25), vec2(0.6), pixel);
    return max(line.x * open.x, line.y * open.y);
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let from_middle = distance(in.position.xy, frame.floor.xy) / frame.floor.w;
    let place = in.position.xy - frame.floor.xy;
    let line = max(0.35 * lines(place, 0.2 * frame.grid.x, 0.0), lines(place, frame.grid.x, 0.02 * frame.grid.x));
    let normal = vec3(0.0, 0.0, 1.0);
    let colour = mix(vec3(0.045, 0.051, 0.062), vec3(0.22, 0.25, 0.29), 0.45 * line);
    let light = MATT_SHARE * colour * falling_light(in.position, normal).rgb;
    let alpha = 1.0 - smoothstep(0.35, 1.0, from_middle);
    return vec4(shown(light), alpha * near_share(in.clip));
}
