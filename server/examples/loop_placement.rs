//! What the loops' places within the millisecond and on the cores are worth: sessions with different ones in turn, in one run.
//!
//! `cargo run --release -p taut --no-default-features --example loop_placement -- [seconds of each] [turns] [--busy]`
//!
//! Each turn starts one session per case with the demo's scene and a simulated device with strings, and lets it run. Cases: as the program has them; all loops due
//! at one time; haptics due just before the kernel's tick; all loops due just before it; and as the program has them, with haptics and coupling on a core
//! each. Printed are, by case, the median of its turns and all of them in ascending order: the time from the reading of a device sample to the start of the
//! force that answers it and to its rendering, the CPU time of coupling and tensions of one cycle, the time from a sample to the rendering of a force whose
//! constraint set answers it, and missed deadlines. With `--busy` two threads stream through memory meanwhile, as drawing in software does.

use std::hint::black_box;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use taut::loops::shell::Phases;
use taut::report::SessionReport;
use taut::session::Session;
use taut::session::setup::workbench::{Overrides, session_setup};
use taut_link::ClusterKey;
use taut_link::Distribution;
use taut_scene::{Device, Workbench};

/// Larger than the caches.
const STREAMED_BYTES: usize = 64 << 20;
/// From one cache line to the next, in words.
const LINE: usize = 8;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut numbers, mut busy) = (Vec::new(), false);
    for argument in std::env::args().skip(1) {
        if argument == "--busy" {
            busy = true;
        } else {
            numbers.push(argument.parse::<u32>()?);
        }
    }
    let seconds = numbers.first().copied().unwrap_or(10);
    let turns = numbers.get(1).copied().unwrap_or(3);

    let cases = cases();
    let end = Arc::new(AtomicBool::new(false));
    let streamers: Vec<_> = (0..if busy { 2 } else { 0 })
        .map(|_| stream(end.clone()))
        .collect::<Result<_, _>>()?;
    let mut reports: Vec<Vec<SessionReport>> = cases.iter().map(|_| Vec::new()).collect();
    for turn in 0..turns as usize {
        for case in 0..cases.len() {
            // Another order in every turn.
            let case = (case + turn) % cases.len();
            let (_, phases, cores) = cases[case];
            reports[case].push(session(phases, cores, seconds)?);
        }
    }
    end.store(true, Ordering::Relaxed);
    for streamer in streamers {
        let _ = streamer.join();
    }
    for ((name, ..), reports) in cases.iter().zip(&reports) {
        println!("{name}");
        print_turns(reports);
    }
    Ok(())
}

/// Name, places within the millisecond, and the cores of haptics and coupling.
type Case = (&'static str, Phases, Option<(usize, usize)>);

fn cases() -> [Case; 5] {
    let us = Duration::from_micros;
    let all_at = |at| Phases {
        haptics: at,
        god_object: at,
        broadcast: at,
    };
    [
        ("as the program has them", Phases::default(), None),
        ("all due at 0.25 ms", all_at(us(250)), None),
        (
            "haptics due at 0.97 ms, just before the kernel, others after it as usual",
            Phases {
                haptics: us(970),
                god_object: us(1170),
                broadcast: us(1470),
            },
            None,
        ),
        ("all due at 0.97 ms", all_at(us(970)), None),
        (
            "as the program has them, haptics on core 0, coupling on core 1",
            Phases::default(),
            Some((0, 1)),
        ),
    ]
}

/// The turns of one case.
fn print_turns(reports: &[SessionReport]) {
    let show = |what: &str, of: &dyn Fn(&SessionReport) -> Distribution| {
        let of_turn: Vec<Distribution> = reports.iter().map(of).collect();
        println!(
            "  {what:24} p50 {}  p99 {}  p99.9 {} us",
            each(&of_turn, |d| d.p50),
            each(&of_turn, |d| d.p99),
            each(&of_turn, |d| d.p999)
        );
    };
    show("sample to force begun", &|r| r.answer_wait_us);
    show("sample to force rendered", &|r| r.force_latency_us);
    show("coupling and tensions", &|r| {
        r.coupling_and_tension_us.unwrap_or_default()
    });
    show("constraints rendered", &|r| r.constraint_latency_us);
    let missed: Vec<String> = reports
        .iter()
        .map(|report| report.deadline_misses.to_string())
        .collect();
    println!("  deadlines missed         {}", missed.join(" / "));
}

/// The median of the turns, and all of them in ascending order.
fn each(turns: &[Distribution], of: impl Fn(&Distribution) -> f64) -> String {
    let mut values: Vec<f64> = turns.iter().map(of).collect();
    values.sort_by(f64::total_cmp);
    let all: Vec<String> = values.iter().map(|value| format!("{value:.1}")).collect();
    let median = values.get(values.len() / 2).copied().unwrap_or_default();
    format!("{median:7.1} ({})", all.join(" "))
}

fn session(
    phases: Phases,
    cores: Option<(usize, usize)>,
    seconds: u32,
) -> Result<SessionReport, Box<dyn std::error::Error>> {
    let mut workbench = Workbench::shipped()?;
    if let Device::Simulated { strings, .. } = &mut workbench.device {
        *strings = Some("wb".to_owned());
    }
    let overrides = Overrides {
        no_monitor: true,
        ..Overrides::default()
    };
    let mut setup = session_setup(&workbench, ClusterKey::generate()?, &overrides)?;
    let free = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    (setup.link.quic, setup.link.udp) = (free, free);
    setup.realtime.phases = phases;
    setup.realtime.haptics_core = cores.map(|cores| cores.0);
    setup.realtime.coupling_core = cores.map(|cores| cores.1);
    let session = Session::start(setup)?;
    std::thread::sleep(Duration::from_secs(seconds.into()));
    let (report, failure) = session.stop();
    failure.map_or(Ok(report), |failure| Err(failure.into()))
}

/// A thread of the normal class that streams through memory until the end.
fn stream(end: Arc<AtomicBool>) -> std::io::Result<std::thread::JoinHandle<()>> {
    let thread = std::thread::Builder::new().name("stream".into());
    thread.spawn(move || {
        let mut memory = vec![0_u64; STREAMED_BYTES / size_of::<u64>()];
        while !end.load(Ordering::Relaxed) {
            for word in memory.iter_mut().step_by(LINE) {
                *word += 1;
            }
            black_box(&mut memory);
        }
    })
}
