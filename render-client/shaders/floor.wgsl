// A grid under the obstacles that takes their shadow: height above it is read from the shadow.
// It fades out into the surroundings at its rim, so that it has no edge of its own. They are mixed in here and not behind it: no pixel is drawn twice.
// Where nothing of it is seen it hides nothing: neither there nor from below, where the pipeline does not draw it.

const UNSEEN = 0.005; // share of it that changes 8-bit colours by half a step at most

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

// Mean of the lines `width` wide around each multiple of `spacing`, over the pixel: lines thinner than a pixel are faint rather than broken,
// lines nearer than a pixel are an even tone, and a finer picture is as bright as a coarse one.
fn lines(place: vec2<f32>, spacing: f32, width: f32) -> f32 {
    let cell = place / spacing + 0.5;
    let pixel = max(fwidth(cell), vec2(1e-4));
    let first = cell - 0.5 * pixel;
    let last = cell + 0.5 * pixel;
    let wide = width / spacing;
    // Whole lines between, less the part of the first that is before, and that of the last that is in.
    let along = (floor(last) - floor(first)) * wide + covered(fract(last), wide) - covered(fract(first), wide);
    let line = clamp(along / pixel, vec2(0.0), vec2(1.0));
    return 1.0 - (1.0 - line.x) * (1.0 - line.y);
}

// How much of [0, `share`] a line of this width around 0.5 covers.
fn covered(share: vec2<f32>, wide: f32) -> vec2<f32> {
    return clamp(share - 0.5 + 0.5 * wide, vec2(0.0), vec2(wide));
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let from_middle = distance(in.position.xy, frame.floor.xy) / frame.floor.w;
    let place = in.position.xy - frame.floor.xy;
    let line = max(0.35 * lines(place, 0.2 * frame.grid.x, 0.012 * frame.grid.x), lines(place, frame.grid.x, 0.028 * frame.grid.x));
    let share = (1.0 - smoothstep(0.35, 1.0, from_middle)) * near_share(in.clip);
    if share < UNSEEN {
        discard; // after the derivatives in lines()
    }
    let normal = vec3(0.0, 0.0, 1.0);
    let colour = mix(vec3(0.045, 0.051, 0.062), vec3(0.22, 0.25, 0.29), 0.45 * line);
    let light = colour * falling_light(in.position, normal).light;
    let behind = surroundings(normalize(in.position - frame.eye.xyz), in.clip.xy);
    return vec4(mix(behind, shown(light), share), 1.0);
}
