//! What a setting costs in accuracy: closed forms, in metres and radians, and in just-noticeable differences.
//!
//! | symbol | unit  | meaning                                                                    |
//! |--------|-------|----------------------------------------------------------------------------|
//! | f      | Hz    | updates of the constraint set per second                                   |
//! | k_s    | –     | share of the pose difference that one update covers                        |
//! | d      | m     | way of the device beyond the god-object when its set is replaced           |
//! | kappa  | 1/m   | curvature of the contact: how fast its normal turns along the way          |
//! | omega  | rad/s | turn rate of the device                                                    |
//! | K      | N/m   | stiffness that the hand feels                                              |
//! | J      | –     | error over the just-noticeable difference                                  |
//!
//! **Lag.** An update that covers the share k_s of the difference leaves, at a constant speed v with a period T, the difference v T (1/k_s - 1)
//! behind it: x <- (1 - k_s) x + v T has that limit less v T. Its set is in use from one period after its device pose to two, so the
//! device is at most v T (1/k_s + 1) ahead.
//!
//! **Curvature.** A tangent plane that is d late is turned by kappa d and lies kappa d^2 / 2 off the surface (the sagitta). The device goes along
//! the parallel of the contact as deep as it presses, p = F / K; so kappa stands for kappa / (1 - kappa p) where the contact is convex.
//!
//! **Rows.** Rows are linear in the rotation; a point at radius r that turns by phi is r (1 - cos phi) = r phi^2 / 2 beside its row. Rounds of implicit
//! constraints shorten phi: see [`rounds`](super::rounds).
//!
//! **Obstacles.** The row of an obstacle that moves at v is one period old when its set is published, and goes on with the obstacle from the first force
//! that sees it: 1/f and up to a millisecond behind it, half of that in the mean. Where the obstacle stops, the row has gone on for a period at most: a
//! [`pulse`](super::ripple::pulse) until the next set comes. An error that does not grow with the force is felt most where that is small: by 0.1 N.
//!
//! **Steps.** When a set is replaced, the body has gone v T on. Its normals turned by theta(v T): the force of the new set points elsewhere by that, and acts
//! from a plane that lies theta (v T / k_s + v T / 2) off the old one where the device is, and as far again as it goes in a millisecond until a force sees
//! the set. Of both, what the right force does in a millisecond anyway is no step.
//! On a smooth contact theta(w) = kappa w. Where facets at the angle phi stand for the curvature, the normal turns at the edges alone: over one by phi, as
//! fast as the body that slides over it is round, kappa_b. The stair is above the slope it stands for by phi (1 - kappa / kappa_b) at most, so
//! theta(w) <= min(kappa_b w, kappa w + phi (1 - kappa / kappa_b)).
//!
//! **Facets.** A chord that is at most e off a circle of curvature kappa spans the angle 2 acos(1 - e kappa).
//!
//! Thresholds: 18.4 degrees for direction (Barbagli et al. 2006); 7 % of the force (Pang, Tan, Durlach 1991), at least 0.1 N for a change.

use super::rounds::left_of_turn;

/// Just-noticeable angle between forces, rad.
pub const JND_DIRECTION: f64 = 18.4 * std::f64::consts::PI / 180.0;
/// Just-noticeable share of a force.
pub const JND_MAGNITUDE: f64 = 0.07;
/// Just-noticeable change of a small force, N.
pub const JND_CHANGE: f64 = 0.1;
/// Time between two forces at the hand, s.
pub const TICK: f64 = 1e-3;

/// Most that the god-object is behind the device while a set is used, s: (1/k_s + 1) / f.
#[must_use]
pub fn longest_lag(k_s: f64, rate: f64) -> f64 {
    (k_s.recip() + 1.0) / rate
}

/// Turn of a normal along a way, rad.
#[must_use]
pub fn normal_turn(curvature: f64, way: f64) -> f64 {
    curvature * way
}

/// Curvature of the parallel of a convex curve, `depth`, m, inside, 1/m: the device goes there, and the normals turn along its way like this. Infinite
/// where the device is as deep as the curve is round.
#[must_use]
pub fn parallel(curvature: f64, depth: f64) -> f64 {
    let left = 1.0 - curvature * depth;
    if left > 0.0 {
        curvature / left
    } else {
        f64::INFINITY
    }
}

