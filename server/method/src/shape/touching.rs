//! A primitive as what can touch: the rows between it and points, segments, triangles and other primitives.

use arrayvec::ArrayVec;
use nalgebra::Vector3;

use super::Primitive;
use super::cylinder::Cylinder;
use super::cylinder_pair::cylinder_cylinder;
use super::element::{
    Cone, Knob, Rod, Row, Skin, knob_face, knob_knob, knob_past_face, knob_plane, knob_rod, rod_rod,
};
use super::implied::ImpliedRows;
use super::primitive::unit_axis;
use crate::collision::Placement;
use crate::constraint::Feature;
use crate::geometry::Mesh;

/// A primitive in the common frame, as what can touch.
#[derive(Clone, Debug)]
pub(super) enum Touching {
    /// A sphere has a point, a capsule its ends and a segment.
    Round(ArrayVec<Knob<'static>, 2>, Option<Rod<'static>>),
    Cylinder(Cylinder),
    Plane(Vector3<f64>, nalgebra::Point3<f64>),
}

impl Touching {
    /// `back` says that the primitive's frame is the obstacle's and the common one the body's.
    pub(super) fn of(primitive: &Primitive, placement: Option<&Placement>, back: bool) -> Self {
        let point = |p: &nalgebra::Point3<f64>| match placement {
            None => *p,
            Some(placement) if back => placement.back(p),
            Some(placement) => placement.point(p),
        };
        let turn = |v: &Vector3<f64>| match placement {
            None => *v,
            Some(placement) if back => placement.rotation.tr_mul(v),
            Some(placement) => placement.rotation * v,
        };
        let skin = |round, cone, feature| Skin {
            round,
            cone,
            feature,
        };
        match primitive {
            Primitive::Sphere { center, radius } => {
                let mut knobs = ArrayVec::new();
                knobs.push(Knob {
                    at: point(center),
                    skin: skin(*radius, Cone::Any, Feature::Whole),
                });
                Self::Round(knobs, None)
            }
            Primitive::Capsule { ends, radius } => {
                let axis = turn(&unit_axis(ends));
                let ends = ends.map(|p| point(&p));
                let knob = |k: usize| {
                    let outward = if k == 0 { -axis } else { axis };
                    Knob {
                        at: ends[k],
                        skin: skin(*radius, Cone::End(outward), Feature::Cap(k as u8)),
                    }
                };
                let side = Rod {
                    ends,
                    skin: skin(*radius, Cone::Any, Feature::Side),
                };
                Self::Round([knob(0), knob(1)].into(), Some(side))
            }
            Primitive::Cylinder { ends, radius } => {
                Self::Cylinder(Cylinder::new(ends, *radius, point, turn))
            }
            Primitive::Plane {
                normal,
                point: through,
            } => Self::Plane(turn(normal), point(through)),
        }
    }
}

/// Rows between a primitive and the features that triangle `t` owns, and its face; the primitive first. Those of its face past its end are `implied`.
pub(super) fn rows_of_triangle(
    touching: &Touching,
    mesh: &Mesh,
    t: u32,
    activation_distance: f64,
    implied: &mut ImpliedRows,
    found: &mut dyn FnMut(Row),
) {
    match touching {
        Touching::Cylinder(cylinder) => cylinder.face(mesh, t, activation_distance, &mut *found),
        Touching::Plane(..) => {}
        Touching::Round(knobs, _) => {
            for knob in knobs {
                if let Some(row) = knob_face(knob, mesh, t) {
                    found(row);
                } else if let Some(row) = knob_past_face(knob, mesh, t, implied.within()) {
                    implied.offer(row, t);
                }
            }
        }
    }
    let owned = mesh.owned_features(t);
    if owned == 0 {
        return;
    }
    let edges = mesh.triangle_edges(t);
    for (k, v) in mesh.triangles()[t as usize].into_iter().enumerate() {
        if owned & (1 << k) != 0 {
            let knob = Knob {
                at: mesh.vertices()[v as usize],
                skin: Skin {
                    round: 0.0,
                    cone: Cone::Vertex(mesh, v),
                    feature: Feature::Vertex(v),
                },
            };
            primitive_knob(touching, &knob, found);
        }
        if owned & (8 << k) != 0 {
            let e = edges[k];
            let rod = Rod {
                ends: mesh.edges()[e as usize]
                    .vertices
                    .map(|v| mesh.vertices()[v as usize]),
                skin: Skin {
                    round: 0.0,
                    cone: Cone::Edge(mesh, e),
                    feature: Feature::Edge(e),
                },
            };
            primitive_rod(touching, &rod, found);
        }
    }
}

fn hand_on(row: Option<Row>, found: &mut dyn FnMut(Row)) {
    if let Some(row) = row {
        found(row);
    }
}

/// Rows between a primitive and a point; the primitive first.
fn primitive_knob(touching: &Touching, other: &Knob<'_>, found: &mut dyn FnMut(Row)) {
    match touching {
        Touching::Cylinder(cylinder) => {
            hand_on(cylinder.knob(other), found);
        }
        Touching::Plane(normal, point) => {
            hand_on(knob_plane(other, normal, point).map(Row::reversed), found);
        }
        Touching::Round(knobs, rod) => {
            for knob in knobs {
                hand_on(knob_knob(knob, other), found);
            }
            let beside = rod.as_ref().and_then(|rod| knob_rod(other, rod));
            hand_on(beside.map(Row::reversed), found);
        }
    }
}

/// Rows between a primitive and a segment; the primitive first.
fn primitive_rod(touching: &Touching, other: &Rod<'_>, found: &mut dyn FnMut(Row)) {
    match touching {
        Touching::Cylinder(cylinder) => {
            hand_on(rod_rod(&cylinder.side(), other), found);
            cylinder.rod_on_rims(other, found);
        }
        Touching::Plane(..) => {} // its ends stand for it
        Touching::Round(knobs, rod) => {
            for knob in knobs {
                hand_on(knob_rod(knob, other), found);
            }
            hand_on(rod.as_ref().and_then(|rod| rod_rod(rod, other)), found);
        }
    }
}

/// Rows between two primitives within `reach`, m, `a` first.
pub(super) fn primitive_pair(a: &Touching, b: &Touching, reach: f64, found: &mut dyn FnMut(Row)) {
    match (a, b) {
        (Touching::Plane(..), Touching::Plane(..)) => {}
        (Touching::Cylinder(cylinder), Touching::Plane(normal, point)) => {
            cylinder.rims_over(normal, point, false, Feature::Whole, |_, _| true, found);
        }
        (Touching::Cylinder(a), Touching::Cylinder(b)) => cylinder_cylinder(a, b, reach, found),
        (_, Touching::Round(knobs, rod)) => {
            for knob in knobs {
                primitive_knob(a, knob, found);
            }
            if let Some(rod) = rod {
                primitive_rod(a, rod, found);
            }
        }
        (_, Touching::Cylinder(_) | Touching::Plane(..)) => {
            primitive_pair(b, a, reach, &mut |row: Row| found(row.reversed()));
        }
    }
}
