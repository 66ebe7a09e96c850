//! Constraint sets to the wire and back. Both ways are bounded by the number of rows and allocate nothing.
//!
//! What is not sent: the smallest gap and the error of the rows' choice, which serve reports at the server.

use god_object::constraint::{Feature, FeaturePair, Separation};
use god_object::{ConstraintSet, NonPenetrationConstraint};
use nalgebra::{Point3, Vector3};
use taut_link::proto;
use taut_link::proto::constraints::{
    ConstraintRow, MAX_SET_ROWS, RowFeature, RowSeparation, SET_TRUNCATED,
};

/// A received unit vector may be this far from unit length: single precision and some.
const UNIT_TOLERANCE: f64 = 1e-5;
/// Bits of an index that hold the place on a rim.
const RIM_PLACE_BITS: u32 = 8;

/// Why a received set is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BrokenSet {
    /// The pose is no pose.
    #[error("a constraint set has a pose that is none; install the same release on both sides")]
    Pose,
    /// A normal is not of unit length.
    #[error("a constraint set has a normal that is none; install the same release on both sides")]
    Normal,
    /// More rows than a period leaves time for.
    #[error(
        "a constraint set has {rows} rows, but the device loop's period leaves time for {most}; lower max_constraints in the scene, or the bridge's --rate"
    )]
    TooManyRows {
        /// What came.
        rows: usize,
        /// What may come.
        most: usize,
    },
    /// A feature of a kind that this release does not know.
    #[error(
        "a constraint set names a feature of an unknown kind; install the same release on both sides"
    )]
    Feature,
}

/// Writes `set` in the form in which it travels; time stamps and flags besides truncation are the caller's.
///
/// `separations`: also how the rows change when the body turns, which only a coupling that re-linearises asks for. Rows
/// beyond [`MAX_SET_ROWS`] are left out.
pub fn write_set(set: &ConstraintSet, separations: bool, wire: &mut proto::ConstraintSet) {
    let origin = set.god_object_pose.translation.vector;
    wire.head.sequence = set.sequence;
    wire.head.pose = proto::PoseF64::from_isometry(&set.god_object_pose);
    wire.head.flags = if set.truncated { SET_TRUNCATED } else { 0 };
    wire.rows.clear();
    let rows = set.constraints.iter().take(MAX_SET_ROWS);
    wire.rows.extend(rows.map(|row| ConstraintRow {
        obstacle: row.features.obstacle,
        on_body: wire_feature(row.features.on_body),
        on_obstacle: wire_feature(row.features.on_obstacle),
        arm: single(&(row.point.coords - origin)),
        normal: single(&row.normal),
        gap: row.gap as f32,
        obstacle_displacement: single(&row.obstacle_displacement),
        separation: if separations {
            wire_separation(&row.separation, &origin)
        } else {
            RowSeparation::OfObstacle
        },
        shading_normal: row.shading_normal.as_ref().map(single),
    }));
}

/// Reads a set that arrived into `set`, whose memory is reused.
///
/// # Errors
/// [`BrokenSet`]: `set` is not to be used then.
pub fn read_set(wire: &proto::ConstraintSet, set: &mut ConstraintSet) -> Result<(), BrokenSet> {
    let pose = wire.head.pose.to_isometry().ok_or(BrokenSet::Pose)?;
    let origin = pose.translation.vector;
    set.sequence = wire.head.sequence;
    set.god_object_pose = pose;
    set.published = None; // on another clock, and the way here is not even
    set.truncated = wire.head.flags & SET_TRUNCATED != 0;
    set.gap_min = f64::INFINITY;
    set.reduction_error = 0.0;
    set.constraints.clear();
    for row in &wire.rows {
        let gap = f64::from(row.gap);
        set.gap_min = set.gap_min.min(gap);
        set.constraints.push(NonPenetrationConstraint {
            features: FeaturePair {
                obstacle: row.obstacle,
                on_body: feature(row.on_body)?,
                on_obstacle: feature(row.on_obstacle)?,
            },
            point: Point3::from(double(&row.arm) + origin),
            normal: unit(&row.normal)?,
            gap,
            obstacle_displacement: double(&row.obstacle_displacement),
            separation: separation(&row.separation, &origin)?,
            shading_normal: row.shading_normal.as_ref().map(unit).transpose()?,
        });
    }
    Ok(())
}