/// Distance of a surface from its tangent plane a way on, m.
#[must_use]
pub fn sagitta(curvature: f64, way: f64) -> f64 {
    0.5 * curvature * way * way
}

/// Distance of a point at `radius`, m, from its linear row, after the body turned by `angle`, rad, and so many Newton rounds, m.
#[must_use]
pub fn linearisation(radius: f64, angle: f64, rounds: u32) -> f64 {
    let left = left_of_turn(angle, rounds);
    0.5 * radius * left * left
}

/// Most that a normal turns along a way, rad: `curvature` in the mean, in facets that meet at `facet`, rad, passed by a body whose own curvature is
/// `rounding`.
#[must_use]
pub fn stair_turn(curvature: f64, facet: f64, rounding: f64, way: f64) -> f64 {
    let smooth = normal_turn(curvature, way);
    let above = if rounding > curvature {
        facet * (1.0 - curvature / rounding)
    } else {
        0.0
    };
    (smooth + above).min(normal_turn(rounding.max(curvature), way))
}

/// Step of force when a set is replaced whose normals turned by `turn`, rad, along `way`, m, of the device since the last, N: of its direction, and of the
/// plane it acts from. `own`: the turn of the right force in a millisecond, rad; `late`: how far the device goes until a force sees the set, m.
#[must_use]
pub fn set_step(
    stiffness: f64,
    k_s: f64,
    force: f64,
    [turn, own]: [f64; 2],
    [way, late]: [f64; 2],
) -> f64 {
    let across = force * (turn - own).max(0.0);
    let along = stiffness * turn * (way * (k_s.recip() + 0.5) + late);
    across.hypot(along)
}

/// Angle between two facets that are at most `error`, m, off a circle of this curvature, rad.
#[must_use]
pub fn facet_angle(error: f64, curvature: f64) -> f64 {
    2.0 * (1.0 - error * curvature).clamp(-1.0, 1.0).acos()
}

/// How far behind an obstacle that moves its row is, m: the period that its set took, and half the time between two forces until one sees it.
#[must_use]
pub fn obstacle_lag(speed: f64, rate: f64) -> f64 {
    speed * (rate.recip() + 0.5 * TICK)
}

/// Step of the row of an obstacle that stops, when the next set comes: how far the row went on, beyond what it goes in a millisecond anyway, m.
#[must_use]
pub fn obstacle_step(speed: f64, rate: f64) -> f64 {
    (speed * (rate.recip() - TICK)).max(0.0)
}

/// An angle between forces in just-noticeable differences.
#[must_use]
pub fn direction_jnd(angle: f64) -> f64 {
    angle / JND_DIRECTION
}

