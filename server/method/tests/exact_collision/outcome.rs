//! What the method answers to a query, beside what is true.

use god_object::collision::{
    AdvancementSettings, Collider, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact,
};
use god_object::geometry::face_normal;
use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::six;
use god_object::{Mesh, Pose, Primitive};

use super::{Kind, Query};

/// How one query was answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// No contact, and none is reported.
    Free,
    /// A contact is reported at `time` where there is none.
    FalsePositive { time: f64 },
    /// A contact is reported at `time`; the true one is `earliness` later, a fraction of the motion.
    Found { time: f64, earliness: f64 },
    /// A contact is reported at `time`, after the true one, which is at most at `truth`.
    Late { time: f64, truth: f64 },
    /// A contact is not reported.
    Missed,
}

/// Asks the method for the time of impact of the query as [`Query::rigid`] has it. A vertex is a ball and an edge a capsule, a quarter of the gap thick, a
/// face the side of a flat tetrahedron; the minimum gap is half of the gap, which is `relative_gap` of the query's size.
pub(crate) fn answer(query: &Query, relative_gap: f64) -> TimeOfImpact {
    let gap = relative_gap * query.size();
    let settings = AdvancementSettings {
        minimum_gap: 0.5 * gap,
        gap_tolerance: 0.05 * gap,
        ..AdvancementSettings::default()
    };
    let motion = Motion {
        start: Pose::translation(query.start[0].x, query.start[0].y, query.start[0].z),
        displacement: six(&(query.end[0] - query.start[0]), &Vector3::zeros()),
        reference_point: query.start[0],
    };
    let (first, second) = query.start.split_at(query.kind.points_of_first());
    let body = round(first, 0.25 * gap);
    let face = (query.kind == Kind::VertexFace).then(|| flat_tetrahedron(second, gap));
    let segment = round(second, 0.25 * gap);
    let obstacle = match face.as_ref().and_then(Option::as_ref) {
        Some(face) => Collider::Mesh(face),
        None => Collider::Primitive(&segment),
    };
    time_of_impact(
        Collider::Primitive(&body),
        &motion,
        obstacle,
        &Pose::identity(),
        &settings,
        &mut CollisionWorkspace::new(),
        &mut Work::default(),
    )
}

/// A ball about one place, or a capsule over the longest of the ways between points.
fn round(points: &[Point3<f64>], radius: f64) -> Primitive {
    let ways = points
        .iter()
        .flat_map(|p| points.iter().map(move |q| [*p, *q]));
    let longest = ways.max_by(|[p, q], [r, s]| (q - p).norm().total_cmp(&(s - r).norm()));
    match longest {
        Some(ends) if ends[0] != ends[1] => Primitive::Capsule { ends, radius },
        _ => Primitive::Sphere {
            center: points[0],
            radius,
        },
    }
}

/// A tetrahedron with this side, about as high as `height`; `None` where the side has no area.
fn flat_tetrahedron(face: &[Point3<f64>], height: f64) -> Option<Mesh> {
    let corners = [face[0], face[1], face[2]];
    let normal = face_normal(&corners)?;
    let middle = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
    let longest = (corners[1] - corners[0])
        .norm()
        .max((corners[2] - corners[0]).norm());
    // As low as rounding leaves it a volume.
    [height, 1e-9 * longest, 1e-6 * longest, 1e-3 * longest]
        .into_iter()
        .find_map(|height| {
            let apex = middle - normal * height;
            let vertices = vec![corners[0], corners[1], corners[2], apex];
            Mesh::new(vertices, vec![[0, 1, 2], [1, 0, 3], [2, 1, 3], [0, 2, 3]]).ok()
        })
}

/// The answer beside the exact bounds of the first contact.
pub(crate) fn judge(answer: TimeOfImpact, truth: Option<[f64; 2]>) -> Outcome {
    let reported = match answer {
        TimeOfImpact::Separated => None,
        TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => Some(time),
        TimeOfImpact::Overlapping => Some(0.0),
    };
    match (reported, truth) {
        (None, None) => Outcome::Free,
        (Some(time), None) => Outcome::FalsePositive { time },
        (None, Some(_)) => Outcome::Missed,
        (Some(time), Some([_, truth])) if time <= truth => Outcome::Found {
            time,
            earliness: truth - time,
        },
        (Some(time), Some([_, truth])) => Outcome::Late { time, truth },
    }
}
