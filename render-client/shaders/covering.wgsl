// The depth scale of occlusion.wgsl and frame.wgsl.

const SHADOW_REACH = 6.0; // mirrors SHADOW_REACH of frame.rs: depth of the map over that of its middle
const DEEPEST = 96.0;     // discs: six radii of the map, as far as shadows reach without ground. What is deeper is as if there

// Depth below the middle of the shadow map, in radii of the disc; `depth` is that of the map, `scale` the radii from 0 to 1.
fn below_middle(depth: f32, scale: f32) -> f32 {
    return clamp((depth - 1.0 / SHADOW_REACH) * scale, -DEEPEST, DEEPEST);
}
