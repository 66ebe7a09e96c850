//! The body on one obstacle: what late sets make of their contact, in just-noticeable differences.
//!
//! | symbol  | unit | meaning                                                               |
//! |---------|------|-----------------------------------------------------------------------|
//! | kappa   | 1/m  | how fast the normal turns along the way                               |
//! | w       | m    | way of the device from one set to the next                            |
//! | d       | m    | way of the device beyond what its set knows, at its longest           |
//!
//! Two convex bodies of the curvature a and b turn about each other like ab / (a + b); an edge of the body slides over a curved obstacle and turns by its
//! curvature. Facets that the device passes more often than sets are replaced are a stair beside that slope; those that it passes more seldom are
//! [`Edges`], as are edges. Facets of a hollow are in the set before they are met, but for a mesh whose rows are made anew for each force: no rows are chosen
//! for it, and it is as late there as its own curvature: an estimate, and no bound.
//! Where the body's faces lie on an obstacle that is no plane, normals turn with the body.

use super::body::BodyNeed;
use super::edges::{Edges, fall};
use super::errors::{
    TICK, direction_jnd, facet_angle, longest_lag, normal_turn, parallel, sagitta, set_step,
    stair_turn,
};
use super::need::SceneNeed;
use super::pressed::Pressed;
use super::ripple::{SPOILED, WINDOW, is_smooth, pulse, ripple_jnd, sawtooth};
use super::rounds::{left_of_slide, left_of_turn};

/// Errors of late sets, in just-noticeable differences.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Late {
    /// Turned normals.
    pub direction: f64,
    /// Surface off its tangent plane.
    pub off_plane: f64,
    /// Force from one set to the next.
    pub step: f64,
    /// What comes and goes with the sets.
    pub ripple: f64,
    /// Faces that were left over an edge, and still hold.
    pub edges: f64,
}

impl Late {
    /// The larger of each.
    #[must_use]
    pub fn or_more(self, other: Self) -> Self {
        Self {
            direction: self.direction.max(other.direction),
            off_plane: self.off_plane.max(other.off_plane),
            step: self.step.max(other.step),
            ripple: self.ripple.max(other.ripple),
            edges: self.edges.max(other.edges),
        }
    }
}

/// Body and obstacle, whose meshes are so far off their files, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact<'a> {
    pub(super) need: &'a SceneNeed,
    pub(super) obstacle: &'a BodyNeed,
    pub(super) errors: [f64; 2],
}

/// When sets come, and how far the device goes until then.
#[derive(Clone, Copy, Debug)]
struct Sets {
    /// Hz.
    rate: f64,
    rounds: u32,
    /// d, m; and the time of it, s.
    lag: f64,
    late: f64,
    /// w, m.
    between: f64,
    /// In a millisecond, m.
    tick: f64,
}

