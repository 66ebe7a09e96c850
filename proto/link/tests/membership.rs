//! Nodes that come, go, die and come back; servers that do.

use crate::support::*;
use std::{
    fs,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
    time::{Duration, Instant},
};
use taut_link::{
    ClientOptions, Content, LinkError, LinkEvent, LinkHealth, MeshCache, RejoinPolicy, Renewal,
    Role, ServerLink, ServerOptions, SessionEnd, SupervisedLink, connect, serve,
};
use taut_proto::{ClientStats, MeshBlob, mesh_blob::Positions};
fn joining(server: &ServerLink, node: &str) -> ClientOptions {
    options(server, Role::Render, node)
}

/// Asks until there is something new.
fn renewal<T: Send + 'static>(link: &SupervisedLink<T>) -> Renewal<T> {
    until_some("something new", || link.take_renewal())
}

#[test]
fn a_link_whose_server_dies_is_lost_and_comes_back_to_the_next_server_with_a_new_epoch() {
    let server = Mortal::start(forgiving(), None);
    let clients = runtime();
    let made = Arc::new(AtomicU32::new(0));
    let counted = made.clone();
    let prepare = move |link: Arc<taut_link::ClientLink>| {
        let number = counted.fetch_add(1, Ordering::Relaxed);
        async move {
            let mesh = link.description().god_object.mesh;
            link.mesh(mesh).await?;
            Ok::<u32, LinkError>(number)
        }
    };
    let joined = SupervisedLink::join(
        joining(&server.link, "left"),
        RejoinPolicy::default(),
        prepare,
    );
    let (supervised, first, prepared) = must(clients.block_on(joined));
    assert_eq!((prepared, supervised.health()), (0, LinkHealth::Connected));
    clients.block_on(wait_until("the clock", || first.session_now().is_some()));
    let before = first.mesh_counters();

    let addresses = server.die();
    let lost = |health| matches!(health, LinkHealth::Lost { since } if since > Duration::ZERO);
    clients.block_on(wait_until("being lost", || lost(supervised.health())));
    assert!(
        first.session_now().is_some(),
        "the clock of the lost session goes on: the age of its last state can be told"
    );

    let server = Mortal::start(forgiving(), Some(addresses));
    let Renewal::Session { link, prepared } = renewal(&supervised) else {
        panic!("a new session");
    };
    assert_eq!((prepared, supervised.sessions()), (1, 2));
    assert_eq!(link.description(), first.description());
    assert!(first.is_closed().is_some() && link.is_closed().is_none());
    assert_eq!(
        link.mesh_counters(),
        before,
        "what was fetched once is not fetched again"
    );
    clients.block_on(wait_until("the clock", || link.session_now().is_some()));
    assert_eq!(supervised.health(), LinkHealth::Connected);
    clients.block_on(take_states(&server.link, &link, 1, 11));
    assert_eq!(made.load(Ordering::Relaxed), 2);
}

#[test]
fn datagrams_of_an_old_epoch_are_refused() {
    let server = Mortal::start(forgiving(), None);
    let clients = runtime();
    // It will not notice the death of its server, and goes on sending to the next one at the same port.
    let old = ClientOptions {
        idle_timeout: Duration::from_secs(60),
        ..options(&server.link, Role::Device, "bridge")
    };
    let old = must(clients.block_on(connect(old)));
    let addresses = server.die();
    let server = Mortal::start(forgiving(), Some(addresses));
    let new = must(clients.block_on(connect(options(&server.link, Role::Device, "bridge"))));
    assert_eq!(
        old.session(),
        new.session(),
        "nothing else tells them apart"
    );
    let mut inputs = server
        .link
        .device_inputs()
        .unwrap_or_else(|| panic!("the first taker gets the inputs"));
    for index in 1..=20 {
        old.send_input(&input(1000 + index));
        new.send_input(&input(index));
    }
    clients.block_on(wait_until("counting", || {
        let counters = server.link.counters();
        counters.forged >= 20 && counters.inputs + counters.inputs_late == 20
    }));
    let newest = inputs.read().unwrap_or_else(|| panic!("an input"));
    assert_eq!(newest.sample.index, 20, "of the new epoch");
    drop(server);
}

