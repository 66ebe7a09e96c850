//! What is measured for which rows.

use std::path::{Path, PathBuf};
use std::time::Duration;

use taut_proto::membership::SilenceLimits;

use super::frames::{failover_rows, skew_rows};
use super::processes::{let_go_and_back, missing, screen_death_rows, server_kill_rows};
use super::row::{Row, brief, worst};
use super::scale::scale_rows;
use crate::bench::age::{self, Age};
use crate::bench::death::{self, Death};
use crate::bench::scale::Place;
use crate::bench::{BenchError, events, isolation, join, latency};
use crate::forge::attack;
use crate::relay::{Burst, Impairment};

/// How much is measured.
#[derive(Clone, Debug)]
pub struct Extent {
    /// Time per latency or age run, s.
    pub seconds: f64,
    /// Forgeries.
    pub forgeries: u64,
    /// Joins.
    pub joins: usize,
    /// Deaths of each sort; of those that whole processes or all nodes take part in, at most three.
    pub deaths: usize,
    /// Numbers of clients whose cost is measured.
    pub clients: &'static [usize],
    /// Where these clients are.
    pub place: Place,
    /// Numbers of nodes whose swaps are compared.
    pub screens: &'static [u64],
    /// Runs of each sort of frames, of which the median counts.
    pub skew_turns: usize,
    /// Silence after which nodes and server give each other up where the server dies.
    pub node_timeout: Duration,
    /// Turns of the isolation runs, each without and with clients.
    pub turns: usize,
    /// Time of each, s.
    pub turn_seconds: f64,
    /// Time of the soak, s; `None`: not now.
    pub soak_seconds: Option<f64>,
    /// Where the soak's log goes, if anywhere.
    pub soak_log: Option<PathBuf>,
    /// The program `taut`.
    pub program: PathBuf,
    /// This program.
    pub this: PathBuf,
}

/// A part of the report.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    /// Name on the command line.
    pub name: &'static str,
    /// What it is about.
    pub about: &'static str,
    /// Measures it.
    pub run: fn(&Extent) -> Result<Vec<Row>, BenchError>,
}

macro_rules! sections {
    ($($name:literal: $run:expr, $about:literal;)*) => {
        &[$(Section { name: $name, about: $about, run: $run }),*]
    };
}

/// All parts, in the order of the table.
pub const SECTIONS: &[Section] = sections! {
    "latency": latency_rows, "one-way latency, sealed UDP and QUIC datagrams beside raw UDP";
    "skew": skew_rows, "frames of two and four nodes: swap skew, pose age, equality";
    "loss": loss_rows, "pose age behind a network that loses, beside one that does not";
    "events": events_rows, "discrete events behind a network that loses";
    "isolation": isolation_rows, "period of the haptics loop without and with eight clients, stalled and flooding ones included";
    "scale": scale_rows, "processor time for each state and client, 8 to 64 clients";
    "forged": forged_rows, "forged, replayed, truncated and damaged datagrams";
    "join": join_rows, "time to join a scene of 10 MB";
    "death": death_rows, "a node that is killed or stopped, and the others";
    "screens": screen_death_rows, "a node that draws is killed or stopped, and the others";
    "server": server_kill_rows, "the server is killed while a hand feels a force";
    "failover": failover_rows, "the server is killed, and the nodes go on together";
    "soak": super::soak::of_links, "hours in which clients of the links come, go and are killed";
    "soak-program": super::soak::of_program, "hours in which nodes, observers, server and bridge come, go and are killed";
    "hostile": crate::hostile::rows, "one attack for each promise";
    "elsewhere": elsewhere, "what is not measured here";
};

