//! A node that draws: takes part in the barrier, "draws" for 3 to 7 ms per frame, joins again when its server is gone, and notes every swap.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use taut_link::{
    ClientLink, ClientOptions, FrameTurn, LinkError, RejoinPolicy, Renewal, SupervisedLink,
};
use tokio::runtime::Runtime;

use super::BenchError;
use super::threads::joined;

/// Drawing time: shortest and longest, us.
const DRAW_US: (u64, u64) = (3000, 7000);
/// Time between two looks while there is no barrier.
const FREE: Duration = Duration::from_millis(1);

/// One frame as a node showed it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swapped {
    /// Its number.
    pub frame: u64,
    /// When its swap was called.
    pub at: Instant,
    /// Sample time of its state: session time, ns.
    pub sample_ns: u64,
    /// Fingerprint of its state.
    pub state_hash: u64,
    /// Sessions that the node had had then, the first included.
    pub sessions: u64,
}

/// How far a node is.
#[derive(Default)]
struct Progress {
    stop: AtomicBool,
    /// Sessions that it has taken over.
    sessions: AtomicU64,
    /// Number of the one that it has.
    session: AtomicU64,
    /// Number of the newest frame.
    frame: AtomicU64,
    /// Frames that it has shown.
    shown: AtomicU64,
}

/// The node; ends when dropped.
pub struct Screen {
    progress: Arc<Progress>,
    link: Arc<ClientLink>,
    thread: Option<JoinHandle<Vec<Swapped>>>,
}

impl Screen {
    /// Joins on `runtime`, and draws in a thread of its own; `seed` decides how long.
    pub fn start(
        runtime: &Runtime,
        options: ClientOptions,
        seed: u64,
    ) -> Result<Screen, BenchError> {
        let name = options.node.clone();
        let prepare = |_: Arc<ClientLink>| async { Ok::<(), LinkError>(()) };
        let joined = SupervisedLink::join(options, RejoinPolicy::default(), prepare);
        let (supervised, link, ()) = runtime.block_on(joined)?;
        let progress = Arc::new(Progress {
            sessions: AtomicU64::new(1),
            session: AtomicU64::new(link.session().into()),
            ..Progress::default()
        });
        let mut drawing = Drawing {
            supervised,
            link: link.clone(),
            random: seed,
            progress: progress.clone(),
        };
        let thread = std::thread::Builder::new()
            .name(name)
            .spawn(move || drawing.run())?;
        Ok(Screen {
            progress,
            link,
            thread: Some(thread),
        })
    }

    /// Its first session.
    pub fn link(&self) -> &ClientLink {
        &self.link
    }

    /// Sessions that it has taken over, the first included.
    pub fn sessions(&self) -> u64 {
        self.progress.sessions.load(Ordering::Relaxed)
    }

    /// Number of the session that it has: of nodes without a server the lowest leads.
    pub fn session(&self) -> u64 {
        self.progress.session.load(Ordering::Relaxed)
    }

    /// Number of the newest frame that it showed.
    pub fn frame(&self) -> u64 {
        self.progress.frame.load(Ordering::Relaxed)
    }

    /// How many frames it has shown.
    pub fn shown(&self) -> u64 {
        self.progress.shown.load(Ordering::Relaxed)
    }

    /// Ends it without a word to anybody; what it showed.
    pub fn end(mut self) -> Result<Vec<Swapped>, BenchError> {
        self.progress.stop.store(true, Ordering::Relaxed);
        let thread = self.thread.take();
        joined(thread.ok_or_else(|| BenchError::missing("the node has ended"))?)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.progress.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // it was given up already
        }
    }
}

struct Drawing {
    supervised: SupervisedLink<()>,
    link: Arc<ClientLink>,
    random: u64,
    progress: Arc<Progress>,
}

