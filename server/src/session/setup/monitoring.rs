//! What the monitor is to do, and where it records: never over a file that is there.

use taut_scene::{Monitoring, free_name, is_taken};

use crate::session::monitor::MonitorSettings;
use crate::session::setup::workbench::Overrides;
use crate::shared::failure::Failure;

pub(super) fn monitor(
    wanted: &Monitoring,
    overrides: &Overrides,
) -> Result<Option<MonitorSettings>, Failure> {
    let serve = wanted.enabled && !overrides.no_monitor;
    if !serve && overrides.record.is_none() {
        return Ok(None);
    }
    let record = match &overrides.record {
        Some(asked) if is_taken(asked) => {
            return Err(Failure::BadInput(format!(
                "{} is there already and is not written over; name another file with --record",
                asked.display()
            )));
        }
        Some(asked) => Some(asked.clone()),
        // Nobody is there to name another file when a service starts again: the session before is what one wants to look at.
        None => wanted.record.as_deref().map(free_name),
    };
    Ok(Some(MonitorSettings {
        bind: wanted.bind,
        grpc_port: wanted.grpc_port,
        web_port: wanted.web_port,
        record,
        memory_limit_bytes: wanted.memory_limit,
        serve,
    }))
}
