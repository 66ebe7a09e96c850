//! Two ends on real sockets: joining, scene, states, device, clock, leaving.

use crate::support::*;
use std::time::Duration;
use taut_link::{
    ClientOptions, Content, DeviceInput, LinkError, LinkEvent, Role, ServerLink, ServerOptions,
    Transport, serve,
};
use taut_proto::{
    ClientStats, Finish, Look, Looks, MeshHash, Panorama, Texture, TextureUse, Textures, Wrap,
    WrenchCommand,
    control::{LogLevel, RefusalCode},
    stats::DrawnState,
};

fn inputs(server: &ServerLink) -> triple_buffer::Output<Option<DeviceInput>> {
    let inputs = server.device_inputs();
    inputs.expect("the first taker gets the inputs")
}

async fn states_arrive_over(transport: Transport) {
    let server = server().await;
    let client = node_over(transport, &server, "left").await;

    assert_eq!(client.description(), &content().description);
    for mesh in content().meshes {
        let hash = hash_of(&mesh);
        let fetched = must(client.mesh(hash).await);
        assert_eq!(*fetched, mesh);
        let again = must(client.mesh(hash).await);
        assert!(
            std::sync::Arc::ptr_eq(&fetched, &again),
            "the second time it comes from memory"
        );
    }

    take_states(&server, &client, 1, 500).await;
    assert_eq!(server.counters().garbage + server.counters().forged, 0);
    let status = &server.clients()[0];
    assert_eq!(
        (status.node.as_str(), status.role, status.transport),
        ("left", Role::Render, transport)
    );
    assert!(status.packets_sent >= 500);
    assert_eq!(status.udp_address.is_some(), transport == Transport::Udp);
    client.close().await;
    server.shutdown().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn states_arrive_in_order_over_udp() {
    states_arrive_over(Transport::Udp).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn states_arrive_in_order_over_quic_datagrams() {
    states_arrive_over(Transport::QuicDatagram).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_joins_late_gets_everything() {
    let server = server().await;
    let first = client(&server, Role::Render, "left").await;
    let tick = take_states(&server, &first, 1, 50).await;

    let late = client(&server, Role::Render, "late").await;
    assert_eq!(late.description(), first.description());
    let hash = late.description().obstacles[0].mesh;
    let mesh = late
        .mesh(hash)
        .await
        .unwrap_or_else(|error| panic!("{error}: {:?}", late.is_closed()));
    assert_eq!(mesh.triangles().len(), 27_000);
    let (mut of_first, mut of_late) = (Vec::new(), Vec::new());
    broadcast_until(&mut server.broadcaster(), tick, || {
        first.drain_states(&mut of_first);
        late.drain_states(&mut of_late);
        of_late.len() >= 50
    })
    .await;
    assert_in_order(&of_late);

    // The same ticks are the same states on both.
    for received in &of_late {
        if let Some(other) = of_first
            .iter()
            .find(|other| other.state.tick == received.state.tick)
        {
            assert_eq!(other.state_hash, received.state_hash);
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_gets_no_more_states_than_it_asked_for() {
    let server = server().await;
    let slow = join(ClientOptions {
        rate_hz: 100,
        ..options(&server, Role::Observer, "slow")
    })
    .await;
    let (_, states) = states_of(&server, &slow, 1, 20).await;
    for pair in states.windows(2) {
        assert!(
            pair[1].state.tick - pair[0].state.tick >= 9,
            "100 of 1000 states per second"
        );
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn device_input_reaches_the_haptics_loop_and_the_wrench_comes_back() {
    let server = server().await;
    let mut inputs = inputs(&server);
    assert!(server.device_inputs().is_none(), "there is one reader");
    let bridge = client(&server, Role::Device, "bridge").await;
    let mut index = 0;
    wait_until("input", || {
        index += 1;
        bridge.send_input(&input(index));
        inputs.read().is_some_and(|taken| taken.sample.index >= 5)
    })
    .await;
    let Some(taken) = *inputs.read() else {
        panic!("an input was read before");
    };
    assert_eq!(taken.sample, input(taken.sample.index));
    assert_eq!(taken.session, bridge.session());
    assert!(taken.received_ns <= server.clock().now_ns());

    let mut broadcaster = server.broadcaster();
    let command = WrenchCommand {
        time_ns: 1,
        origin_ns: taken.sample.sample_time_ns,
        wrench: [0.0, 1.0, 0.0, 0.0, 0.0, 0.01],
        obstacle_work: -0.5,
        flags: 0,
    };
    wait_until("wrench", || {
        broadcaster.send_wrench(&command);
        bridge.latest_wrench().is_some()
    })
    .await;
    assert_eq!(
        bridge.latest_wrench().map(|wrench| wrench.command),
        Some(command)
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn device_input_of_a_render_node_is_refused() {
    let server = server().await;
    let mut inputs = inputs(&server);
    let render = client(&server, Role::Render, "left").await;
    wait_until("refusal", || {
        render.send_input(&input(1));
        server.counters().inputs_refused >= 3
    })
    .await;
    assert_eq!(*inputs.read(), None);
    assert_eq!(server.counters().inputs, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_device_pose_that_is_no_pose_never_reaches_the_loop() {
    let server = server().await;
    let mut inputs = inputs(&server);
    let bridge = client(&server, Role::Device, "bridge").await;
    let mut bent = input(1);
    bent.pose.rotation = [0.5, 0.0, 0.0, 0.0];
    wait_until("refusal", || {
        bridge.send_input(&bent);
        server.counters().inputs_refused >= 3
    })
    .await;
    let mut nan = input(2);
    nan.pose.position[0] = f64::NAN;
    let errors = bridge.counters().send_errors;
    bridge.send_input(&nan);
    assert_eq!(
        bridge.counters().send_errors,
        errors + 1,
        "NaN does not even leave"
    );
    assert_eq!(*inputs.read(), None);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn there_is_one_device_bridge() {
    let server = server().await;
    let _bridge = client(&server, Role::Device, "bridge").await;
    let (code, text) = refusal_of(options(&server, Role::Device, "second")).await;
    assert_eq!(code, RefusalCode::DeviceTaken);
    assert!(text.contains("\"bridge\""), "{text}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn session_time_is_within_its_stated_uncertainty() {
    for transport in [Transport::Udp, Transport::QuicDatagram] {
        let server = server().await;
        let client = node_over(transport, &server, "left").await;
        wait_until("clock lock", || client.session_now().is_some()).await;
        tokio::time::sleep(Duration::from_millis(300)).await;
        for _ in 0..20 {
            let before = server.clock().now_ns();
            let time = client.session_now().expect("a locked clock stays locked");
            let after = server.clock().now_ns();
            assert!(
                time.ns + time.uncertainty_ns >= before,
                "{time:?} is before {before}"
            );
            assert!(
                time.ns <= after + time.uncertainty_ns,
                "{time:?} is after {after}"
            );
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        wait_until("a round trip as short as loopback's", || {
            client
                .round_trip()
                .is_some_and(|time| time < Duration::from_millis(50))
        })
        .await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn reports_and_log_lines_reach_the_server_and_drawn_states_are_compared() {
    let server = server().await;
    let client = client(&server, Role::Render, "left").await;
    let (_, states) = states_of(&server, &client, 1, 3).await;
    let drawn = |received: &taut_link::ReceivedState, flip: u64| DrawnState {
        tick: received.state.tick,
        state_hash: received.state_hash ^ flip,
    };
    let stats = ClientStats {
        frames: 60,
        fps: 59.9,
        drawn: vec![
            drawn(&states[0], 0),
            drawn(&states[1], 0),
            drawn(&states[2], 1),
        ],
        ..ClientStats::default()
    };
    assert!(client.post_stats(stats.clone()));
    assert!(client.post_log(LogLevel::Warning, "software rendering".to_owned()));
    event(&server, "log", |event| matches!(event, LinkEvent::Log { node, event } if node == "left" && event.level == LogLevel::Warning)).await;
    let status = &server.clients()[0];
    assert_eq!(status.stats.as_ref(), Some(&stats));
    assert_eq!(
        (status.state_hash_matches, status.state_hash_mismatches),
        (2, 1)
    );
    client.close().await;
    let left = event(&server, "leaving", |event| {
        matches!(event, LinkEvent::Left { .. })
    })
    .await;
    let LinkEvent::Left { status, reason } = left else {
        panic!("it was just matched");
    };
    assert_eq!(status.stats, Some(stats));
    assert_eq!(reason, "the node left");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn clients_hear_that_the_server_stops() {
    let server = server().await;
    let client = client(&server, Role::Render, "left").await;
    assert_eq!(client.is_closed(), None);
    server.shutdown().await;
    wait_until("closing", || client.is_closed().is_some()).await;
    assert_eq!(client.is_closed().as_deref(), Some("server is stopping"));
    assert!(!client.post_stats(ClientStats::default()));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_that_has_stopped_has_freed_its_port() {
    let mut quic = ServerOptions::loopback(key('a')).quic;
    for _ in 0..40 {
        let options = ServerOptions {
            quic,
            ..forgiving()
        };
        let server = server_with(options).await;
        quic = server.quic_addr();
        let _client = client(&server, Role::Render, "left").await;
        server.shutdown().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_mesh_that_the_server_lacks_is_an_error_and_the_link_lives_on() {
    let server = server().await;
    let client = client(&server, Role::Render, "left").await;
    let missing = MeshHash::of(b"no mesh");
    assert!(matches!(
        client.mesh(missing).await,
        Err(LinkError::NoSuchMesh { .. })
    ));
    assert!(
        client
            .mesh(client.description().god_object.mesh)
            .await
            .is_ok()
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_host_name_will_do() {
    let server = server().await;
    let port = server.quic_addr().port();
    let by_name = ClientOptions {
        server: format!("localhost:{port}"),
        ..options(&server, Role::Observer, "named")
    };
    assert!(taut_link::connect(by_name).await.is_ok());
}

async fn assert_content_refused(content: Content, names: &str) {
    match not_served(ServerOptions::loopback(key('a')), content).await {
        LinkError::Content { reason } => assert!(reason.contains(names), "{reason}"),
        other => panic!("{other}"),
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn content_without_its_meshes_is_not_served() {
    let mut content = content();
    content.meshes.pop();
    assert_content_refused(content, "\"box\"").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_light_around_the_scene_comes_by_its_hash_and_is_not_served_without() {
    let light = Panorama::from_fn(|column, row| [column as f32, row as f32, 1.0]);
    let hash = MeshHash::of(&light.encode());
    let mut content = content();
    content.description.environment = Some(hash);
    assert_content_refused(content.clone(), "panorama").await;
    content.panorama = Some(light.clone());
    let server = must(serve(ServerOptions::loopback(key('a')), content).await);
    let client = client(&server, Role::Render, "left").await;
    assert_eq!(client.description().environment, Some(hash));
    assert_eq!(must(client.panorama(hash).await), light);
    // A mesh is no light.
    let mesh = client.description().god_object.mesh;
    assert!(matches!(
        client.panorama(mesh).await,
        Err(LinkError::BadMesh { .. })
    ));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn textures_come_by_their_hash_and_no_mesh_is_served_without_its_own() {
    let texture = must(Texture::new((2, 1), vec![[255, 0, 0, 255], [0, 0, 255, 9]]));
    let hash = MeshHash::of(&texture.encode());
    let mut content = content();
    let mesh = content.meshes.remove(0);
    let triangles = mesh.triangles().len();
    let looks = Looks {
        list: vec![Look {
            colour: [1.0; 3],
            finish: Finish {
                roughness: 0.5,
                metallic: 0.0,
            },
        }],
        of_triangles: vec![0; triangles],
    };
    let textures = Textures {
        list: vec![TextureUse {
            texture: hash,
            wrap: [Wrap::Repeat, Wrap::Clamp],
        }],
        of_looks: vec![Some(0)],
        coordinates: vec![[[0.0; 2]; 3]; triangles],
    };
    let mesh = must(must(mesh.with_looks(looks)).with_textures(textures));
    content.description.god_object.mesh = MeshHash::of(&must(mesh.encode()));
    content.meshes.push(mesh.clone());
    assert_content_refused(content.clone(), "texture").await;
    content.textures.push(std::sync::Arc::new(texture.clone()));
    let server = must(serve(ServerOptions::loopback(key('a')), content).await);
    let client = client(&server, Role::Render, "left").await;
    let named = client.description().god_object.mesh;
    assert_eq!(*must(client.mesh(named).await), mesh);
    assert_eq!(must(client.texture(hash).await), texture);
    // A mesh is no texture.
    assert!(matches!(
        client.texture(named).await,
        Err(LinkError::BadMesh { .. })
    ));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bridge_is_told_how_to_couple_and_gets_whole_constraint_sets() {
    use taut_proto::constraints::{ConstraintRow, SET_PAUSED, SetHead};
    use taut_proto::{ConstraintSet, CouplingOffer, Division};

    let offer = CouplingOffer::AtServer {
        reason: "as this test says".into(),
    };
    let server = server_with(ServerOptions {
        coupling: offer.clone(),
        ..ServerOptions::loopback(key('a'))
    })
    .await;
    let bridge = client(&server, Role::Device, "bridge").await;
    let watcher = client(&server, Role::Observer, "watcher").await;
    assert_eq!(bridge.coupling(), Some(&offer));
    assert_eq!(watcher.coupling(), None);

    let mut set = ConstraintSet::new();
    set.head = SetHead {
        sequence: 1,
        ..SetHead::default()
    };
    set.rows.resize(60, ConstraintRow::default());
    let mut broadcaster = server.broadcaster();
    let mut send = |set: &ConstraintSet| {
        let division = Division::of(set);
        for part in 0..division.parts() {
            broadcaster.send_constraints(division.part(set, part));
        }
    };
    let (mut here, mut nothing) = (ConstraintSet::new(), ConstraintSet::new());
    let mut confirmed = None;
    wait_until("a set", || {
        send(&set); // until the bridge's path is open
        confirmed = bridge.newest_set(&mut here);
        confirmed.is_some()
    })
    .await;
    assert_eq!(here, set);
    assert_eq!(watcher.newest_set(&mut nothing), None);

    // The same set again confirms it, and may say more.
    set.head.flags = SET_PAUSED;
    wait_until("a repeat", || {
        send(&set);
        bridge.newest_set(&mut here) > confirmed && here.head.flags == SET_PAUSED
    })
    .await;
    assert_eq!(here.rows.len(), 60);
    assert_eq!(bridge.counters().sets, 1);
    assert_eq!(bridge.counters().garbage, 0);
}