impl Drawing {
    fn run(&mut self) -> Vec<Swapped> {
        let mut shown = Vec::with_capacity(1 << 16);
        let mut gate = self.link.frame_gate(Duration::ZERO);
        let progress = self.progress.clone();
        while !progress.stop.load(Ordering::Relaxed) {
            match self.supervised.take_renewal() {
                Some(Renewal::Session { link, .. }) => {
                    self.link = link;
                    gate = self.link.frame_gate(Duration::ZERO);
                    let number = self.link.session();
                    progress.session.store(number.into(), Ordering::Relaxed);
                    progress.sessions.fetch_add(1, Ordering::Relaxed);
                }
                Some(Renewal::Ended(_)) => break,
                None => {}
            }
            let FrameTurn::Draw(released) = gate.turn() else {
                std::thread::sleep(FREE);
                continue;
            };
            std::thread::sleep(Duration::from_micros(self.draws_us()));
            gate.arrive();
            if gate.wait().is_some() {
                let at = Instant::now();
                gate.swapped(at);
                progress.frame.store(released.frame, Ordering::Relaxed);
                progress.shown.fetch_add(1, Ordering::Relaxed);
                shown.push(Swapped {
                    frame: released.frame,
                    at,
                    sample_ns: released.state.sample_time_ns,
                    state_hash: released.state_hash,
                    sessions: progress.sessions.load(Ordering::Relaxed),
                });
            }
        }
        shown
    }

    fn draws_us(&mut self) -> u64 {
        self.random = self
            .random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        DRAW_US.0 + (self.random >> 33) % (DRAW_US.1 - DRAW_US.0)
    }
}

/// Frames that all of `nodes` showed.
#[derive(Clone, Debug, Default)]
pub struct Together {
    /// Last swap call less first of each, us.
    pub skew_us: Vec<f64>,
    /// Frames of which two nodes drew different states: must be 0.
    pub different: u64,
}

/// What the nodes showed together, of frames for which `counts`.
pub fn together(nodes: &[Vec<Swapped>], counts: impl Fn(&Swapped) -> bool) -> Together {
    // A frame of one term has one number and one count of sessions.
    let mut frames: HashMap<(u64, u64), Vec<&Swapped>> = HashMap::new();
    for swapped in nodes.iter().flatten().filter(|swapped| counts(swapped)) {
        let key = (swapped.sessions, swapped.frame);
        frames.entry(key).or_default().push(swapped);
    }
    let mut found = Together::default();
    for swaps in frames.values() {
        let hash = swaps[0].state_hash;
        found.different += u64::from(swaps.iter().any(|swap| swap.state_hash != hash));
        let times = || swaps.iter().map(|swap| swap.at);
        if swaps.len() == nodes.len()
            && let Some((last, first)) = times().max().zip(times().min())
        {
            found.skew_us.push((last - first).as_secs_f64() * 1e6);
        }
    }
    found
}

/// Longest time between two swaps of one node between two moments, ms: the moments themselves count as none.
pub fn longest_gap_ms(shown: &[Swapped], from: Instant, to: Instant) -> f64 {
    let ends_within = |pair: &&[Swapped]| pair[1].at > from && pair[0].at < to;
    let gaps = shown.windows(2).filter(ends_within);
    let longest = gaps.map(|pair| pair[1].at - pair[0].at).max();
    longest.map_or(f64::NAN, |gap| gap.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swapped(start: Instant, frame: u64, ms: u64, state_hash: u64) -> Swapped {
        Swapped {
            frame,
            at: start + Duration::from_millis(ms),
            sample_ns: 0,
            state_hash,
            sessions: 1,
        }
    }

    #[test]
    fn frames_that_only_some_showed_have_no_skew_and_different_states_are_found() {
        let start = Instant::now();
        let one = vec![
            swapped(start, 1, 10, 7),
            swapped(start, 2, 20, 8),
            swapped(start, 3, 30, 9),
        ];
        let other = vec![swapped(start, 1, 12, 7), swapped(start, 3, 30, 5)];
        let found = together(&[one, other], |_| true);
        let mut skews = found.skew_us;
        skews.sort_by(f64::total_cmp);
        assert_eq!(skews.len(), 2);
        assert!(skews[0] < 1e-6 && (skews[1] - 2000.0).abs() < 1e-6);
        assert_eq!(found.different, 1);
    }

    #[test]
    fn a_gap_counts_where_it_reaches_into_the_time() {
        let start = Instant::now();
        let shown: Vec<_> = [0, 10, 110, 120, 500]
            .into_iter()
            .zip(1..)
            .map(|(ms, frame)| swapped(start, frame, ms, 0))
            .collect();
        let at = |ms| start + Duration::from_millis(ms);
        assert!((longest_gap_ms(&shown, at(50), at(115)) - 100.0).abs() < 1e-9);
        assert!((longest_gap_ms(&shown, at(50), at(130)) - 380.0).abs() < 1e-9);
        assert!(longest_gap_ms(&shown, at(600), at(700)).is_nan());
    }
}
