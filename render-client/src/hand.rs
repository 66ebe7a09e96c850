//! The hand that the mouse is: a device bridge of its own, in a thread of this process.
//!
//! The window names targets; the bridge's device loop leads the body there at 1 kHz and sends its poses to the
//! server, as any other device does ([`taut_bridge::run_device`]). The window never waits for it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use nalgebra::Isometry3;
use taut_bridge::{BridgeArgs, LedDevice, Target, run_device};

use crate::cli::RenderArgs;
use crate::error::RenderError;
use crate::hold::Hold;
use crate::stage::Stage;

/// The window's end. Dropping it leaves the server.
pub(crate) struct Hand {
    pub(crate) hold: Hold,
    targets: triple_buffer::Input<Target>,
    stop: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Hand {
    /// Joins the server of `args` once more, as its device.
    pub(crate) fn join(args: &RenderArgs, stage: &Stage) -> Result<Self, RenderError> {
        let system = |reason: String| RenderError::System {
            what: "hand of the mouse",
            reason,
        };
        let node = format!("{}-mouse", args.node);
        let mut bridge = BridgeArgs::joining(&args.server, &node)
            .ok_or_else(|| system(format!("{} is no address", args.server)))?;
        bridge.key = Some(args.key.clone());
        bridge.transport = args.transport.into();
        bridge.priority = 0; // the picture shares this process
        bridge.stay = args.membership.stay;
        bridge.give_up = args.membership.give_up;
        let hold = Hold::new(stage);
        let first = target(hold.target(), 0);
        let (targets, output) = triple_buffer::TripleBuffer::new(&first).split();
        let stop = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&stop);
        let thread = thread::Builder::new()
            .name("taut-hand".to_owned())
            .spawn(move || {
                let make = |placement| Box::new(LedDevice::new("mouse", output, placement)) as _;
                match run_device(&bridge, asked, make) {
                    Ok(report) => tracing::debug!("{report}"),
                    Err(error) => tracing::error!("the mouse holds nothing: {error}"),
                }
            })
            .map_err(|error| system(error.to_string()))?;
        Ok(Self {
            hold,
            targets,
            stop,
            thread: Some(thread),
        })
    }

    /// Leads the body to where it is held now.
    pub(crate) fn lead(&mut self, buttons: u16) {
        self.targets.write(target(self.hold.target(), buttons));
    }
}

impl Drop for Hand {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // If it broke down, it has said so.
            let _ = thread.join();
        }
    }
}

fn target(pose: &Isometry3<f64>, buttons: u16) -> Target {
    Target {
        pose: *pose,
        buttons,
    }
}
