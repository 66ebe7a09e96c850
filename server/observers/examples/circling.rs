//! A god-object that circles on a plane, served to VRPN clients and observers: for trying a client without a scene.
//!
//! `cargo run -p taut-observers --example circling -- [SECONDS]`

use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::time::{Duration, Instant};

use taut_observers::{
    Hello, StreamServer, StreamSettings, VrpnFrame, VrpnServer, VrpnSettings, state_channel,
};
use taut_proto::scene::BodyDescription;
use taut_proto::state::{RunState, ToolState};
use taut_proto::{HotState, MeshHash, PoseF64, SceneDescription};

/// Time between two states.
const PERIOD: Duration = Duration::from_millis(1);
/// Radius of the circle, m.
const RADIUS: f64 = 0.05;
/// Turns per second.
const TURNS: f64 = 0.25;

fn main() -> std::io::Result<()> {
    let seconds = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let scene = scene();
    let (mut to_vrpn, vrpn_feed) = state_channel();
    let (mut to_stream, stream_feed) = state_channel();
    let vrpn = VrpnServer::start(
        VrpnSettings {
            address: SocketAddrV4::new(Ipv4Addr::LOCALHOST, 3883),
            rate: 120.0,
            tracker: "taut".to_owned(),
            max_clients: 16,
            frame: VrpnFrame::of(&scene).unwrap_or_else(|| unreachable!("the identity is a pose")),
        },
        vrpn_feed,
    )?;
    let hello = Hello {
        workbench: "circling".to_owned(),
        program: "taut-observers example".to_owned(),
        scene,
        rate: 60.0,
    };
    let settings = StreamSettings {
        address: SocketAddr::from((Ipv4Addr::LOCALHOST, 4860)),
        rate: 60.0,
        token: None,
        max_observers: 16,
        naming: |_| None,
    };
    let stream = StreamServer::start(settings, &hello, stream_feed)?;
    println!("VRPN on {}, http://{}/", vrpn.address(), stream.address());

    let begun = Instant::now();
    let end = seconds.map(Duration::from_secs_f64);
    let mut state = HotState::empty();
    state.run = RunState::Running;
    state.scene_revision = 1;
    state.tools.push(ToolState::default());
    while end.is_none_or(|end| begun.elapsed() < end) {
        let time = begun.elapsed();
        state.tick += 1;
        state.sample_time_ns = time.as_nanos() as u64;
        circle(&mut state.tools[0], time.as_secs_f64());
        to_vrpn.publish(&state);
        to_stream.publish(&state);
        std::thread::sleep(PERIOD);
    }
    Ok(())
}

/// On a circle in the plane z = 0, pressed on it by a hand 1 mm below; button 0 is down for half of each turn.
fn circle(tool: &mut ToolState, time: f64) {
    let turn = std::f64::consts::TAU * TURNS;
    let (sine, cosine) = (turn * time).sin_cos();
    let position = [RADIUS * cosine, RADIUS * sine].map(|x| x as f32);
    tool.god_object.position = [position[0], position[1], 0.0];
    tool.device.position = [position[0], position[1], -1e-3];
    let speed = RADIUS * turn;
    tool.linear_velocity = [-speed * sine, speed * cosine, 0.0].map(|x| x as f32);
    tool.force = [0.0, 0.0, (2.0 + sine) as f32];
    tool.buttons = u16::from(sine > 0.0);
}

fn scene() -> SceneDescription {
    let body = |name: &str| BodyDescription {
        name: name.into(),
        mesh: MeshHash::of(b""),
        pose: PoseF64::IDENTITY,
        colour: [1.0; 4],
    };
    SceneDescription {
        obstacles: vec![body("plane")],
        ..SceneDescription::of_body("circle", body("ball"))
    }
}
