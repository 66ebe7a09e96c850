//! Exact continuous collision detection of a vertex with a triangle and of two edges whose points move on straight lines.
//!
//! Every coordinate is a double, hence an integer over a power of two, so that the conditions for contact are signs of integer
//! polynomials of the time t. They are decided exactly at the roots of the coplanarity cubic; where the points stay coplanar, at
//! the roots of all conditions. Nothing here rounds, and nothing is shared with the method.

mod outcome;
mod polynomial;
mod queries;

use god_object::nalgebra::Point3;
use num_bigint::BigInt;
pub(crate) use outcome::{Outcome, answer, judge};
use polynomial::{Dyadic, Polynomial};
pub(crate) use queries::{Kind, Query, query_sets};

type Vector = [Polynomial; 3];

/// Bounds of the time of the first contact; `None` when there is none in [0, 1].
///
/// A vertex and three corners, or an edge and another.
pub(crate) fn first_contact(
    kind: Kind,
    start: &[Point3<f64>; 4],
    end: &[Point3<f64>; 4],
) -> Option<[f64; 2]> {
    let points = paths(start, end);
    let conditions = match kind {
        Kind::VertexFace => vertex_face(&points),
        Kind::EdgeEdge => edge_edge(&points),
    };
    let holds_at_start = conditions.hold(&mut |p| p.sign_at(&Dyadic::whole(0)));
    if holds_at_start {
        return Some([0.0, 0.0]);
    }
    let candidates: Vec<&Polynomial> = if conditions.coplanar.is_zero() {
        conditions.all().filter(|p| !p.is_zero()).collect()
    } else {
        vec![&conditions.coplanar]
    };
    let mut first: Option<[f64; 2]> = None;
    for polynomial in candidates {
        for mut root in polynomial.roots() {
            if conditions.hold(&mut |p| root.sign_of(p)) {
                let bounds = root.bounds();
                if first.is_none_or(|best| bounds[1] < best[1]) {
                    first = Some(bounds);
                }
            }
        }
    }
    first
}

/// When four points touch: they are coplanar, and either all `inside` are >= 0 while `regular` is > 0, or `regular` is zero and
/// a point lies on a segment.
struct Conditions {
    coplanar: Polynomial,
    regular: Polynomial,
    inside: Vec<Polynomial>,
    on_segments: Vec<OnSegment>,
}

/// A point lies on a segment: the components of the cross product are zero, and the point is not beyond an end.
struct OnSegment {
    across: Vector,
    /// `(v - a) . (v - b)`, not above zero between a and b.
    beyond: Polynomial,
}

impl Conditions {
    fn hold(&self, sign: &mut dyn FnMut(&Polynomial) -> i32) -> bool {
        if sign(&self.coplanar) != 0 {
            return false;
        }
        if sign(&self.regular) > 0 {
            return self.inside.iter().all(|p| sign(p) >= 0);
        }
        self.on_segments
            .iter()
            .any(|on| on.across.iter().all(|p| sign(p) == 0) && sign(&on.beyond) <= 0)
    }

    fn all(&self) -> impl Iterator<Item = &Polynomial> {
        let on_segments = self
            .on_segments
            .iter()
            .flat_map(|on| on.across.iter().chain(std::iter::once(&on.beyond)));
        [&self.coplanar, &self.regular]
            .into_iter()
            .chain(&self.inside)
            .chain(on_segments)
    }
}

fn vertex_face([v, a, b, c]: &[Vector; 4]) -> Conditions {
    let normal = cross(&minus(b, a), &minus(c, a));
    let inside = [(a, b), (b, c), (c, a)]
        .map(|(from, to)| dot(&normal, &cross(&minus(to, from), &minus(v, from))));
    Conditions {
        coplanar: dot(&normal, &minus(v, a)),
        regular: dot(&normal, &normal),
        inside: inside.into(),
        on_segments: vec![
            on_segment(v, a, b),
            on_segment(v, b, c),
            on_segment(v, c, a),
        ],
    }
}

fn edge_edge([a, b, c, d]: &[Vector; 4]) -> Conditions {
    let (first, second, between) = (minus(b, a), minus(d, c), minus(c, a));
    let normal = cross(&first, &second);
    let regular = dot(&normal, &normal);
    // Lines cross at a + s (b - a) = c + u (d - c), with s and u over `regular`.
    let s = dot(&cross(&between, &second), &normal);
    let u = dot(&cross(&between, &first), &normal);
    Conditions {
        coplanar: dot(&normal, &between),
        inside: vec![regular.minus(&s), regular.minus(&u), s, u],
        regular,
        on_segments: vec![
            on_segment(a, c, d),
            on_segment(b, c, d),
            on_segment(c, a, b),
            on_segment(d, a, b),
        ],
    }
}

fn on_segment(v: &Vector, a: &Vector, b: &Vector) -> OnSegment {
    OnSegment {
        across: cross(&minus(v, a), &minus(b, a)),
        beyond: dot(&minus(v, a), &minus(v, b)),
    }
}

/// The points' straight paths over t in [0, 1], all times one power of two.
fn paths(start: &[Point3<f64>; 4], end: &[Point3<f64>; 4]) -> [Vector; 4] {
    let exponent = |x: &f64| if *x == 0.0 { 0 } else { split(*x).1 };
    let least = start
        .iter()
        .chain(end)
        .flat_map(|p| p.iter().map(exponent))
        .min()
        .unwrap_or(0);
    let whole = |x: f64| {
        let (digits, exponent) = split(x);
        BigInt::from(digits) << u64::try_from(exponent - least).unwrap_or(0)
    };
    std::array::from_fn(|k| {
        std::array::from_fn(|axis| {
            let (from, to) = (whole(start[k][axis]), whole(end[k][axis]));
            Polynomial::new(vec![from.clone(), to - from])
        })
    })
}

/// `x = digits * 2^exponent`, exactly.
fn split(x: f64) -> (i64, i32) {
    let bits = x.to_bits();
    let exponent = ((bits >> 52) & 0x7ff) as i32;
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let digits = if exponent == 0 {
        fraction
    } else {
        fraction | (1 << 52)
    };
    let sign = if x < 0.0 { -1 } else { 1 };
    (sign * digits, exponent.max(1) - 1075)
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|k| a[k].minus(&b[k]))
}

fn dot(a: &Vector, b: &Vector) -> Polynomial {
    a.iter()
        .zip(b)
        .fold(Polynomial::default(), |sum, (a, b)| sum.plus(&a.times(b)))
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[i].times(&b[j]).minus(&a[j].times(&b[i]))
    })
}
