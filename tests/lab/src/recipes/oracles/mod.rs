//! Oracles of the projection: rows are given, nothing is detected, and the answer has a closed form.
//!
//! They are run for the solvers, not for the methods: the methods that project share the solver of ours, and rates have no part in it.

pub(super) mod corner;
pub(super) mod flat_on_flat;
mod gauss_seidel;
pub(super) mod groove;
pub(super) mod many_contacts;
pub(super) mod near_parallel;
pub(super) mod one_contact;

use god_object::quasi_statics::{HalfSpace, Metric, ProjectionStatus, Projector, SolverLimits};
use god_object::spatial::six;
use god_object::{SolverKind, Vector6};
use nalgebra::{Matrix3, Vector3};

use crate::cpu_time::{quantile, thread_us};
use crate::method::Method;
use crate::row::Row;

/// k_h of the recipes, 1/s^2.
pub(super) const K_H: f64 = 2000.0;

/// Who solves the projection: the method's solvers, and the one of game engines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SolverName {
    Ours(SolverKind),
    GaussSeidel,
}

impl SolverName {
    /// All of them, as a chart names them.
    pub(crate) const ALL: [(Self, &'static str); 3] = [
        (Self::Ours(SolverKind::ActiveSet), "active set"),
        (Self::Ours(SolverKind::Clarabel), "Clarabel"),
        (Self::GaussSeidel, "projected Gauss-Seidel"),
    ];
}

/// What a solver says.
pub(super) struct Solved {
    pub(super) acceleration: Vector6,
    pub(super) active_rows: usize,
    certified: bool,
}

/// A solver with its memory and limits.
pub(super) struct Projecting {
    /// `None`: projected Gauss-Seidel.
    projector: Option<Projector>,
    limits: SolverLimits,
}

impl Projecting {
    pub(super) fn new(name: SolverName, max_rows: usize, limits: Option<SolverLimits>) -> Self {
        let projector = match name {
            SolverName::Ours(kind) => Some(Projector::new(kind, max_rows)),
            SolverName::GaussSeidel => None,
        };
        Self {
            projector: match limits {
                Some(limits) => projector.map(|projector| projector.with_limits(limits)),
                None => projector,
            },
            limits: limits.unwrap_or(gauss_seidel::LIMITS),
        }
    }

    pub(super) fn project(
        &mut self,
        metric: &Metric,
        wish: &Vector6,
        rows: &[HalfSpace],
    ) -> Solved {
        match &mut self.projector {
            Some(projector) => {
                let answer = projector.project(metric, wish, rows, &[]);
                Solved {
                    acceleration: answer.acceleration,
                    active_rows: answer.active.len(),
                    certified: answer.status == ProjectionStatus::Solved,
                }
            }
            None => {
                let answer = gauss_seidel::relax(metric, wish, rows, self.limits);
                Solved {
                    acceleration: answer.acceleration,
                    active_rows: answer.active.len(),
                    certified: answer.solved,
                }
            }
        }
    }
}

/// A solver under test; counts what it does not solve, and takes its times.
pub(super) struct Solver {
    name: SolverName,
    projecting: Projecting,
    pub(super) unsolved: usize,
    pub(super) times: Vec<f64>,
}

impl Solver {
    fn new(name: SolverName) -> Self {
        Self {
            name,
            projecting: Projecting::new(name, 16_384, None),
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
    ) -> Solved {
        let before = thread_us();
        let answer = self.projecting.project(metric, wish, rows);
        self.times.push(thread_us() - before);
        self.unsolved += usize::from(!answer.certified);
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

    /// A row of this solver: the active set is that of this project's method.
    pub(super) fn row(&self, recipe: &'static str, case: &str) -> Row {
        let (method, settings) = match self.name {
            SolverName::Ours(SolverKind::ActiveSet) => (Method::Ours.name(), "active set"),
            SolverName::Ours(SolverKind::Clarabel) => ("Clarabel", "interior point"),
            SolverName::GaussSeidel => ("projected Gauss-Seidel", "capped iterations"),
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
    for (name, _) in SolverName::ALL {
        let mut solver = Solver::new(name);
        rows.extend(run(&mut solver));
        let case = "all answers certified";
        rows.push(solver.row(recipe, case).never("unsolved", solver.unsolved));
    }
    for method in Method::ALL {
        let reason = match method {
            Method::Ours => continue,
            Method::Penalty | Method::StaticCoupling | Method::LinearisedPenalty => {
                "it projects nothing: its springs add up"
            }
            Method::TwoRateLcp => "it solves its own complementarity problem",
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
