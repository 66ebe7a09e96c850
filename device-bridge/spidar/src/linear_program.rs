//! A linear program in three unknowns: the highest point of a polyhedron, one half-space after the other.
//!
//! | symbol | name in code | meaning                              |
//! |--------|--------------|--------------------------------------|
//! | x      | `at`         | two coordinates and the height       |
//! | a, b   | [`HalfSpace`]| `a . x <= b`                         |
//!
//! The highest point of the half-spaces so far stays while the next ones hold there. One that does not has the new highest point on its
//! plane, where the same problem with two unknowns is solved, and there on a line. With n half-spaces that is at most n^3 / 6 intersections,
//! whatever they are; where those come first that met in the last answer, it is about n comparisons.
//!
//! Source: Seidel 1991, small-dimensional linear programming by incremental insertion (here in a given order).

/// Most half-spaces of a problem.
pub(crate) const MAX_HALF_SPACES: usize = 16;
/// A point may lie this far beyond a plane, in units of the unknowns for `a` of length one: rounding of the intersections.
const TOLERANCE: f64 = 1e-9;
/// An interval may be empty by this much and count as one point: equations given as two half-spaces.
const EMPTY: f64 = 1e-7;
/// Cosine below which a line runs along an edge.
const PARALLEL: f64 = 1e-12;

/// `a . x <= b`, the third component of x being the height.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfSpace {
    pub(crate) a: [f64; 3],
    pub(crate) b: f64,
}

/// `a . u <= b`.
#[derive(Clone, Copy, Debug)]
struct HalfPlane {
    a: [f64; 2],
    b: f64,
}

/// The highest point of `spaces` between heights 0 and `top`; `None` where they have no point in common there (up to rounding) or are not
/// finite.
///
/// `extent` bounds the coordinates of every point that they have in common. `order` holds the indices of `spaces`: it only decides the cost.
pub(crate) fn highest(
    spaces: &[HalfSpace],
    order: &[u8],
    top: f64,
    extent: f64,
) -> Option<[f64; 3]> {
    debug_assert!(spaces.len() <= MAX_HALF_SPACES && order.len() == spaces.len());
    // The box in which all of it happens: without one, an answer on the way would be at infinity.
    let ranges = [(-extent, extent), (-extent, extent), (0.0, top)];
    let mut at = [0.0, 0.0, top];
    for (done, next) in order.iter().enumerate() {
        let space = &spaces[usize::from(*next)];
        let over = space.a[0] * at[0] + space.a[1] * at[1] + space.a[2] * at[2] - space.b;
        if over <= TOLERANCE {
            continue; // false for NaN
        }
        // On its plane, `x_m = offset + slope . u`, with m the coordinate along which it is steepest.
        let [m, u, w] = steepest(&space.a);
        let lead = space.a[m];
        if lead.abs() <= PARALLEL || !lead.is_finite() {
            return None;
        }
        let slope = [-space.a[u] / lead, -space.a[w] / lead];
        let offset = space.b / lead;
        let mut planes = [HalfPlane {
            a: [0.0; 2],
            b: 0.0,
        }; MAX_HALF_SPACES + 2];
        // x_m stays in its range, and the half-spaces before this one hold.
        planes[0] = HalfPlane {
            a: slope,
            b: ranges[m].1 - offset,
        };
        planes[1] = HalfPlane {
            a: slope.map(|s| -s),
            b: offset - ranges[m].0,
        };
        let before = order[..done].iter().map(|i| &spaces[usize::from(*i)]);
        for (plane, space) in planes[2..].iter_mut().zip(before) {
            *plane = HalfPlane {
                a: [
                    space.a[u] + space.a[m] * slope[0],
                    space.a[w] + space.a[m] * slope[1],
                ],
                b: space.b - space.a[m] * offset,
            };
        }
        let upwards = if m == 2 { slope } else { [0.0, 1.0] };
        let found = farthest(&planes[..done + 2], &upwards, &[ranges[u], ranges[w]])?;
        at[u] = found[0];
        at[w] = found[1];
        at[m] = offset + slope[0] * found[0] + slope[1] * found[1];
    }
    at.iter().all(|x| x.is_finite()).then_some(at)
}

