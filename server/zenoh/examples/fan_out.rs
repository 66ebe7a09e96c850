//! A workbench that publishes 1000 states a second to an outlet, as the broadcaster does, and observers behind a Zenoh router, all
//! on this machine: how old states are when they arrive, how many are lost, how many bytes each costs, and whether a loop of
//! 1 kHz in the publisher's process notices.
//!
//! `cargo run --release -p taut-zenoh --features zenoh --example fan_out -- [OBSERVERS] [SECONDS] [KEY] [RATE]`
//!
//! Every observer is a Zenoh session of its own, over TCP. They and the router run in another process on the same cores. The loop
//! asks for real-time scheduling, as the haptics loop does, by `chrt`. Measurements without and with observers alternate, and the
//! ratio is between them.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use taut_observers::{Hello, StateOutlet, state_channel};
use taut_proto::scene::BodyDescription;
use taut_proto::state::{ContactState, RunState, ToolState};
use taut_proto::{HotState, MeshHash, PoseF64, SceneDescription};
use taut_zenoh::zenoh::{Config, Session, Wait, open};
use taut_zenoh::{ZenohPublisher, ZenohSettings};

/// Whatever goes wrong ends the measurement.
type Outcome<T> = Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// Time for subscriptions to spread, and for a loop to come to rest, before anything is counted.
const SETTLING: Duration = Duration::from_secs(2);
/// Measurements of each kind.
const ROUNDS: usize = 2;
/// Period of the loop.
const PERIOD: Duration = Duration::from_millis(1);
/// First argument of the process in which the observers are.
const AS_OBSERVERS: &str = "--observers";

/// What is measured.
#[derive(Clone, Debug)]
struct Plan {
    observers: usize,
    time: Duration,
    key: String,
    rate: f64,
}

/// What one observer received: when the state was sampled and when it came, ns on the system's clock, and its bytes.
type Received = Arc<Mutex<Vec<(u64, u64, usize)>>>;

fn main() -> Outcome<()> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let as_observers = arguments.first().is_some_and(|first| first == AS_OBSERVERS);
    if as_observers {
        arguments.remove(0);
    }
    let number = |at: usize, default: f64| {
        arguments
            .get(at)
            .map_or(Ok(default), |text| text.parse::<f64>())
    };
    let plan = Plan {
        observers: number(0, 120.0)? as usize,
        time: Duration::from_secs_f64(number(1, 10.0)?),
        key: arguments
            .get(2)
            .cloned()
            .unwrap_or_else(|| "state".to_owned()),
        rate: number(3, 60.0)?,
    };
    if as_observers {
        return observe(&plan);
    }
    println!(
        "{} observers of `{}` at {} states per second, {} s each",
        plan.observers,
        plan.key,
        plan.rate,
        plan.time.as_secs_f64()
    );
    let (mut without, mut with) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        without.push(looped(None, &plan)?);
        with.push(observed(&plan)?);
    }
    for (what, periods) in [("nobody", &without), ("observers", &with)] {
        for (p50, p99) in periods {
            println!("1 kHz loop, {what:9}: period p50 {p50:.0} us, p99 {p99:.0} us");
        }
    }
    let mean = |periods: &[(f64, f64)]| periods.iter().map(|p| p.1).sum::<f64>() / ROUNDS as f64;
    println!(
        "ratio of p99, with observers to without: {:.3}",
        mean(&with) / mean(&without)
    );
    Ok(())
}

/// Observers in a process of their own, and the loop in this one; what the loop's period was.
fn observed(plan: &Plan) -> Outcome<(f64, f64)> {
    let mut process = Command::new(std::env::current_exe()?)
        .args([AS_OBSERVERS, &plan.observers.to_string()])
        .args([
            &plan.time.as_secs_f64().to_string(),
            &plan.key,
            &plan.rate.to_string(),
        ])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let ended = follow_observers(&mut process, plan);
    // By now it has ended or is of no use.
    let _ = process.kill();
    process.wait()?;
    ended
}

fn follow_observers(process: &mut Child, plan: &Plan) -> Outcome<(f64, f64)> {
    let output = process.stdout.take().ok_or("no output of the observers")?;
    let mut lines = BufReader::new(output).lines();
    let endpoint = lines.next().ok_or("the observers did not start")??;
    let periods = looped(Some(&endpoint), plan)?;
    // Its input ends: it tells what came.
    drop(process.stdin.take());
    for line in lines {
        println!("{}", line?);
    }
    Ok(periods)
}