fn latency_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let mut rows = Vec::new();
    for full in [false, true] {
        let run = latency::measure(Duration::from_secs_f64(extent.seconds), full)?;
        let (raw, sealed, quic) = (run.raw, run.sealed, run.quic);
        let bytes = run.bytes;
        let class = if run.fifo { "FIFO" } else { "default class" };
        let all = |q: &crate::bench::Quantiles| {
            format!("{}/{}/{} us", brief(q.p50), brief(q.p99), brief(q.p999))
        };
        let raw_text = format!("raw {}, {class}", all(&raw));
        let over = |p50: f64| p50 - raw.p50;
        rows.push(Row::at_most(
            format!("sealed UDP, {bytes} B: p50 over raw UDP"),
            over(sealed.p50),
            10.0,
            "us",
            format!("p50/p99/p99.9 {}, {raw_text}", all(&sealed)),
        ));
        rows.push(Row::at_most(
            format!("sealed UDP, {bytes} B: p99 over raw p99"),
            sealed.p99 / raw.p99,
            2.0,
            "times",
            format!("opening costs {} us, included", brief(run.opening_us)),
        ));
        rows.push(Row::at_most(
            format!("QUIC datagram, {bytes} B: p50 over raw UDP"),
            over(quic.p50),
            50.0,
            "us",
            format!("p50/p99/p99.9 {}, {raw_text}", all(&quic)),
        ));
        let lost = |q: crate::bench::Quantiles| run.sent.saturating_sub(q.count as u64) as f64;
        rows.push(Row::at_most(
            format!("datagrams lost of {} each way, {bytes} B", run.sent),
            lost(sealed),
            0.0,
            "lost",
            format!("sealed UDP; raw {}", lost(raw)),
        ));
        // What was not sent is not lost: newest wins, and a full way gets less for a while.
        let (left_out, gave_way) = (run.left_out as f64, run.gave_way as f64);
        rows.push(Row::at_most(
            format!("QUIC datagrams lost of {}, {bytes} B", run.sent),
            (lost(quic) - left_out - gave_way).max(0.0),
            0.0,
            "lost",
            format!(
                "{} did not come: {left_out} left out at the lowered rate of a full way, {gave_way} gave way to newer ones",
                lost(quic)
            ),
        ));
    }
    Ok(rows)
}

/// The bad network of the cluster's targets. Bursts are so rare that the tail of the age at one in a hundred is that of the single losses; what a
/// burst itself costs has a row of its own.
const LOSS: &str = "5 % lost and bursts of 20, one in 4 s";

fn loss_with_bursts() -> Impairment {
    Impairment {
        lost: 0.05,
        ..bursts_of_20(1.0 / 4000.0)
    }
}

/// Bursts of 20, with this chance at each state.
fn bursts_of_20(chance: f64) -> Impairment {
    Impairment {
        bursts: Some(Burst { chance, length: 20 }),
        ..Impairment::default()
    }
}

fn loss_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let duration = Duration::from_secs_f64(extent.seconds);
    let mut rows = Vec::new();
    for (what, impairment, seed) in [
        (LOSS, loss_with_bursts(), 12),
        ("5 % lost, no bursts", Impairment::losing(0.05), 11),
    ] {
        let run = age::measure(duration, &impairment, seed)?;
        rows.push(Row::at_most(
            format!("{what}: age p99 over the control's"),
            run.impaired.p99 - run.control.p99,
            2.0,
            "ms",
            format!(
                "p99 {} against {} ms, {} by the losses alone; {}",
                brief(run.impaired.p99),
                brief(run.control.p99),
                brief(run.by_loss_alone.p99),
                losses(&run)
            ),
        ));
        rows.push(truth(what, &run));
    }
    let what = "bursts of 20, two in 1 s";
    let run = age::measure(duration, &bursts_of_20(1.0 / 500.0), 13)?;
    rows.push(Row::at_most(
        format!("{what}: largest age over the control's, by the losses alone"),
        run.by_loss_alone.max - run.control.max,
        20.0,
        "ms",
        format!(
            "{} against {} ms; {}",
            brief(run.by_loss_alone.max),
            brief(run.control.max),
            losses(&run)
        ),
    ));
    rows.push(truth(what, &run));
    Ok(rows)
}

fn events_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let duration = Duration::from_secs_f64(extent.seconds);
    let bad = Impairment {
        doubled: 0.02,
        swapped: 0.02,
        ..Impairment::losing(0.1)
    };
    let mut rows = Vec::new();
    for (what, impairment, seed) in [
        (LOSS, loss_with_bursts(), 14),
        ("10 % lost, 2 % doubled, 2 % swapped", bad, 15),
    ] {
        let run = events::measure(duration, &impairment, seed)?;
        rows.push(Row::invariant(
            format!("{what}, both ways: events lost, twice, changed or out of order"),
            "0",
            format!(
                "{} of {}; {} datagrams down were lost",
                run.sent.abs_diff(run.arrived) + run.wrong,
                run.sent,
                run.relay.lost
            ),
            run.sent > 0
                && run.arrived == run.sent
                && run.wrong == 0
                && run.lost == 0
                && run.relay.lost > 0,
        ));
    }
    Ok(rows)
}

fn losses(run: &Age) -> String {
    format!(
        "{} of {} states lost, longest run {}",
        run.sent - run.arrived[1],
        run.sent,
        run.longest_gap
    )
}

fn truth(what: &str, run: &Age) -> Row {
    Row::invariant(
        format!("{what}: states that are not what was sent, or out of order"),
        "0",
        run.wrong,
        run.wrong == 0 && run.arrived[1] > run.sent / 2,
    )
}

