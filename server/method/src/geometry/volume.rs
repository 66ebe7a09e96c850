//! Bounding volume of some triangles of a mesh: a box, a box about their mean normal, a ball and a cone of normals.
//!
//! | symbol | name in code  | unit | meaning                                                                       |
//! |--------|---------------|------|-------------------------------------------------------------------------------|
//! | c      | `center`      | m    | centre of the box, from the node's `origin`, mesh axes                        |
//! | a      | `axis`        | –    | mean normal of the triangles inside, unit to rounding                         |
//! | t      | `tangent`     | –    | across a, unit to rounding; b = a x t                                         |
//! | m, h   | `middle`, `slab` | m | `a.(p - c)` is in [m - h, m + h] for every point p inside                     |
//! | d, e   | `along`, `across` | m | `|t.(p - c)| <= d` and `|b.(p - c)| <= e` for every point p inside            |
//! | rho    | `radius`      | m    | `|p - c| <= rho` for every point p inside                                     |
//! | alpha  | `cosine`, `sine` | – | half-angle about a of a cone that holds the normal cones of all features inside |
//!
//! A slab is thin where the surface is nearly flat, whatever its orientation: surfaces that lie on each other are told apart
//! by slabs long before they are by boxes. Seen along a unit direction n, the points reach over
//! `m a.n +- (h |a.n| + d |t.n| + e |b.n|)`: exactly as far as they do, for a rectangle that is seen aslant.
//!
//! **Rounding.** All is relative to the middle of the volume above, so that a small volume loses nothing on a large mesh. The
//! centre and the axes are what single precision holds; half sides, slab, radius and angle are measured from them in double
//! precision and rounded outward by `OUTWARD`, more than one unit in the last place of either precision. The boxes are wider than what is inside by what a
//! test of two volumes in single precision may lose (`SEPARATION_ROUNDING`, `CENTER_ROUNDING`; `collision/facing_volumes.rs` says why that is enough), so
//! that it is not worked out for each pair.

use nalgebra::{Point3, Vector2, Vector3};

use super::collapse::Collapse;
use super::normal_cone::NormalCone;
use super::tree::Node;

/// Outward rounding of a length relative to it and to the coordinates that it is the difference of.
const OUTWARD: f64 = f32::EPSILON as f64;
const OUTWARD_DOUBLE: f64 = 8.0 * f64::EPSILON;
/// By how much the boxes are wider than their contents, per radius, and per radius of the volume above: 160 and 16 half units in the last place of single
/// precision.
const SEPARATION_ROUNDING: f64 = 80.0 * f32::EPSILON as f64;
const CENTER_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;
/// By how much more those of a primitive are, whose extents are not measured along the axes that single precision holds.
const AXIS_ROUNDING: f64 = 4.0 * f32::EPSILON as f64;
/// Cones are wider than computed by this, rad: the rounding of an arc tangent, and then some.
const CONE_ROUNDING: f64 = 1e-7;
/// A rectangle may be larger by this share than that along the longest way, to lie as the strip does that it is of.
const STRIP_SHARE: f64 = 0.1;
/// The tangent of a volume above is of use where so much of it is left across the axis.
const LEAST_TANGENT: f64 = 0.5;

/// Features of all kinds, as the bits of [`Mesh::owned_features`](crate::Mesh::owned_features).
const ALL_FEATURES: u8 = 63;

/// What a child of a node of the wide tree holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Volume {
    pub(crate) center: [f32; 3],
    pub(crate) half: [f32; 3],
    pub(crate) axis: [f32; 3],
    pub(crate) tangent: [f32; 3],
    pub(crate) middle: f32,
    pub(crate) slab: f32,
    pub(crate) along: f32,
    pub(crate) across: f32,
    pub(crate) radius: f32,
    pub(crate) cosine: f32,
    pub(crate) sine: f32,
    /// Which kinds of features the triangles inside own, as the bits of [`Mesh::owned_features`](crate::Mesh::owned_features).
    pub(crate) owned: u8,
}

