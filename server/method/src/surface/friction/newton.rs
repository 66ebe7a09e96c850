//! The cone problem with contacts that give a little: a semi-smooth Newton iteration in the six unknowns of the correction, and an augmented
//! Lagrangian around it, which takes the giving out again.
//!
//! | symbol      | name in code | unit       | meaning                                                              |
//! |-------------|--------------|------------|----------------------------------------------------------------------|
//! | y           | `y`          | m kg^(1/2) | `L^T (a - a_u)`                                                      |
//! | lambda_0    | in the contacts | N s^2   | multipliers to start from                                            |
//! | lambda(y)   | `Reaction`   | N s^2      | multipliers of one contact at y: `(lambda_0 - r (c + j . y))` on its cone |
//! | r           | `stiffness`  |            | in units of the contact's own                                        |
//! | G(y)        |              | m kg^(1/2) | `y - sum j lambda(y)`: zero where forces balance                     |
//!
//! What gives by a share 1/r of `lambda - lambda_0` leaves no contact's share open, however many there are and in whatever order they come. Where that is found,
//! `lambda` becomes `lambda_0` and the contacts are solved again, stiffer: they give less each time. A stiffness that does it at once leaves the
//! iteration going round where contacts hardly slip. It is converged when the slip and penetration that the compliance allows count as none.
//! The first step takes the contacts that lambda_0 loads for the loaded ones, whatever y says: the loads may be of the sample before, where the hand pressed
//! less or more. A contact whose slip turns back within a step is taken as stuck in the next.
//! Source: Alart and Curnier 1991, in six unknowns; Simo and Laursen 1992 (augmented Lagrangian of friction); Bertsekas 1982, Section 2.2 (growing stiffness).

use pulp::{Arch, Simd, WithSimd};

use super::cone::{ConeProblem, MAX_CONE_CONTACTS, Measure};
use super::contact::ConeContact;
use crate::quasi_statics::lanes::{Lanes8, add_scaled, dot, widened};
use crate::spatial::Vector6;

/// Penalty stiffness at first, in units of the contact's own, and the most Newton steps of one balance. Chosen by counting over some 2,000 problems of
/// pegs and plates, from predicted loads: a tenth of it needs up to a third more augmentations, ten times as much up to twice the steps.
const STIFFNESS: f64 = 2e4;
const MAX_STEPS: usize = 12;
/// Most updates of the multipliers (augmentations) of one solve.
const MAX_AUGMENTATIONS: usize = 8;
/// After each of them the contacts give so many times less, as contacts that hold the body badly turn what is left into a larger motion;
const STIFFER: f64 = 10.0;
/// where forces do not balance, they are tried again with this share of the stiffness.
const SOFTER: f64 = 0.2;
/// Forces balance when this share of the scale is left.
const BALANCE_TOLERANCE: f64 = 1e-6;

/// A linear system for the next y: six rows, with their right sides in the lane after the sixth.
struct System([Lanes8; 6]);

const RIGHT: usize = 6;

/// The rows of a contact, padded.
#[derive(Clone, Copy, Debug)]
struct Rows {
    normal: Lanes8,
    tangents: [Lanes8; 2],
}

/// The multipliers of one contact at some y.
#[derive(Clone, Copy, Debug)]
struct Reaction {
    load: f64,
    /// `lambda_0 - r u` of the tangents, before the disc, and its length.
    wished: [f64; 2],
    length: f64,
    /// Radius of the disc.
    limit: f64,
}

impl Reaction {
    const NONE: Self = Self {
        load: 0.0,
        wished: [0.0; 2],
        length: 0.0,
        limit: 0.0,
    };

    /// False for NaN.
    #[inline(always)]
    fn sticks(&self) -> bool {
        self.length <= self.limit
    }

    #[inline(always)]
    fn grip(&self) -> [f64; 2] {
        if self.sticks() {
            self.wished
        } else if self.length > 0.0 {
            let share = self.limit / self.length;
            [self.wished[0] * share, self.wished[1] * share]
        } else {
            [0.0; 2]
        }
    }
}

impl Rows {
    const NONE: Self = Self {
        normal: [0.0; 8],
        tangents: [[0.0; 8]; 2],
    };

    #[inline(always)]
    fn of(contact: &ConeContact) -> Self {
        Self {
            normal: widened(&contact.normal),
            tangents: [0, 1].map(|i| widened(&contact.tangents[i])),
        }
    }