impl Contact<'_> {
    /// What sets at `rate`, Hz, with so many rounds make of it.
    pub(super) fn late(&self, rate: f64, rounds: u32) -> Late {
        let need = self.need;
        let late = longest_lag(need.k_s, rate);
        let sets = Sets {
            rate,
            rounds,
            late,
            lag: need.speed * late,
            between: need.speed / rate,
            tick: need.speed * TICK,
        };
        let passed = self.passed(&sets).into_iter();
        let passed = passed.map(|(edges, rounding)| self.passing(&edges, rounding, &sets));
        passed.fold(self.sliding(&sets), Late::or_more)
    }

    /// How fast its normal turns along the way, 1/m.
    pub(super) fn curvature(&self) -> f64 {
        let (a, b) = (&self.need.body, self.obstacle);
        let sum = a.curvature + b.curvature;
        let smooth = if sum > 0.0 {
            a.curvature * b.curvature / sum
        } else {
            0.0
        };
        smooth.max(if a.sharp { b.curvature } else { 0.0 })
    }

    fn pressed(&self) -> Pressed {
        Pressed {
            stiffness: self.need.stiffness,
            force: self.need.force,
            friction: self.obstacle.friction,
            turns: self.need.lever > 0.0,
        }
    }

    /// As the device sees it, which goes as deep as it presses.
    fn deep(&self, curvature: f64) -> f64 {
        parallel(curvature, self.need.depth())
    }

    /// What slides over the obstacle's edges, and over the body's: there a round obstacle alone. Where edges
    /// of both cross, other rows hold as well.
    fn roundings(&self) -> [f64; 2] {
        [self.need.body.rounding(), self.obstacle.curvature].map(|rounding| self.deep(rounding))
    }

    /// On what goes on bending: a slope, with facets that are finer than the lag.
    fn sliding(&self, sets: &Sets) -> Late {
        let (need, pressed) = (self.need, self.pressed());
        let curvature = self.curvature();
        let exact = need.body.exact && self.obstacle.exact;
        let deep = self.deep(curvature);
        let slid = |way: f64| {
            let angle = normal_turn(deep, way);
            let rounds = if exact { sets.rounds } else { 0 };
            left_of_slide(angle, curvature, need.depth(), rounds)
        };
        let turning = |time: f64| {
            let angle = if self.turns_with_body() {
                need.turn_rate * time
            } else {
                0.0
            };
            left_of_turn(angle, sets.rounds)
        };
        let angle = slid(sets.lag) + turning(sets.late);
        // Where rows follow the surface, what a set changes is all beside what the right force changes.
        let follows = slid(sets.lag) < normal_turn(deep, sets.lag); // false for NaN
        let (turn, own, left) = if follows {
            let turn = slid(sets.lag) - slid(sets.lag - sets.between);
            (turn, 0.0, slid(sets.lag) / normal_turn(deep, sets.lag))
        } else {
            (self.stairs(sets), normal_turn(curvature, sets.tick), 1.0)
        };
        let turn = turn + turning(sets.rate.recip());
        let lean = pressed.lean();
        let change = |own: f64| {
            let ways = [sets.between * left, sets.tick * left];
            set_step(need.stiffness, need.k_s, need.force, [turn, own], ways)
        };
        let facets = need.force * self.fluctuation(sets) / 6.0_f64.sqrt();
        let ripple = sawtooth(change(0.0), sets.rate).max(facets) * lean;
        let off = sagitta(deep, sets.lag) * left * left;
        Late {
            direction: direction_jnd(angle).max(pressed.felt_torque(angle)),
            off_plane: pressed.felt(need.stiffness * off),
            step: pressed.felt(change(own)),
            ripple: ripple_jnd(ripple),
            edges: 0.0,
        }
    }

    /// How much the error of the normal comes and goes by facets that are finer than the lag, rad: in the
    /// mean it is that of the slope.
    fn fluctuation(&self, sets: &Sets) -> f64 {
        let slope = self.deep(self.curvature());
        let bodies = [self.obstacle, &self.need.body].into_iter();
        let each = bodies.zip(self.roundings()).map(|(body, rounding)| {
            let finer = body.bends.filter(|bends| bends.apart <= sets.lag);
            let steps = rounding > slope; // false for NaN
            let facet = finer.filter(|_| steps).map_or(0.0, |bends| bends.turn);
            (facet * (1.0 - slope / rounding)).min(normal_turn(rounding, sets.lag))
        });
        each.fold(0.0, |most, angle| if angle > most { angle } else { most })
    }

    /// Whether faces of the body make the normals.
    fn turns_with_body(&self) -> bool {
        let plane = self.obstacle.curvature == 0.0 && self.obstacle.creases.is_none();
        self.need.lever > 0.0 && !plane
    }

    /// Most that normals turn from one set to the next, rad.
    fn stairs(&self, sets: &Sets) -> f64 {
        let goes = sets.between > 0.0; // false for NaN
        if !goes {
            return 0.0;
        }
        let (a, o) = (&self.need.body, self.obstacle);
        let curvature = self.deep(self.curvature());
        let [over_obstacle, over_body] = [a.rounding(), o.curvature].map(|r| self.deep(r));
        // Facets of a simplified mesh may meet in hollow edges, where the normal turns at once however round the other body is.
        let stair = |body: &BodyNeed, error: f64, rounding: f64| {
            let finer = body.bends.filter(|bends| bends.apart <= sets.lag);
            let coarser = facet_angle(error, body.curvature);
            let largest = finer.map_or(0.0, |bends| bends.turn).max(coarser);
            let hollow = if error > 0.0 { coarser } else { 0.0 };
            let turned = |facet, rounding| stair_turn(curvature, facet, rounding, sets.between);
            turned(largest, rounding).max(turned(hollow, f64::INFINITY))
        };
        // Where no rows are chosen.
        let late = !a.exact && sets.rounds > 0;
        let in_hollow = |hollow: bool, inside: &BodyNeed| {
            let curvature = if hollow && late {
                inside.curvature
            } else {
                0.0
            };
            normal_turn(curvature, sets.between)
        };
        [
            stair(o, self.errors[1], over_obstacle),
            stair(a, self.errors[0], over_body),
            in_hollow(o.hollow, a),
            in_hollow(a.hollow, o),
        ]
        .into_iter()
        .fold(0.0, f64::max)
    }

    /// Edges that are passed, with what slides over them, 1/m.
    fn passed(&self, sets: &Sets) -> Vec<(Edges, f64)> {
        let [over_obstacle, over_body] = self.roundings();
        let bodies = [(self.obstacle, over_obstacle), (&self.need.body, over_body)];
        let mut passed = Vec::new();
        for (body, rounding) in bodies {
            let seldom = body.bends.filter(|bends| bends.apart > sets.lag);
            let edges = seldom.into_iter().chain(body.creases);
            passed.extend(edges.map(|edges| (edges, rounding)));
        }
        passed
    }

    /// Over edges that the device comes to now and then.
    fn passing(&self, edges: &Edges, rounding: f64, sets: &Sets) -> Late {
        let (need, pressed) = (self.need, self.pressed());
        let reached = sets.lag > 0.0 && rounding > 0.0; // false for NaN
        if !reached {
            return Late::default();
        }
        let (arc, lean) = (edges.turn / rounding, pressed.lean());
        let turn = |way: f64| normal_turn(rounding, way).min(edges.turn);
        let change = |own: f64| {
            let ways = [sets.between, sets.tick];
            let turned = [turn(sets.between), own];
            let change = set_step(need.stiffness, need.k_s, need.force, turned, ways);
            change.min(need.force)
        };
        let sets_on_it = (arc / sets.between).max(1.0);
        let smooth = is_smooth(need.force * lean, turn(sets.tick));
        // Until a set knows of the edge the error grows; it stays until one knows of its end.
        let fallen = fall(edges.turn, rounding, sets.lag).min(need.depth());
        let error = (need.force * turn(sets.lag)).hypot(need.stiffness * fallen);
        let time = (arc + sets.lag) / need.speed;
        let teeth = sawtooth(change(0.0), sets.rate) * (time / WINDOW).min(1.0).sqrt();
        // Several in a window add up like noise.
        let in_window = (need.speed * WINDOW / edges.apart).max(1.0).sqrt();
        let amplitude = teeth.max((pulse(error, time) * in_window).min(error));
        let ripple = if smooth { amplitude * lean } else { 0.0 };
        Late {
            step: pressed.felt(change(turn(sets.tick))) * edges.weight(sets_on_it * sets.tick),
            ripple: ripple_jnd(ripple) * edges.weight(need.speed * SPOILED),
            edges: edges.felt(rounding, sets.lag, &pressed),
            ..Late::default()
        }
    }
}
