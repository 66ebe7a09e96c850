//! What each role may do once it is in: every role against every act, over both transports; and who is shut out.

use crate::support::*;
use taut_link::{
    Act, ClientLink, ClientOptions, Credential, Holder, JoinPolicy, LinkError, LinkEvent, Role,
    ServerLink, ServerOptions, Transport,
};
use taut_proto::{
    ForceSample, HeadSample, PoseF64,
    control::{LogLevel, RefusalCode},
    revocation::Revoked,
};

fn credential(role: Role, name: &str, issue: u16) -> Credential {
    let holder = must(Holder::of(name));
    key('a').credential(role, holder, issue)
}

fn with(server: &ServerLink, role: Role, node: &str, credential: Credential) -> ClientOptions {
    ClientOptions {
        key: credential.into(),
        ..options(server, role, node)
    }
}

/// With the credential of exactly this role and name.
fn own(server: &ServerLink, role: Role, node: &str, issue: u16) -> ClientOptions {
    with(server, role, node, credential(role, node, issue))
}

fn head(index: u64) -> HeadSample {
    HeadSample {
        sample_time_ns: index * 1_000_000,
        index,
        pose: PoseF64 {
            position: [0.0, -1.0, index as f64 * 1e-3],
            ..PoseF64::IDENTITY
        },
    }
}

fn force(index: u64) -> ForceSample {
    ForceSample {
        sample_time_ns: index * 1_000_000,
        clock_uncertainty_ns: 0,
        index,
        wrench: [0.0, 0.0, index as f64, 0.0, 0.0, 0.0],
    }
}

/// Tries `act` as the client would; whether there is a way to.
async fn attempt(client: &ClientLink, act: Act) -> bool {
    match act {
        Act::GiveInput => client.send_input(&input(1)),
        Act::GiveHead => client.send_head(&head(1)),
        Act::GiveForce => client.send_force(&force(1)),
        Act::Arm => assert!(client.post_arm(true)),
        Act::Log => assert!(client.post_log(LogLevel::Info, "here".to_owned())),
        Act::Report => assert!(client.post_stats(Default::default())),
        Act::GetMeshes => {
            let _ = client.mesh(client.description().god_object.mesh).await;
        }
        // Every client does the first; the others are the server's to send, or have no datagram of their own here.
        Act::KeepPath | Act::GetStates | Act::GetWrenches | Act::KeepFrames => return false,
    }
    true
}

/// What the server shows when `act` had its effect.
fn has_effect(server: &ServerLink, act: Act) -> bool {
    let counters = server.counters();
    match act {
        Act::GiveInput => counters.inputs == 1,
        Act::GiveHead => counters.heads == 1,
        Act::GiveForce => counters.forces == 1,
        _ => {
            let mut found = false;
            while let Some(event) = server.try_event() {
                found |= matches!(
                    (act, event),
                    (Act::Arm, LinkEvent::Arm { .. })
                        | (Act::Log, LinkEvent::Log { .. })
                        | (Act::Report, LinkEvent::Stats { .. })
                );
            }
            found
        }
    }
}