/// The coordinate along which `a` is longest, and the other two in ascending order.
fn steepest(a: &[f64; 3]) -> [usize; 3] {
    let [x, y, z] = a.map(f64::abs);
    if z >= x && z >= y {
        [2, 0, 1]
    } else if y >= x {
        [1, 0, 2]
    } else {
        [0, 1, 2]
    }
}

/// The point of `planes` farthest along `direction`, with coordinates in `ranges`; `None` where they have none in common.
fn farthest(
    planes: &[HalfPlane],
    direction: &[f64; 2],
    ranges: &[(f64, f64); 2],
) -> Option<[f64; 2]> {
    let mut at = [0, 1].map(|k| {
        if direction[k] < 0.0 {
            ranges[k].0
        } else {
            ranges[k].1
        }
    });
    for (done, plane) in planes.iter().enumerate() {
        let [ax, ay] = plane.a;
        if ax * at[0] + ay * at[1] - plane.b <= TOLERANCE {
            continue; // false for NaN
        }
        let length = (ax * ax + ay * ay).sqrt();
        let usable = length > PARALLEL && length.is_finite(); // false for NaN
        if !usable {
            return None;
        }
        let along = [-ay / length, ax / length];
        let share = plane.b / (length * length);
        let foot = [ax * share, ay * share];
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        // Of the point `foot + along t`: `rise t <= left`.
        let mut clip = |rise: f64, left: f64| {
            if rise.abs() <= PARALLEL {
                return left >= -EMPTY;
            }
            if rise > 0.0 {
                high = high.min(left / rise);
            } else {
                low = low.max(left / rise);
            }
            true
        };
        let mut crossed = true;
        for k in 0..2 {
            crossed &= clip(along[k], ranges[k].1 - foot[k]);
            crossed &= clip(-along[k], foot[k] - ranges[k].0);
        }
        for other in &planes[..done] {
            let rise = other.a[0] * along[0] + other.a[1] * along[1];
            let left = other.b - other.a[0] * foot[0] - other.a[1] * foot[1];
            crossed &= clip(rise, left);
        }
        if !crossed {
            return None;
        }
        let place = if low > high {
            if low - high > EMPTY {
                return None;
            }
            0.5 * (low + high)
        } else if direction[0] * along[0] + direction[1] * along[1] > 0.0 {
            high
        } else {
            low
        };
        at = [foot[0] + along[0] * place, foot[1] + along[1] * place];
    }
    Some(at)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    const TOP: f64 = 1.0;
    const EXTENT: f64 = 100.0;

    fn all(spaces: &[HalfSpace]) -> Vec<u8> {
        (0..spaces.len()).map(|i| i as u8).collect()
    }

    /// xorshift64*, in [-1, 1).
    pub(crate) fn random(state: &mut u64) -> f64 {
        *state ^= *state >> 12;
        *state ^= *state << 25;
        *state ^= *state >> 27;
        let bits = state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        2.0 * bits as f64 / (1_u64 << 53) as f64 - 1.0
    }

    /// The greatest height of all corners at which every half-space holds: all triples, by Cramer's rule.
    fn by_corners(spaces: &[HalfSpace]) -> Option<f64> {
        let cross = |a: &[f64; 3], b: &[f64; 3]| {
            [
                a[1] * b[2] - a[2] * b[1],
                a[2] * b[0] - a[0] * b[2],
                a[0] * b[1] - a[1] * b[0],
            ]
        };
        let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let mut best: Option<f64> = None;
        for i in 0..spaces.len() {
            for j in 0..i {
                for k in 0..j {
                    let (a, b, c) = (&spaces[i], &spaces[j], &spaces[k]);
                    let (bc, ca, ab) = (cross(&b.a, &c.a), cross(&c.a, &a.a), cross(&a.a, &b.a));
                    let volume = dot(&a.a, &bc);
                    if volume.abs() < 1e-9 {
                        continue;
                    }
                    let at: [f64; 3] =
                        std::array::from_fn(|m| (a.b * bc[m] + b.b * ca[m] + c.b * ab[m]) / volume);
                    if spaces
                        .iter()
                        .all(|space| dot(&space.a, &at) <= space.b + 1e-7)
                    {
                        best = Some(best.map_or(at[2], |best: f64| best.max(at[2])));
                    }
                }
            }
        }
        best
    }

    #[test]
    fn the_highest_point_is_the_highest_corner_in_every_order() {
        let mut state = 5;
        let (mut found, mut none) = (0, 0);
        for round in 0..2000 {
            // A box that bounds all, and random half-spaces around the origin or beside it.
            let beside = if round % 3 == 0 { 0.4 } else { 0.05 };
            let mut spaces = Vec::new();
            for axis in 0..2 {
                for sign in [1.0, -1.0] {
                    let mut a = [0.0; 3];
                    a[axis] = sign;
                    spaces.push(HalfSpace { a, b: 10.0 });
                }
            }
            for _ in 0..12 {
                let a = std::array::from_fn(|_| random(&mut state));
                let b = random(&mut state).abs() - beside;
                spaces.push(HalfSpace { a, b });
            }
            let order = all(&spaces);
            let backwards: Vec<u8> = order.iter().rev().copied().collect();
            let one = highest(&spaces, &order, TOP, EXTENT).map(|at| at[2]);
            let other = highest(&spaces, &backwards, TOP, EXTENT).map(|at| at[2]);
            let mut closed = spaces.clone();
            for (up, b) in [(1.0, TOP), (-1.0, 0.0)] {
                let a = [0.0, 0.0, up];
                closed.push(HalfSpace { a, b });
            }
            match (one, other, by_corners(&closed)) {
                (Some(one), Some(other), Some(expected)) => {
                    found += 1;
                    assert!((one - expected).abs() < 1e-6, "{one} {expected}");
                    assert!((other - expected).abs() < 1e-6, "{other} {expected}");
                }
                (None, None, None) => none += 1,
                different => panic!("round {round}: {different:?}"),
            }
        }
        assert!(found > 500 && none > 100, "{found} {none}");
    }

    #[test]
    fn a_height_far_above_the_extent_of_the_coordinates_is_reached() {
        let lean = HalfSpace {
            a: [1.0, 0.0, 0.01],
            b: 5.0,
        };
        let wall = HalfSpace {
            a: [-1.0, 0.0, 0.0],
            b: 1.0,
        };
        let at = highest(&[lean, wall], &[0, 1], 1e4, 2.0);
        assert!(at.is_some_and(|at| (at[2] - 600.0).abs() < 1e-9), "{at:?}");
    }

    #[test]
    fn an_equation_is_two_half_spaces() {
        let spaces = [
            HalfSpace {
                a: [1.0, 0.0, 1.0],
                b: 0.3,
            },
            HalfSpace {
                a: [-1.0, 0.0, -1.0],
                b: -0.3,
            },
            HalfSpace {
                a: [-1.0, 0.0, 0.0],
                b: 0.1,
            },
        ];
        let at = highest(&spaces, &all(&spaces), TOP, EXTENT);
        assert!(at.is_some_and(|at| (at[2] - 0.4).abs() < 1e-12 && (at[0] + 0.1).abs() < 1e-12));
    }

    #[test]
    fn what_is_not_finite_has_no_highest_point() {
        let spaces = [HalfSpace {
            a: [f64::NAN, 0.0, 1.0],
            b: 0.5,
        }];
        assert!(highest(&spaces, &[0], TOP, EXTENT).is_none());
        let spaces = [HalfSpace {
            a: [0.0; 3],
            b: -1.0,
        }];
        assert!(highest(&spaces, &[0], TOP, EXTENT).is_none());
    }
}
