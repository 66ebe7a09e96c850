//! Rims of cylinders against points, segments, faces and each other.
//!
//! | symbol | name in code         | unit | meaning                                                            |
//! |--------|----------------------|------|--------------------------------------------------------------------|
//! | c, R   | `center`, `radius`   | m    | the circle                                                         |
//! | o      | `outward`            | –    | unit, across it, out of the cap                                    |
//! | r, t   | `radial`, `tangent`  | –    | unit, from the centre to a point of it, and along it               |
//! | n      | `normal`             | –    | unit, from the other surface to the rim                            |
//!
//! Over a face each rim has its lowest point, exactly. Where the cylinder stands on the face, to the look-ahead tilt, [`RIM_POINTS`] points fixed to the
//! body hold it as well, so that it does not wobble: between two of them its footprint is short by R (1 - cos(pi / 16)), 2 % of R, until it tilts and
//! the lowest point takes over. Where a rim is nearest to a line or another circle is searched by the slope of their distance along it.

use nalgebra::{Point3, Vector3};

use super::element::{Face, Point, Row, Segment};
use super::facing::{PARALLEL_SINE, Reach};
use super::{Feature, LOOK_AHEAD_TILT, NORMAL_CONE_TOLERANCE};

/// Points of a rim that hold a cylinder that stands. As many places tell minima of the distance apart: two of them are pi apart or nearly, or one is
/// hardly one.
const RIM_POINTS: u8 = 16;
/// Places on a rim: the lowest point; the two nearest to a line; then the fixed ones.
const LOWEST: u8 = 0;
const CROSSINGS: u8 = 1;
const FIXED: u8 = 3;
/// A cylinder nearer to upright than this has no lowest point, as a sine.
const UPRIGHT_SINE: f64 = 1e-12;
/// Most places looked at between two ends; some eight are enough.
const MAX_REFINEMENTS: u32 = 60;
/// An angle that moves by no more than this is found, rad.
const ANGLE_ROUNDING: f64 = 1e-14;

/// A rim, in the common frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Circle {
    pub(super) center: Point3<f64>,
    pub(super) outward: Vector3<f64>,
    pub(super) radius: f64,
    /// A unit vector in its plane that turns with the body: from it the fixed points are counted.
    pub(super) mark: Vector3<f64>,
    /// 0 or 1.
    pub(super) end: u8,
}

/// A point of a rim.
#[derive(Clone, Copy)]
struct RimPoint {
    at: Point3<f64>,
    radial: Vector3<f64>,
    tangent: Vector3<f64>,
    /// In the first half turn from where the search began: tells minima apart.
    upper: bool,
}

impl RimPoint {
    fn place(&self) -> u8 {
        CROSSINGS + u8::from(self.upper)
    }
}

impl Circle {
    /// The point at an angle, by its sine and cosine, from a unit vector in its plane.
    fn at(&self, from: &Vector3<f64>, (sin, cos): (f64, f64)) -> RimPoint {
        let across = self.outward.cross(from);
        let radial = from * cos + across * sin;
        RimPoint {
            at: self.center + radial * self.radius,
            radial,
            tangent: across * cos - from * sin,
            upper: sin >= 0.0,
        }
    }

    /// The direction from its axis to a point; `None` on the axis.
    fn radial(&self, p: &Point3<f64>) -> Option<Vector3<f64>> {
        let offset = p - self.center;
        let sideways = offset - self.outward * self.outward.dot(&offset);
        sideways.try_normalize(f64::MIN_POSITIVE)
    }

    /// Whether a direction lies in the normal cone at a point of the rim, to `tolerance`, rad.
    fn holds(&self, radial: &Vector3<f64>, direction: &Vector3<f64>, tolerance: f64) -> bool {
        direction.dot(radial) >= -tolerance && direction.dot(&self.outward) >= -tolerance
    }

    fn row(
        &self,
        place: u8,
        other: Feature,
        [x, y]: [Point3<f64>; 2],
        round: f64,
        normal: Vector3<f64>,
    ) -> Row {
        Row {
            features: [Feature::Rim(self.end, place), other],
            on_first: x,
            on_second: y + normal * round,
            normal,
            gap: normal.dot(&(x - y)) - round,
            implied: false,
        }
    }

    /// Whether something between these points may be within `reach` (m) of it: they lie on either side of its plane, or as near to that, and not all
    /// farther inside it.
    pub(super) fn may_be_near(&self, points: &[Point3<f64>], reach: f64) -> bool {
        let offsets = || points.iter().map(|p| p - self.center);
        let heights = || offsets().map(|offset| self.outward.dot(&offset));
        let inside = (self.radius - reach).max(0.0);
        let far_out = |(offset, height): (Vector3<f64>, f64)| {
            offset.norm_squared() - height * height >= inside * inside
        };
        heights().any(|height| height >= -reach)
            && heights().any(|height| height <= reach)
            && offsets().zip(heights()).any(far_out)
    }

