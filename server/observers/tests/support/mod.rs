//! A workbench that moves: states on a thread of its own, 500 a second.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use taut_observers::{StateFeed, StateOutlet, state_channel};
use taut_proto::HotState;
use taut_proto::state::{EventRecord, MAX_EVENTS, RunState, ToolState, event_code};

/// Longest that any test waits for anything: far above what a loaded machine needs.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// Publishes states until it is dropped; x of the god-object is the tick in millimetres, of the device in metres.
pub(crate) struct Workbench {
    stop: Arc<AtomicBool>,
    ticks: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Workbench {
    pub(crate) fn start() -> (Self, StateFeed) {
        let (outlet, feed) = state_channel();
        let stop = Arc::new(AtomicBool::new(false));
        let ticks = Arc::new(AtomicU64::new(0));
        let (stopped, count) = (stop.clone(), ticks.clone());
        let thread = std::thread::Builder::new()
            .name("workbench".into())
            .spawn(move || run(outlet, &stopped, &count))
            .expect("a thread");
        let workbench = Self {
            stop,
            ticks,
            thread: Some(thread),
        };
        (workbench, feed)
    }

    /// States published so far.
    #[allow(dead_code, reason = "not every test looks at it")]
    pub(crate) fn ticks(&self) -> u64 {
        self.ticks.load(Ordering::Relaxed)
    }
}

impl Drop for Workbench {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(mut outlet: StateOutlet, stopped: &AtomicBool, count: &AtomicU64) {
    let mut state = HotState::empty();
    state.run = RunState::Running;
    state.scene_revision = 1;
    state.tools.push(ToolState::default());
    let mut tick = 0_u32;
    while !stopped.load(Ordering::Relaxed) {
        tick += 1;
        state.tick = u64::from(tick);
        state.sample_time_ns = u64::from(tick) * 2_000_000;
        let tool = &mut state.tools[0];
        tool.god_object.position = [tick as f32 * 1e-3, 0.0, 0.0];
        tool.device.position = [tick as f32, 0.0, 0.0];
        tool.force = [0.0, 0.0, 2.5];
        // A button goes down and up each second, with its event.
        let buttons = u16::from(tick / 250 % 2 == 1) << 2;
        if buttons != tool.buttons {
            let code = if buttons == 0 {
                event_code::BUTTON_UP
            } else {
                event_code::BUTTON_DOWN
            };
            tool.buttons = buttons;
            let id = state.events.last().map_or(1, |event| event.id + 1);
            if state.events.len() == MAX_EVENTS {
                state.events.remove(0);
            }
            state.events.push(EventRecord {
                id,
                tick,
                code: code | 2 << event_code::VALUE_SHIFT,
            });
        }
        outlet.publish(&state);
        count.store(u64::from(tick), Ordering::Relaxed);
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Looks until `found` has something.
pub(crate) fn wait_for<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(Instant::now() < end, "{what}: not within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}