impl Volume {
    /// That of a convex piece about `center`, mesh axes, with normals all ways: about the axis of the slab and the tangent, the slab's middle and half its
    /// thickness, half the sides of the strip along the tangent and across it, half those of the box, and the radius, m.
    pub(crate) fn of_piece(
        center: &Point3<f64>,
        [axis, tangent]: [Vector3<f64>; 2],
        [middle, slab]: [f64; 2],
        [along, across]: [f64; 2],
        half: Vector3<f64>,
        radius: f64,
    ) -> Self {
        let error = OUTWARD_DOUBLE * (2.0 * center.coords.amax() + radius);
        let lost = (SEPARATION_ROUNDING + AXIS_ROUNDING) * radius + error;
        let wider = |length: f64| (length * (1.0 + 2.0 * OUTWARD) + lost) as f32;
        Self {
            center: [0.0; 3],
            half: half.map(wider).into(),
            axis: axis.map(|x| x as f32).into(),
            tangent: tangent.map(|x| x as f32).into(),
            middle: middle as f32,
            slab: wider(slab),
            along: wider(along),
            across: wider(across),
            radius: wider(radius),
            cosine: -1.0,
            sine: 0.0,
            owned: ALL_FEATURES,
        }
    }
}

/// What the build of a wide tree reads.
pub(super) struct Source<'a> {
    pub(super) vertices: &'a [Point3<f64>],
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) face_normals: &'a [Vector3<f64>],
    pub(super) cones: &'a [NormalCone],
    pub(super) owned: &'a [u8],
    pub(super) binary: &'a [Node],
    pub(super) collapse: Collapse<'a>,
    /// Triangles in the order of the binary tree's leaves, and the range of them below each of its nodes.
    pub(super) order: Vec<u32>,
    pub(super) ranges: Vec<[u32; 2]>,
    pub(super) origin: Point3<f64>,
}

