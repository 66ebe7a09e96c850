//! Conservative advancement of one convex piece of a moving body towards a piece of an obstacle.
//!
//! | symbol | name in code | unit | meaning                                                                   |
//! |--------|--------------|------|---------------------------------------------------------------------------|
//! | n      | `direction`  | –    | unit direction from the obstacle's piece to the body's                    |
//! | x_i    |              | m    | points of the body's piece; velocity v_i, half acceleration b_i           |
//! | s      | `support`    | m    | largest n.y over the obstacle's piece                                     |
//! | R, a   |              | m, – | radius and axis of a moving cylinder, w its spin                          |
//! | h      |              | –    | step in time                                                              |
//!
//! For *any* direction n the distance at `time + h` is at least `min_i n.x_i(h) - rho - R |n x a(h)| - s`. The points' paths are
//! bounded to second order with the cubic term as in the meshes' advancement. For the disc two bounds hold, and the better is taken:
//!
//! - `|n x a(h)| <= |n x a| - (n.a / |n x a|) (n.a(h) - n.a)`, from the mean of the squares of `|n x a|`: exact where the cylinder lies, rolls or yaws;
//! - `|n x a(h)| <= |n x a| + h |n x (w x a)| + h^2 |w| |w x a| / 2`: where it stands, n along a.
//!
//! A step is safe whatever the direction is worth. Source: Mirtich 1996; Tang et al. 2009 (directional bound); the discs are ours.

use nalgebra::Vector3;

use super::closest;
use super::piece::Piece;
use crate::collision::{Gaps, Placement, RelativeMotion, Work, time_to_fall};

/// A step along the normals of faces and caps that covers this share of what is left is taken without a look at closest points.
const GOOD_SHARE: f64 = 0.25;
/// A cylinder's axis nearer to the direction than this stands, as a sine: the first bound divides by it.
const STANDING_SINE: f64 = 1e-9;

/// What a pair of pieces does in an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    /// They stay apart.
    Free,
    /// They stay apart up to this time, and are near the minimum gap there.
    Hit(f64),
    /// They stay apart up to this time; the iterations ran out.
    Limit(f64),
    /// They are at this distance, nearer than the gap to stop at, when the interval begins, m.
    Near(f64),
}

/// The piece of the obstacle.
#[derive(Clone, Copy, Debug)]
pub(super) enum Still {
    /// A bounded one, obstacle frame.
    Convex(Piece),
    /// All points with `normal . x <= offset`.
    HalfSpace { normal: Vector3<f64>, offset: f64 },
}

/// A search for the first impact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search<'a> {
    pub(super) motion: &'a RelativeMotion,
    pub(super) gaps: Gaps,
    pub(super) max_iterations: u32,
}

impl Search<'_> {
    /// Follows the pair over `[from, to]`; `placement` is the body at `from`, `mover` its piece in its own frame.
    pub(super) fn advance(
        &self,
        mover: &Piece,
        still: &Still,
        placement: &Placement,
        from: f64,
        to: f64,
        work: &mut Work,
    ) -> Outcome {
        let mut moving = Moving::at(self.motion, placement, mover, to - from);
        // The directions that cost nothing settle most pairs.
        if moving.cheap_step(still, self.gaps.stop).step >= to - from {
            return Outcome::Free;
        }
        let mut time = from;
        for iteration in 0..self.max_iterations {
            work.advancement_steps += 1;
            let cheap = moving.cheap_step(still, self.gaps.stop);
            let good = cheap.step >= GOOD_SHARE * (to - time)
                && cheap.gap - self.gaps.stop > self.gaps.tolerance; // false for NaN
            let best = if good {
                cheap
            } else {
                moving.best_step(still, cheap, self.gaps.stop)
            };
            let far = best.gap >= self.gaps.stop; // false for NaN
            if iteration == 0 && !far {
                return Outcome::Near(best.gap);
            }
            if best.step >= to - time {
                return Outcome::Free;
            }
            let apart = best.gap - self.gaps.stop > self.gaps.tolerance; // false for NaN
            time += best.step.max(0.0);
            if !apart {
                return Outcome::Hit(time);
            }
            moving = Moving::at(self.motion, &self.motion.at(time), mover, to - time);
        }
        Outcome::Limit(time)
    }
}

/// A step in time that is safe along some direction, and the gap along it.
#[derive(Clone, Copy, Debug)]
struct SafeStep {
    step: f64,
    gap: f64,
}

impl SafeStep {
    const NOWHERE: Self = Self {
        step: 0.0,
        gap: f64::NEG_INFINITY,
    };

    /// The longer step and the larger gap; `max` prefers any number to NaN.
    fn or(self, other: Self) -> Self {
        Self {
            step: self.step.max(other.step),
            gap: self.gap.max(other.gap),
        }
    }
}

/// A piece of the body at one time, obstacle frame, with what bounds its path from there.
#[derive(Clone, Copy, Debug)]
struct Moving {
    piece: Piece,
    velocities: [Vector3<f64>; 3],
    /// Half of the accelerations.
    bends: [Vector3<f64>; 3],
    /// `|w| |w x r_i| H / 6`, H the time that is left.
    remainders: [f64; 3],
    spin: Vector3<f64>,
    /// `w x a` and `w x (w x a) / 2` of a cylinder's axis, and the axis' remainder.
    axis_turn: Vector3<f64>,
    axis_bend: Vector3<f64>,
    axis_remainder: f64,
    rate: f64,
}

