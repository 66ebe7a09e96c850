//! Edges that stand out: a set holds the body by the face that was left until the next set comes.
//!
//! | symbol  | unit | meaning                                                                        |
//! |---------|------|--------------------------------------------------------------------------------|
//! | theta   | rad  | turn of the normal over an edge                                                |
//! | kappa_b | 1/m  | curvature of what slides over it, infinite of what is sharp itself             |
//! | ell     | m    | mean way on the surface from one edge to the next                              |
//! | d       | m    | way of the device beyond what its set knows, at its longest                    |
//! | q       | –    | share of the time                                                              |
//!
//! **Convex edges.** A row is the whole plane of its face. The edge passed, that plane is followed for up to d; the surface turns away beneath it along an
//! arc of theta / kappa_b, and then along the slope of the next face. So s after the edge the force is wrong by min(kappa_b s, theta) in its direction, and
//! by the way that the surface has fallen away, kappa_b s^2 / 2 on the arc and tan(theta) times the way on the slope. No more than all of it can be wrong.
//!
//! **How long.** The error is above that of the way x from x after the edge until the set is replaced, d - x; on an arc longer than d it stays until the arc
//! ends: arc + d - 2 x. An edge comes once in ell, so the share q of the time is spent above the larger x of d - q ell and (arc + d - q ell) / 2.
//! What is felt is judged at two shares: a twentieth of the time may be above the budget, a hundredth above twice the budget.
//!
//! **How often.** Parallel straight ways over a surface of the area A with edges of the length E cross at most E / A of them in a metre in the mean: just so
//! many where they go across all of them.
//!
//! **Concave edges** cost nothing: the rows of the face behind one are in the set before the device is there, since a set holds what the body can reach
//! until its last use.

use std::f64::consts::FRAC_PI_2;

use super::errors::{direction_jnd, normal_turn, sagitta};
use super::pressed::Pressed;

/// Shares of the time that may be above the budget and above twice the budget.
pub const SHARES: [f64; 2] = [0.05, 0.01];

/// Convex edges of one surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edges {
    /// Largest turn of the normal over one, theta, rad.
    pub turn: f64,
    /// Least mean way from one to the next, ell, m.
    pub apart: f64,
}

impl Edges {
    /// Of a surface of `area`, m^2, with edges of this total length, m; `None` without edges.
    #[must_use]
    pub fn on(area: f64, length: f64, turn: f64) -> Option<Self> {
        let any = length > 0.0 && turn > 0.0;
        any.then(|| Self {
            turn,
            apart: area / length,
        })
    }

    /// What is felt of them where sets are up to `lag`, m, behind, and what slides over them is round by
    /// `rounding`, 1/m, where the device is.
    #[must_use]
    pub fn felt(&self, rounding: f64, lag: f64, pressed: &Pressed) -> f64 {
        let at = |share: f64| {
            let way = self.way_at(rounding, lag, share);
            past(self.turn, rounding, way, pressed)
        };
        at(SHARES[0]).max(0.5 * at(SHARES[1]))
    }

    /// Whether they come so often that what happens at one of them, `for_way`, m, long, fills the shares that
    /// are judged: 1, or half where only the
    /// smaller one is filled, or 0.
    #[must_use]
    pub fn weight(&self, for_way: f64) -> f64 {
        let share = for_way / self.apart;
        if share >= SHARES[0] {
            1.0
        } else if share >= SHARES[1] {
            0.5
        } else {
            0.0
        }
    }

    /// The way beyond an edge whose error the share of the time is above, m; 0 where there is no error for so
    /// long.
    fn way_at(&self, rounding: f64, lag: f64, share: f64) -> f64 {
        let arc = self.turn / rounding;
        let between = share * self.apart;
        let on_slope = lag - between;
        let on_arc = 0.5 * (arc + lag - between);
        on_slope.max(on_arc).clamp(0.0, lag)
    }
}

/// How far the surface has fallen away from the plane of the face before an edge, a way behind it, m;
/// infinite where nothing is there.
#[must_use]
pub fn fall(turn: f64, rounding: f64, way: f64) -> f64 {
    let arc = turn / rounding;
    if way <= arc {
        return sagitta(rounding, way);
    }
    let on_arc = if arc > 0.0 {
        sagitta(rounding, arc)
    } else {
        0.0
    };
    let slope = if turn < FRAC_PI_2 {
        turn.tan()
    } else {
        f64::INFINITY
    };
    on_arc + (way - arc) * slope
}

