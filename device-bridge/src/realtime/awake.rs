//! Idle cores that stay awake: between two ticks of 1 kHz a core is idle, and one that sleeps deeply wakes late and cold.
//!
//! A processor that idles saves power in steps; the deeper ones switch caches off and take up to hundreds of microseconds to leave, and a virtual
//! machine's core that idles is given to others by its host. The system keeps all cores out of them for as long as somebody holds
//! [`AWAKE`] open with a latency of 0 us. Idle cores then wait at work: it costs power and heat.
//!
//! Source: Linux, Documentation/power/pm_qos_interface.rst.

use std::fs::{File, OpenOptions};
use std::io::Write;

use super::RealtimeGrant;

/// Whoever holds it open says which latency of idle cores is borne, us, as an `i32`.
pub const AWAKE: &str = "/dev/cpu_dma_latency";

/// Keeps idle cores awake until it is dropped.
#[derive(Debug)]
pub struct Awake {
    _held: File,
}

/// Asks that no core sleeps deeply while the answer is held.
pub fn keep_cores_awake() -> (RealtimeGrant, Option<Awake>) {
    let what = "cores awake while idle".to_owned();
    match open(AWAKE) {
        Ok(awake) => (RealtimeGrant::Granted { what }, Some(awake)),
        Err(error) => {
            let why = format!(
                "{AWAKE} cannot be written ({error}); run as root, or let the user's group write it by a rule of udev"
            );
            (RealtimeGrant::Waived { what, why }, None)
        }
    }
}

fn open(path: &str) -> std::io::Result<Awake> {
    let mut held = OpenOptions::new().write(true).open(path)?;
    held.write_all(&0_i32.to_ne_bytes())?;
    Ok(Awake { _held: held })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_there_is_refused_with_a_reason() {
        assert!(open("/nonexistent/latency").is_err());
    }

    #[test]
    fn what_is_granted_is_held_and_what_is_not_says_why() {
        let (grant, held) = keep_cores_awake();
        assert_eq!(grant.is_granted(), held.is_some());
        assert!(grant.is_granted() || grant.to_string().contains("udev"));
    }
}
