//! The counters of all threads in one place, for status line, monitor and end report.

use std::sync::Arc;

use crate::loops::checker::CheckCounts;
use crate::loops::coupling::CouplingStatistics;
use crate::loops::god_object::GodObjectStatistics;
use crate::loops::haptics::HapticsStatistics;
use taut_bridge::ExternalWrenchStatistics;

/// Handles on what each thread counts. Clones read the same counters.
#[derive(Clone, Debug, Default)]
pub struct Statistics {
    /// Loop 3.
    pub haptics: Arc<HapticsStatistics>,
    /// Loop 2.
    pub coupling: Arc<CouplingStatistics>,
    /// Loop 1.
    pub god_object: Arc<GodObjectStatistics>,
    /// The checker.
    pub checks: Arc<CheckCounts>,
    /// A force from outside; `None` where the workbench takes none.
    pub external: Option<Arc<ExternalWrenchStatistics>>,
}