fn wire_feature(feature: Feature) -> RowFeature {
    let (kind, index) = match feature {
        Feature::Vertex(index) => (0, index),
        Feature::Edge(index) => (1, index),
        Feature::Face(index) => (2, index),
        Feature::Whole => (3, 0),
        Feature::Side => (4, 0),
        Feature::Cap(end) => (5, u32::from(end)),
        Feature::Rim(end, place) => (6, u32::from(end) << RIM_PLACE_BITS | u32::from(place)),
    };
    RowFeature { kind, index }
}

fn feature(wire: RowFeature) -> Result<Feature, BrokenSet> {
    let byte = |index: u32| u8::try_from(index).map_err(|_| BrokenSet::Feature);
    Ok(match wire.kind {
        0 => Feature::Vertex(wire.index),
        1 => Feature::Edge(wire.index),
        2 => Feature::Face(wire.index),
        3 => Feature::Whole,
        4 => Feature::Side,
        5 => Feature::Cap(byte(wire.index)?),
        6 => Feature::Rim(
            byte(wire.index >> RIM_PLACE_BITS)?,
            byte(wire.index & ((1 << RIM_PLACE_BITS) - 1))?,
        ),
        _ => return Err(BrokenSet::Feature),
    })
}

fn wire_separation(separation: &Separation, origin: &Vector3<f64>) -> RowSeparation {
    match separation {
        Separation::OfObstacle => RowSeparation::OfObstacle,
        Separation::OfBody => RowSeparation::OfBody,
        Separation::OfEdges {
            on_body,
            on_obstacle,
        } => RowSeparation::OfEdges([single(on_body), single(on_obstacle)]),
        Separation::OfBall { radius } => RowSeparation::OfBall(*radius as f32),
        Separation::OfRim {
            center,
            axis,
            radius,
        } => RowSeparation::OfRim(
            single(&(center.coords - origin)),
            single(axis),
            *radius as f32,
        ),
        Separation::OfRods {
            on_body,
            on_obstacle,
            radii,
        } => RowSeparation::OfRods(
            [single(on_body), single(on_obstacle)],
            radii.map(|radius| radius as f32),
        ),
    }
}

fn separation(wire: &RowSeparation, origin: &Vector3<f64>) -> Result<Separation, BrokenSet> {
    // The axis of a rod is zero for a point.
    let unit_or_zero = |along: &[f32; 3]| match along {
        [0.0, 0.0, 0.0] => Ok(Vector3::zeros()),
        along => unit(along),
    };
    Ok(match wire {
        RowSeparation::OfObstacle => Separation::OfObstacle,
        RowSeparation::OfBody => Separation::OfBody,
        RowSeparation::OfEdges([on_body, on_obstacle]) => Separation::OfEdges {
            on_body: unit(on_body)?,
            on_obstacle: unit(on_obstacle)?,
        },
        RowSeparation::OfBall(radius) => Separation::OfBall {
            radius: f64::from(*radius),
        },
        RowSeparation::OfRim(center, axis, radius) => Separation::OfRim {
            center: Point3::from(double(center) + origin),
            axis: unit(axis)?,
            radius: f64::from(*radius),
        },
        RowSeparation::OfRods([on_body, on_obstacle], radii) => Separation::OfRods {
            on_body: unit_or_zero(on_body)?,
            on_obstacle: unit_or_zero(on_obstacle)?,
            radii: radii.map(f64::from),
        },
    })
}

fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

fn double(v: &[f32; 3]) -> Vector3<f64> {
    Vector3::from(v.map(f64::from))
}