    pub(super) fn beside_point(&self, b: &Point) -> Option<Row> {
        let radial = self.radial(&b.at)?;
        let at = self.center + radial * self.radius;
        let normal = (at - b.at).try_normalize(f64::MIN_POSITIVE)?;
        let facing = self.holds(&radial, &-normal, NORMAL_CONE_TOLERANCE)
            && b.skin.cone.holds(&normal, NORMAL_CONE_TOLERANCE);
        facing.then(|| self.row(LOWEST, b.skin.feature, [at, b.at], b.skin.round, normal))
    }

    /// Where the rim is nearest to a segment across it.
    pub(super) fn beside_segment(&self, b: &Segment, reach: &Reach, found: &mut dyn FnMut(Row)) {
        let from = b.ends[0];
        let along = b.ends[1] - from;
        let length = along.norm();
        let along = along / length;
        let share = |p: &Point3<f64>| along.dot(&(p - from));
        let nearest = from + along * share(&self.center).clamp(0.0, length);
        let within = b.skin.round + reach.within;
        let near = (nearest - self.center).norm() <= self.radius + within;
        if !near || !self.may_be_near(&b.ends, within) {
            return;
        }
        // Two minima lie on either side of where the circle is the farthest along the segment.
        let start = self.in_plane(&along);
        let foot = |p: &Point3<f64>| Some(from + along * share(p));
        self.for_nearest(&start, foot, |rim| {
            let t = share(&rim.at);
            if !(0.0..=length).contains(&t) {
                return;
            }
            let on_segment = from + along * t;
            let cross = rim.tangent.cross(&along);
            let normal = cross.try_normalize(PARALLEL_SINE).map(|unit| {
                let inward = unit.dot(&(rim.radial + self.outward)) <= 0.0;
                if inward { unit } else { -unit }
            });
            let apart = || (rim.at - on_segment).try_normalize(f64::MIN_POSITIVE);
            let Some(normal) = normal.or_else(apart) else {
                return;
            };
            let facing = self.holds(&rim.radial, &-normal, LOOK_AHEAD_TILT)
                && b.skin.cone.holds(&normal, LOOK_AHEAD_TILT);
            if facing {
                let points = [rim.at, on_segment];
                found(self.row(rim.place(), b.skin.feature, points, b.skin.round, normal));
            }
        });
    }

    /// Points of the rim over a face: the lowest, which may move by the look-ahead tilt to be over it, and the fixed ones where the cylinder stands.
    pub(super) fn over_face(&self, face: &Face, reach: &Reach, found: &mut dyn FnMut(Row)) {
        let normal = face.normal;
        let leaning = self.outward.dot(&normal);
        let down = self.outward * leaning - normal;
        let sine = down.norm();
        let lowest = normal.dot(&(self.center - face.point)) - self.radius * sine;
        let facing = leaning <= LOOK_AHEAD_TILT && lowest <= reach.within; // false for NaN
        if !facing {
            return;
        }
        let mut take = |radial: Vector3<f64>, place: u8| {
            let at = self.center + radial * self.radius;
            let height = normal.dot(&(at - face.point));
            let over = reach.is_near(height) && face.is_under(&at, height);
            if over {
                found(self.row(place, face.feature, [at, at - normal * height], 0.0, normal));
            }
            over
        };
        if sine > UPRIGHT_SINE {
            let lowest = down / sine;
            let aside = self.outward.cross(&lowest) * LOOK_AHEAD_TILT;
            let mut turned = |by: f64| take((lowest + aside * by).normalize(), LOWEST);
            let _ = turned(0.0) || sine > LOOK_AHEAD_TILT && (turned(1.0) || turned(-1.0));
        }
        if sine <= LOOK_AHEAD_TILT {
            for k in 0..RIM_POINTS {
                let angle = angle_of(k).sin_cos();
                take(self.at(&self.mark, angle).radial, FIXED + k);
            }
        }
    }

    /// Where two rims are locally nearest; and where they cross in the plane of a cap on a cap that they overlap in part.
    pub(super) fn beside_circle(&self, b: &Self, reach: &Reach, found: &mut dyn FnMut(Row)) {
        let centers = self.center - b.center;
        let near = centers.norm() <= reach.within + self.radius + b.radius;
        if !near {
            return;
        }
        let opposite = -self.outward.dot(&b.outward);
        if opposite > 0.0 && self.outward.cross(&b.outward).norm() <= LOOK_AHEAD_TILT {
            self.overlapping(b, found);
        }
        let foot = |p: &Point3<f64>| Some(b.center + b.radial(p)? * b.radius);
        let mut taken = [false; 2];
        self.for_nearest(&self.in_plane(&centers), foot, |rim| {
            let Some(radial) = b.radial(&rim.at) else {
                return;
            };
            let y = b.center + radial * b.radius;
            let Some(normal) = (rim.at - y).try_normalize(f64::MIN_POSITIVE) else {
                return;
            };
            let facing = self.holds(&rim.radial, &-normal, NORMAL_CONE_TOLERANCE)
                && b.holds(&radial, &normal, NORMAL_CONE_TOLERANCE);
            // Circles with one axis are as near everywhere.
            if facing && !std::mem::replace(&mut taken[usize::from(rim.upper)], true) {
                let other = Feature::Rim(b.end, rim.place());
                found(self.row(rim.place(), other, [rim.at, y], 0.0, normal));
            }
        });
    }

