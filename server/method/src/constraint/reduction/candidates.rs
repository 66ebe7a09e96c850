//! Rows to choose from: every pair that faced within a distance at the pose where it was collected.
//!
//! | symbol | name in code | unit   | meaning                                                            |
//! |--------|--------------|--------|--------------------------------------------------------------------|
//! | J_k    | `jacobian`   |        | at the pose of collection, one column after the other              |
//! | g_k    | `gap`        | m      | `g + J d`, d the motion since: exact at the pose of collection      |
//! | d      | `moved`      | m, rad | from the pose of collection to the present one                     |

use nalgebra::{Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};

use super::super::{Contact, in_world};
use super::met::are_corners;
use super::row::Known;
use super::{Purpose, Surfaces, felt};
use crate::spatial::{Pose, Vector6, pose_difference};

/// The rows. Components lie apart, so that the compiler scans four rows at a time. No allocation after `with_capacity`.
#[derive(Debug)]
pub(super) struct Candidates {
    pub(super) contacts: Vec<Contact>,
    /// Places of those that are pairs of corners.
    pub(super) corners: Vec<u32>,
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

/// One of them: the contact where it was collected, and its rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stored {
    contact: Contact,
    jacobian: Vector6,
    felt: Vector6,
    nearer: f64,
}

impl Candidates {
    pub(super) fn with_capacity(limit: usize) -> Self {
        Self {
            contacts: Vec::with_capacity(limit),
            corners: Vec::with_capacity(limit),
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
        self.corners.clear();
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
        if are_corners(&contact.features) {
            self.corners.push(self.contacts.len() as u32); // at most a set's capacity and what is searched for
        }
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

    /// Body and obstacles have made a motion together.
    pub(super) fn go_along(&mut self, motion: &Pose) {
        for contact in &mut self.contacts {
            *contact = in_world(contact, motion);
        }
        let [x, y, z, u, v, w] = &mut self.jacobian;
        for [x, y, z] in [[x, y, z], [u, v, w]] {
            for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
                [*x, *y, *z] = (motion.rotation * Vector3::new(*x, *y, *z)).into();
            }
        }
        self.collected_at = motion * self.collected_at;
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

    /// Another row of the same features takes the place of a candidate, which is given back.
    pub(super) fn exchange(&mut self, k: usize, stored: Stored) -> Stored {
        let Stored {
            contact,
            jacobian,
            felt,
            nearer,
        } = stored;
        let exchange = |columns: &mut [Vec<f64>; 6], row: Vector6| {
            let each = columns.iter_mut().zip(row.iter());
            // Of the felt rows there may be none.
            let before = each
                .map(|(column, x)| column.get_mut(k).map_or(*x, |it| std::mem::replace(it, *x)));
            Vector6::from_iterator(before)
        };
        self.gap[k] = contact.gap + jacobian.dot(&self.moved);
        Stored {
            contact: std::mem::replace(&mut self.contacts[k], contact),
            jacobian: exchange(&mut self.jacobian, jacobian),
            felt: exchange(&mut self.felt, felt),
            nearer: self
                .nearer
                .get_mut(k)
                .map_or(nearer, |it| std::mem::replace(it, nearer)),
        }
    }

    /// A row of the present pose as it is stored: its gap is carried back to where the others were collected, so that it is true here.
    pub(super) fn stored(&self, row: &Known) -> Stored {
        let gap = row.contact.gap - row.jacobian.dot(&self.moved);
        Stored {
            contact: Contact { gap, ..row.contact },
            jacobian: row.jacobian,
            felt: row.felt,
            nearer: row.nearer,
        }
    }

    /// A pair that was a row may become one again; its contact is that of the present pose.
    pub(super) fn put_back(&mut self, contact: &Contact) {
        let mut all = self.contacts.iter();
        if let Some(k) = all.position(|c| c.features == contact.features) {
            self.gap[k] = contact.gap;
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

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::constraint::{Feature, FeaturePair, contact_jacobian};

    #[test]
    fn what_goes_along_is_what_would_be_found_there() {
        let reference = Pose::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.2, 0.4, -0.1));
        let motion = Pose::new(Vector3::new(-0.3, 0.1, 0.7), Vector3::new(1.0, -2.0, 0.5));
        let row = |contact: &Contact, about: &Pose| {
            let center = Point3::from(about.translation.vector);
            contact_jacobian(&contact.normal, &contact.point_on_obstacle, &center)
        };
        let there = motion * reference;
        let (mut gone, mut found) = (Candidates::with_capacity(8), Candidates::with_capacity(8));
        gone.clear(&reference);
        found.clear(&there);
        for k in 0..8_u32 {
            let u = f64::from(k);
            let normal = Vector3::new(u.sin(), u.cos(), 0.3 * u - 1.0).normalize();
            let point_on_obstacle = Point3::new(0.1 * u, 0.05 * (2.0 * u).cos(), 0.2);
            let contact = Contact {
                features: FeaturePair {
                    obstacle: 0,
                    on_body: Feature::Vertex(k),
                    on_obstacle: Feature::Face(k),
                },
                point_on_body: point_on_obstacle + normal * 1e-3,
                point_on_obstacle,
                normal,
                gap: 1e-3 * (1.0 + u),
                obstacle_triangle: k,
                barycentric: [1.0, 0.0, 0.0],
            };
            gone.push(&contact, &row(&contact, &reference));
            let contact = in_world(&contact, &motion);
            found.push(&contact, &row(&contact, &there));
        }
        gone.go_along(&motion);
        for (a, b) in gone.contacts.iter().zip(&found.contacts) {
            assert!((a.point_on_obstacle - b.point_on_obstacle).norm() < 1e-12);
        }
        // On from there, as the candidates have it.
        let further = Pose::new(Vector3::new(1e-4, 2e-4, -3e-4), Vector3::zeros()) * there;
        gone.move_to(&further);
        found.move_to(&further);
        for (a, b) in gone.gap.iter().zip(&found.gap) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        let wish = Vector6::new(1e-3, -2e-3, 3e-3, 0.01, 0.02, -0.03);
        let least = |all: &mut Candidates| all.least_clearance(&wish, Purpose::Motion, 0.0);
        let (a, b) = (
            least(&mut gone).expect("one"),
            least(&mut found).expect("one"),
        );
        assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-12, "{a:?} {b:?}");
    }
}