/// The loop, with a publisher where there is a router; p50 and p99 of its period, us.
fn looped(endpoint: Option<&str>, plan: &Plan) -> Outcome<(f64, f64)> {
    let (outlet, feed) = state_channel();
    let publisher = match endpoint {
        Some(endpoint) => Some(ZenohPublisher::start(
            ZenohSettings {
                name: "workbench".to_owned(),
                connect: vec![endpoint.to_owned()],
                config: None,
                rate: plan.rate,
                naming: |_| None,
                ros: None,
            },
            &hello(plan.rate),
            feed,
        )?),
        None => None,
    };
    let time = plan.time + SETTLING * 2;
    let ticker = std::thread::Builder::new()
        .name("loop".to_owned())
        .spawn(move || tick(outlet, time))?;
    let periods = ticker.join().map_err(|_| "the loop broke down")?;
    if let Some(publisher) = publisher {
        println!("{} states handed to Zenoh", publisher.published());
    }
    let mut periods = periods[SETTLING.as_millis() as usize..].to_vec();
    Ok((quantile(&mut periods, 0.5), quantile(&mut periods, 0.99)))
}

/// Publishes a state at each deadline; the times between them, us.
fn tick(mut outlet: StateOutlet, time: Duration) -> Vec<f64> {
    be_real_time();
    let mut state = typical_state();
    let begun = Instant::now();
    let count = time.as_millis() as u32;
    let mut periods = Vec::with_capacity(count as usize);
    let mut last = begun;
    for tick in 1..=count {
        let deadline = begun + PERIOD * tick;
        std::thread::sleep(deadline.saturating_duration_since(Instant::now()));
        let now = Instant::now();
        periods.push((now - last).as_secs_f64() * 1e6);
        last = now;
        state.tick += 1;
        state.sample_time_ns = wall_clock();
        state.tools[0].god_object.position[0] = 1e-5 * (tick % 1000) as f32;
        outlet.publish(&state);
    }
    periods
}

/// Real-time priority for this thread, where the system grants it.
fn be_real_time() {
    let thread = std::fs::read_link("/proc/thread-self").unwrap_or_default();
    let number = thread.file_name().unwrap_or_default();
    let granted = Command::new("chrt")
        .args(["-f", "-p", "80"])
        .arg(number)
        .status();
    if !granted.is_ok_and(|status| status.success()) {
        println!("the loop has no real-time scheduling: `chrt` is missing or not allowed");
    }
}

/// A tool, a head and two contacts: what a session has most of the time.
fn typical_state() -> HotState {
    let mut state = HotState::empty();
    state.run = RunState::Running;
    state.scene_revision = 1;
    let mut tool = ToolState::default();
    tool.god_object.position = [0.012_345_678, -0.023_456_79, 0.034_567_89];
    tool.god_object.rotation = [0.182_574_19, 0.365_148_37, 0.547_722_6, 0.730_296_7];
    tool.device = tool.god_object;
    tool.linear_velocity = [0.012_345_67, 0.023_456_78, -0.034_567_89];
    tool.angular_velocity = [0.123_456_7, 0.234_567_8, -0.345_678_9];
    tool.force = [1.234_567_8, -2.345_678_9, 3.456_789];
    tool.torque = [0.012_345_678, 0.023_456_79, 0.034_567_89];
    state.tools.push(tool);
    state.head.pose = tool.god_object;
    for _ in 0..2 {
        state.contacts.push(ContactState {
            pair: [0, 0],
            point: tool.god_object.position,
            normal: [0.0, 0.6, 0.8],
            force: 0.0,
            gap: 1.234_567_8e-4,
        });
    }
    state
}

fn hello(rate: f64) -> Hello {
    let body = |name: &str| BodyDescription {
        name: name.to_owned().into(),
        mesh: MeshHash::of(b""),
        pose: PoseF64::IDENTITY,
        colour: [1.0; 4],
    };
    Hello {
        workbench: "workbench".to_owned(),
        program: "taut-zenoh example".to_owned(),
        rate,
        scene: SceneDescription {
            obstacles: vec![body("plane")],
            ..SceneDescription::of_body("none", body("ball"))
        },
    }
}