/// An error of force, N, at a force, N, in just-noticeable differences.
#[must_use]
pub fn force_jnd(error: f64, force: f64) -> f64 {
    error / (JND_MAGNITUDE * force).max(JND_CHANGE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::nalgebra::Vector2;

    #[test]
    fn the_lag_is_the_limit_of_the_recursion() {
        // The device goes 1 m per second; one update a period, published a period later, used for one.
        for k_s in [0.25, 0.5, 1.0] {
            let rate = 200.0;
            let (mut body, mut last) = (0.0, 0.0);
            for update in 0..200 {
                let device = f64::from(update) / rate;
                last = body;
                body += k_s * (device - body);
            }
            // At the end of the use of `last`, the newest update has its period behind it.
            let end_of_use = 200.0 / rate;
            assert!((end_of_use - last - longest_lag(k_s, rate)).abs() < 1e-9);
        }
    }

    #[test]
    fn the_rate_for_a_direction_is_that_of_the_rule() {
        // R = 20 mm, 0.2 m/s, k_s = 0.5, half a difference of direction: 187 Hz; k_s = 1: 125 Hz.
        for (k_s, rate) in [(0.5, 187.0), (1.0, 125.0)] {
            let turn = normal_turn(50.0, 0.2 * longest_lag(k_s, rate));
            assert!((direction_jnd(turn) - 0.5).abs() < 2e-3);
        }
    }

    #[test]
    fn a_sagitta_is_the_distance_of_a_circle_from_its_tangent() {
        let (radius, way) = (0.02_f64, 1e-3_f64);
        let exact = radius - (radius * radius - way * way).sqrt();
        assert!((sagitta(radius.recip(), way) / exact - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_stair_turns_at_most_by_its_slope_and_one_step() {
        // A ball of 10 mm round a polygon of 30 mm, in the space of its centre: arcs of 10 mm at the corners, straight between.
        let (facet, rounding, curvature) = (0.035, 100.0, 25.0);
        let (arc, pitch) = (facet / rounding, facet / curvature);
        let turned = |at: f64| (at / pitch).floor() * facet + ((at % pitch) * rounding).min(facet);
        for way in [0.1 * arc, arc, 0.5 * pitch, pitch, 3.3 * pitch] {
            let most = (0..1000)
                .map(|i| pitch * (1.0 + f64::from(i) / 1000.0))
                .map(|from| turned(from + way) - turned(from))
                .fold(0.0, f64::max);
            let bound = stair_turn(curvature, facet, rounding, way);
            assert!(most <= bound + 1e-12, "{way}: {most} of {bound}");
            if way == pitch {
                // A whole facet on, the stair has turned by just one step, wherever it began: the bound allows for part of a second.
                assert!((most - facet).abs() < 1e-12, "{way}: {most}");
            } else {
                assert!(most > 0.7 * bound, "{way}: {most} of {bound}");
            }
        }
        // What is as round as the stair has no steps.
        assert_eq!(stair_turn(25.0, 0.1, 25.0, 1e-3), normal_turn(25.0, 1e-3));
    }

    #[test]
    fn a_step_is_the_difference_of_two_tangent_planes() {
        // A point on a circle of 40 mm, pressed 2 mm in; sets of a body 3 and 2 periods behind, 0.5 mm each.
        let (radius, depth, stiffness, way) = (0.04_f64, 2e-3, 1000.0, 5e-4);
        let place = |behind: f64| {
            let angle = behind * way / radius;
            Vector2::new(-angle.sin(), angle.cos())
        };
        let device = Vector2::new(0.0, radius - depth);
        let force =
            |behind: f64| place(behind) * (stiffness * (radius - device.dot(&place(behind))));
        let step = (force(3.0) - force(2.0)).norm();
        let turn = normal_turn(1.0 / radius, way);
        let predicted = set_step(stiffness, 0.5, stiffness * depth, [turn, 0.0], [way, 0.0]);
        assert!(
            (predicted / step - 1.0).abs() < 0.1,
            "{predicted} of {step}"
        );
    }

    #[test]
    fn a_parallel_of_a_circle_is_a_circle() {
        assert!((parallel(1.0 / 0.01, 0.002) - 1.0 / 0.008).abs() < 1e-9);
        assert_eq!(parallel(0.0, 0.002), 0.0);
        assert_eq!(parallel(100.0, 0.01), f64::INFINITY);
        assert_eq!(parallel(f64::INFINITY, 0.0), f64::INFINITY);
    }

    #[test]
    fn a_turned_point_leaves_its_row_by_the_cosine() {
        let (radius, angle) = (0.05_f64, 0.05_f64);
        let exact = radius * (1.0 - angle.cos());
        assert!((linearisation(radius, angle, 0) / exact - 1.0).abs() < 1e-3);
        // Newton on cos: the error of the next round is that of half the square of the angle.
        assert_eq!(
            linearisation(radius, angle, 1),
            linearisation(radius, 0.5 * angle * angle, 0)
        );
    }

    #[test]
    fn facets_are_chords() {
        let (radius, sides) = (0.02, 24.0);
        let angle = std::f64::consts::TAU / sides;
        let middle = 0.5 * (Vector2::new(1.0, 0.0) + Vector2::new(angle.cos(), angle.sin()));
        let error = radius * (1.0 - middle.norm());
        assert!((facet_angle(error, 1.0 / radius) - angle).abs() < 1e-9);
        // 39 sides: half of 18.4 degrees.
        assert!(direction_jnd(std::f64::consts::TAU / 39.0) < 0.51);
    }

    #[test]
    fn a_force_is_felt_by_its_share_and_never_below_a_tenth_of_a_newton() {
        assert_eq!(force_jnd(0.1, 1.0), 1.0);
        assert!((force_jnd(0.1, 10.0) - 1.0 / 7.0).abs() < 1e-12);
    }

    #[test]
    fn an_obstacle_at_the_rate_of_the_forces_makes_no_further_step() {
        assert_eq!(obstacle_step(0.1, 1000.0), 0.0);
        assert!((obstacle_step(0.1, 100.0) - 0.9e-3).abs() < 1e-12);
    }
}
