//! The end reports of `taut replay`.

use std::fmt;

use serde::{Deserialize, Serialize};
use taut_link::Distribution;

use crate::loops::fidelity::FidelityReport;

/// What `taut replay` measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReplayReport {
    /// Rows of the trace.
    pub steps: u64,
    /// Thread CPU time of one god-object update.
    pub update_us: Distribution,
    /// Thread CPU time of one force.
    pub force_us: Distribution,
    /// Rows in the constraint set, over the rows of the trace.
    pub contacts: Distribution,
    /// Rows in the active set of the force's projection, over the rows of the trace.
    pub active: Distribution,
    /// Smallest distance between the bodies, m; `null` when they never came near.
    pub gap_min_m: Option<f64>,
    /// Largest relative KKT residual of a projection.
    pub kkt_max: f64,
    /// Projections that the chosen solver did not certify and another one answered.
    pub solver_fallbacks: u64,
    /// Energy given to the hand beyond what it had put in, J; obstacles that move may truly give some.
    pub energy_injected_j: f64,
    /// Net work that obstacles that move did on the hand, J; negative where they gave way under it.
    pub energy_from_obstacles_j: f64,
    /// Energy given to the hand beyond what it and the obstacles had put in, J: the coupling made it.
    pub energy_generated_j: f64,
    /// Updates in which an obstacle did not get to where its trace is, because the body was squeezed or the budget spent.
    pub obstacle_blocked_updates: u64,
    /// Updates in which something stopped the body that gives no force: a surface that is inside out.
    #[serde(default)]
    pub stops_without_force: u64,
    /// Largest change of the force from one row to the next, N.
    pub max_force_step_n: f64,
    /// Largest force, N.
    pub max_force_n: f64,
    /// What the god-object loop did, counted.
    pub work: WorkReport,
    /// The fidelity that the scene chose for itself, and how it held; `null` where it does not choose.
    pub fidelity: Option<FidelityReport>,
}

/// What came of computing a recorded session again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordedReport {
    /// Name of the scene.
    pub scene: String,
    /// The session came to its end and nothing of it was lost.
    pub complete: bool,
    /// God-object updates computed again.
    pub updates: u64,
    /// Forces computed again.
    pub forces: u64,
    /// Updates whose pose, gap or number of rows is not the same bit by bit.
    pub different_updates: u64,
    /// Forces that are not the same bit by bit.
    pub different_forces: u64,
    /// What differed first.
    pub first_difference: Option<String>,
    /// What is missing first of a recording that is not whole; nothing behind it was computed.
    pub gap: Option<String>,
    /// Thread CPU time of one god-object update, here and now.
    pub update_us: Distribution,
    /// Thread CPU time of one force, here and now.
    pub force_us: Distribution,
}

/// Counts of the god-object loop's work: the same on every machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkReport {
    /// Pairs of boxes tested.
    pub node_pairs: u64,
    /// Pairs of triangles reached.
    pub triangle_pairs: u64,
    /// Pairs of vertex and face or of two edges examined.
    pub feature_pairs: u64,
    /// Steps of conservative advancement.
    pub advancement_steps: u64,
    /// Projections solved.
    pub projections: u64,
}

impl fmt::Display for RecordedReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = if self.complete { "" } else { " (not whole)" };
        writeln!(f, "scene               {}{whole}", self.scene)?;
        writeln!(
            f,
            "updates             {}, {} differ",
            self.updates, self.different_updates
        )?;
        writeln!(
            f,
            "forces              {}, {} differ",
            self.forces, self.different_forces
        )?;
        f.write_str(&said_of_times(&self.update_us, &self.force_us))?;
        if let Some(difference) = &self.first_difference {
            write!(f, "\nfirst difference    {difference}")?;
        }
        match &self.gap {
            Some(gap) => write!(f, "\nnot computed        from here on: {gap}"),
            None => Ok(()),
        }
    }
}

impl fmt::Display for ReplayReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "rows                {}", self.steps)?;
        writeln!(f, "{}", said_of_times(&self.update_us, &self.force_us))?;
        writeln!(
            f,
            "contacts            p50 {:.0}, max {:.0}; active max {:.0}",
            self.contacts.p50, self.contacts.max, self.active.max
        )?;
        write_obstacles(
            f,
            self.energy_from_obstacles_j,
            self.energy_generated_j,
            self.obstacle_blocked_updates,
        )?;
        if let Some(fidelity) = &self.fidelity {
            writeln!(f, "fidelity            {fidelity}")?;
        }
        match self.gap_min_m {
            Some(gap) => writeln!(f, "smallest gap        {gap:.3e} m")?,
            None => writeln!(f, "smallest gap        never near")?,
        }
        if let Some(stops) = said_of_stops(self.stops_without_force) {
            writeln!(f, "look at this        {stops}")?;
        }
        writeln!(
            f,
            "largest force       {:.2} N, largest change per row {:.3} N",
            self.max_force_n, self.max_force_step_n
        )?;
        write!(
            f,
            "KKT residual        {:.1e}, {} solver fallbacks; energy injected {:.2e} J",
            self.kkt_max, self.solver_fallbacks, self.energy_injected_j
        )
    }
}

/// Times of one update and of one force, in two lines.
fn said_of_times(update_us: &Distribution, force_us: &Distribution) -> String {
    let said = |us: &Distribution| {
        format!(
            "p50 {:.1} us, p99 {:.1} us, max {:.1} us",
            us.p50, us.p99, us.max
        )
    };
    let (update, force) = (said(update_us), said(force_us));
    format!("god-object update   {update}\nforce               {force}")
}

/// What updates say in which something stopped the body that gives no force, if there are any.
pub(crate) fn said_of_stops(updates: u64) -> Option<String> {
    (updates > 0).then(|| {
        format!(
            "in {updates} updates the body was stopped by a surface that gives no force (one that runs through itself or is inside out? `taut check` names it)"
        )
    })
}

/// A line on moving obstacles, where some did work or were held up.
pub(super) fn write_obstacles(
    f: &mut fmt::Formatter<'_>,
    work: f64,
    generated: f64,
    blocked: u64,
) -> fmt::Result {
    if work == 0.0 && blocked == 0 {
        return Ok(());
    }
    writeln!(
        f,
        "moving obstacles    gave the hand {work:.2e} J, held up in {blocked} updates; the coupling itself made {generated:.2e} J"
    )
}
