//! What a scene's hand intends, as a path in time.

use god_object::Pose;
use taut_bridge::{MinJerkPath, ViaPoint};
use taut_scene::BuiltScene;

/// What the scene's hand intends, as a path in time.
pub fn intention(scene: &BuiltScene) -> MinJerkPath {
    let hand = scene.hand.as_ref().expect("the scene has a hand");
    let points = hand.path.samples().iter().map(|s| ViaPoint {
        time_s: s.time,
        pose: s.pose,
    });
    MinJerkPath::new(points.collect(), hand.repeat).unwrap_or_else(|error| panic!("{error}"))
}

/// The path at `rate_hz` from `from` to `to`, s.
pub fn sampled(
    path: &MinJerkPath,
    rate_hz: f64,
    from: f64,
    to: f64,
) -> impl Iterator<Item = (f64, Pose)> {
    let steps = ((to - from) * rate_hz).round() as u64;
    (0..=steps).map(move |step| {
        let time = from + step as f64 / rate_hz;
        (time, path.at(time).0)
    })
}
