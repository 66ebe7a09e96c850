//! Rows to choose from: every pair that faced within a distance at the pose where it was collected.
//!
//! | symbol | name in code | unit   | meaning                                                            |
//! |--------|--------------|--------|--------------------------------------------------------------------|
//! | J_k    | `jacobian`   |        | at the pose of collection, one column after the other              |
//! | g_k    | `gap`        | m      | `g + J d`, d the motion since: exact at the pose of collection      |
//! | d      | `moved`      | m, rad | from the pose of collection to the present one                     |

use nalgebra::{Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};

use super::super::Contact;
use super::{Purpose, Surfaces, felt};
use crate::spatial::{Pose, Vector6, pose_difference};

/// The rows. Components lie apart, so that the compiler scans four rows at a time. No allocation after `with_capacity`.
#[derive(Debug)]
pub(super) struct Candidates {
    pub(super) contacts: Vec<Contact>,
    jacobian: [Vec<f64>; 6],
    /// The rows that the force has, where some differ: of shaded surfaces. Empty otherwise.
    felt: [Vec<f64>; 6],
    /// How much nearer than their gaps say the candidates count, m, where some do: obstacles move. Empty otherwise.
    nearer: Vec<f64>,
    shaded: bool,
    moving: bool,
    /// Gaps at the present pose, m; infinite for a candidate that is out of the question there.
    pub(super) gap: Vec<f64>,
    clearance: Vec<f64>,
    limit: usize,
    collected_at: Pose,
    pub(super) moved: Vector6,
    pub(super) complete_within: f64,
    processor: Arch,
}

impl Candidates {
    pub(super) fn with_capacity(limit: usize) -> Self {
        Self {
            contacts: Vec::with_capacity(limit),
            jacobian: std::array::from_fn(|_| Vec::with_capacity(limit)),
            felt: std::array::from_fn(|_| Vec::with_capacity(limit)),
            nearer: Vec::with_capacity(limit),
            shaded: false,
            moving: false,
            gap: Vec::with_capacity(limit),
            clearance: Vec::with_capacity(limit),
            limit,
            collected_at: Pose::identity(),
            moved: Vector6::zeros(),
            complete_within: 0.0,
            processor: Arch::new(),
        }
    }

    /// No candidates; the next are collected at this pose of the reference point.
    pub(super) fn clear(&mut self, reference: &Pose) {
        self.contacts.clear();
        self.jacobian.iter_mut().for_each(Vec::clear);
        self.felt.iter_mut().for_each(Vec::clear);
        self.nearer.clear();
        self.gap.clear();
        self.collected_at = *reference;
        self.moved = Vector6::zeros();
        self.complete_within = f64::INFINITY;
    }

    pub(super) fn room(&self) -> usize {
        self.limit - self.contacts.len()
    }

    pub(super) fn push(&mut self, contact: &Contact, jacobian: &Vector6) {
        self.contacts.push(*contact);
        self.gap.push(contact.gap);
        for (column, x) in self.jacobian.iter_mut().zip(jacobian.iter()) {
            column.push(*x);
        }
    }

    /// Adds one that was found at the present pose: its gap is carried back to where the others were collected, so that it is true here.
    pub(super) fn push_at(
        &mut self,
        contact: &Contact,
        jacobian: &Vector6,
        felt: &Vector6,
        nearer: f64,
    ) {
        let shaded = self.shaded && self.felt[0].len() == self.gap.len();
        let moving = self.moving && self.nearer.len() == self.gap.len();
        self.push(contact, jacobian);
        if let Some(stored) = self.contacts.last_mut() {
            stored.gap -= jacobian.dot(&self.moved);
        }
        if shaded {
            for (column, x) in self.felt.iter_mut().zip(felt.iter()) {
                column.push(*x);
            }
        }
        if moving {
            self.nearer.push(nearer);
        }
    }

    /// Carries the gaps on to another pose of the reference point.
    pub(super) fn move_to(&mut self, reference: &Pose) {
        self.moved = pose_difference(reference, &self.collected_at, &Vector3::zeros());
        self.gap.clear();
        self.gap.extend(self.contacts.iter().map(|c| c.gap));
        self.processor.dispatch(AddProducts {
            sums: &mut self.gap,
            columns: &self.jacobian,
            a: &self.moved,
        });
    }

    /// Takes over what the scene adds to each candidate.
    pub(super) fn set_surfaces(&mut self, center: &Point3<f64>, surfaces: &dyn Surfaces) {
        self.felt.iter_mut().for_each(Vec::clear);
        self.nearer.clear();
        (self.shaded, self.moving) = (surfaces.shade(), surfaces.move_on());
        if self.shaded {
            for contact in &self.contacts {
                let row = felt(contact, surfaces, center);
                for (column, x) in self.felt.iter_mut().zip(row.iter()) {
                    column.push(*x);
                }
            }
        }
        if self.moving {
            let nearer = self.contacts.iter().map(|c| surfaces.nearer(c));
            self.nearer.extend(nearer);
        }
    }

    /// The candidate with the least gap, and that; the first of several.
    pub(super) fn nearest(&self) -> Option<(usize, f64)> {
        let least = self.processor.dispatch(Least(&self.gap));
        let place = self.gap.iter().position(|gap| *gap == least)?;
        Some((place, least))
    }

    /// The candidate with the least `max(g, g_0) + J a`, as the purpose sees it, and that.
    pub(super) fn least_clearance(
        &mut self,
        a: &Vector6,
        purpose: Purpose,
        least_gap: f64,
    ) -> Option<(usize, f64)> {
        self.clearance.clear();
        self.clearance
            .extend(self.gap.iter().map(|gap| gap.max(least_gap)));
        let shaded = self.shaded && purpose.is_felt() && self.felt[0].len() == self.gap.len();
        let rows = if shaded { &self.felt } else { &self.jacobian };
        self.processor.dispatch(AddProducts {
            sums: &mut self.clearance,
            columns: rows,
            a,
        });
        if !matches!(purpose, Purpose::Motion | Purpose::Force) {
            for (clearance, nearer) in self.clearance.iter_mut().zip(&self.nearer) {
                *clearance -= nearer;
            }
        }
        let least = self.processor.dispatch(Least(&self.clearance));
        let place = self.clearance.iter().position(|c| *c == least)?;
        Some((place, least))
    }
}

/// Adds `J a` to numbers of which there is one for each row.
struct AddProducts<'a> {
    sums: &'a mut [f64],
    columns: &'a [Vec<f64>; 6],
    a: &'a Vector6,
}

impl WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (column, x) in self.columns.iter().zip(self.a.iter()) {
            for (sum, j) in self.sums.iter_mut().zip(column) {
                *sum += j * x;
            }
        }
    }
}

/// The least of the numbers, infinite without any; NaN is passed over.
struct Least<'a>(&'a [f64]);

impl WithSimd for Least<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let smaller = |x: f64, y: f64| if y < x { y } else { x };
        let (whole, rest) = self.0.as_chunks::<8>();
        let mut least = [f64::INFINITY; 8];
        for eight in whole {
            for k in 0..8 {
                least[k] = smaller(least[k], eight[k]);
            }
        }
        let all = least.iter().chain(rest).copied();
        all.fold(f64::INFINITY, smaller)
    }
}
