//! Polynomials with integer coefficients, and exact signs at their real roots.
//!
//! | symbol | name in code | meaning                                                    |
//! |--------|--------------|------------------------------------------------------------|
//! | p, q   | [`Polynomial`] | coefficients by ascending power; no trailing zeros       |
//! | t      | [`Dyadic`]   | `numerator / 2^exponent`                                   |
//! | α      | [`Root`]     | the only root of a square-free p in the half-open (lo, hi] |
//!
//! Roots are counted by Sturm's theorem; no step rounds.

use num_bigint::{BigInt, Sign};
use num_integer::Integer;

#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Polynomial(Vec<BigInt>);

/// `numerator / 2^exponent`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Dyadic {
    numerator: BigInt,
    exponent: u64,
}

/// The only root of `chain[0]` in (lo, hi].
#[derive(Clone, Debug)]
pub(crate) struct Root {
    chain: Vec<Polynomial>,
    lo: Dyadic,
    hi: Dyadic,
}

impl Polynomial {
    pub(crate) fn new(mut coefficients: Vec<BigInt>) -> Self {
        while coefficients.last().is_some_and(is_zero) {
            coefficients.pop();
        }
        Self(coefficients)
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.0.is_empty()
    }

    fn degree(&self) -> usize {
        self.0.len().saturating_sub(1)
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        let zero = BigInt::default();
        let terms = self.0.len().max(other.0.len());
        let at = |p: &Self, k: usize| p.0.get(k).unwrap_or(&zero).clone();
        Self::new((0..terms).map(|k| at(self, k) + at(other, k)).collect())
    }

    pub(crate) fn minus(&self, other: &Self) -> Self {
        self.plus(&Self(other.0.iter().map(|c| -c).collect()))
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::default();
        }
        let mut product = vec![BigInt::default(); self.0.len() + other.0.len() - 1];
        for (i, a) in self.0.iter().enumerate() {
            for (j, b) in other.0.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        Self::new(product)
    }

    /// The sign at `t`: -1, 0 or 1.
    pub(crate) fn sign_at(&self, t: &Dyadic) -> i32 {
        // Horner, everything times 2^(exponent * degree).
        let mut value = BigInt::default();
        let mut shift = 0_u64;
        for coefficient in self.0.iter().rev() {
            value = value * &t.numerator + (coefficient << shift);
            shift += t.exponent;
        }
        match value.sign() {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }

    fn derivative(&self) -> Self {
        let terms = self.0.iter().enumerate().skip(1);
        Self::new(terms.map(|(k, c)| c * BigInt::from(k)).collect())
    }

    /// The same over the greatest common divisor of its coefficients.
    fn primitive(self) -> Self {
        let mut content = BigInt::default();
        for c in &self.0 {
            content = content.gcd(c);
        }
        if is_zero(&content) {
            return self;
        }
        Self(self.0.into_iter().map(|c| c / &content).collect())
    }

    /// Quotient and remainder of `self`, times an even power of the divisor's leading coefficient, by `divisor`.
    fn divided_by(&self, divisor: &Self) -> (Self, Self) {
        let leading = &divisor.0[divisor.degree()];
        let square = leading * leading;
        let mut rest = self.clone();
        let mut quotient = Self::default();
        while !rest.is_zero() && rest.degree() >= divisor.degree() {
            let shift = rest.degree() - divisor.degree();
            let mut term = vec![BigInt::default(); shift + 1];
            term[shift] = &rest.0[rest.degree()] * leading;
            let term = Self(term);
            let scale = |p: &Self| Self::new(p.0.iter().map(|c| c * &square).collect());
            quotient = scale(&quotient).plus(&term);
            rest = scale(&rest).minus(&term.times(divisor));
        }
        (quotient, rest)
    }

    fn common_divisor(&self, other: &Self) -> Self {
        let (mut a, mut b) = (self.clone(), other.clone());
        while !b.is_zero() {
            let rest = a.divided_by(&b).1.primitive();
            (a, b) = (b, rest);
        }
        a
    }

    /// Sturm's chain of the square-free part. Not for zero.
    fn sturm_chain(&self) -> Vec<Self> {
        let derivative = self.derivative();
        let repeated = self.common_divisor(&derivative);
        let square_free = if repeated.degree() == 0 {
            self.clone()
        } else {
            self.divided_by(&repeated).0.primitive()
        };
        let mut chain = vec![square_free.clone().primitive(), square_free.derivative()];
        while !chain[chain.len() - 1].is_zero() {
            let [.., a, b] = chain.as_slice() else { break };
            let rest = a.divided_by(b).1.primitive();
            chain.push(Self::default().minus(&rest));
        }
        chain.pop();
        chain
    }

    /// The roots in (0, 1], each isolated. Not for zero.
    pub(crate) fn roots(&self) -> Vec<Root> {
        let chain = self.sturm_chain();
        let mut found = Vec::new();
        let mut open = vec![(Dyadic::whole(0), Dyadic::whole(1))];
        while let Some((lo, hi)) = open.pop() {
            match count(&chain, &lo, &hi) {
                0 => {}
                1 => found.push(Root {
                    chain: chain.clone(),
                    lo,
                    hi,
                }),
                _ => {
                    let middle = lo.middle(&hi);
                    open.push((lo, middle.clone()));
                    open.push((middle, hi));
                }
            }
        }
        found
    }
}

impl Root {
    /// Halves the interval.
    fn refine(&mut self) {
        let middle = self.lo.middle(&self.hi);
        if count(&self.chain, &self.lo, &middle) == 1 {
            self.hi = middle;
        } else {
            self.lo = middle;
        }
    }

