//! The right answer for a ball that is led round inside a regular prism: along the side that it is on, and over a corner when it gets there.
//!
//! A ball on a side stays there until the foot of the device on that side is at its end; then nothing holds it, and it goes on to the next. So the
//! answer depends on the way by which the device came, and jumps at each corner.

use std::f64::consts::PI;

use god_object::{Obstacle, Pose};
use nalgebra::Vector3;
use taut_method_tests::solids::{mesh, obstacle};
use taut_scene::shapes::{Axis, cylinder};

/// The direction from the axis y at an angle from z towards x, rad.
pub(super) fn out(angle: f64) -> Vector3<f64> {
    Vector3::new(angle.sin(), 0.0, angle.cos())
}

/// A prism about an axis, the middle of one side at angle 0, and a ball on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prism {
    pub(super) sides: usize,
    /// Of the corners, m.
    pub(super) radius: f64,
    /// Of the ball, m.
    pub(super) tip: f64,
}

impl Prism {
    /// Angle of a side, rad.
    pub(super) fn side(&self) -> f64 {
        2.0 * PI / self.sides as f64
    }

    /// How far a side is from the axis, m.
    pub(super) fn apothem(&self) -> f64 {
        self.radius * (0.5 * self.side()).cos()
    }

    /// An obstacle about y, of half this length, m.
    pub(super) fn obstacle(&self, half: f64) -> Obstacle {
        // A ball comes down on the middle of a side: on a corner it could go either way.
        let half_side = Vector3::y() * (0.5 * self.side());
        let turned = Pose::new(Vector3::zeros(), half_side);
        let round = cylinder(self.radius, half, self.sides, Axis::Y);
        obstacle("cylinder", mesh(round), turned)
    }

    /// How deep a device at this angle, rad, and distance from the axis, m, is behind the side that the ball is on, and the angle of that side.
    /// The device has come from angle 0 to `most` (the angle itself on the way there), and back.
    pub(super) fn depth(&self, angle: f64, most: f64, distance: f64) -> (f64, f64) {
        let half = self.radius * (0.5 * self.side()).sin();
        let reach = (half / distance).min(1.0).asin();
        let there = ((most - reach) / self.side()).ceil().max(0.0);
        let back = ((angle + reach) / self.side()).floor();
        let normal = there.min(back) * self.side();
        let depth = self.apothem() + self.tip - distance * (angle - normal).cos();
        (depth.max(0.0), normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ball_leaves_a_side_at_its_end_on_the_way_there_and_on_the_way_back() {
        let prism = Prism {
            sides: 16,
            radius: 0.019,
            tip: 1e-3,
        };
        let reach = (0.019 * (PI / 16.0).sin() / 0.017).asin();
        let side_at = |angle: f64, most: f64| prism.depth(angle, most, 0.017).1 / prism.side();
        assert!(reach > 0.5 * prism.side(), "behind the corner");
        assert_eq!(side_at(reach - 1e-6, reach - 1e-6), 0.0);
        assert_eq!(side_at(reach + 1e-6, reach + 1e-6), 1.0);
        // Back again: it stays on side 1 as long at its other end.
        let other = prism.side() - reach;
        assert_eq!(side_at(other + 1e-6, reach + 1e-6), 1.0);
        assert_eq!(side_at(other - 1e-6, reach + 1e-6), 0.0);
        // Before the middle of a side the depth is that of the plane.
        let (depth, _) = prism.depth(0.0, 0.0, 0.017);
        assert!((depth - (prism.apothem() + 1e-3 - 0.017)).abs() < 1e-15);
    }
}
