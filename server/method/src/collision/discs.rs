//! Conservative advancement of cylinders, whose pieces are segments with a disc swept along them; and towards a half-space, which is bounded along its
//! normal alone.
//!
//! | symbol | name in code | unit | meaning                                        |
//! |--------|--------------|------|------------------------------------------------|
//! | n      | `n`          | –    | unit direction from the obstacle's piece to the body's |
//! | R, a   | `radius`, `axis` | m, – | a disc, w the body's spin                    |
//! | h      |              | –    | step in time                                   |
//!
//! A disc reaches `R |n x a|` along n and along -n. Of the body's, which turns, two bounds hold, and the better is taken:
//!
//! - `|n x a(h)| <= |n x a| - (n.a / |n x a|) (n.a(h) - n.a)`, from the mean of the squares of `|n x a|`: exact where the cylinder lies, rolls or yaws;
//! - `|n x a(h)| <= |n x a| + h |n x (w x a)| + h^2 |w| |w x a| / 2`: where it stands, n along a.

use nalgebra::Vector3;

use super::advancement::{Directions, PairSearch, PiecePair};
use super::collider::{Disc, Swept};
use super::fall::time_to_fall;
use super::gjk::{Core, direction};
use super::motion::Placement;
use super::moving_piece::{MovingPiece, SafeStep, support};
use super::turning::Turning;
use super::work::Work;

/// A step along the normals of faces and caps that covers this share of what is left is taken without a look at closest points.
const GOOD_SHARE: f64 = 0.25;
/// A cylinder's axis nearer to the direction than this stands, as a sine: the first bound divides by it.
const STANDING_SINE: f64 = 1e-9;

/// A pair of pieces at one time, obstacle frame, with what bounds the path of the body's.
pub(super) struct SweptPair<'a> {
    search: &'a PairSearch<'a>,
    pair: &'a PiecePair,
    moving: &'a MovingPiece,
    body_normal: Vector3<f64>,
    disc: Option<MovingDisc>,
}

/// The disc of the body.
struct MovingDisc {
    disc: Disc,
    /// `w x a` and `w x (w x a) / 2`, and what is left: `|w| |w x a| H / 6`, H the time that is left.
    turn: Vector3<f64>,
    bend: Vector3<f64>,
    remainder: f64,
}

impl<'a> SweptPair<'a> {
    pub(super) fn new(
        search: &'a PairSearch<'a>,
        pair: &'a PiecePair,
        moving: &'a MovingPiece,
        placement: &Placement,
        time_left: f64,
    ) -> Self {
        let (spin, rate) = (search.motion.spin, search.motion.rate);
        let disc = search.swept.discs[0].map(|disc| {
            let axis = placement.rotation * disc.axis;
            let turn = spin.cross(&axis);
            MovingDisc {
                disc: Disc { axis, ..disc },
                turn,
                bend: spin.cross(&turn) * 0.5,
                remainder: turn.norm() * rate * time_left / 6.0,
            }
        });
        Self {
            search,
            pair,
            moving,
            body_normal: placement.rotation * pair.body_normal,
            disc,
        }
    }

    fn swept(&self) -> &Swept {
        &self.search.swept
    }

    /// The best step along the normals of faces and caps.
    pub(super) fn step_along_faces(&self) -> SafeStep {
        let along_obstacle = self.safe_step(&self.pair.obstacle_normal);
        if self.swept().half_space {
            return along_obstacle;
        }
        let mut best = along_obstacle.or(self.safe_step(&-self.body_normal));
        let offset = self.moving.corners[0] - self.pair.on_obstacle[0];
        let axes = [
            self.swept().discs[1].map(|disc| disc.axis),
            self.disc.as_ref().map(|moving| moving.disc.axis),
        ];
        for axis in axes.into_iter().flatten() {
            best = best.or(self.safe_step(&(axis * axis.dot(&offset).signum())));
        }
        best
    }

    /// Whether the pair is free in the time that is `left` along one of the normals of faces and caps, or a direction along which others were followed.
    pub(super) fn is_free(&self, left: f64, lately: &Directions) -> bool {
        let along = |n: &Vector3<f64>| self.safe_step(n).step >= left;
        // A half-space is bounded along its normal alone.
        let others = !self.swept().half_space;
        self.step_along_faces().step >= left || others && lately.newest.iter().any(along)
    }