async fn each_role_against_each_act(transport: Transport) {
    for (name, role) in Role::NAMED {
        for act in Act::ALL {
            let server = server().await;
            let client = join(ClientOptions {
                transport,
                ..own(&server, role, name, 1)
            })
            .await;
            if !attempt(&client, act).await {
                continue;
            }
            let what = format!("{role}: {act}");
            if role.may(act) {
                if act != Act::GetMeshes {
                    wait_until(&what, || has_effect(&server, act)).await;
                }
                assert_eq!(client.is_closed(), None, "{what}");
                assert_eq!(server.counters().forbidden, 0, "{what}");
                continue;
            }
            event(&server, &what, |event| {
                matches!(event, LinkEvent::Forbidden { node, role: r, act: a }
                    if node == name && *r == role && *a == act)
            })
            .await;
            assert_eq!(server.counters().forbidden, 1, "{what}");
            assert!(!has_effect(&server, act), "{what} had its effect");
            if matches!(act, Act::GiveInput | Act::GiveHead | Act::GiveForce) {
                assert_eq!(client.is_closed(), None, "a datagram ends no session");
            } else {
                wait_until(&what, || client.is_closed().is_some()).await;
                let reason = client.is_closed().unwrap_or_default();
                assert!(
                    reason.contains(act.name()) && reason.contains(role.name()),
                    "{reason}"
                );
            }
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_role_may_do_what_the_table_says_and_nothing_else_over_udp() {
    each_role_against_each_act(Transport::Udp).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_role_may_do_what_the_table_says_and_nothing_else_over_quic() {
    each_role_against_each_act(Transport::QuicDatagram).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn states_go_to_who_may_get_them_and_wrenches_to_the_device_alone() {
    let server = server().await;
    let mut clients = Vec::new();
    for (name, role) in Role::NAMED {
        clients.push((role, client(&server, role, name).await));
    }
    let mut broadcaster = server.broadcaster();
    let counts = |clients: &[(Role, ClientLink)]| -> Vec<(Role, u64)> {
        clients
            .iter()
            .map(|(role, client)| (*role, client.counters().states))
            .collect()
    };
    let next = broadcast_until(&mut broadcaster, 1, || {
        counts(&clients)
            .iter()
            .all(|(role, states)| *states > 0 || !role.may(Act::GetStates))
    })
    .await;
    // The tracker's path is open by now, too: it was simply not sent any.
    wait_until("time at the tracker", || {
        clients
            .iter()
            .all(|(_, client)| client.session_now().is_some())
    })
    .await;
    let _ = broadcast_until(&mut broadcaster, next, || {
        clients
            .iter()
            .any(|(_, client)| client.counters().states > 200)
    })
    .await;
    for (role, states) in counts(&clients) {
        assert_eq!(states > 0, role.may(Act::GetStates), "{role}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_newest_reading_of_the_head_reaches_both_readers() {
    let server = server().await;
    let tracker = client(&server, Role::Tracker, "tracker").await;
    let [mut one, mut other] = match server.head_inputs() {
        Some(readers) => readers,
        None => panic!("taken already"),
    };
    assert!(server.head_inputs().is_none());
    for index in [1, 3, 2] {
        // One after the other, so that each is judged in this order.
        let before = server.counters().heads + server.counters().heads_refused;
        tracker.send_head(&head(index));
        wait_until("its arrival", || {
            server.counters().heads + server.counters().heads_refused > before
        })
        .await;
    }
    wait_until("all three", || {
        server.counters().heads == 2 && server.counters().heads_refused == 1
    })
    .await;
    for reader in [&mut one, &mut other] {
        let newest = reader.read().unwrap_or_else(|| panic!("nothing"));
        assert_eq!(newest.sample, head(3));
        assert_eq!(newest.session, tracker.session());
    }
    // A rotation that is none gets no further than the link.
    tracker.send_head(&HeadSample {
        index: 4,
        pose: PoseF64 {
            rotation: [0.0; 4],
            ..PoseF64::IDENTITY
        },
        ..head(4)
    });
    wait_until("the refusal", || server.counters().heads_refused == 2).await;
    assert_eq!(one.read().map(|input| input.sample), Some(head(3)));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn there_is_one_tracker_at_a_time() {
    let server = server().await;
    let _first = client(&server, Role::Tracker, "tracker").await;
    let (code, text) = refusal_of(options(&server, Role::Tracker, "another")).await;
    assert_eq!(code, RefusalCode::TrackerTaken);
    assert!(text.contains("head tracker \"tracker\""), "{text}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_credential_is_not_even_shown_for_what_it_is_not() {
    let server = server().await;
    for (role, node) in [
        (Role::Device, "left"),
        (Role::Operator, "left"),
        (Role::Render, "right"),
    ] {
        let error = error_of(with(
            &server,
            role,
            node,
            credential(Role::Render, "left", 1),
        ))
        .await;
        assert!(matches!(error, LinkError::NotAllowed(_)), "{error}");
    }
    assert_eq!(server.counters().refused, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_revoked_credential_and_a_closed_role_stay_outside_and_a_new_issue_comes_in() {
    let revoked = |text: &str| -> Revoked { must(text.parse()) };
    let server = server_with(ServerOptions {
        policy: JoinPolicy {
            roles: vec![Role::Render, Role::Device],
            revoked: vec![revoked("left#1"), revoked("bridge")],
        },
        ..forgiving()
    })
    .await;
    for (role, name, code) in [
        (Role::Render, "left", RefusalCode::Revoked),
        (Role::Device, "bridge", RefusalCode::Revoked),
        (Role::Observer, "web", RefusalCode::RoleClosed),
    ] {
        let (found, text) = refusal_of(own(&server, role, name, 1)).await;
        assert_eq!(found, code, "{name}: {text}");
        assert!(text.contains("network."), "{text}");
    }
    assert_eq!(server.counters().shut_out, 3);
    let _second = join(own(&server, Role::Render, "left", 2)).await;
}

/// Whoever may choose his name must not keep a screen out, nor push out one that is silent for a moment.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_name_of_a_screen_is_not_for_others() {
    let server = server().await;
    let any = credential(Role::Observer, "*", 1);
    let (taken, text) = refusal_of(with(&server, Role::Observer, "left", any.clone())).await;
    assert_eq!(taken, RefusalCode::NameTaken, "{text}");
    let _free = join(with(&server, Role::Observer, "watcher", any)).await;
}

/// A client that floods is cut to its role's rate; its session, and the others', go on.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_floods_is_cut_to_his_rate_and_the_others_go_on() {
    let server = server().await;
    let flooding = client(&server, Role::Observer, "flooding").await;
    let device = client(&server, Role::Device, "bridge").await;
    all_have_paths(&server).await;
    let mut flood = 0;
    wait_until("being cut", || {
        for _ in 0..200 {
            flood += 1;
            flooding.send_input(&input(flood));
        }
        server.counters().flooded > 0
    })
    .await;
    a_reading_arrives(&device, &server).await;
    let counters = server.counters();
    assert!(counters.forbidden < flood, "{counters:?}");
    assert_eq!(flooding.is_closed(), None);
    assert_eq!(device.is_closed(), None);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_is_revoked_while_he_is_in_goes_out_and_the_others_stay() {
    let server = server().await;
    let old = own(&server, Role::Render, "left", 1);
    let left = join(old.clone()).await;
    let web = join(own(&server, Role::Observer, "web", 1)).await;
    let policy = JoinPolicy {
        revoked: vec!["left#1".parse().unwrap_or_else(|error| panic!("{error}"))],
        ..JoinPolicy::default()
    };
    assert_eq!(server.set_policy(policy.clone()), 1);
    assert_eq!(server.set_policy(policy), 0, "it is out");
    wait_until("the end", || left.is_closed().is_some()).await;
    let reason = left.is_closed().unwrap_or_default();
    assert!(reason.contains("revoked"), "{reason}");
    assert_eq!(refusal_of(old).await.0, RefusalCode::Revoked);
    assert!(web.is_closed().is_none());
    let next = credential(Role::Render, "left", 2);
    join(with(&server, Role::Render, "left", next)).await;
}
