//! The tables that set the method's [`Settings`]: `[coupling]`, `[limits]`, `[method]`. Each key is declared once, here: type, reader, and the setting
//! that it overrides.

use god_object::{Adaptation, RotationMetric, Settings, SolverKind};
use taut_proto::range::STIFFNESS;

use crate::document::{Range, Section, Value, table};

/// Largest capacity or iteration limit. More is a slip of the keyboard.
const MAX_COUNT: i64 = 1_000_000;

/// Declares a table: `key: type = reader => setting;`. A key without a setting is used elsewhere.
macro_rules! settings_table {
    (
        $(#[$about:meta])*
        pub struct $Table:ident { $( $(#[$what:meta])* pub $key:ident: $kind:ty = $read:expr $(=> $setting:ident)?; )* }
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $Table { $( $(#[$what])* pub $key: Option<$kind>, )* }

        impl $Table {
            /// The table as it is written.
            pub(super) fn read(section: &Section<'_>) -> Self {
                Self { $( $key: ($read)(section, stringify!($key)), )* }
            }

            /// Overrides the settings whose keys are written.
            pub(super) fn apply(&self, settings: &mut Settings) {
                $( $( if let Some(value) = self.$key { settings.$setting = value; } )? )*
            }
        }
    };
}

settings_table! {
    /// `[coupling]`; what is `None` keeps the method's default.
    pub struct CouplingSpec {
        /// The rotational part of the metric.
        pub rotation_metric: RotationMetric = rotation_metric => rotation_metric;
        /// Constraint adaptation; `Some(None)` is `adaptation = false`.
        pub adaptation: Option<Adaptation> = adaptation => adaptation;
        /// Share of the pose difference covered in one update.
        pub k_s: f64 = number(Range::PositiveUpTo(1.0)) => k_s;
        /// Coupling constant, 1/s^2.
        pub k_h: f64 = number(Range::Between(STIFFNESS.least(), STIFFNESS.most())) => k_h;
        /// Damping over stiffness, s.
        pub damping_time: f64 = number(Range::NotNegative) => damping_time;
        /// Contacts before they touch.
        pub look_ahead: bool = Section::boolean => look_ahead;
        /// Bound the energy that the hand takes out.
        pub passive: bool = Section::boolean => passive;
    }
}

impl CouplingSpec {
    /// The same with both gains where one is written: the other is the published one. The stiffness is their product, and a scene from when these were
    /// the defaults must not become twice as stiff.
    pub(super) fn pair(mut self, size: f64) -> Self {
        let published = Settings::paper(size);
        if self.k_s.is_some() != self.k_h.is_some() {
            self.k_s.get_or_insert(published.k_s);
            self.k_h.get_or_insert(published.k_h);
        }
        self
    }
}

settings_table! {
    /// `[limits]`; what is `None` keeps the method's default.
    pub struct LimitSpec {
        /// N.
        pub force: f64 = number(Range::Positive) => force_limit;
        /// N m.
        pub torque: f64 = number(Range::Positive) => torque_limit;
    }
}

settings_table! {
    /// `[method]`: lengths and limits of the method; what is `None` keeps the method's default for the body's size.
    pub struct MethodSpec {
        /// Least play that some fit of the scene leaves the body on each side, m: rest distance and what hangs on it follow.
        pub clearance: f64 = number(Range::Positive);
        /// m.
        pub rest_distance: f64 = number(Range::Positive) => rest_distance;
        /// m.
        pub minimum_gap: f64 = number(Range::Positive) => minimum_gap;
        /// m.
        pub gap_tolerance: f64 = number(Range::Positive) => gap_tolerance;
        /// m.
        pub activation_distance: f64 = number(Range::Positive) => activation_distance;
        /// m.
        pub motion_tolerance: f64 = number(Range::Positive) => motion_tolerance;
        /// Rows in the constraint set.
        pub max_constraints: usize = integer(1, MAX_COUNT) => max_constraints;
        /// Repetitions within one update.
        pub max_substeps: u32 = integer(1, MAX_COUNT) => max_substeps;
        /// Rounds of implicit constraints, 0 to 3.
        pub implicit_rounds: u32 = integer(0, 3) => implicit_rounds;
        /// Evaluations in one collision search.
        pub max_advancement_steps: u32 = integer(1, MAX_COUNT) => max_advancement_steps;
        /// Nominal microseconds of work of one update.
        pub work_budget: Option<u64> = work_budget => work_budget;
        /// Solver of the projections.
        pub solver: SolverKind = solver => solver;
    }
}

fn number(range: Range) -> impl Fn(&Section<'_>, &'static str) -> Option<f64> {
    move |section, key| section.number(key, range)
}

/// A whole number from `low` to `high`.
fn integer<T: TryFrom<i64>>(
    low: i64,
    high: i64,
) -> impl Fn(&Section<'_>, &'static str) -> Option<T> {
    move |section, key| section.integer(key, low, high)
}

fn work_budget(section: &Section<'_>, key: &'static str) -> Option<Option<u64>> {
    section.integer(key, 1, i64::MAX).map(Some)
}

fn rotation_metric(section: &Section<'_>, key: &'static str) -> Option<RotationMetric> {
    match section.get(key).map(|node| &node.value) {
        Some(Value::Text(_)) => section.choice(key, &[("inertia", RotationMetric::Inertia)]),
        _ => section
            .number(key, Range::Positive)
            .map(RotationMetric::RadiusOfGyration),
    }
}

fn adaptation(section: &Section<'_>, key: &'static str) -> Option<Option<Adaptation>> {
    if let Some(Value::Boolean(false)) = section.get(key).map(|node| &node.value) {
        return Some(None);
    }
    let default = Adaptation::default();
    let read = |table: &Section<'_>| Adaptation {
        duration: table.number_or("duration", Range::NotNegative, default.duration),
        threshold: table.number_or("threshold", Range::NotPositive, default.threshold),
    };
    table(section, key, read).map(Some)
}

fn solver(section: &Section<'_>, key: &'static str) -> Option<SolverKind> {
    let solvers = [
        ("active-set", SolverKind::ActiveSet),
        ("clarabel", SolverKind::Clarabel),
    ];
    section.choice(key, &solvers)
}