#[test]
fn a_server_that_stops_ends_the_link_unless_it_is_to_stay() {
    let clients = runtime();
    for stay in [false, true] {
        let server = Mortal::start(forgiving(), None);
        let policy = RejoinPolicy {
            stay,
            ..RejoinPolicy::default()
        };
        let (supervised, _first) = supervised(&clients, joining(&server.link, "left"), policy);
        let Mortal {
            runtime,
            link,
            addresses,
        } = server;
        runtime.block_on(link.shutdown());
        if stay {
            let _again = Mortal::start(forgiving(), Some(addresses));
            assert!(matches!(renewal(&supervised), Renewal::Session { .. }));
        } else {
            let Renewal::Ended(end) = renewal(&supervised) else {
                panic!("the end");
            };
            assert_eq!(end, SessionEnd::ServerStopped);
        }
    }
}

#[test]
fn a_limit_that_was_named_ends_a_lost_link_and_a_failed_preparation_does_not() {
    let server = Mortal::start(forgiving(), None);
    let clients = runtime();
    let policy = RejoinPolicy {
        give_up: Some(Duration::from_millis(800)),
        ..RejoinPolicy::default()
    };
    let (supervised, _first) = supervised(&clients, joining(&server.link, "left"), policy);
    let dead = Instant::now();
    let addresses = server.die();
    assert!(matches!(
        renewal(&supervised),
        Renewal::Ended(SessionEnd::Lost(_))
    ));
    assert!(dead.elapsed() >= Duration::from_millis(800));

    // The second session cannot be made ready; the third can.
    let server = Mortal::start(forgiving(), Some(addresses));
    let tries = AtomicU32::new(0);
    let prepare = move |_| {
        let number = tries.fetch_add(1, Ordering::Relaxed);
        async move {
            if number == 1 {
                Err(LinkError::NoSuchMesh {
                    server: "here".to_owned(),
                    hash: "0".to_owned(),
                })
            } else {
                Ok(number)
            }
        }
    };
    let joined = SupervisedLink::join(
        joining(&server.link, "right"),
        RejoinPolicy::default(),
        prepare,
    );
    let (supervised, first, _) = must(clients.block_on(joined));
    first.abandon();
    let Renewal::Session { prepared, .. } = renewal(&supervised) else {
        panic!("a new session");
    };
    assert_eq!(prepared, 2);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_silent_node_is_told_evicted_and_its_name_is_free_and_who_only_watches_is_left_in_peace()
{
    let server = server_with(ServerOptions {
        idle_timeout: Duration::from_secs(60), // QUIC alone would notice nothing
        node_timeout: Duration::from_secs(2), // a node that joins on a busy machine is not silent yet
        ..ServerOptions::loopback(key('a'))
    })
    .await;
    for (role, node) in [(Role::Observer, "watcher"), (Role::Render, "left")] {
        let options = ClientOptions {
            idle_timeout: Duration::from_secs(60),
            ..options(&server, role, node)
        };
        murder(options);
    }
    let died = Instant::now();
    event(
        &server,
        "silence",
        |event| matches!(event, LinkEvent::Silent { node, .. } if node == "left"),
    )
    .await;
    let left = event(
        &server,
        "leaving",
        |event| matches!(event, LinkEvent::Left { status, .. } if status.node == "left"),
    )
    .await;
    println!("evicted {:?} after its end", died.elapsed());
    let LinkEvent::Left { reason, status } = left else {
        panic!("as asked for");
    };
    assert!(reason.contains("silent"), "{reason}");
    assert!(status.last_heard_ns > status.joined_ns);
    assert_eq!(server.counters().evicted, 1);
    assert_eq!(server.clients().len(), 1, "the watcher is there still");
    assert_eq!(server.clients()[0].node, "watcher");
    let again = client(&server, Role::Render, "left").await;
    assert_eq!(again.is_closed(), None);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn meshes_come_from_the_disk_the_second_time_and_a_damaged_one_is_fetched_again() {
    let server = server().await;
    let folder = must(tempfile::tempdir());
    let start = || async {
        let cache = must(MeshCache::open(folder.path()));
        let options = ClientOptions {
            mesh_cache: Some(Arc::new(cache)),
            ..options(&server, Role::Render, "left") // who only watches gets no meshes
        };
        let link = must(connect(options).await);
        for mesh in content().meshes {
            let got = must(link.mesh(hash_of(&mesh)).await);
            assert_eq!(*got, mesh);
        }
        let counters = link.mesh_counters();
        link.close().await;
        wait_until("leaving", || server.clients().is_empty()).await;
        counters
    };
    let bytes: u64 = content()
        .meshes
        .iter()
        .map(|mesh| mesh.encode().map_or(0, |bytes| bytes.len() as u64))
        .sum();
    let first = start().await;
    assert_eq!((first.fetched, first.fetched_bytes), (2, bytes));
    let second = start().await;
    assert_eq!((second.fetched, second.fetched_bytes), (0, 0));
    assert_eq!((second.from_cache, second.cache_bytes), (2, bytes));

    let damaged = folder
        .path()
        .join(format!("{}.tmsh", hash_of(&content().meshes[1])));
    let mut content = must(fs::read(&damaged));
    let middle = content.len() / 2;
    content[middle] ^= 1;
    must(fs::write(&damaged, content));
    let third = start().await;
    assert_eq!((third.fetched, third.from_cache, third.damaged), (1, 1, 1));
    let fourth = start().await;
    assert_eq!((fourth.fetched, fourth.from_cache), (0, 2));
}

/// A scene with one large mesh besides the usual ones, and its size in bytes.
fn heavy_content(triangles: u32) -> (Content, u64) {
    let mut content = content();
    let positions = (0..triangles + 2)
        .map(|i| [f64::from(i) * 1e-6, f64::from(i % 2) * 1e-3, 0.0])
        .collect();
    let faces = (0..triangles).map(|i| [i, i + 1, i + 2]).collect();
    let mesh = must(MeshBlob::new(Positions::F64(positions), faces, None));
    content.description.obstacles[0].mesh = hash_of(&mesh);
    let bytes = mesh.encode().map_or(0, |bytes| bytes.len() as u64);
    content.meshes.push(mesh);
    (content, bytes)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_late_node_gets_a_large_mesh_at_a_pace_that_leaves_the_others_their_states() {
    let (content, bytes) = heavy_content(280_000);
    assert!(bytes > 10_000_000);
    let server = must(serve(forgiving(), content).await);
    let early = client(&server, Role::Render, "left").await;
    let tick = take_states(&server, &early, 1, 50).await;

    let late_options = joining(&server, "late");
    let began = Instant::now();
    let late = tokio::spawn(async move {
        let late = must(connect(late_options).await);
        let mesh = late.description().obstacles[0].mesh;
        must(late.mesh(mesh).await);
        let took = began.elapsed();
        // What was sent meanwhile has been queued: the newest quarter of a second of it.
        (drain(&late).len(), took)
    });
    let mut seen = Vec::new();
    broadcast_in_step_until(
        &mut server.broadcaster(),
        tick,
        || early.counters().states,
        || {
            early.drain_states(&mut seen);
            late.is_finished()
        },
    )
    .await;
    let (queued, took) = must(late.await);
    assert_in_order(&seen);
    let gaps = seen.windows(2).map(|two| two[1].received - two[0].received);
    println!(
        "{bytes} bytes and the scene in {took:?}; the other node's longest gap meanwhile: {:?}",
        gaps.max()
    );
    let even = Duration::from_secs_f64((bytes - (256 << 10)) as f64 / f64::from(64 << 20));
    assert!(took >= even, "{took:?} is faster than the pace, {even:?}");
    assert!(queued > 0, "the states of the join wait for the node");
    assert_eq!(early.counters().lost, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_of_reports_is_read_slowly_and_costs_others_nothing() {
    let server = server().await;
    let flooding = client(&server, Role::Render, "left").await;
    let quiet = client(&server, Role::Render, "right").await;
    let stats = |frames| ClientStats {
        frames,
        ..ClientStats::default()
    };
    let began = Instant::now();
    let (mut taken, mut reports) = (0_u64, 0_u64);
    let mut quiet_reported = false;
    while began.elapsed() < Duration::from_secs(1) || !quiet_reported {
        assert!(began.elapsed() < PATIENCE, "the quiet one is not heard");
        while flooding.post_stats(stats(taken)) {
            taken += 1;
            if taken.is_multiple_of(1000) {
                tokio::task::yield_now().await;
            }
        }
        if !quiet_reported {
            quiet.post_stats(stats(7));
        }
        while let Some(event) = server.try_event() {
            match event {
                LinkEvent::Stats { node, .. } if node == "left" => reports += 1,
                LinkEvent::Stats { node, .. } if node == "right" => quiet_reported = true,
                _ => {}
            }
        }
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    let allowed = 256.0 + 100.0 * began.elapsed().as_secs_f64() + 1.0;
    assert!(reports as f64 <= allowed, "{reports} reports were taken");
    assert!(taken > reports, "the flood was larger than what was read");
    assert!(server.counters().control_delayed > 0);
    assert_eq!(server.counters().events_dropped, 0);
    assert_eq!(flooding.is_closed(), None, "slowed, not thrown out");
}