/// Of unit length again, which single precision is not quite.
fn unit(v: &[f32; 3]) -> Result<Vector3<f64>, BrokenSet> {
    let v = double(v);
    let norm = v.norm();
    let near = (norm - 1.0).abs() <= UNIT_TOLERANCE; // false for NaN
    if near {
        Ok(v / norm)
    } else {
        Err(BrokenSet::Normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::Pose;
    use proptest::prelude::*;

    fn any_unit() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0_f64)
            .prop_map(Vector3::from)
            .prop_filter("has a direction", |v| v.norm() > 0.1)
            .prop_map(|v| v / v.norm())
    }

    fn any_point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-0.1..0.1_f64).prop_map(Vector3::from)
    }

    fn any_feature() -> impl Strategy<Value = Feature> {
        prop_oneof![
            any::<u32>().prop_map(Feature::Vertex),
            any::<u32>().prop_map(Feature::Edge),
            any::<u32>().prop_map(Feature::Face),
            Just(Feature::Whole),
            Just(Feature::Side),
            any::<u8>().prop_map(Feature::Cap),
            any::<(u8, u8)>().prop_map(|(end, place)| Feature::Rim(end, place)),
        ]
    }

    fn any_separation() -> impl Strategy<Value = Separation> {
        prop_oneof![
            Just(Separation::OfObstacle),
            Just(Separation::OfBody),
            (any_unit(), any_unit()).prop_map(|(on_body, on_obstacle)| Separation::OfEdges {
                on_body,
                on_obstacle
            }),
            (0.0..1.0_f64).prop_map(|radius| Separation::OfBall { radius }),
            (any_point(), any_unit(), 0.0..1.0_f64).prop_map(|(center, axis, radius)| {
                Separation::OfRim {
                    center: Point3::from(center),
                    axis,
                    radius,
                }
            }),
            (any_unit(), any::<bool>(), 0.0..1.0_f64).prop_map(|(along, point, radius)| {
                Separation::OfRods {
                    on_body: along,
                    on_obstacle: if point { Vector3::zeros() } else { along },
                    radii: [radius, 2.0 * radius],
                }
            }),
        ]
    }

    fn any_constraint() -> impl Strategy<Value = NonPenetrationConstraint> {
        (
            (any::<u16>(), any_feature(), any_feature()),
            (any_point(), any_unit(), 0.0..0.01_f64, any_point()),
            any_separation(),
            prop::option::of(any_unit()),
        )
            .prop_map(
                |(
                    (obstacle, on_body, on_obstacle),
                    (point, normal, gap, moved),
                    separation,
                    shading,
                )| {
                    NonPenetrationConstraint {
                        features: FeaturePair {
                            obstacle,
                            on_body,
                            on_obstacle,
                        },
                        point: Point3::from(point),
                        normal,
                        gap,
                        obstacle_displacement: moved * 1e-3,
                        separation,
                        shading_normal: shading,
                    }
                },
            )
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_set_comes_back_to_single_precision_and_features_exactly(
            rows in prop::collection::vec(any_constraint(), 0..30),
            place in any_point(),
            turn in any_unit(),
        ) {
            let mut set = ConstraintSet::with_capacity(64);
            set.sequence = 7;
            set.god_object_pose = Pose::new(place, turn);
            set.constraints.extend(&rows);
            let (mut wire, mut back) = (proto::ConstraintSet::new(), ConstraintSet::with_capacity(64));
            write_set(&set, true, &mut wire);
            prop_assert_eq!(read_set(&wire, &mut back), Ok(()));
            prop_assert_eq!(back.sequence, 7);
            prop_assert!((back.god_object_pose.inverse() * set.god_object_pose).translation.vector.norm() < 1e-15);
            for (sent, read) in rows.iter().zip(&back.constraints) {
                prop_assert_eq!(sent.features, read.features);
                prop_assert!((sent.point - read.point).norm() < 3e-8, "arms of up to 0.35 m");
                prop_assert!((sent.normal - read.normal).norm() < 1e-7);
                prop_assert!((sent.gap - read.gap).abs() <= 1e-9);
                prop_assert!((sent.obstacle_displacement - read.obstacle_displacement).norm() <= 1e-9);
                prop_assert_eq!(
                    std::mem::discriminant(&sent.separation),
                    std::mem::discriminant(&read.separation)
                );
                // The same surface at another pose, too.
                let there = Pose::new(place * 0.9, turn * 1.2);
                let [a, b] = [sent, read].map(|row| row.moved(&set.god_object_pose, &there, false).gap);
                prop_assert!((a - b).abs() < 1e-5, "{} {}", a, b);
            }
            prop_assert_eq!(back.constraints.len(), rows.len());
        }

        #[test]
        fn whatever_arrives_is_a_set_or_an_error(
            position in prop::array::uniform3(prop::num::f64::ANY),
            normal in prop::array::uniform3(prop::num::f32::ANY),
            kind in any::<u8>(),
            index in any::<u32>(),
        ) {
            let mut wire = proto::ConstraintSet::new();
            wire.head.pose.position = position;
            wire.rows.push(ConstraintRow { normal, on_body: RowFeature { kind, index }, ..ConstraintRow::default() });
            let mut set = ConstraintSet::with_capacity(4);
            if read_set(&wire, &mut set).is_ok() {
                prop_assert!((set.constraints[0].normal.norm() - 1.0).abs() < 1e-12);
            }
        }
    }
}
