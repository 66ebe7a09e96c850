//! A workbench publishes through a router, a second router carries it on, and observers at both see the same.

use std::collections::BTreeSet;
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::Value;
use taut_observers::{Hello, StateFeed, state_channel};
use taut_proto::codec::decode;
use taut_proto::scene::BodyDescription;
use taut_proto::state::{EventRecord, RunState, ToolState, event_code};
use taut_proto::{HotState, MeshHash, PoseF64, SceneDescription};
use taut_zenoh::{
    Domain, RosSettings, RosWrenchSettings, RosWrenchSubscriber, SessionTime, ZenohPublisher,
    ZenohSettings,
};
use zenoh::{Config, Session, Wait};

/// Far above what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(60);

fn config(mode: &str, listen: &str, connect: &str) -> Config {
    let mut config = Config::default();
    for (key, value) in [
        ("mode", format!("\"{mode}\"")),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("listen/endpoints", format!("[{listen}]")),
        ("connect/endpoints", format!("[{connect}]")),
    ] {
        config.insert_json5(key, &value).expect("a key of Zenoh's");
    }
    config
}

/// A router on a free port of the loopback address, linked to `connect`; and where it is.
fn router(connect: &str) -> (Session, String) {
    let end = Instant::now() + PATIENCE;
    loop {
        let port = TcpListener::bind("127.0.0.1:0")
            .and_then(|socket| socket.local_addr())
            .expect("a free port")
            .port();
        let endpoint = format!("\"tcp/127.0.0.1:{port}\"");
        match zenoh::open(config("router", &endpoint, connect)).wait() {
            Ok(session) => return (session, endpoint),
            // Somebody else took the port in between.
            Err(error) => assert!(Instant::now() < end, "no router: {error}"),
        }
    }
}

fn hello() -> Hello {
    let body = BodyDescription {
        name: "ball".to_owned().into(),
        mesh: MeshHash::of(b""),
        pose: PoseF64::IDENTITY,
        colour: [1.0; 4],
    };
    Hello {
        workbench: "bench".to_owned(),
        program: "taut test".to_owned(),
        rate: 100.0,
        scene: SceneDescription {
            obstacles: vec![body.clone()],
            ..SceneDescription::of_body("ball-on-ball", body)
        },
    }
}

/// States every 5 ms, an event with every 20th, until it is asked to end.
fn workbench(stop: &Arc<AtomicBool>) -> StateFeed {
    let (mut outlet, feed) = state_channel();
    let stop = stop.clone();
    std::thread::Builder::new()
        .name("workbench".to_owned())
        .spawn(move || {
            let mut state = HotState::empty();
            state.run = RunState::Running;
            state.tools.push(ToolState::default());
            while !stop.load(Ordering::Relaxed) {
                state.tick += 1;
                state.tools[0].force = [0.0, 0.0, state.tick as f32];
                if state.tick.is_multiple_of(20) {
                    let id = state.tick as u32 / 20;
                    state.events.clear();
                    state.events.push(EventRecord {
                        id,
                        tick: state.tick as u32,
                        code: event_code::CONTACT_ON,
                    });
                }
                outlet.publish(&state);
                std::thread::sleep(Duration::from_millis(5));
            }
        })
        .expect("a thread");
    feed
}

fn settings(connect: &str) -> ZenohSettings {
    ZenohSettings {
        name: "bench".to_owned(),
        connect: vec![connect.trim_matches('"').to_owned()],
        config: None,
        rate: 100.0,
        naming: |_| None,
        ros: None,
    }
}

fn publisher(connect: &str, feed: StateFeed) -> ZenohPublisher {
    ZenohPublisher::start(settings(connect), &hello(), feed).expect("a good configuration")
}

fn line(payload: &zenoh::bytes::ZBytes) -> Value {
    serde_json::from_slice(&payload.to_bytes()).expect("JSON")
}

