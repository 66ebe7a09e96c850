// The device pose: a translucent shell, thin where it faces the eye and denser towards its outline.
// Uses the vertex stage of mesh.wgsl.

@fragment
fn ghost(in: Fragment) -> @location(0) vec4<f32> {
    let normal = normalize(in.normal);
    let facing = abs(dot(normal, normalize(frame.eye.xyz - in.position)));
    let alpha = mix(0.75, in.colour.a, smoothstep(0.0, 0.75, facing));
    let light = in.colour.rgb * (0.55 + 0.45 * max(dot(normal, frame.key.xyz), 0.0) + ambient(in.position, normal));
    return vec4(shown(light), alpha * near_share(in.clip));
}
