//! Normal cones of features: the directions in which a vertex, an edge or a face is a local maximum of its surface.
//!
//! The normal cone of a vertex is `{n : n.e <= 0}` over the edges e that leave it. Its extreme rays are among the products of two
//! edges; a saddle or a hollow has none, and can never be touched there. That of an edge is the arc between its two face
//! normals where it is convex; that of a face is its normal. A triangle's cone holds its normal and the normal cones of
//! the features that it owns.

use nalgebra::{Point3, Vector3};

use super::topology::{CORNER_EDGES, FLAT_EDGE_ANGLE, Topology};

/// Edges nearer to parallel than 1e-8 have no product, as its squared length.
const PARALLEL: f64 = 1e-16;
/// A product of two edges this far above a third is above it: the rounding of the product of edges that are nearly parallel,
/// 2e-8, and the tilt of edges taken as parallel, 1e-8.
const RAY_TOLERANCE: f64 = 1e-7;
/// Rounding of a face's normal, times the product of two sides over the doubled area, rad.
const NORMAL_ROUNDING: f64 = 8.0 * f64::EPSILON;
/// Vertices with more edges, tips of fans, are taken as corners without looking: the look costs the cube of their number.
const MAX_RING: usize = 32;

/// A cone that holds the normal of a triangle and the normal cones of the features that it owns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormalCone {
    /// Unit axis.
    pub(crate) axis: Vector3<f64>,
    /// Half-angle, rad; pi holds every direction.
    pub(crate) angle: f64,
}

/// What is outward at an edge of a ring: the sum of the normals of its faces, and bounds on their rounding.
#[derive(Clone, Copy, Debug)]
struct Outward {
    sum: Vector3<f64>,
    rounding: f64,
}

/// The extreme rays of a vertex's normal cone, unit length: none for a saddle or a hollow. `None` when it was not looked at. `outward` is of all rings.
fn vertex_rays(
    vertices: &[Point3<f64>],
    topology: &Topology,
    outward: &[Outward],
    v: u32,
    rays: &mut Vec<Vector3<f64>>,
) -> Option<()> {
    rays.clear();
    let ring = topology.ring(v);
    let outward = &outward[topology.ring_start[v as usize] as usize..][..ring.len()];
    if ring.len() > MAX_RING {
        return None;
    }
    let apex = vertices[v as usize];
    let mut edges = [Vector3::zeros(); MAX_RING];
    for (edge, w) in edges.iter_mut().zip(ring) {
        let along = vertices[*w as usize] - apex;
        *edge = along / along.norm();
    }
    let edges = &edges[..ring.len()];
    for (i, a) in edges.iter().enumerate() {
        for b in &edges[i + 1..] {
            let cross = a.cross(b);
            let squared = cross.norm_squared();
            if squared < PARALLEL {
                // A sliver's tip: the normal between its sides is not to be had from them.
                if a.dot(b) > 0.0 {
                    return None;
                }
                continue;
            }
            let ray = cross / squared.sqrt();
            // What all edges lie below may be the solid itself, as behind a flat face or a groove. The faces at an edge that the ray is across lie below
            // it, too: the sum of their normals says on which side the solid is, unless it is as thin as rounding.
            let Outward { sum, rounding } = outward[i];
            let inward = |n: &Vector3<f64>| n.dot(&sum) < -(RAY_TOLERANCE + rounding);
            for n in [ray, -ray] {
                if edges.iter().all(|e| n.dot(e) <= RAY_TOLERANCE) && !inward(&n) {
                    rays.push(n);
                }
            }
        }
    }
    Some(())
}

/// Takes the corners away whose normal cone is empty, and gives each triangle the cone of its features.
///
/// Each point of the surface lies on a feature that some triangle owns, and where the point is a local minimum of the
/// distance to something outside, the direction there is in that triangle's cone. So flat edges and corners that stand
/// for nothing in contact collection are in some cone, too.
pub(crate) fn triangle_cones(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    face_normals: &[Vector3<f64>],
    topology: &mut Topology,
) -> Vec<NormalCone> {
    // A corner that can be touched from outside has three edges that are not hollow: those at the rim of its normal cone. A pit
    // has products of edges below every edge, too, but they point into the solid. Corners along a ridge are in its edges' arcs.
    let mut standing = vec![0_u8; vertices.len()];
    for edge in &topology.edges {
        for v in edge.vertices {
            let counts = edge.convexity > -FLAT_EDGE_ANGLE;
            standing[v as usize] = standing[v as usize].saturating_add(u8::from(counts));
        }
    }
    let rounding = |t: u32| normal_rounding(&triangles[t as usize].map(|v| vertices[v as usize]));
    let outward = outward_of_rings(face_normals, rounding, topology);
    let mut rays = Vec::new();
    let mut cones = Vec::with_capacity(triangles.len());
    for (t, corners) in triangles.iter().enumerate() {
        let axis = face_normals[t];
        let mut least: f64 = 1.0;
        let mut spread = rounding(t as u32);
        for (k, &corner) in corners.iter().enumerate() {
            let edge = &topology.edges[topology.triangle_edges[t][k] as usize];
            if edge.faces[0] == t as u32 && edge.convexity > -FLAT_EDGE_ANGLE {
                let other = edge.faces[1];
                least = least.min(axis.dot(&face_normals[other as usize]));
                spread = spread.max(rounding(other));
            }
            let owned = topology.vertex_owner[corner as usize] == t as u32;
            let rim = usize::from(CORNER_EDGES).min(topology.ring(corner).len());
            if !owned || usize::from(standing[corner as usize]) < rim {
                continue;
            }
            let looked = vertex_rays(vertices, topology, &outward, corner, &mut rays);
            if looked.is_some() && rays.is_empty() {
                topology.owned[t] &= !(1 << k);
            }
            least = match looked {
                Some(()) => rays.iter().map(|n| axis.dot(n)).fold(least, f64::min),
                None => -1.0,
            };
        }
        // Rays within a right angle of the axis span a cone within their farthest; wider ones may hold anything.
        let angle = least.min(1.0).acos() + spread;
        let narrow = least > 0.0 && angle < std::f64::consts::FRAC_PI_2; // false for NaN
        let angle = if narrow { angle } else { std::f64::consts::PI };
        cones.push(NormalCone { axis, angle });
    }
    cones
}

