//! What wrenches the strings of one pose can render: the nearest one, and the largest along a direction.
//!
//! | symbol | name in code | meaning                                                    |
//! |--------|--------------|------------------------------------------------------------|
//! | Z      |              | scaled wrenches `A t` within the bounds: [`crate::tension`] |
//! | n      | `normal`     | Z lies behind the plane `n . z = support(n)`               |
//! | N, y   |              | tensions without a wrench: [`crate::null_space`]           |
//!
//! The largest alpha for which `alpha f` is in Z: with `t = alpha A^+ f + N y` that is a linear program in alpha and the two
//! components of y. Where the rows are not of full rank, cutting planes find it: the way from the nearest point of Z to a target outside is
//! the normal of a plane that Z lies behind, and alpha falls to where the ray meets that plane.

use crate::box_program::{Bounds, BoxAnswer, BoxProgram, Side};
use crate::linear_program::{HalfSpace, highest};
use crate::null_space::NullSpace;
use crate::{PerString, STRINGS};

/// Most cutting planes of one search for the scale.
const MAX_CUTS: u32 = 12;
/// A wrench is in Z if it is this near, relative to itself. Small, because tensions near the edge of Z may change two hundred
/// times as much as the wrench.
const RELATIVE_NEARNESS: f64 = 1e-6;
/// The same, absolute, N: above what the regularisation adds, a thousandth of what a finger feels.
pub(crate) const NEARNESS: f64 = 2e-5;
/// A tension this near its bound counts as at it, N: it comes early in the next search.
const TIGHT: f64 = 1e-6;
/// A scale above this is all of the command; what lacks is the rounding of an intersection.
const WHOLE: f64 = 1.0 - 1e-9;
/// Each string's two bounds.
const HALF_SPACES: usize = 2 * STRINGS;

/// What a search along a ray leaves for the next one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) sides: [Side; STRINGS],
    /// Of the last plane that Z was found to lie behind, of any length.
    normal: [f64; 6],
    /// The half-spaces of the linear program, those first that met in its last answer.
    order: [u8; HALF_SPACES],
}

impl Ray {
    pub(crate) const UNKNOWN: Self = Self {
        sides: [Side::Lower; STRINGS],
        normal: [0.0; 6],
        order: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15],
    };
}

pub(crate) struct Search {
    pub(crate) program: BoxProgram,
    pub(crate) bounds: Bounds,
    pub(crate) factorisations: u32,
    /// Of the program's rows, once it was needed; the inner `None` where they are not of full rank.
    space: Option<Option<NullSpace>>,
}

impl Search {
    pub(crate) fn new(program: BoxProgram, bounds: Bounds) -> Self {
        Self {
            program,
            bounds,
            factorisations: 0,
            space: None,
        }
    }

    /// The nearest point of Z to `target`, with the lowest tensions that render it. `sides` is a guess and becomes the answer's.
    pub(crate) fn nearest(&mut self, target: &[f64; 6], sides: &mut [Side; STRINGS]) -> BoxAnswer {
        let found = self
            .program
            .solve(target, &self.bounds.lower, &self.bounds, sides);
        self.factorisations += found.factorisations;
        if found.solved {
            *sides = found.sides;
        }
        found
    }

    /// The largest alpha in [0, 1] with `alpha f` in Z, up to rounding; `None` if the ray misses Z. `ray` only saves time.
    pub(crate) fn largest_scale(&mut self, f: &[f64; 6], ray: &mut Ray) -> Option<f64> {
        // Where the ray missed Z a moment ago, the plane between them mostly still is one.
        if self.misses(f, &ray.normal) {
            return None;
        }
        let Some(space) = self.null_space() else {
            return self.largest_scale_by_planes(f, ray);
        };
        let found = self.highest_scale(&space, f, &mut ray.order);
        if found.is_none() {
            // Both ends of the ray are beyond the plane through the point of Z that is nearest to one of them, as a rule.
            let nearest = self.nearest(&[0.0; 6], &mut ray.sides);
            ray.normal = nearest.image.map(|z| -z);
        }
        found
    }

    /// Whether the plane with this normal has Z on one side and the whole ray, `alpha f` with alpha in [0, 1], on the other.
    fn misses(&self, f: &[f64; 6], normal: &[f64; 6]) -> bool {
        // False for NaN.
        self.support(normal) < dot(normal, f).min(0.0)
    }

    /// Factorised at the first call.
    fn null_space(&mut self) -> Option<NullSpace> {
        let (program, factorisations) = (&self.program, &mut self.factorisations);
        *self.space.get_or_insert_with(|| {
            *factorisations += 1;
            NullSpace::of(program.rows())
        })
    }