    /// The sign of `q` at the root.
    pub(crate) fn sign_of(&mut self, q: &Polynomial) -> i32 {
        if q.is_zero() {
            return 0;
        }
        let common = self.chain[0].common_divisor(q);
        if common.degree() > 0 && count(&common.sturm_chain(), &self.lo, &self.hi) > 0 {
            return 0;
        }
        // Not a root of q: an interval without roots of q tells the sign.
        let chain = q.sturm_chain();
        while count(&chain, &self.lo, &self.hi) > 0 {
            self.refine();
        }
        q.sign_at(&self.hi)
    }

    /// Bounds of the root, 2^-60 apart or less.
    pub(crate) fn bounds(&mut self) -> [f64; 2] {
        while self.lo.exponent.max(self.hi.exponent) < 60 {
            self.refine();
        }
        [self.lo.value(), self.hi.value()]
    }
}

impl Dyadic {
    pub(crate) fn whole(n: i64) -> Self {
        Self {
            numerator: n.into(),
            exponent: 0,
        }
    }

    fn middle(&self, other: &Self) -> Self {
        let exponent = self.exponent.max(other.exponent);
        let at = |d: &Self| &d.numerator << (exponent - d.exponent);
        Self {
            numerator: at(self) + at(other),
            exponent: exponent + 1,
        }
    }

    /// To the nearest double: a fraction of [0, 1] with at most some hundred bits.
    fn value(&self) -> f64 {
        let surplus = self.numerator.bits().saturating_sub(62);
        let digits: i64 = (&self.numerator >> surplus).try_into().unwrap_or(i64::MAX);
        digits as f64 * 2.0_f64.powi(surplus as i32 - self.exponent as i32)
    }
}

fn is_zero(n: &BigInt) -> bool {
    n.sign() == Sign::NoSign
}

/// Distinct roots of `chain[0]` in (lo, hi].
fn count(chain: &[Polynomial], lo: &Dyadic, hi: &Dyadic) -> usize {
    let changes = |t: &Dyadic| {
        let signs: Vec<i32> = chain
            .iter()
            .map(|p| p.sign_at(t))
            .filter(|sign| *sign != 0)
            .collect();
        signs.windows(2).filter(|two| two[0] != two[1]).count()
    };
    changes(lo).saturating_sub(changes(hi))
}