fn isolation_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let measure = "haptics period p99, 8 clients against none";
    if let Some(why) = missing(extent) {
        return Ok(vec![Row::unknown(measure, "<= 1.05 times", why)]);
    }
    let duration = Duration::from_secs_f64(extent.turn_seconds);
    let run = isolation::measure(&extent.program, &extent.this, duration, extent.turns)?;
    let [alone, crowded] = run.p99();
    let each = |turns: &[isolation::Period]| {
        let p99s: Vec<String> = turns.iter().map(|turn| brief(turn.p99)).collect();
        p99s.join(" ")
    };
    Ok(vec![
        Row::at_most(
            measure,
            crowded / alone,
            1.05,
            "times",
            format!(
                "median of {} turns: {} against {} us; turns {} against {} us; in force: {}",
                extent.turns,
                brief(crowded),
                brief(alone),
                each(&run.crowded),
                each(&run.alone),
                run.realtime
            ),
        ),
        Row::invariant(
            "clients that stayed members while others flooded",
            ">= 7",
            format!(
                "{} ({} datagrams flooded, {} counted as refused)",
                run.members, run.flooded, run.refused
            ),
            run.members >= 7,
        ),
    ])
}

fn forged_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let run = attack(extent.forgeries, 1);
    Ok(vec![Row::invariant(
        "forged, replayed, truncated, bit-flipped datagrams accepted",
        "0",
        format!(
            "{} of {}; {} of {} genuine ones between them refused",
            run.accepted, run.forged, run.refused, run.genuine
        ),
        run.accepted == 0 && run.refused == 0,
    )])
}

fn join_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let run = join::measure(extent.joins)?;
    Ok(vec![Row::at_most(
        "join: scene, mesh and first state, slowest",
        run.joined_s.max,
        1.0,
        "s",
        format!(
            "median {} s of {} joins, {:.1} MB",
            brief(run.joined_s.p50),
            run.joined_s.count,
            run.mesh_bytes as f64 * 1e-6
        ),
    )])
}

fn death_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    /// Three frames at 60 Hz, ms.
    const THREE_FRAMES_MS: f64 = 50.0;
    let mut rows = Vec::new();
    for (death, signal) in [(Death::Killed, "SIGKILL"), (Death::Stopped, "SIGSTOP")] {
        let mut runs = Vec::new();
        for _ in 0..extent.deaths {
            runs.push(death::measure(&extent.this, death)?);
        }
        let times = format!("largest of {}", runs.len());
        rows.push(Row::at_most(
            format!("{signal} of a node: others' longest time without a state"),
            worst(&runs, |run| run.longest_gap_ms),
            THREE_FRAMES_MS,
            "ms",
            format!(
                "{times}; {} states missed",
                worst(&runs, |run| run.missed as f64)
            ),
        ));
        let let_go_s = worst(&runs, |run| run.let_go_s);
        let back = (
            "from the start of its process",
            worst(&runs, |run| run.back_s),
        );
        let subject = format!("{signal} of a node");
        rows.extend(let_go_and_back(&subject, let_go_s, back, &times));
    }
    Ok(rows)
}

/// Targets of the cluster that other programs measure.
fn elsewhere(_: &Extent) -> Result<Vec<Row>, BenchError> {
    Ok(vec![Row::unknown(
        "fuzzing",
        "10 minutes per decoder, no finding",
        "scripts/fuzz 600",
    )])
}

impl Extent {
    /// What the report of a release takes, beside the program at `this`.
    pub fn full(this: &Path) -> Extent {
        Extent {
            seconds: 20.0,
            forgeries: 1_000_000,
            joins: 10,
            deaths: 5,
            clients: &[8, 32, 64],
            place: Place::Loopback,
            screens: &[2, 4],
            skew_turns: 5,
            node_timeout: Duration::from_nanos(SilenceLimits::OF_A_NODE.dead_after_ns),
            turns: 6,
            turn_seconds: 8.0,
            soak_seconds: None,
            soak_log: None,
            program: this.with_file_name("taut"),
            this: this.to_path_buf(),
        }
    }

    /// A few seconds in all: the figures mean little, the invariants hold.
    pub fn quick(this: &Path) -> Extent {
        Extent {
            seconds: 1.0,
            forgeries: 20_000,
            joins: 1,
            deaths: 1,
            clients: &[4],
            screens: &[2],
            skew_turns: 1,
            // A busy machine starves a thread for longer than a workbench forgives.
            node_timeout: Duration::from_secs(2),
            turns: 1,
            turn_seconds: 2.0,
            soak_seconds: Some(20.0),
            ..Extent::full(this)
        }
    }
}