impl Source<'_> {
    /// What node `index` of the binary tree holds, measured triangle by triangle, in a node with this origin below the volume `above`.
    pub(super) fn volume(&self, index: u32, above: Option<&Volume>, origin: &[f32; 3]) -> Volume {
        let node = &self.binary[index as usize];
        let [from, to] = self.ranges[index as usize];
        let inside = &self.order[from as usize..to as usize];
        let origin = self.origin + Vector3::from(*origin).map(f64::from);
        let center = (node.center - origin).map(|x| x as f32);
        let axis = self.mean_normal(inside).map(|x| x as f32);
        let (wide_center, wide_axis) = (origin + center.map(f64::from), axis.map(f64::from));
        let tangent = self.tangent(inside, &wide_center, &wide_axis, above.map(|v| &v.tangent));
        let wide_tangent = tangent.map(f64::from);
        let [along, across] = self.sides(inside, &wide_center, &wide_axis, &wide_tangent);

        let (mut low, mut high, mut radius): (f64, f64, f64) =
            (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        let mut half = Vector3::zeros();
        let mut angle: f64 = 0.0;
        for t in inside {
            for v in self.triangles[*t as usize] {
                let arm = self.vertices[v as usize] - wide_center;
                let height = wide_axis.dot(&arm);
                (low, high) = (low.min(height), high.max(height));
                radius = radius.max(arm.norm_squared());
                half = half.sup(&arm.abs());
            }
            let cone = &self.cones[*t as usize];
            let between = wide_axis
                .cross(&cone.axis)
                .norm()
                .atan2(wide_axis.dot(&cone.axis));
            angle = angle.max(between + cone.angle + CONE_ROUNDING);
        }
        // Coordinates are exact in the mesh's frame; their differences are rounded relative to them.
        let error = OUTWARD_DOUBLE * (self.origin.coords.amax() + wide_center.coords.amax());
        let around = above.map_or(0.0, |volume| f64::from(volume.radius));
        let outward = |length: f64| (length * (1.0 + 2.0 * OUTWARD) + error) as f32;
        let radius = radius.sqrt();
        let lost = SEPARATION_ROUNDING * radius + CENTER_ROUNDING * around;
        let wider = |length: f64| outward(length + lost);
        let middle = (0.5 * (low + high)) as f32;
        let slab = (high - f64::from(middle)).max(f64::from(middle) - low);
        let angle = angle.min(std::f64::consts::PI);
        Volume {
            center: center.into(),
            half: half.map(wider).into(),
            axis: axis.into(),
            tangent: tangent.into(),
            middle,
            slab: wider(slab + OUTWARD_DOUBLE * radius),
            along: wider(along),
            across: wider(across),
            radius: outward(radius),
            cosine: angle.cos() as f32,
            sine: angle.sin() as f32,
            owned: inside
                .iter()
                .fold(0, |kinds, t| kinds | self.owned[*t as usize]),
        }
    }

    /// The direction of the rectangle's sides: that of the volume above where it is about as good as any. A triangle has no shape to
    /// go by, and lies as the strip does that it is of.
    fn tangent(
        &self,
        inside: &[u32],
        center: &Point3<f64>,
        axis: &Vector3<f64>,
        above: Option<&[f32; 3]>,
    ) -> Vector3<f32> {
        let longest = self.longest_way(inside, axis);
        let area = |tangent: &Vector3<f64>| {
            let [along, across] = self.sides(inside, center, axis, tangent);
            along * across
        };
        let inherited = above.and_then(|t| {
            let t = Vector3::from(t.map(f64::from));
            (t - axis * axis.dot(&t)).try_normalize(LEAST_TANGENT)
        });
        inherited
            .filter(|t| area(t) <= (1.0 + STRIP_SHARE) * area(&longest))
            .unwrap_or(longest)
            .map(|x| x as f32)
    }

    /// Half of the sides of the rectangle about `center` in the plane across `axis`, along `tangent` and across it, m.
    fn sides(
        &self,
        inside: &[u32],
        center: &Point3<f64>,
        axis: &Vector3<f64>,
        tangent: &Vector3<f64>,
    ) -> [f64; 2] {
        let bitangent = axis.cross(tangent);
        let mut sides: [f64; 2] = [0.0; 2];
        for t in inside {
            for v in self.triangles[*t as usize] {
                let arm = self.vertices[v as usize] - center;
                sides[0] = sides[0].max(tangent.dot(&arm).abs());
                sides[1] = sides[1].max(bitangent.dot(&arm).abs());
            }
        }
        sides
    }

    /// The direction in the plane across `axis` in which the corners spread most; unit.
    fn longest_way(&self, inside: &[u32], axis: &Vector3<f64>) -> Vector3<f64> {
        let u = across(axis);
        let v = axis.cross(&u);
        let (mut count, mut sum, mut squares) = (0.0, Vector2::zeros(), Vector3::zeros());
        for t in inside {
            for corner in self.triangles[*t as usize] {
                let p = self.vertices[corner as usize] - self.origin;
                let (x, y) = (u.dot(&p), v.dot(&p));
                count += 1.0;
                sum += Vector2::new(x, y);
                squares += Vector3::new(x * x, y * y, x * y);
            }
        }
        let mean = sum / count;
        let products = Vector3::new(mean.x * mean.x, mean.y * mean.y, mean.x * mean.y);
        let [xx, yy, xy] = (squares / count - products).into();
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let way = u * angle.cos() + v * angle.sin();
        way.try_normalize(0.0).unwrap_or(u)
    }

    /// Mean of the normals, each with its triangle's area; some unit vector where they cancel.
    fn mean_normal(&self, inside: &[u32]) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for t in inside {
            let [a, b, c] = self.triangles[*t as usize].map(|v| self.vertices[v as usize]);
            let area = (b - a).cross(&(c - a)).norm();
            sum += self.face_normals[*t as usize] * area;
        }
        let first = self.face_normals[inside[0] as usize];
        // One triangle: its normal as it is.
        if inside.len() == 1 {
            return first;
        }
        sum.try_normalize(f64::MIN_POSITIVE).unwrap_or(first)
    }
}

/// Some unit direction across a unit vector.
fn across(axis: &Vector3<f64>) -> Vector3<f64> {
    let other = Vector3::ith(axis.iamin(), 1.0);
    let off = other - axis * axis.dot(&other);
    off / off.norm()
}