/// What is felt a way behind an edge of the plane of the face before it, in just-noticeable differences.
fn past(turn: f64, rounding: f64, way: f64, pressed: &Pressed) -> f64 {
    let beyond = way > 0.0; // false for NaN
    if !beyond {
        return 0.0;
    }
    let angle = normal_turn(rounding, way).min(turn);
    let fallen = fall(turn, rounding, way).min(pressed.depth());
    let wrong = pressed.felt(pressed.stiffness * fallen);
    wrong
        .max(direction_jnd(angle))
        .max(pressed.felt_torque(angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pressed() -> Pressed {
        Pressed {
            stiffness: 1000.0,
            force: 2.0,
            friction: 0.0,
            turns: false,
        }
    }

    /// Way beyond the edge whose error is exceeded for a share of the time, by trying every place of a long
    /// straight way.
    fn by_trial(edges: &Edges, rounding: f64, lag: f64, share: f64) -> f64 {
        let normal = |s: f64| (s.max(0.0) * rounding).min(edges.turn);
        let mut errors: Vec<f64> = (0..100_000)
            .map(|i| edges.apart * f64::from(i) / 100_000.0)
            .map(|s| normal(s) - normal(s - lag))
            .collect();
        errors.sort_by(f64::total_cmp);
        errors[((1.0 - share) * 99_999.0) as usize]
    }

    #[test]
    fn the_error_at_a_share_of_the_time_is_that_of_every_place_tried() {
        let edges = Edges {
            turn: 1.0,
            apart: 0.03,
        };
        for rounding in [100.0, 400.0, 5000.0] {
            for lag in [2e-4, 1e-3, 4e-3] {
                for share in SHARES {
                    let way = edges.way_at(rounding, lag, share);
                    let found = (rounding * way).min(edges.turn);
                    let tried = by_trial(&edges, rounding, lag, share);
                    assert!(
                        (found - tried).abs() < 0.02,
                        "{rounding} {lag} {share}: {found} {tried}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_surface_falls_away_like_a_ball_rolls_over_the_edge() {
        // The centre of a ball of 10 mm on a roof of 0.2 rad: an arc about the edge, then the slope.
        let (radius, turn) = (0.01_f64, 0.2_f64);
        let height = |way: f64| {
            let arc = radius * turn.sin();
            if way <= arc {
                radius - (radius * radius - way * way).sqrt()
            } else {
                radius * (1.0 - turn.cos()) + (way - arc) * turn.tan()
            }
        };
        for way in [5e-4, 1e-3, 2e-3, 5e-3] {
            let found = fall(turn, radius.recip(), way);
            assert!(
                (found / height(way) - 1.0).abs() < 0.05,
                "{way}: {found} {}",
                height(way)
            );
        }
        assert_eq!(fall(FRAC_PI_2, f64::INFINITY, 1e-6), f64::INFINITY);
        assert_eq!(fall(1.0, 0.0, 1.0), 0.0);
    }

    #[test]
    fn edges_are_never_nearer_than_straight_ways_find_them() {
        // A plane ruled in lines 1 m apart along x, and 0.5 m apart along y: in each square metre 3 m of lines.
        let apart = Edges::on(1.0, 3.0, 1.0).map_or(0.0, |edges| edges.apart);
        for degrees in 0..90 {
            let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
            assert!((sine + 2.0 * cosine).recip() >= apart);
        }
        // Lines of one direction are as far apart as they are.
        assert_eq!(
            Edges::on(1.0, 4.0, 1.0).map(|edges| edges.apart),
            Some(0.25)
        );
        assert_eq!(Edges::on(1.0, 0.0, 0.0), None);
    }

    #[test]
    fn what_lasts_too_short_is_not_felt_and_what_lasts_is_by_all_of_the_force() {
        let edges = Edges {
            turn: 2.0,
            apart: 0.05,
        };
        let sharp = |lag| edges.felt(f64::INFINITY, lag, &pressed());
        assert_eq!(sharp(0.009 * 0.05), 0.0);
        let all = pressed().felt(pressed().force);
        assert_eq!(sharp(0.04 * 0.05), 0.5 * all);
        assert_eq!(sharp(0.06 * 0.05), all);
        // A body as round as the way is long feels little of it.
        assert!(edges.felt(50.0, 1e-4, &pressed()) < 0.1);
    }
}
