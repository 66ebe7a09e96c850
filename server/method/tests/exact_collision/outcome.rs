//! What the method answers to a query, beside what is true.

use god_object::collision::{
    AdvancementSettings, TimeOfImpact, edge_edge_time_of_impact, vertex_face_time_of_impact,
};

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

/// Asks the method, with a minimum gap of `relative_gap` times the query's size and a tenth of that as tolerance.
pub(crate) fn answer(query: &Query, relative_gap: f64) -> TimeOfImpact {
    let minimum_gap = relative_gap * query.size();
    let settings = AdvancementSettings {
        minimum_gap,
        gap_tolerance: 0.1 * minimum_gap,
        ..AdvancementSettings::default()
    };
    match query.kind {
        Kind::VertexFace => vertex_face_time_of_impact(&query.start, &query.end, &settings),
        Kind::EdgeEdge => edge_edge_time_of_impact(&query.start, &query.end, &settings),
    }
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
