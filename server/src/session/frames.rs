//! The barrier of the render nodes' frames, as the workbench file wants it.

use taut_link::proto::barrier::{MasterSettings, Swap};
use taut_scene::{FrameSwap, Frames};

const NANOSECONDS_PER_SECOND: f64 = 1e9;

/// How frames go as the workbench wants it; `None` where each node draws by itself.
pub(super) fn settings(wanted: &Frames) -> Option<MasterSettings> {
    let swap = match wanted.swap {
        FrameSwap::Immediate => Swap::Immediate,
        FrameSwap::Scheduled => Swap::Scheduled,
        FrameSwap::Off => return None,
    };
    Some(MasterSettings {
        swap,
        period_ns: (NANOSECONDS_PER_SECOND / wanted.rate) as u64,
        slowest_ns: (NANOSECONDS_PER_SECOND / wanted.least_rate) as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_a_period() {
        let frames = Frames {
            swap: FrameSwap::Scheduled,
            rate: 50.0,
            least_rate: 20.0,
        };
        let wanted = MasterSettings {
            swap: Swap::Scheduled,
            period_ns: 20_000_000,
            slowest_ns: 50_000_000,
        };
        assert_eq!(settings(&frames), Some(wanted));
        let off = FrameSwap::Off;
        assert_eq!(
            settings(&Frames {
                swap: off,
                ..frames
            }),
            None
        );
    }
}