    /// Caps that face each other and overlap in part hold each other where their circles cross.
    fn overlapping(&self, b: &Self, found: &mut dyn FnMut(Row)) {
        let (cap, normal) = (self.outward, b.outward);
        let offset = self.center - b.center;
        let sideways = offset - normal * normal.dot(&offset);
        let distance = sideways.norm();
        // From b's centre: how far along the line of centres the crossings lie.
        let along = (distance * distance + b.radius * b.radius - self.radius * self.radius)
            / (2.0 * distance);
        let squared = b.radius * b.radius - along * along;
        let crosses = squared > 0.0; // false for NaN: circles with one centre
        if !crosses {
            return;
        }
        let line = sideways / distance;
        let beside = normal.cross(&line) * squared.sqrt();
        for (place, side) in [(CROSSINGS, beside), (CROSSINGS + 1, -beside)] {
            let foot = b.center + line * along + side;
            // Up to this cap, along b's normal.
            let height = cap.dot(&(self.center - foot)) / cap.dot(&normal);
            let points = [foot + normal * height, foot];
            found(self.row(place, Feature::Cap(b.end), points, 0.0, normal));
        }
    }

    /// The unit vector in its plane nearest to a direction.
    fn in_plane(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let part = v - self.outward * self.outward.dot(v);
        part.try_normalize(f64::EPSILON * v.norm())
            .unwrap_or(self.mark)
    }

    /// Calls `found` for the points at which the distance to something has a minimum along the circle, by the nearest point of that to a point. The search
    /// begins at `start`, a unit vector from the centre.
    fn for_nearest(
        &self,
        start: &Vector3<f64>,
        nearest: impl Fn(&Point3<f64>) -> Option<Point3<f64>>,
        mut found: impl FnMut(&RimPoint),
    ) {
        // Half the slope of the squared distance, over R.
        let slope = |angle: f64| {
            let rim = self.at(start, angle.sin_cos());
            nearest(&rim.at).map_or(0.0, |y| rim.tangent.dot(&(rim.at - y)))
        };
        let mut before = slope(0.0);
        for k in 0..RIM_POINTS {
            let ends = [angle_of(k), angle_of(k + 1)];
            let after = slope(ends[1]);
            if before < 0.0 && after >= 0.0 {
                let angle = zero_between(ends, [before, after], slope);
                found(&self.at(start, angle.sin_cos()));
            }
            before = after;
        }
    }
}

/// Where a function of an angle crosses zero between two ends, from below: false position, where the value at an end that stays counts half.
/// Source: Dowell, Jarratt 1971 (the Illinois method).
fn zero_between(mut ends: [f64; 2], mut values: [f64; 2], of: impl Fn(f64) -> f64) -> f64 {
    let (mut angle, mut replaced) = (f64::INFINITY, None);
    for _ in 0..MAX_REFINEMENTS {
        let share = values[0] / (values[0] - values[1]);
        let next = ends[0] + (ends[1] - ends[0]) * share;
        let moves = (next - angle).abs() > ANGLE_ROUNDING; // false for NaN
        if !moves {
            break;
        }
        angle = next;
        let value = of(angle);
        let side = usize::from(value >= 0.0);
        (ends[side], values[side]) = (angle, value);
        if replaced.replace(side) == Some(side) {
            values[1 - side] *= 0.5;
        }
    }
    angle
}

fn angle_of(place: u8) -> f64 {
    std::f64::consts::TAU * f64::from(place) / f64::from(RIM_POINTS)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::zero_between;

    #[test]
    fn a_zero_between_two_ends_is_found_in_a_few_looks() {
        for k in 0..1000 {
            let u = f64::from(k);
            // Slopes of rims over lines: two waves, of once and twice the angle.
            let (zero, bend) = (0.39 * (1.3 * u).sin().abs(), 0.8 * (0.7 * u).sin());
            let wave = |angle: f64| angle.sin() + bend * (0.5 * (2.0 * angle).sin());
            let looks = Cell::new(0);
            let of = |angle: f64| {
                looks.set(looks.get() + 1);
                wave(angle - zero)
            };
            let ends = [zero - 0.39 + 1e-3 * u.cos().abs(), zero + 0.2];
            let values = ends.map(|angle| wave(angle - zero));
            if !(values[0] < 0.0 && values[1] >= 0.0) {
                continue;
            }
            let found = zero_between(ends, values, of);
            assert!((found - zero).abs() < 1e-13, "{k}: {found} {zero}");
            assert!(looks.get() <= 14, "{k}: {} looks", looks.get());
        }
    }
}