    /// Tangential displacement since the contact stuck, m.
    #[inline(always)]
    fn slip(&self, contact: &ConeContact, y: &Lanes8) -> [f64; 2] {
        let [first, second] = &self.tangents;
        [
            contact.slip[0] + dot(first, y),
            contact.slip[1] + dot(second, y),
        ]
    }

    #[inline(always)]
    fn reaction(&self, contact: &ConeContact, y: &Lanes8, stiffness: f64) -> Reaction {
        let penetration = contact.slack + dot(&self.normal, y);
        let load = (contact.load - stiffness * contact.normal_step * penetration).max(0.0);
        let slip = self.slip(contact, y);
        let rate = stiffness * contact.tangent_step;
        let wished = [
            contact.grip[0] - rate * slip[0],
            contact.grip[1] - rate * slip[1],
        ];
        Reaction {
            load,
            wished,
            length: (wished[0] * wished[0] + wished[1] * wished[1]).sqrt(),
            limit: contact.coefficient * load,
        }
    }

    /// `rest - j lambda`.
    #[inline(always)]
    fn pulled(&self, rest: &Lanes8, reaction: &Reaction) -> Lanes8 {
        let grip = reaction.grip();
        let rest = add_scaled(rest, &self.normal, -reaction.load);
        let rest = add_scaled(&rest, &self.tangents[0], -grip[0]);
        add_scaled(&rest, &self.tangents[1], -grip[1])
    }

    /// Adds `j lambda(y)`, linear about the reaction at `y`, to a system for the next y.
    #[inline(always)]
    fn add_to(
        &self,
        system: &mut System,
        contact: &ConeContact,
        (reaction, y): (&Reaction, &Lanes8),
        stiffness: f64,
    ) {
        let normal_rate = stiffness * contact.normal_step;
        let rate = stiffness * contact.tangent_step;
        let load = contact.load - normal_rate * contact.slack;
        if contact.coefficient <= 0.0 {
            system.add_product(&self.normal, &self.normal, normal_rate, load);
        } else if reaction.sticks() {
            system.add_product(&self.normal, &self.normal, normal_rate, load);
            for (i, tangent) in self.tangents.iter().enumerate() {
                let grip = contact.grip[i] - rate * contact.slip[i];
                system.add_product(tangent, tangent, rate, grip);
            }
        } else {
            // Slipping: the grip follows the load along its direction, and turns across it.
            let [u, v] = [
                reaction.wished[0] / reaction.length,
                reaction.wished[1] / reaction.length,
            ];
            let [first, second] = &self.tangents;
            let mu = contact.coefficient;
            let slipping = add_scaled(&self.normal, first, mu * u);
            let slipping = add_scaled(&slipping, second, mu * v);
            system.add_product(&slipping, &self.normal, normal_rate, load);
            let across = add_scaled(&scaled(second, u), first, -v);
            let turning = rate * reaction.limit / reaction.length;
            system.add_product(&across, &across, turning, turning * dot(&across, y));
        }
    }
}

impl System {
    #[inline(always)]
    fn identity() -> Self {
        let mut rows = [[0.0; 8]; 6];
        for (k, row) in rows.iter_mut().enumerate() {
            row[k] = 1.0;
        }
        Self(rows)
    }

    /// Adds `rate a b^T` to the rows, and `a right` to their right sides.
    #[inline(always)]
    fn add_product(&mut self, a: &Lanes8, b: &Lanes8, rate: f64, right: f64) {
        let mut b = scaled(b, rate);
        b[RIGHT] = right;
        for (row, x) in self.0.iter_mut().zip(a) {
            *row = add_scaled(row, &b, *x);
        }
    }

    /// Gauss-Jordan elimination with the largest of each column; `None` for a singular system, and for NaN.
    #[inline(always)]
    fn solved(self) -> Option<Lanes8> {
        let Self(mut rows) = self;
        for k in 0..6 {
            let mut largest = k;
            for i in k + 1..6 {
                if rows[i][k].abs() > rows[largest][k].abs() {
                    largest = i;
                }
            }
            rows.swap(k, largest);
            let regular = rows[k][k].abs() > 0.0; // false for NaN
            if !regular {
                return None;
            }
            rows[k] = scaled(&rows[k], 1.0 / rows[k][k]);
            let pivot = rows[k];
            for i in (0..6).filter(|i| *i != k) {
                rows[i] = add_scaled(&rows[i], &pivot, -rows[i][k]);
            }
        }
        let mut y = [0.0; 8];
        for (y, row) in y.iter_mut().zip(&rows) {
            *y = row[RIGHT];
        }
        Some(y)
    }
}

