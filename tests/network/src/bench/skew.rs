//! How far apart nodes call their swaps, how old their states are then, and whether they are the same: real sessions on loopback, by threads of one
//! process, so that one clock sees all of them.
//!
//! Beside it stands a control of the same run: as many threads that wait for one bare UDP datagram each, sent one right after the other by one
//! thread, at the same rate. What this machine's scheduler does to them it does to everybody.

use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use taut_link::{ClusterKey, Role, ServerLink, ServerOptions, serve};
use taut_proto::barrier::{MasterSettings, Swap};

use super::screen::{Screen, Swapped, together};
use super::state_stream::StateStream;
use super::threads::{joined, on_own_thread, runtime};
use super::{
    BenchError, Quantiles, Ticker, client_options, keep_cores_awake, request_fifo, small_content,
};

/// Frames at the start do not count: clocks lock, nodes fall in step.
const WARM_UP: Duration = Duration::from_secs(2);
/// Longest that the control runs.
const CONTROL: Duration = Duration::from_secs(5);
/// Real-time priority of all threads of the run, where the system grants it.
const PRIORITY: u8 = 60;

/// What is run.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Nodes.
    pub nodes: u64,
    /// Frames per second.
    pub rate: u64,
    /// When frames are swapped.
    pub swap: Swap,
    /// Time that counts.
    pub duration: Duration,
}

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Skew {
    /// Whether the run was of the real-time class.
    pub fifo: bool,
    /// Whether idle processors were kept awake.
    pub awake: bool,
    /// Last swap call of a frame less first, us.
    pub skew_us: Quantiles,
    /// The same of the control.
    pub control_us: Quantiles,
    /// Age of the state at the swap call, ms.
    pub age_ms: Quantiles,
    /// From the moment at which a frame could be shown to the last swap call, as the server reports it, us: p50, p99.
    pub overhead_us: (f64, f64),
    /// Frames released without a node that was waited for.
    pub lapses: u64,
    /// Drawn states that the server compared with the released one.
    pub compared: u64,
    /// Of these, and of the frames compared here, other ones: must be 0.
    pub different: u64,
}

/// What came of several runs of one plan, one after the other.
#[derive(Clone, Debug)]
pub struct Turns(pub Vec<Skew>);

/// One figure over turns.
#[derive(Clone, Debug, PartialEq)]
pub struct OverTurns {
    /// The median of the turns' figures: of an even number, the larger of the two in the middle.
    pub median: f64,
    /// The largest.
    pub worst: f64,
    /// Each turn's, in order.
    pub each: Vec<f64>,
}

impl Turns {
    /// A figure of each turn. NaN, a turn without frames, is the largest of all.
    pub fn over(&self, figure: impl Fn(&Skew) -> f64) -> OverTurns {
        OverTurns::of(self.0.iter().map(figure).collect())
    }

    /// The sum of a count.
    pub fn sum(&self, count: impl Fn(&Skew) -> u64) -> u64 {
        self.0.iter().map(count).sum()
    }
}

impl OverTurns {
    /// Of each turn's figure.
    pub fn of(each: Vec<f64>) -> OverTurns {
        let mut sorted = each.clone();
        sorted.sort_by(f64::total_cmp);
        OverTurns {
            median: sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN),
            worst: sorted.last().copied().unwrap_or(f64::NAN),
            each,
        }
    }
}

/// Runs a plan so many times.
pub fn measure_turns(plan: Plan, turns: usize) -> Result<Turns, BenchError> {
    let runs: Result<Vec<_>, _> = (0..turns).map(|_| measure(plan)).collect();
    Ok(Turns(runs?))
}

/// Runs it.
pub fn measure(plan: Plan) -> Result<Skew, BenchError> {
    on_own_thread("skew", || measure_here(plan, request_fifo(PRIORITY)))
}

fn measure_here(plan: Plan, fifo: bool) -> Result<Skew, BenchError> {
    let awake = keep_cores_awake();
    let runtime = runtime(2)?;
    let key = ClusterKey::generate()?;
    let options = ServerOptions {
        frames: Some(settings(plan.swap, plan.rate)),
        ..ServerOptions::loopback(key.clone())
    };
    let server = runtime.block_on(serve(options, small_content()))?;
    let clock = server.clock();
    let leading = Leading::start(&server)?;
    let mut screens = Vec::new();
    for number in 0..plan.nodes {
        let options = client_options(&server, &key, Role::Render, &format!("node{number}"));
        screens.push(Screen::start(&runtime, options, number)?);
    }
    std::thread::sleep(WARM_UP);
    let begin = Instant::now();
    std::thread::sleep(plan.duration);
    let report = server
        .frame_report()
        .ok_or_else(|| BenchError::missing("nobody leads"))?;
    let shown: Vec<_> = screens
        .into_iter()
        .map(Screen::end)
        .collect::<Result<_, _>>()?;
    leading.end()?;
    runtime.block_on(server.shutdown());

    let counts = |swapped: &Swapped| swapped.at >= begin;
    let found = together(&shown, counts);
    let age =
        |swapped: &Swapped| clock.at(swapped.at).saturating_sub(swapped.sample_ns) as f64 * 1e-6;
    let ages = shown.iter().flatten().filter(|swapped| counts(swapped));
    Ok(Skew {
        fifo,
        awake: awake.is_some(),
        skew_us: Quantiles::of(found.skew_us),
        control_us: Quantiles::of(control(plan)?),
        age_ms: Quantiles::of(ages.map(age).collect()),
        overhead_us: (report.overhead.p50, report.overhead.p99),
        lapses: report.counts.lapses,
        compared: report.counts.compared,
        different: found.different + report.counts.mismatches,
    })
}

