//! Single features whose vertices move along straight lines: never late, whatever the features are.

use god_object::collision::{
    AdvancementSettings, TimeOfImpact, edge_edge_time_of_impact, vertex_face_time_of_impact,
};
use god_object::geometry::distance::{closest_on_edges, closest_on_triangle};
use god_object::nalgebra::{Point3, Vector3};
use proptest::prelude::*;

const SETTINGS: AdvancementSettings = AdvancementSettings {
    minimum_gap: 1e-7,
    gap_tolerance: 1e-8,
    max_iterations: 200,
    interval_edges: 0.5,
    max_intervals: 64,
};

/// How far above the minimum gap an advance may end: the tolerance, and the rounding of coordinates up to 2 by 4e-16 m. Over a gap
/// of 1e-7 m that tilts the direction by 4e-9, and features as long as 3.5 m stop earlier by that share of their length.
const NEAR: f64 = SETTINGS.gap_tolerance + 1.5e-8;
/// A kilometre away coordinates are rounded by 1e-13 m: over a gap of 1e-7 m that tilts the direction by some 1e-6, and features
/// as long as 3 m stop earlier by that share of their length.
const FAR: f64 = 1e-5;

type Points = [Point3<f64>; 4];

fn at(start: &Points, end: &Points, time: f64) -> Points {
    [0, 1, 2, 3].map(|k| start[k] + (end[k] - start[k]) * time)
}

fn vertex_face_distance(p: &Points) -> f64 {
    (closest_on_triangle(&p[0], &[p[1], p[2], p[3]]).point - p[0]).norm()
}

fn edge_edge_distance(p: &Points) -> f64 {
    closest_on_edges([&p[0], &p[1]], [&p[2], &p[3]])
        .difference
        .norm()
}

/// Coordinates on a coarse grid as often as not: coplanar, collinear and coincident vertices are then common.
fn points() -> impl Strategy<Value = Points> {
    let coordinate = prop_oneof![-1.0..1.0_f64, (-2..=2_i32).prop_map(|k| f64::from(k) * 0.5)];
    proptest::collection::vec(coordinate, 12)
        .prop_map(|x| [0, 1, 2, 3].map(|k| Point3::new(x[3 * k], x[3 * k + 1], x[3 * k + 2])))
}

fn check(
    found: TimeOfImpact,
    (start, end): (&Points, &Points),
    distance: impl Fn(&Points) -> f64,
    early: f64,
) -> Result<(), TestCaseError> {
    let until = match found {
        TimeOfImpact::Separated => 1.0,
        TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => time,
        TimeOfImpact::Overlapping => return Err(TestCaseError::fail("it never says so")),
    };
    let first = distance(start);
    let kept = SETTINGS.minimum_gap.min(0.89 * first);
    for k in 0..=200 {
        let least = distance(&at(start, end, until * f64::from(k) / 200.0));
        // What touches at the start stops there.
        prop_assert!(
            least >= kept || until == 0.0,
            "{least:e} of {first:e} at {k} of {until}"
        );
    }
    if matches!(found, TimeOfImpact::Impact { .. }) && first > 2.0 * SETTINGS.minimum_gap {
        let reached = distance(&at(start, end, until));
        prop_assert!(
            reached <= SETTINGS.minimum_gap + early,
            "early: {reached:e}"
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_vertex_is_never_late_at_a_face(start in points(), end in points()) {
        let found = vertex_face_time_of_impact(&start, &end, &SETTINGS);
        check(found, (&start, &end), vertex_face_distance, NEAR)?;
    }

    #[test]
    fn an_edge_is_never_late_at_an_edge(start in points(), end in points()) {
        let found = edge_edge_time_of_impact(&start, &end, &SETTINGS);
        check(found, (&start, &end), edge_edge_distance, NEAR)?;
    }

    #[test]
    fn a_kilometre_away_it_is_the_same(start in points(), end in points(), far in [-1e3..1e3_f64, -1e3..1e3_f64, -1e3..1e3_f64]) {
        let moved = |p: &Points| p.map(|q| q + Vector3::from(far));
        let (start, end) = (moved(&start), moved(&end));
        check(vertex_face_time_of_impact(&start, &end, &SETTINGS), (&start, &end), vertex_face_distance, FAR)?;
        check(edge_edge_time_of_impact(&start, &end, &SETTINGS), (&start, &end), edge_edge_distance, FAR)?;
    }
}