    /// The linear program: most alpha with `lower <= alpha A^+ f + N y <= upper`.
    fn highest_scale(
        &self,
        space: &NullSpace,
        f: &[f64; 6],
        order: &mut [u8; HALF_SPACES],
    ) -> Option<f64> {
        let smallest = space.smallest(f);
        let largest = largest_of(&smallest);
        // The height is alpha in newtons, so that all entries have one size.
        let newtons = if largest > 0.0 { largest } else { 1.0 };
        let mut spaces = [HalfSpace {
            a: [0.0; 3],
            b: 0.0,
        }; HALF_SPACES];
        for i in 0..STRINGS {
            let a = [space.basis[0][i], space.basis[1][i], smallest[i] / newtons];
            spaces[2 * i] = HalfSpace {
                a,
                b: self.bounds.upper[i],
            };
            spaces[2 * i + 1] = HalfSpace {
                a: a.map(|x| -x),
                b: -self.bounds.lower[i],
            };
        }
        // y = N^T t.
        let extent = (STRINGS as f64).sqrt() * largest_of(&self.bounds.upper) + 1.0;
        let at = highest(&spaces, order, newtons, extent)?;
        let mut first = 0;
        for place in 0..HALF_SPACES {
            let HalfSpace { a, b } = spaces[usize::from(order[place])];
            let left = b - (0..3).map(|k| a[k] * at[k]).sum::<f64>();
            if left < TIGHT {
                order.swap(first, place);
                first += 1;
            }
        }
        let scale = (at[2] / newtons).max(0.0);
        Some(if scale > WHOLE { 1.0 } else { scale })
    }

    /// The same for rows of any rank.
    ///
    /// Never less than the true one: `n . z <= support(n)` on Z for every n, exact or not, so that each cut is valid.
    fn largest_scale_by_planes(&mut self, f: &[f64; 6], ray: &mut Ray) -> Option<f64> {
        // The last search's normal is a good first cut.
        let first = self.support(&ray.normal) / dot(&ray.normal, f);
        let cuts = dot(&ray.normal, f) > 0.0 && (0.0..1.0).contains(&first);
        let mut alpha = if cuts { first } else { 1.0 };
        for _ in 0..MAX_CUTS {
            let target = f.map(|f| alpha * f);
            let found = self.nearest(&target, &mut ray.sides);
            let normal: [f64; 6] = std::array::from_fn(|k| target[k] - found.image[k]);
            if norm(&normal) <= nearness(&target) {
                break;
            }
            let (along, support) = (dot(&normal, f), self.support(&normal));
            let separated = alpha * along > support; // false for NaN
            if !separated {
                break; // what is left is rounding
            }
            ray.normal = normal;
            if along <= 0.0 || support < 0.0 {
                return None;
            }
            alpha = support / along;
        }
        Some(alpha)
    }

    /// The largest `n . z` over z in Z.
    fn support(&self, normal: &[f64; 6]) -> f64 {
        (0..STRINGS)
            .map(|i| {
                let along = self.program.along(normal, i);
                (along * self.bounds.lower[i]).max(along * self.bounds.upper[i])
            })
            .sum()
    }
}

fn largest_of(values: &PerString) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// How near a wrench must be to count as one of Z, N.
pub(crate) fn nearness(f: &[f64; 6]) -> f64 {
    NEARNESS + RELATIVE_NEARNESS * norm(f)
}

fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (0..6).map(|k| a[k] * b[k]).sum()
}

pub(crate) fn norm(f: &[f64; 6]) -> f64 {
    dot(f, f).sqrt()
}

pub(crate) fn distance(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (0..6)
        .map(|k| (a[k] - b[k]) * (a[k] - b[k]))
        .sum::<f64>()
        .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear_program::tests::random;
    use crate::{Geometry, Pose, StringMatrix};
    use nalgebra::Vector3;

    #[test]
    fn the_linear_program_and_cutting_planes_find_one_scale() {
        let mut state = 11;
        let (mut found, mut none) = (0, 0);
        for name in Geometry::shipped_names() {
            let geometry = Geometry::shipped(name).expect("shipped");
            let reach = geometry.half_width() / 3.0;
            let mut warm = Ray::UNKNOWN;
            for _ in 0..2000 {
                let mut any = |size: f64| {
                    Vector3::new(
                        size * random(&mut state),
                        size * random(&mut state),
                        size * random(&mut state),
                    )
                };
                let pose = Pose::new(any(reach), any(0.4));
                let (force, torque) = (
                    any(2.0 * geometry.tension_max),
                    any(2.0 * geometry.tension_max),
                );
                let f = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
                let rows = StringMatrix::at(&geometry, &pose).scaled_rows(geometry.arm());
                let bounds = Bounds {
                    lower: [geometry.tension_min; STRINGS],
                    upper: [geometry.tension_max; STRINGS],
                };
                let mut search = Search::new(BoxProgram::new(&rows, 1e-11), bounds);
                let program = search.largest_scale(&f, &mut warm);
                let mut cold = Ray::UNKNOWN;
                let planes = search.largest_scale_by_planes(&f, &mut cold);
                match (program, planes) {
                    (Some(program), Some(planes)) => {
                        found += 1;
                        assert!(
                            (program - planes).abs() * norm(&f) < 1e-2,
                            "{name}: {program} {planes}"
                        );
                    }
                    (None, None) => none += 1,
                    different => panic!("{name}: {different:?}"),
                }
            }
        }
        assert!(found > 1000 && none > 1000, "{found} {none}");
    }
}