/// Frames of this rate.
pub fn settings(swap: Swap, rate: u64) -> MasterSettings {
    MasterSettings {
        swap,
        period_ns: 1_000_000_000 / rate,
        slowest_ns: 100_000_000,
    }
}

/// A server's stream of states, and its thread that leads frames.
pub struct Leading {
    states: StateStream,
    stop: Arc<AtomicBool>,
    frames: std::thread::JoinHandle<()>,
}

impl Leading {
    /// Starts them.
    pub fn start(server: &ServerLink) -> Result<Leading, BenchError> {
        let mut master = server
            .frame_master()
            .ok_or_else(|| BenchError::missing("the server leads no frames"))?;
        let stop = Arc::new(AtomicBool::new(false));
        let over = stop.clone();
        let states = StateStream::start(server)?;
        let frames = std::thread::Builder::new()
            .name("frames".to_owned())
            .spawn(move || master.run(&|| over.load(Ordering::Relaxed)))?;
        Ok(Leading {
            states,
            stop,
            frames,
        })
    }

    /// Ends them.
    pub fn end(self) -> Result<(), BenchError> {
        self.stop.store(true, Ordering::Relaxed);
        self.states.end()?;
        joined(self.frames)
    }
}

/// Skew of the wake-ups of as many threads by one bare datagram each, us.
fn control(plan: Plan) -> Result<Vec<f64>, BenchError> {
    let rounds = (plan.duration.min(CONTROL).as_secs_f64() * plan.rate as f64) as usize;
    let start = Instant::now();
    let (mut sockets, mut threads) = (Vec::new(), Vec::new());
    for _ in 0..plan.nodes {
        let socket = UdpSocket::bind("127.0.0.1:0")?;
        sockets.push(socket.local_addr()?);
        let wait = move || {
            let mut woken = Vec::with_capacity(rounds);
            let mut buffer = [0; 1200];
            while woken.len() < rounds && socket.recv(&mut buffer).is_ok() {
                woken.push(start.elapsed().as_secs_f64() * 1e6);
            }
            woken
        };
        threads.push(
            std::thread::Builder::new()
                .name("control".to_owned())
                .spawn(wait)?,
        );
    }
    let sender = UdpSocket::bind("127.0.0.1:0")?;
    let mut ticker = Ticker::new(Duration::from_secs(1) / plan.rate as u32);
    for _ in 0..rounds {
        ticker.wait();
        for socket in &sockets {
            sender.send_to(&[0; 600], socket)?;
        }
    }
    let mut woken = Vec::new();
    for thread in threads {
        woken.push(joined(thread)?);
    }
    let skew = |round: usize| {
        let at = || woken.iter().map(|of: &Vec<f64>| of[round]);
        at().fold(f64::MIN, f64::max) - at().fold(f64::MAX, f64::min)
    };
    Ok((0..rounds).map(skew).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(p99: f64) -> Skew {
        Skew {
            fifo: true,
            awake: true,
            skew_us: Quantiles {
                p99,
                ..Quantiles::default()
            },
            control_us: Quantiles::default(),
            age_ms: Quantiles::default(),
            overhead_us: (0.0, 0.0),
            lapses: 2,
            compared: 0,
            different: 0,
        }
    }

    #[test]
    fn turns_tell_their_median_their_worst_and_all_of_them() {
        let of = |turns: &[f64]| {
            let turns = Turns(turns.iter().map(|p99| turn(*p99)).collect());
            (
                turns.over(|turn| turn.skew_us.p99),
                turns.sum(|turn| turn.lapses),
            )
        };
        let (over, lapses) = of(&[40.0, 900.0, 30.0]);
        assert_eq!((over.median, over.worst, lapses), (40.0, 900.0, 6));
        assert_eq!(over.each, [40.0, 900.0, 30.0]);
        assert_eq!(of(&[2.0, 1.0]).0.median, 2.0);
        assert!(of(&[1.0, f64::NAN]).0.worst.is_nan());
        assert!(of(&[]).0.median.is_nan());
    }
}
