//! Contacts of a cylinder with points, segments, faces and half-spaces.
//!
//! | symbol | name in code | unit | meaning                                                       |
//! |--------|--------------|------|---------------------------------------------------------------|
//! | a      | `axis`       | –    | unit, from end 0 to end 1                                     |
//! | R      | `radius`     | m    |                                                               |
//! | n      | `normal`     | –    | unit, from the other surface to the cylinder                  |
//!
//! Over a face each rim has its lowest point, exactly. Where the cylinder stands on the face, to the look-ahead tilt, [`RIM_POINTS`] points fixed to the
//! body hold it as well, so that it does not wobble: between two of them its footprint is short by R (1 - cos(pi / 16)), 2 % of R, until it tilts and
//! the lowest point takes over.

use nalgebra::{Point3, Vector3};

use super::element::{Cone, Knob, Rod, Row, Skin};
use super::primitive::{across, unit_axis};
use super::rim::nearest_to_line;
use crate::constraint::{Feature, LOOK_AHEAD_TILT, NORMAL_CONE_TOLERANCE, is_over};
use crate::geometry::Mesh;

/// Points of a rim that hold a cylinder that stands.
pub(super) const RIM_POINTS: u8 = 16;
/// Places on a rim: the lowest point; the two nearest to an edge; then the fixed ones.
pub(super) const LOWEST: u8 = 0;
pub(super) const CROSSINGS: u8 = 1;
pub(super) const FIXED: u8 = 3;
/// A cylinder nearer to upright than this has no lowest point, as a sine.
const UPRIGHT_SINE: f64 = 1e-12;

/// A cylinder in the common frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cylinder {
    pub(super) ends: [Point3<f64>; 2],
    pub(super) axis: Vector3<f64>,
    pub(super) length: f64,
    pub(super) radius: f64,
    /// A unit vector across the axis that turns with the body: from it the fixed rim points are counted.
    pub(super) mark: Vector3<f64>,
}

impl Cylinder {
    /// From its own frame into the common one.
    pub(super) fn new(
        ends: &[Point3<f64>; 2],
        radius: f64,
        point: impl Fn(&Point3<f64>) -> Point3<f64>,
        turn: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    ) -> Self {
        let axis = unit_axis(ends);
        Self {
            ends: [point(&ends[0]), point(&ends[1])],
            axis: turn(&axis),
            length: (ends[1] - ends[0]).norm(),
            radius,
            mark: turn(&across(&axis)),
        }
    }

    /// Out of end 0 or 1.
    #[inline]
    pub(super) fn outward(&self, end: usize) -> Vector3<f64> {
        if end == 0 { -self.axis } else { self.axis }
    }

    /// A point against side, cap or rim, whichever is nearest.
    pub(super) fn knob(&self, b: &Knob) -> Option<Row> {
        let offset = b.at - self.ends[0];
        let along = self.axis.dot(&offset);
        let sideways = offset - self.axis * along;
        let distance = sideways.norm();
        let end = usize::from(along > 0.5 * self.length);
        let above = if end == 1 {
            along - self.length
        } else {
            -along
        };
        let radial = sideways / distance; // NaN on the axis, where it is not used
        let name = end as u8;
        let (on_cylinder, outward, tilt, feature) = if above <= 0.0 {
            let at = b.at - radial * (distance - self.radius);
            (at, radial, LOOK_AHEAD_TILT, Feature::Side)
        } else if distance <= self.radius {
            let outward = self.outward(end);
            let at = b.at - outward * above;
            (at, outward, LOOK_AHEAD_TILT, Feature::Cap(name))
        } else {
            let at = self.ends[end] + radial * self.radius;
            let outward = (b.at - at).try_normalize(f64::MIN_POSITIVE)?;
            (
                at,
                outward,
                NORMAL_CONE_TOLERANCE,
                Feature::Rim(name, LOWEST),
            )
        };
        let normal = -outward;
        let facing = b.skin.cone.holds(&normal, tilt); // the cylinder's own cone holds by construction
        facing.then(|| {
            Row::between(
                [feature, b.skin.feature],
                [on_cylinder, b.at],
                [0.0, b.skin.round],
                normal,
            )
        })
    }

