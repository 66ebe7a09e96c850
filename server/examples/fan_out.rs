//! A session with observers behind a Zenoh router, all on this machine: how old states are when they arrive, how many are
//! lost, how many bytes each costs, and whether the haptics loop notices.
//!
//! `cargo run --release -p taut --no-default-features --features zenoh --example fan_out -- [OBSERVERS] [SECONDS] [KEY]`
//!
//! Every observer is a Zenoh session of its own, over TCP. They share this process and its cores with the loops: on machines of
//! their own they would cost the haptic PC nothing. Sessions without and with observers alternate, and the ratio is between them.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context, anyhow};
use taut::config::{Overrides, session_setup};
use taut::report::SessionReport;
use taut::session::Session;
use taut::terminal::Terminal;
use taut::timing::distribution_of;
use taut_link::ClusterKey;
use taut_scene::{SHIPPED_WORKBENCH, Workbench};
use taut_zenoh::zenoh::{Config, Session as Zenoh, Wait, open};

/// Time for subscriptions to spread before anything is counted.
const SETTLING: Duration = Duration::from_secs(2);
/// Sessions of each kind.
const ROUNDS: usize = 2;

/// What one observer received: session time of the sample, session time now, ns, and bytes.
type Received = Arc<Mutex<Vec<(u64, u64, usize)>>>;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: usize| arguments.next().map_or(Ok(default), |text| text.parse());
    let (observers, seconds) = (number(120)?, number(10)?);
    let key = arguments.next().unwrap_or_else(|| "state".to_owned());
    let time = Duration::from_secs(seconds as u64);

    let (_router, endpoint) = router()?;
    println!("{observers} observers of `{key}` at one router on this machine, {seconds} s each");
    let (mut without, mut with) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        without.push(alone(time)?);
        with.push(observed(time, observers, &endpoint, &key)?);
    }
    for (what, reports) in [("nobody", &without), ("observers", &with)] {
        for report in reports {
            let period = &report.haptics_period_us;
            println!(
                "haptics period, {what:9}: p50 {:.0} us, p99 {:.0} us, {:.1} Hz, {} deadlines missed",
                period.p50,
                period.p99,
                period.count as f64 / report.duration_s,
                report.deadline_misses
            );
        }
    }
    let mean = |reports: &[SessionReport]| {
        reports
            .iter()
            .map(|report| report.haptics_period_us.p99)
            .sum::<f64>()
            / ROUNDS as f64
    };
    println!(
        "ratio of p99, with observers to without: {:.3}",
        mean(&with) / mean(&without)
    );
    Ok(())
}

fn session(zenoh: Option<&str>) -> anyhow::Result<Session> {
    let mut assignments = vec![
        "network.quic_port=0".to_owned(),
        "network.udp_port=0".to_owned(),
    ];
    if let Some(endpoint) = zenoh {
        assignments.push("zenoh.enabled=true".to_owned());
        assignments.push(format!("zenoh.connect=[\"{endpoint}\"]"));
    }
    let workbench = Workbench::parse_with_overrides(
        "workbench.toml",
        SHIPPED_WORKBENCH,
        Path::new(""),
        &assignments,
    )?;
    let overrides = Overrides {
        no_monitor: true,
        ..Overrides::default()
    };
    let setup = session_setup(&workbench, ClusterKey::generate()?, &overrides);
    setup
        .and_then(Session::start)
        .map_err(|failure| anyhow!("{failure}"))
}

fn alone(time: Duration) -> anyhow::Result<SessionReport> {
    let session = session(None)?;
    std::thread::sleep(SETTLING + time);
    Ok(session.stop(&Terminal::standard_error()).0)
}

fn observed(
    time: Duration,
    observers: usize,
    endpoint: &str,
    key: &str,
) -> anyhow::Result<SessionReport> {
    // They are there first: what joining costs is no part of the measurement.
    let counter = Counter::start(endpoint.trim_start_matches("tcp/").to_owned())?;
    let clock = Arc::new(Mutex::new(None));
    let mut sessions = Vec::new();
    let mut all: Vec<Received> = Vec::new();
    for number in 0..observers {
        let through_counter = format!("tcp/{}", counter.address);
        let at = if number == 0 {
            &through_counter
        } else {
            endpoint
        };
        let observer = open(config("client", "", at)?)
            .wait()
            .map_err(|error| anyhow!(error))?;
        let received = Received::default();
        let (into, clock) = (received.clone(), clock.clone());
        let subscriber = observer
            .declare_subscriber(format!("taut/workbench/{key}"))
            .callback(move |sample| {
                let payload = sample.payload().to_bytes();
                let now = clock
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .map(|clock: taut::clock::SessionClock| taut::clock::nanoseconds(clock.now()));
                if let (Some(now), Some(sampled)) = (now, sampled(&payload)) {
                    let mut into = into.lock().unwrap_or_else(PoisonError::into_inner);
                    into.push((sampled, now, payload.len()));
                }
            })
            .wait()
            .map_err(|error| anyhow!(error))?;
        sessions.push((observer, subscriber));
        all.push(received);
    }
    let session = session(Some(endpoint))?;
    *clock.lock().unwrap_or_else(PoisonError::into_inner) = Some(session.clock());
    std::thread::sleep(SETTLING);
    let (begin, bytes) = (session.clock().now(), counter.bytes());
    std::thread::sleep(time);
    let (end, bytes) = (session.clock().now(), counter.bytes() - bytes);
    std::thread::sleep(SETTLING / 4); // what is under way arrives
    let (report, _) = session.stop(&Terminal::standard_error());
    tell(&all, (begin, end), bytes)?;
    Ok(report)
}

