//! Published queries with exact truth, most of them degenerate by design: no contact is missed, none is late.

mod exact_collision;
mod geometry_shapes;

use exact_collision::{first_contact, query_sets};

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
    println!("{} queries", queries.len());
}
