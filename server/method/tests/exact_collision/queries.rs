//! The query sets of the test data: 24 rationals `num/den` a row, all of them doubles, and whether the features meet.

use std::path::Path;

use god_object::nalgebra::Point3;

/// The features of a query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    VertexFace,
    EdgeEdge,
}

/// Four points on straight paths over t in [0, 1], m.
#[derive(Clone, Debug)]
pub(crate) struct Query {
    pub(crate) kind: Kind,
    /// Set, scene, file and number.
    pub(crate) name: String,
    pub(crate) start: [Point3<f64>; 4],
    pub(crate) end: [Point3<f64>; 4],
    /// Whether the features meet, from the file.
    pub(crate) truth: bool,
}

impl Kind {
    /// How many of the four points are the first feature's.
    pub(crate) fn points_of_first(self) -> usize {
        match self {
            Self::VertexFace => 1,
            Self::EdgeEdge => 2,
        }
    }
}

impl Query {
    /// The features as they start, and as parts of rigid bodies: the second rests, and the first goes where its first point does as seen from the first of
    /// the second. `truth` is that of the file, of the points that move each for itself.
    pub(crate) fn rigid(&self) -> Self {
        let first = self.kind.points_of_first();
        let path = |k: usize| self.end[k] - self.start[k];
        let way = path(0) - path(first);
        let mut end = self.start;
        for point in &mut end[..first] {
            *point += way;
        }
        Self {
            end,
            ..self.clone()
        }
    }

    /// Longest side of the box around all eight points, m: the query's scale.
    pub(crate) fn size(&self) -> f64 {
        let all = self.start.iter().chain(&self.end);
        let (low, high) = all.fold((self.start[0], self.start[0]), |(low, high), p| {
            (low.inf(p), high.sup(p))
        });
        (high - low).max()
    }
}

const SETS: [(&str, Kind); 4] = [
    ("ccd_vf.csv", Kind::VertexFace),
    ("ccd_ee.csv", Kind::EdgeEdge),
    ("ccd_meshes_vf.csv", Kind::VertexFace),
    ("ccd_meshes_ee.csv", Kind::EdgeEdge),
];

/// Every query of every set below `data`; `None` when they are not there.
#[allow(
    clippy::disallowed_methods,
    reason = "tests may read files; the method may not"
)]
pub(crate) fn query_sets(data: Option<&Path>) -> Option<Vec<Query>> {
    let mut queries = Vec::new();
    for (name, kind) in SETS {
        let Some(text) = data.and_then(|d| std::fs::read_to_string(d.join("ccd").join(name)).ok())
        else {
            taut_test_kit::left_out(format_args!("ccd/{name} is not in the test data"));
            return None;
        };
        queries.extend(text.lines().skip(1).map(|line| query(name, kind, line)));
    }
    Some(queries)
}

fn query(set: &str, kind: Kind, line: &str) -> Query {
    let fields: Vec<&str> = line.split(',').collect();
    let numbers: Vec<f64> = fields[4..28].iter().map(|field| rational(field)).collect();
    let points = |from: usize| {
        std::array::from_fn(|k| Point3::from_slice(&numbers[from + 3 * k..from + 3 * k + 3]))
    };
    Query {
        kind,
        name: format!("{set} {} {} {}", fields[0], fields[1], fields[2]),
        start: points(0),
        end: points(12),
        truth: fields[3] == "1",
    }
}

/// `num/den` where den is a power of two: both are doubles, and so is the quotient.
fn rational(text: &str) -> f64 {
    let (numerator, denominator) = text.split_once('/').expect("a fraction");
    let [numerator, denominator]: [f64; 2] =
        [numerator, denominator].map(|n| n.parse().expect("a number"));
    numerator / denominator
}