/// What is outward at each edge of each vertex, in the order of the rings.
fn outward_of_rings(
    face_normals: &[Vector3<f64>],
    rounding: impl Fn(u32) -> f64,
    topology: &Topology,
) -> Vec<Outward> {
    let nothing = Outward {
        sum: Vector3::zeros(),
        rounding: 0.0,
    };
    let mut next = topology.ring_start.clone();
    let mut outward = vec![nothing; topology.neighbours.len()];
    for edge in &topology.edges {
        let [left, right] = edge.faces;
        let at_edge = Outward {
            sum: face_normals[left as usize] + face_normals[right as usize],
            rounding: rounding(left) + rounding(right),
        };
        for v in edge.vertices {
            let place = &mut next[v as usize];
            outward[*place as usize] = at_edge;
            *place += 1;
        }
    }
    outward
}

/// Bound on the rounding of a triangle's normal, rad.
fn normal_rounding(t: &[Point3<f64>; 3]) -> f64 {
    let sides = [t[1] - t[0], t[2] - t[1]];
    let doubled = sides[0].cross(&sides[1]).norm();
    NORMAL_ROUNDING * sides[0].norm() * sides[1].norm() / doubled
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells along a side of the slab.
    const CELLS: u32 = 12;

    /// The widest cone, rad, of the triangles away from the rim of the upper side of a slab that is as high as `height` says.
    fn widest(height: impl Fn(f64, f64) -> f64) -> f64 {
        let at = |i: u32, j: u32| i * (CELLS + 1) + j;
        let share = |i: u32| f64::from(i) / f64::from(CELLS) - 0.5;
        let places = (0..=CELLS).flat_map(|i| (0..=CELLS).map(move |j| (share(i), share(j))));
        let mut vertices: Vec<Point3<f64>> = places
            .map(|(x, y)| Point3::new(x, y, height(x, y)))
            .collect();
        let under = vertices.len() as u32;
        for k in 0..vertices.len() {
            vertices.push(vertices[k] - Vector3::z());
        }
        let mut triangles = Vec::new();
        for (i, j) in (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j))) {
            let q = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
        let upper = triangles.len();
        for k in 0..upper {
            let [a, b, c] = triangles[k];
            triangles.push([under + a, under + c, under + b]);
        }
        for k in 0..CELLS {
            for [a, b] in [
                [at(k, 0), at(k + 1, 0)],
                [at(CELLS, k), at(CELLS, k + 1)],
                [at(k + 1, CELLS), at(k, CELLS)],
                [at(0, k + 1), at(0, k)],
            ] {
                triangles.extend([[b, a, under + a], [b, under + a, under + b]]);
            }
        }
        let normals: Vec<Vector3<f64>> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| vertices[v as usize]);
                (b - a).cross(&(c - a)).normalize()
            })
            .collect();
        let mut topology = Topology::build(&vertices, &triangles, &normals).expect("closed");
        let cones = triangle_cones(&vertices, &triangles, &normals, &mut topology);
        let is_inside = |t: &[u32; 3]| {
            t.iter().all(|v| {
                let p = vertices[*v as usize];
                p.x.abs() < 0.45 && p.y.abs() < 0.45
            })
        };
        let inside = (0..upper).filter(|t| is_inside(&triangles[*t]));
        inside.map(|t| cones[t].angle).fold(0.0, f64::max)
    }

    /// Behind the vertices of a flat face and of a groove lies the solid: no direction into it is a normal of theirs.
    #[test]
    fn what_is_nearly_flat_has_narrow_cones_whichever_way_it_is_bent() {
        let bend = |x: f64| 0.5 * x * x;
        assert!(widest(|_, _| 0.0) < 1e-6);
        assert!(widest(|x, _| bend(x)) < 1e-6, "a groove stands out nowhere");
        assert!(widest(|x, y| bend(x) + bend(y)) < 0.2, "a pit");
        assert!(widest(|x, y| bend(x) - bend(y)) < 0.2, "a saddle");
        let ridge = widest(|x, _| -bend(x));
        assert!((0.05..0.2).contains(&ridge), "{ridge}");
        assert!(widest(|x, y| -bend(x) - bend(y)) < 0.2, "a cap");
    }
}
