//! Published queries with exact truth, most of them degenerate by design: as motions of rigid bodies, no contact is missed, none is late.

use crate::geometry_shapes;

use crate::exact_collision::{Outcome, Query, answer, first_contact, judge, query_sets};

/// Minimum gaps relative to the size of a query.
const RELATIVE_GAPS: [f64; 6] = [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12];

#[test]
fn the_exact_oracle_agrees_with_the_truth_of_every_query() {
    let Some(queries) = query_sets(geometry_shapes::data_dir().as_deref()) else {
        return;
    };
    for query in &queries {
        let found = first_contact(query.kind, &query.start, &query.end);
        assert_eq!(found.is_some(), query.truth, "{}: {found:?}", query.name);
        assert!(found.is_none_or(|[lo, hi]| (0.0..=1.0).contains(&lo) && lo <= hi));
    }
}

#[test]
fn no_contact_of_the_query_sets_is_missed_or_late_whatever_the_gap() {
    let Some(queries) = query_sets(geometry_shapes::data_dir().as_deref()) else {
        return;
    };
    let queries: Vec<_> = queries.iter().map(Query::rigid).collect();
    let truths: Vec<_> = queries
        .iter()
        .map(|query| first_contact(query.kind, &query.start, &query.end))
        .collect();
    let mut last_false_positives = queries.len();
    for relative_gap in RELATIVE_GAPS {
        let (mut false_positives, mut found, mut free) = (0, 0, 0);
        for (query, truth) in queries.iter().zip(&truths) {
            match judge(answer(query, relative_gap), *truth) {
                Outcome::Free => free += 1,
                Outcome::Found { .. } => found += 1,
                Outcome::FalsePositive { .. } => false_positives += 1,
                wrong @ (Outcome::Missed | Outcome::Late { .. }) => {
                    panic!("{}, gap {relative_gap:e}: {wrong:?}", query.name)
                }
            }
        }
        println!(
            "gap {relative_gap:e}: {found} found, {free} free, {false_positives} false positives"
        );
        // A smaller gap takes fewer near misses for contacts.
        assert!(false_positives <= last_false_positives);
        last_false_positives = false_positives;
    }
}