impl Moving {
    #[inline]
    fn at(motion: &RelativeMotion, placement: &Placement, piece: &Piece, time_left: f64) -> Self {
        let piece = piece.placed(placement);
        let turns = piece
            .points
            .map(|x| motion.spin.cross(&(x.coords - placement.center)));
        let cubic = motion.rate * time_left / 6.0;
        let axis_turn = motion.spin.cross(&piece.axis);
        Self {
            piece,
            velocities: turns.map(|turn| motion.velocity + turn),
            bends: turns.map(|turn| motion.spin.cross(&turn) * 0.5),
            remainders: turns.map(|turn| turn.norm() * cubic),
            spin: motion.spin,
            axis_turn,
            axis_bend: motion.spin.cross(&axis_turn) * 0.5,
            axis_remainder: axis_turn.norm() * cubic,
            rate: motion.rate,
        }
    }

    /// The best step along the normals of faces and caps.
    fn cheap_step(&self, still: &Still, gap_to_keep: f64) -> SafeStep {
        match still {
            Still::HalfSpace { normal, offset } => self.safe_step(normal, *offset, gap_to_keep),
            Still::Convex(other) => {
                let mut best = SafeStep::NOWHERE;
                let mut consider = |n: &Vector3<f64>| {
                    best = best.or(self.safe_step(n, other.support(n), gap_to_keep));
                };
                if let Some(normal) = &other.face {
                    consider(normal);
                }
                if let Some(normal) = &self.piece.face {
                    consider(&-normal);
                }
                let offset = self.piece.points[0] - other.points[0];
                for axis in [&other.axis, &self.piece.axis] {
                    if *axis != Vector3::zeros() {
                        consider(&(axis * axis.dot(&offset).signum()));
                    }
                }
                best
            }
        }
    }

    /// The better of a step and that along the closest points.
    fn best_step(&self, still: &Still, best: SafeStep, gap_to_keep: f64) -> SafeStep {
        let Still::Convex(other) = still else {
            return best;
        };
        let n = closest::direction(&self.piece, other);
        best.or(self.safe_step(&n, other.support(&n), gap_to_keep))
    }

    /// How far in time the piece may move so that it stays `gap_to_keep` above `support` along `direction`. NaN goes nowhere.
    #[inline]
    fn safe_step(&self, direction: &Vector3<f64>, support: f64, gap_to_keep: f64) -> SafeStep {
        let sideways = direction.cross(&self.spin).norm();
        let below = support + self.piece.round;
        if self.piece.disc > 0.0 {
            return self.safe_disc_step(direction, sideways, below, gap_to_keep);
        }
        let mut best = SafeStep {
            step: f64::INFINITY,
            gap: f64::INFINITY,
        };
        for i in 0..self.piece.count {
            let (height, speed, bend) = self.path(i, direction, sideways, below);
            best.gap = best.gap.min(height);
            best.step = best
                .step
                .min(time_to_fall(height - gap_to_keep, speed, bend));
        }
        if below.is_finite() {
            best
        } else {
            SafeStep::NOWHERE
        }
    }

    /// The same for a cylinder: each end of the axis carries the disc.
    fn safe_disc_step(
        &self,
        n: &Vector3<f64>,
        sideways: f64,
        below: f64,
        gap_to_keep: f64,
    ) -> SafeStep {
        let (along, turn, bend) = (
            n.dot(&self.piece.axis),
            n.dot(&self.axis_turn),
            n.dot(&self.axis_bend),
        );
        let sine = n.cross(&self.piece.axis).norm();
        let disc = self.piece.disc;
        // Growth of the disc's reach along -n: speed and bend (growth `speed h + bend h^2`).
        let standing = (
            n.cross(&self.axis_turn).norm(),
            0.5 * self.rate * self.axis_turn.norm(),
        );
        let slope = along / sine;
        let lying = (
            -slope * turn,
            -slope * bend + slope.abs() * self.axis_remainder * sideways,
        );
        let growths = [
            standing,
            if sine > STANDING_SINE {
                lying
            } else {
                standing
            },
        ];
        let mut best = SafeStep {
            step: f64::INFINITY,
            gap: f64::INFINITY,
        };
        for i in 0..2 {
            let (height, speed, drop) = self.path(i, n, sideways, below + disc * sine);
            best.gap = best.gap.min(height);
            let steps = growths.map(|(faster, lower)| {
                time_to_fall(
                    height - gap_to_keep,
                    speed - disc * faster,
                    drop + disc * lower,
                )
            });
            best.step = best.step.min(steps[0].max(steps[1]));
        }
        if below.is_finite() && sine.is_finite() {
            best
        } else {
            SafeStep::NOWHERE
        }
    }

    /// Height of point `i` above `below` along `n`, its speed, and the coefficient by which it may bend down.
    #[inline]
    fn path(&self, i: usize, n: &Vector3<f64>, sideways: f64, below: f64) -> (f64, f64, f64) {
        (
            n.dot(&self.piece.points[i].coords) - below,
            n.dot(&self.velocities[i]),
            self.remainders[i] * sideways - n.dot(&self.bends[i]),
        )
    }
}