#[test]
fn observers_at_two_routers_see_states_events_and_the_hello_that_they_ask_for() {
    let (_first, first) = router("");
    let (_second, second) = router(&first);
    let stop = Arc::<AtomicBool>::default();
    let publisher = publisher(&first, workbench(&stop));
    assert_eq!(publisher.prefix(), "taut/bench");

    for endpoint in [&first, &second] {
        let observer = zenoh::open(config("client", "", endpoint))
            .wait()
            .expect("a router");
        let subscribe = |key: &str| observer.declare_subscriber(key.to_owned()).wait();
        let states = subscribe("taut/bench/state").expect("a subscription");
        let hot = subscribe("taut/bench/hot").expect("a subscription");
        let events = subscribe("taut/bench/event").expect("a subscription");
        let mut tick = 0;
        for _ in 0..20 {
            let sample = states
                .recv_timeout(PATIENCE)
                .expect("open")
                .expect("a state");
            let line = line(sample.payload());
            let now = line["tick"].as_u64().expect("a number");
            assert!(now > tick, "newer each time");
            assert_eq!(line["tools"][0]["force"][2].as_f64(), Some(now as f64));
            tick = now;
        }
        let sample = hot.recv_timeout(PATIENCE).expect("open").expect("a state");
        let state: HotState = decode(&sample.payload().to_bytes()).expect("the HOT payload");
        assert_eq!(state.tools[0].force[2], state.tick as f32);
        let mut ids = BTreeSet::new();
        while ids.len() < 3 {
            let sample = events
                .recv_timeout(PATIENCE)
                .expect("open")
                .expect("an event");
            let line = line(sample.payload());
            assert_eq!(line["kind"], "contact-on");
            assert!(ids.insert(line["id"].as_u64()), "each once");
        }
        // The query finds the answer once the routers have told each other of it.
        let end = Instant::now() + PATIENCE;
        let hello = loop {
            let replies = observer.get("taut/bench/hello").wait().expect("a query");
            let answer = replies
                .iter()
                .find_map(|reply| reply.result().ok().map(|sample| line(sample.payload())));
            match answer {
                Some(hello) => break hello,
                None => assert!(Instant::now() < end, "nobody says hello"),
            }
        };
        assert_eq!(hello["scene"], "ball-on-ball");
    }
    assert!(publisher.published() > 20);
    stop.store(true, Ordering::Relaxed);
}

#[test]
fn a_router_that_comes_later_is_found() {
    let (first, endpoint) = router("");
    first.close().wait().expect("closed");
    let stop = Arc::<AtomicBool>::default();
    let publisher = publisher(&endpoint, workbench(&stop));
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(publisher.published(), 0);
    let end = Instant::now() + PATIENCE;
    let _router = loop {
        match zenoh::open(config("router", &endpoint, "")).wait() {
            Ok(router) => break router,
            // Somebody else has the port for a moment.
            Err(error) => assert!(Instant::now() < end, "no router: {error}"),
        }
        std::thread::sleep(Duration::from_millis(100));
    };
    while publisher.published() == 0 {
        assert!(Instant::now() < end, "the router is not found");
        std::thread::sleep(Duration::from_millis(20));
    }
    stop.store(true, Ordering::Relaxed);
}

#[test]
fn a_wrong_configuration_is_said_at_once_and_an_end_without_a_router_does_not_wait() {
    let (_, feed) = state_channel();
    let refused = ZenohPublisher::start(settings("no endpoint"), &hello(), feed);
    let error = refused.expect_err("no endpoint").to_string();
    assert!(error.contains("connect"), "{error}");
    let (_, feed) = state_channel();
    let missing = ZenohSettings {
        config: Some("/nowhere/zenoh.json5".into()),
        ..settings("tcp/127.0.0.1:1")
    };
    assert!(ZenohPublisher::start(missing, &hello(), feed).is_err());

    let (_, feed) = state_channel();
    drop(publisher("tcp/127.0.0.1:1", feed));
}

#[test]
fn no_two_nodes_of_ros_have_the_same_name() {
    let (_router, endpoint) = router("");
    let connect = vec![endpoint.trim_matches('"').to_owned()];
    let stop = Arc::<AtomicBool>::default();
    let settings = ZenohSettings {
        ros: Some(RosSettings {
            domain: Domain(7),
            session_time: SessionTime::reading(Duration::ZERO),
        }),
        ..settings(&endpoint)
    };
    let _publisher =
        ZenohPublisher::start(settings, &hello(), workbench(&stop)).expect("a good configuration");
    let wrench = RosWrenchSettings {
        name: "bench".to_owned(),
        connect,
        config: None,
        domain: Domain(7),
        topic: "/ft_sensor/wrench".to_owned(),
        allow_unproven: false,
    };
    let _subscriber = RosWrenchSubscriber::start(wrench, |_| {}).expect("a router here");

    let observer = zenoh::open(config("client", "", &endpoint))
        .wait()
        .expect("a router");
    let end = Instant::now() + PATIENCE;
    let nodes: BTreeSet<String> = loop {
        let replies = observer.liveliness().get("@ros2_lv/7/*/0/0/NN/**");
        let tokens: Vec<String> = replies
            .wait()
            .expect("a query")
            .iter()
            .filter_map(|reply| Some(reply.result().ok()?.key_expr().to_string()))
            .collect();
        assert!(Instant::now() < end, "not both are there: {tokens:?}");
        if tokens.len() == 2 {
            let names = tokens.iter().map(|token| {
                let (_, name) = token.split_once("/NN/").expect("a node's token");
                name.to_owned()
            });
            break names.collect();
        }
    };
    let expected = ["%/%bench/taut", "%/%bench/taut_wrench_in"];
    assert_eq!(nodes, BTreeSet::from(expected.map(str::to_owned)));
    stop.store(true, Ordering::Relaxed);
}