#[inline(always)]
fn scaled(a: &Lanes8, by: f64) -> Lanes8 {
    let mut product = *a;
    for x in &mut product {
        *x *= by;
    }
    product
}

/// The search for balance, with the vectors that the processor has.
struct Balance<'a> {
    problem: &'a mut ConeProblem,
    start: &'a Vector6,
    measure: Measure,
}

impl WithSimd for Balance<'_> {
    type Output = Option<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<f64> {
        let contacts = &mut self.problem.contacts;
        let mut rows = [Rows::NONE; MAX_CONE_CONTACTS];
        for (rows, contact) in rows.iter_mut().zip(contacts.iter()) {
            *rows = Rows::of(contact);
        }
        let Measure { scale, no_slip } = self.measure;
        let tolerance = BALANCE_TOLERANCE * scale;
        let mut y = widened(self.start);
        let mut left: Option<f64> = None;
        let mut stiffness = STIFFNESS;
        for _ in 0..MAX_AUGMENTATIONS {
            let found = newton(&rows, contacts, &y, tolerance, stiffness);
            let Some((next, reactions)) = found else {
                stiffness *= SOFTER;
                continue;
            };
            y = next;
            let (mut given, mut slip) = (0.0_f64, 0.0_f64);
            for ((rows, contact), reaction) in rows.iter().zip(&mut *contacts).zip(&reactions) {
                let grip = reaction.grip();
                let load = reaction.load - contact.load;
                let pulls = [0, 1].map(|i| grip[i] - contact.grip[i]);
                let change = scaled(&rows.normal, load);
                let change = add_scaled(&change, &rows.tangents[0], pulls[0]);
                let change = add_scaled(&change, &rows.tangents[1], pulls[1]);
                given = given.max(dot(&change, &change));
                let [u, v] = pulls.map(|pull| pull / contact.tangent_step);
                let sunk = load / contact.normal_step;
                slip = slip.max(sunk * sunk + u * u + v * v);
                contact.load = reaction.load;
                contact.grip = grip;
            }
            left = Some(given.sqrt() / (stiffness * scale));
            if slip.sqrt() <= no_slip * stiffness {
                break;
            }
            stiffness *= STIFFER;
        }
        left
    }
}

/// Newton steps on G from `start`; the contacts that carry load now do so in the first. Where forces balance, and the multipliers there; `None` where they
/// do not to `tolerance` after the last.
#[inline(always)]
fn newton(
    rows: &[Rows; MAX_CONE_CONTACTS],
    contacts: &[ConeContact],
    start: &Lanes8,
    tolerance: f64,
    stiffness: f64,
) -> Option<(Lanes8, [Reaction; MAX_CONE_CONTACTS])> {
    let loaded = contacts.iter().any(|contact| contact.load > 0.0);
    let mut reactions = [Reaction::NONE; MAX_CONE_CONTACTS];
    let mut y = *start;
    for step in 0..=MAX_STEPS {
        let given = loaded && step == 0;
        let before = reactions;
        let mut rest = y;
        for ((rows, contact), reaction) in rows.iter().zip(contacts).zip(&mut reactions) {
            *reaction = rows.reaction(contact, &y, stiffness);
            rest = rows.pulled(&rest, reaction);
        }
        if !given && dot(&rest, &rest).sqrt() <= tolerance {
            return Some((y, reactions));
        }
        if step == MAX_STEPS {
            break;
        }
        let mut system = System::identity();
        let all = rows.iter().zip(contacts).zip(reactions.iter().zip(&before));
        for ((rows, contact), (reaction, before)) in all {
            let mut linear = *reaction;
            if before.wished[0] * linear.wished[0] + before.wished[1] * linear.wished[1] < 0.0 {
                linear.limit = f64::INFINITY;
            }
            if given {
                linear.load = contact.load;
                linear.limit = contact.limit();
            }
            if linear.load > 0.0 {
                rows.add_to(&mut system, contact, (&linear, &y), stiffness);
            }
        }
        y = system.solved()?;
    }
    None
}

impl ConeProblem {
    /// Finds the multipliers, from those in the contacts and a correction `start` that is likely.
    ///
    /// Returns the slip and penetration that are left, relative to the scale; `None` where forces do not balance
    /// by then: the multipliers stay as they were.
    pub(super) fn balance(&mut self, measure: Measure, start: &Vector6) -> Option<f64> {
        Arch::new().dispatch(Balance {
            problem: self,
            start,
            measure,
        })
    }
}
