//! A contact as it is pressed: what of an error of its force is felt.
//!
//! | symbol | unit | meaning                                                   |
//! |--------|------|-----------------------------------------------------------|
//! | K      | N/m  | stiffness that the hand feels                             |
//! | F      | N    | usual force across the surface                            |
//! | mu     | –    | coefficient of friction                                   |
//!
//! **Friction.** Where the body slides, the force leans on the edge of the cone: it is sqrt(1 + mu^2) F, and an error of its part across the surface takes
//! that along it with it, in the same ratio. An angle stays an angle.
//!
//! **Torque.** An error of force at the radius r of the body is one of torque of at most r times it, and a torque is felt from a force of 0.1 N at the
//! radius of the body on. So where a body can turn, errors are felt by 0.1 N however large the force is.

use super::errors::{JND_CHANGE, force_jnd};

/// Force, stiffness and surface of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// K, N/m.
    pub stiffness: f64,
    /// F, N.
    pub force: f64,
    /// mu.
    pub friction: f64,
    /// The contact is off the point about which the body turns.
    pub turns: bool,
}

impl Pressed {
    /// How deep the device is, m.
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.force / self.stiffness
    }

    /// The whole force over its part across the surface.
    #[must_use]
    pub fn lean(&self) -> f64 {
        self.friction.hypot(1.0)
    }

    /// An error of the force across the surface, N, in just-noticeable differences.
    #[must_use]
    pub fn felt(&self, error: f64) -> f64 {
        let whole = error * self.lean();
        if self.turns {
            whole / JND_CHANGE
        } else {
            force_jnd(whole, self.force * self.lean())
        }
    }

    /// The torque of a force whose direction is off by an angle, rad, in just-noticeable differences; 0 where
    /// the body cannot turn.
    #[must_use]
    pub fn felt_torque(&self, angle: f64) -> f64 {
        if self.turns {
            self.force * self.lean() * angle / JND_CHANGE
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::nalgebra::Vector2;

    #[test]
    fn an_error_takes_friction_with_it() {
        let (force, error, mu) = (2.0, 0.05, 0.4);
        let sliding = |across: f64| Vector2::new(mu * across, across);
        let pressed = Pressed {
            stiffness: 1000.0,
            force,
            friction: mu,
            turns: false,
        };
        let off = (sliding(force + error) - sliding(force)).norm();
        let felt = force_jnd(off, sliding(force).norm());
        assert!((pressed.felt(error) - felt).abs() < 1e-12);
        assert!((pressed.depth() - 2e-3).abs() < 1e-15);
    }

    #[test]
    fn an_error_is_felt_as_a_torque_where_the_body_turns() {
        let held = Pressed {
            stiffness: 1000.0,
            force: 5.0,
            friction: 0.0,
            turns: false,
        };
        let turns = Pressed {
            turns: true,
            ..held
        };
        assert!(turns.felt(0.1) > held.felt(0.1));
        assert_eq!(held.felt_torque(0.1), 0.0);
        assert!((turns.felt_torque(0.02) - 1.0).abs() < 1e-12);
    }
}