    /// The best of those and the step along the closest points, which cost more: they are asked where the others allow little of the time that is `left`.
    pub(super) fn best_step(&self, left: f64, lately: &Directions, work: &mut Work) -> SafeStep {
        let gaps = &self.search.gaps;
        let good = |step: &SafeStep| {
            step.step >= GOOD_SHARE * left && step.gap - gaps.stop > gaps.tolerance // false for NaN
        };
        let mut best = self.step_along_faces();
        if good(&best) || self.swept().half_space {
            return best;
        }
        for n in &lately.newest {
            best = best.or(self.safe_step(n));
            if good(&best) {
                return best;
            }
        }
        let body = Core {
            points: self.moving.corners,
            disc: self.disc.as_ref().map(|moving| moving.disc),
        };
        let obstacle = Core {
            points: self.pair.on_obstacle,
            disc: self.swept().discs[1],
        };
        let kept = gaps.stop + self.swept().round;
        let (n, supports) = direction(&body, &obstacle, [kept, gaps.tolerance]);
        work.advancement_steps += supports;
        // First, so that neighbours are tried along it.
        best = self.safe_step(&n).or(best);
        if good(&best) {
            return best;
        }
        best.or(self.turning_step(&n, left, best.gap - gaps.stop))
    }

    /// The same along `n` and what it may turn to, where the side of a cylinder lies on something, so much farther away than the gap to stop at.
    fn turning_step(&self, n: &Vector3<f64>, left: f64, above: f64) -> SafeStep {
        let mut best = SafeStep::nowhere(n);
        let discs = [
            self.disc.as_ref().map(|moving| moving.disc),
            self.swept().discs[1],
        ];
        let all = || discs.iter().flatten();
        // No disc reaches farther than its radius along any direction; one that lies reaches that far.
        let over = all().map(|disc| disc.radius * (1.0 - n.cross(&disc.axis).norm()));
        let lies = over.sum::<f64>() < above; // false for NaN
        if !lies {
            return best;
        }
        let round = self.swept().round + all().map(|disc| disc.radius).sum::<f64>();
        let still = &self.pair.on_obstacle;
        let turning = Turning {
            moving: self.moving,
            still,
            velocity: &self.search.motion.velocity,
            rate: self.search.motion.rate,
            left,
        };
        let [of_body, of_obstacle] = [(0, &self.moving.corners), (1, still)].map(|(k, piece)| {
            let sides = [0, 1, 2].map(|i| piece[(i + 1) % 3] - piece[i]);
            discs[k].map_or(sides, |disc| {
                [disc.axis, Vector3::zeros(), Vector3::zeros()]
            })
        });
        // A corner of the obstacle lets n turn as it may.
        let corner = discs[1].is_none().then_some(None);
        let lines = of_obstacle.into_iter().map(Some).chain(corner);
        for other in lines {
            for spin in of_body
                .iter()
                .filter_map(|line| turning.spin(n, line, other))
            {
                let mut step = turning.safe_step(n, &spin, self.search.gaps.stop + round);
                step.gap -= round;
                best = best.or(step);
            }
        }
        best
    }

    /// How far in time the body's piece may move so that it stays the gap to stop at above the obstacle's along `n`. NaN goes nowhere.
    fn safe_step(&self, n: &Vector3<f64>) -> SafeStep {
        let obstacle = self.swept().discs[1];
        let sideways = obstacle.map_or(0.0, |disc| disc.radius * n.cross(&disc.axis).norm());
        let below = support(n, &self.pair.on_obstacle) + sideways + self.swept().round;
        match &self.disc {
            Some(moving) => self.safe_disc_step(n, below, moving),
            None => self.moving.safe_step(n, below, self.search.gaps.stop),
        }
    }

    /// The same for a cylinder: each end of the axis carries the disc.
    fn safe_disc_step(&self, n: &Vector3<f64>, below: f64, moving: &MovingDisc) -> SafeStep {
        let kept = self.search.gaps.stop;
        let Disc { radius, axis } = moving.disc;
        let sideways = n.cross(&self.search.motion.spin).norm();
        let sine = n.cross(&axis).norm();
        // Growth of the disc's reach along -n: speed and bend (growth `speed h + bend h^2`).
        let standing = (
            n.cross(&moving.turn).norm(),
            0.5 * self.search.motion.rate * moving.turn.norm(),
        );
        let slope = n.dot(&axis) / sine;
        let lying = (
            -slope * n.dot(&moving.turn),
            -slope * n.dot(&moving.bend) + slope.abs() * moving.remainder * sideways,
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
            direction: *n,
        };
        for end in 0..2 {
            let (height, speed, drop) = self.moving.path(end, n, sideways);
            let height = height - (below + radius * sine);
            best.gap = best.gap.min(height);
            let steps = growths.map(|(faster, lower)| {
                time_to_fall(
                    height - kept,
                    speed - radius * faster,
                    drop + radius * lower,
                )
            });
            best.step = best.step.min(steps[0].max(steps[1]));
        }
        if below.is_finite() && sine.is_finite() {
            best
        } else {
            SafeStep::nowhere(n)
        }
    }
}