/// The router and its observers: says where the router is, counts until the input ends, tells what came.
fn observe(plan: &Plan) -> Outcome<()> {
    let (_router, endpoint) = router()?;
    let counter = Counter::start(endpoint.trim_start_matches("tcp/").to_owned())?;
    let mut sessions = Vec::new();
    let mut all: Vec<Received> = Vec::new();
    for number in 0..plan.observers {
        // One of them through the relay that counts.
        let through_counter = format!("tcp/{}", counter.address);
        let at = if number == 0 {
            &through_counter
        } else {
            &endpoint
        };
        let observer = open(config("client", "", at)?).wait()?;
        let received = Received::default();
        let into = received.clone();
        let subscriber = observer
            .declare_subscriber(format!("taut/workbench/{}", plan.key))
            .callback(move |sample| {
                let now = wall_clock();
                let payload = sample.payload().to_bytes();
                if let Some(sampled) = sampled(&payload) {
                    let mut into = into.lock().unwrap_or_else(PoisonError::into_inner);
                    into.push((sampled, now, payload.len()));
                }
            })
            .wait()?;
        sessions.push((observer, subscriber));
        all.push(received);
    }
    println!("{endpoint}");
    let ended = Arc::new(AtomicBool::new(false));
    let (input_ended, count) = (ended.clone(), counter.bytes.clone());
    std::thread::Builder::new()
        .name("input".to_owned())
        .spawn(move || {
            // Ends when the other process closes it or is gone.
            let _ = std::io::stdin().read_to_end(&mut Vec::new());
            input_ended.store(true, Ordering::Relaxed);
        })?;
    // The window begins when states have come for a while.
    while all[0]
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .is_empty()
    {
        if ended.load(Ordering::Relaxed) {
            return Err("nothing came".into());
        }
        std::thread::sleep(PERIOD);
    }
    std::thread::sleep(SETTLING);
    let (begin, before) = (wall_clock(), count.load(Ordering::Relaxed));
    std::thread::sleep(plan.time);
    let (end, after) = (wall_clock(), count.load(Ordering::Relaxed));
    while !ended.load(Ordering::Relaxed) {
        std::thread::sleep(PERIOD);
    }
    tell(&all, (begin, end), after - before)
}

fn tell(all: &[Received], (begin, end): (u64, u64), bytes: u64) -> Outcome<()> {
    let window = begin..end;
    let mut published = BTreeSet::new();
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
    if count == 0 {
        return Err("nothing came".into());
    }
    let (p50, p99) = (quantile(&mut ages, 0.5), quantile(&mut ages, 0.99));
    let seconds = (end - begin) as f64 * 1e-9;
    println!(
        "age at arrival: p50 {p50:.0} us, p99 {p99:.0} us; {} states published ({:.1} per second), {} of {whole} not received ({:.4} %)",
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

/// The value below which this share lies, by nearest rank.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (share * values.len() as f64).ceil() as usize;
    values
        .get(at.saturating_sub(1))
        .copied()
        .unwrap_or(f64::NAN)
}

/// The system's clock, which all processes share, ns.
fn wall_clock() -> u64 {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    since.as_nanos() as u64
}

/// When the state was sampled, ns: the first field of the HOT payload, `t` of a JSON line.
fn sampled(payload: &[u8]) -> Option<u64> {
    if payload.first() == Some(&b'{') {
        let line: serde_json::Value = serde_json::from_slice(payload).ok()?;
        return Some((line["t"].as_f64()? * 1e9).round() as u64);
    }
    payload
        .first_chunk()
        .map(|bytes| u64::from_le_bytes(*bytes))
}

fn config(mode: &str, listen: &str, connect: &str) -> Outcome<Config> {
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
        config.insert_json5(key, &value)?;
    }
    Ok(config)
}

fn router() -> Outcome<(Session, String)> {
    let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let router = open(config("router", &endpoint, "")?).wait()?;
    Ok((router, endpoint))
}

/// Passes one connection on and counts what comes back.
struct Counter {
    address: SocketAddr,
    bytes: Arc<AtomicU64>,
}

impl Counter {
    fn start(to: String) -> Outcome<Self> {
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
            })?;
        Ok(Self { address, bytes })
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