fn tell(all: &[Received], (begin, end): (Duration, Duration), bytes: u64) -> anyhow::Result<()> {
    let window = taut::clock::nanoseconds(begin)..taut::clock::nanoseconds(end);
    let mut published = std::collections::BTreeSet::new();
    let (mut ages, mut payload) = (Vec::new(), 0);
    for received in all {
        for (sampled, now, length) in received
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .iter()
        {
            if window.contains(sampled) {
                published.insert(*sampled);
                ages.push(now.saturating_sub(*sampled) as f64 * 1e-3);
                payload += length;
            }
        }
    }
    let count = ages.len();
    let whole = published.len() * all.len();
    anyhow::ensure!(count > 0, "nothing arrived");
    let age = distribution_of(&ages);
    let seconds = (end - begin).as_secs_f64();
    println!(
        "age at arrival: p50 {:.0} us, p99 {:.0} us; {} states published ({:.1} per second), {} of {whole} not received ({:.4} %)",
        age.p50,
        age.p99,
        published.len(),
        published.len() as f64 / seconds,
        whole - count,
        100.0 * (whole - count) as f64 / whole as f64,
    );
    println!(
        "bytes per state: {:.0} payload, {:.0} on one observer's TCP stream; {:.1} kbit/s each",
        payload as f64 / count as f64,
        bytes as f64 / published.len() as f64,
        bytes as f64 * 8e-3 / seconds
    );
    Ok(())
}

/// When the state was sampled, session time, ns: the first field of the HOT payload, `t` of a JSON line.
fn sampled(payload: &[u8]) -> Option<u64> {
    if payload.first() == Some(&b'{') {
        let line: serde_json::Value = serde_json::from_slice(payload).ok()?;
        return Some((line["t"].as_f64()? * 1e9).round() as u64);
    }
    payload
        .first_chunk()
        .map(|bytes| u64::from_le_bytes(*bytes))
}

fn config(mode: &str, listen: &str, connect: &str) -> anyhow::Result<Config> {
    let list = |endpoint: &str| match endpoint {
        "" => "[]".to_owned(),
        endpoint => format!("[\"{endpoint}\"]"),
    };
    let mut config = Config::default();
    for (key, value) in [
        ("mode", format!("\"{mode}\"")),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("listen/endpoints", list(listen)),
        ("connect/endpoints", list(connect)),
    ] {
        config
            .insert_json5(key, &value)
            .map_err(|error| anyhow!("{key}: {error}"))?;
    }
    Ok(config)
}

fn router() -> anyhow::Result<(Zenoh, String)> {
    let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let router = open(config("router", &endpoint, "")?)
        .wait()
        .map_err(|error| anyhow!(error))?;
    Ok((router, endpoint))
}

/// Passes one connection on and counts what comes back.
struct Counter {
    address: std::net::SocketAddr,
    bytes: Arc<AtomicU64>,
}

impl Counter {
    fn start(to: String) -> anyhow::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = listener.local_addr()?;
        let bytes = Arc::<AtomicU64>::default();
        let count = bytes.clone();
        let relay = move || -> std::io::Result<()> {
            let (observer, _) = listener.accept()?;
            let router = TcpStream::connect(to)?;
            for stream in [&observer, &router] {
                stream.set_nodelay(true)?;
            }
            let (up_from, up_to) = (observer.try_clone()?, router.try_clone()?);
            std::thread::Builder::new()
                .name("relay-up".to_owned())
                .spawn(move || pass(up_from, up_to, &AtomicU64::new(0)))?;
            pass(router, observer, &count);
            Ok(())
        };
        std::thread::Builder::new()
            .name("relay".to_owned())
            .spawn(move || {
                if let Err(error) = relay() {
                    eprintln!("the relay that counts: {error}");
                }
            })
            .context("a thread")?;
        Ok(Self { address, bytes })
    }

    fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }
}

fn pass(mut from: TcpStream, mut to: TcpStream, count: &AtomicU64) {
    let mut buffer = [0; 65_536];
    while let Ok(length @ 1..) = from.read(&mut buffer) {
        count.fetch_add(length as u64, Ordering::Relaxed);
        if to.write_all(&buffer[..length]).is_err() {
            break;
        }
    }
    // Either end may be gone.
    let _ = to.shutdown(Shutdown::Both);
}