    /// The side as a rod: the axis with the radius around it.
    pub(super) fn side(&self) -> Rod<'static> {
        Rod {
            ends: self.ends,
            skin: Skin {
                round: self.radius,
                cone: Cone::Any,
                feature: Feature::Side,
            },
        }
    }

    /// A segment across the rims: where each is nearest to it.
    pub(super) fn rod_on_rims(&self, b: &Rod, mut found: impl FnMut(Row)) {
        let along = b.ends[1] - b.ends[0];
        let length = along.norm();
        let along = along / length;
        for end in 0..2 {
            let outward = self.outward(end);
            nearest_to_line(
                &self.ends[end],
                &self.axis,
                self.radius,
                &b.ends[0],
                &along,
                |rim| {
                    let t = along.dot(&(rim.at - b.ends[0]));
                    if !(0.0..=length).contains(&t) {
                        return;
                    }
                    let on_rod = b.ends[0] + along * t;
                    let Some(normal) = out_of(&rim.tangent, &along, &(rim.radial + outward))
                        .or_else(|| (rim.at - on_rod).try_normalize(f64::MIN_POSITIVE))
                    else {
                        return;
                    };
                    let facing = -normal.dot(&rim.radial) >= -LOOK_AHEAD_TILT
                        && -normal.dot(&outward) >= -LOOK_AHEAD_TILT
                        && b.skin.cone.holds(&normal, LOOK_AHEAD_TILT);
                    if facing {
                        let place = CROSSINGS + u8::from(rim.upper);
                        found(Row::between(
                            [Feature::Rim(end as u8, place), b.skin.feature],
                            [rim.at, on_rod],
                            [0.0, b.skin.round],
                            normal,
                        ));
                    }
                },
            );
        }
    }

    /// Rim points over a plane through `point`: the lowest of each rim, the fixed ones where the cylinder stands. `over` says whether the plane
    /// is there under a point, at this height; `beside` lets the lowest point move by the look-ahead tilt to be over it.
    pub(super) fn rims_over(
        &self,
        normal: &Vector3<f64>,
        point: &Point3<f64>,
        beside: bool,
        other: Feature,
        over: impl Fn(&Point3<f64>, f64) -> bool,
        mut found: impl FnMut(Row),
    ) {
        let leaning = self.axis.dot(normal);
        let down = -(normal - self.axis * leaning);
        let sine = down.norm();
        for end in 0..2 {
            let facing = -self.outward(end).dot(normal) >= -LOOK_AHEAD_TILT; // false for NaN
            if !facing {
                continue;
            }
            let center = self.ends[end];
            let mut take = |radial: Vector3<f64>, place: u8| {
                let at = center + radial * self.radius;
                let height = normal.dot(&(at - point));
                let is_over = over(&at, height);
                if is_over {
                    found(Row::between(
                        [Feature::Rim(end as u8, place), other],
                        [at, at - normal * height],
                        [0.0; 2],
                        *normal,
                    ));
                }
                is_over
            };
            if sine > UPRIGHT_SINE {
                let lowest = down / sine;
                let aside = self.axis.cross(&lowest) * LOOK_AHEAD_TILT;
                let near = take(lowest, LOWEST);
                if !near && beside && sine > LOOK_AHEAD_TILT {
                    let turned = |by: f64| {
                        let radial = lowest + aside * by;
                        radial / radial.norm()
                    };
                    let _ = take(turned(1.0), LOWEST) || take(turned(-1.0), LOWEST);
                }
            }
            if sine <= LOOK_AHEAD_TILT {
                let other_mark = self.axis.cross(&self.mark);
                for k in 0..RIM_POINTS {
                    let (sin, cos) =
                        (std::f64::consts::TAU * f64::from(k) / f64::from(RIM_POINTS)).sin_cos();
                    take(self.mark * cos + other_mark * sin, FIXED + k);
                }
            }
        }
    }

    /// Rim points over a face of a mesh.
    pub(super) fn face(
        &self,
        mesh: &Mesh,
        t: u32,
        activation_distance: f64,
        found: impl FnMut(Row),
    ) {
        let (corners, normal) = (mesh.corners(t), *mesh.face_normal(t));
        // The plane must come near, and some rim be beside the triangle along the axis.
        let lowest = self.ends.map(|end| normal.dot(&(end - corners[0])));
        let reach = self.radius * normal.cross(&self.axis).norm() + activation_distance;
        if lowest[0].min(lowest[1]) > reach {
            return;
        }
        let heights = corners.map(|c| self.axis.dot(&(c - self.ends[0])));
        let low = heights[0].min(heights[1]).min(heights[2]) - activation_distance;
        let high = heights[0].max(heights[1]).max(heights[2]) + activation_distance;
        let beside = |end: f64| low <= end && end <= high;
        if !beside(0.0) && !beside(self.length) {
            return;
        }
        self.rims_over(
            &normal,
            &corners[0],
            true,
            Feature::Face(t),
            |at, height| height <= activation_distance && is_over(at, &corners, &normal, height),
            found,
        );
    }
}

/// The unit normal of two crossing directions that points against `outward`; `None` where they are parallel.
fn out_of(
    tangent: &Vector3<f64>,
    along: &Vector3<f64>,
    outward: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let unit = tangent.cross(along).try_normalize(f64::EPSILON.sqrt())?;
    Some(if unit.dot(outward) > 0.0 { -unit } else { unit })
}
