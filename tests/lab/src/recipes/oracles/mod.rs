//! Oracles of the projection: rows are given, nothing is detected, and the answer has a closed form.
//!
//! They are run for the solvers, not for the methods: the methods that project share the solver of ours, and rates have no part in it.

pub(super) mod corner;
pub(super) mod flat_on_flat;
pub(super) mod groove;
pub(super) mod many_contacts;
pub(super) mod near_parallel;
pub(super) mod one_contact;

use god_object::quasi_statics::{HalfSpace, Metric, Projection, ProjectionStatus, Projector};
use god_object::spatial::six;
use god_object::{SolverKind, Vector6};
use nalgebra::{Matrix3, Vector3};

use crate::cpu_time::{quantile, thread_us};
use crate::method::Method;
use crate::row::Row;

/// k_h of the recipes, 1/s^2.
pub(super) const K_H: f64 = 2000.0;

/// A solver under test; counts what it does not solve, and takes its times.
pub(super) struct Solver {
    kind: SolverKind,
    projector: Projector,
    pub(super) unsolved: usize,
    times: Vec<f64>,
}

impl Solver {
    fn new(kind: SolverKind) -> Self {
        Self {
            kind,
            projector: Projector::new(kind, 16_384),
            unsolved: 0,
            times: Vec::new(),
        }
    }

    /// The projection of a wish.
    pub(super) fn project(
        &mut self,
        metric: &Metric,
        wish: &Vector6,
        rows: &[HalfSpace],
    ) -> Projection {
        let before = thread_us();
        let answer = self.projector.project(metric, wish, rows, &[]);
        self.times.push(thread_us() - before);
        self.unsolved += usize::from(answer.status != ProjectionStatus::Solved);
        answer
    }

    /// `k_h M (a_c - a_u)`.
    pub(super) fn wrench(
        &mut self,
        metric: &Metric,
        wish: &Vector6,
        rows: &[HalfSpace],
    ) -> Vector6 {
        let answer = self.project(metric, wish, rows);
        metric.mass_matrix_times(&(answer.acceleration - wish)) * K_H
    }

    /// Forgets the times so far.
    pub(super) fn forget_times(&mut self) {
        self.times.clear();
    }

    /// A row of this solver: the active set is that of this project's method.
    pub(super) fn row(&self, recipe: &'static str, case: &str) -> Row {
        let (method, settings) = match self.kind {
            SolverKind::ActiveSet => (Method::Ours.name(), "active set"),
            SolverKind::Clarabel => ("Clarabel", "interior point"),
            SolverKind::ProjectedGaussSeidel => ("projected Gauss-Seidel", "capped iterations"),
        };
        Row {
            settings: settings.to_owned(),
            p99_us: quantile(&self.times, 0.99),
            ..Row::new(recipe, case, method)
        }
    }
}

/// Runs an oracle for every solver, and says of the methods why they are not run.
pub(super) fn for_solvers(recipe: &'static str, run: impl Fn(&mut Solver) -> Vec<Row>) -> Vec<Row> {
    let mut rows = Vec::new();
    for kind in [
        SolverKind::ActiveSet,
        SolverKind::Clarabel,
        SolverKind::ProjectedGaussSeidel,
    ] {
        let mut solver = Solver::new(kind);
        rows.extend(run(&mut solver));
        let case = "all answers certified";
        rows.push(solver.row(recipe, case).never("unsolved", solver.unsolved));
    }
    for method in Method::ALL {
        let reason = match method {
            Method::Ours => continue,
            Method::Penalty => "it projects nothing: its springs add up",
            _ => "it projects with the solver of ours",
        };
        rows.push(Row::new(recipe, "rows given", method.name()).out_of_scope(reason));
    }
    rows
}

/// Of a kilogram, with a small inertia.
pub(super) fn point_metric() -> Metric {
    Metric::new(1.0, &(Matrix3::identity() * 1e-3)).expect("the tensor is positive definite")
}

/// A contact at `arm` from the reference point that already touches.
pub(super) fn contact(arm: &Vector3<f64>, normal: &Vector3<f64>) -> HalfSpace {
    HalfSpace {
        jacobian: six(normal, &arm.cross(normal)),
        bound: 0.0,
    }
}

/// A contact at the reference point.
pub(super) fn plane(x: f64, y: f64, z: f64) -> HalfSpace {
    contact(&Vector3::zeros(), &Vector3::new(x, y, z))
}

/// Numbers that are the same in every run. Source: Knuth's constants of MMIX.
pub(super) struct Random(pub(super) u64);

impl Random {
    /// In [-1, 1).
    pub(super) fn number(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub(super) fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.number())
    }

    pub(super) fn direction(&mut self) -> Vector3<f64> {
        loop {
            let vector = self.vector();
            let length = vector.norm();
            if (0.1..1.0).contains(&length) {
                return vector / length;
            }
        }
    }

    /// A few millimetres and some hundredths of a radian.
    pub(super) fn wish(&mut self) -> Vector6 {
        six(&(self.vector() * 5e-3), &(self.vector() * 0.05))
    }
}
