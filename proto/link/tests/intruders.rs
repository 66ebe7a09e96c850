//! People in the middle and at the door: another certificate, a relayed proof, a stolen credential, guesses.

use crate::support::*;
use ring::digest::{SHA256, digest};
use std::{
    net::{SocketAddr, UdpSocket},
    time::{Duration, Instant},
};
use taut_link::{
    ClientOptions, Credential, FloodLimits, Holder, LinkError, Role, ServerLink, ServerOptions,
    ServerPin, binding,
};
use taut_proto::{
    Header, Kind, PROTOCOL_VERSION,
    control::{ControlMessage, Hello, LENGTH_BYTES, RefusalCode},
    header::{HEADER_BYTES, TAG_BYTES},
    limits::{JoinLimits, Rate},
    proof::{Claim, Grant},
};
use tokio::sync::mpsc;

/// Stands between with a certificate of his own, and passes on what each side says.
struct Middle {
    address: SocketAddr,
    pin: ServerPin,
    /// What clients said to it.
    heard: mpsc::UnboundedReceiver<Vec<u8>>,
}

impl Middle {
    fn between(server: &ServerLink) -> Middle {
        let identity = must(rcgen::generate_simple_self_signed(["taut".to_owned()]));
        let spki = must(rustls::server::ParsedCertificate::try_from(
            identity.cert.der(),
        ))
        .subject_public_key_info();
        let private =
            rustls::pki_types::PrivatePkcs8KeyDer::from(identity.signing_key.serialize_der());
        let endpoint = raw_server(identity.cert.der().clone(), private);
        let address = must(endpoint.local_addr());
        let (hears, heard) = mpsc::unbounded_channel();
        let (real, pin) = (server.quic_addr(), server.pin());
        tokio::spawn(async move {
            while let Some(incoming) = endpoint.accept().await {
                if let Ok(victim) = incoming.await {
                    let _ = relay(victim, real, pin, hears.clone()).await;
                }
            }
        });
        Middle {
            address,
            pin: ServerPin::of_spki(&spki),
            heard,
        }
    }
}

async fn relay(
    victim: quinn::Connection,
    real: SocketAddr,
    pin: ServerPin,
    hears: mpsc::UnboundedSender<Vec<u8>>,
) -> Option<()> {
    let onward = raw_connection(real, raw_config(pin)).await;
    let (mut to_victim, mut from_victim) = victim.accept_bi().await.ok()?;
    let (mut to_server, mut from_server) = onward.open_bi().await.ok()?;
    let up = async {
        while let Ok(Some(chunk)) = from_victim.read_chunk(4096, true).await {
            let _ = hears.send(chunk.bytes.to_vec());
            to_server.write_all(&chunk.bytes).await.ok()?;
        }
        Some(())
    };
    let down = async {
        while let Ok(Some(chunk)) = from_server.read_chunk(4096, true).await {
            to_victim.write_all(&chunk.bytes).await.ok()?;
        }
        let _ = to_victim.finish();
        let _ = to_victim.stopped().await;
        Some(())
    };
    tokio::join!(up, down);
    Some(())
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_man_in_the_middle_with_his_own_certificate_hears_nothing() {
    let server = server().await;
    let mut middle = Middle::between(&server);
    for credential in [
        None,
        Some(key('a').credential(Role::Render, Holder::Node("left".to_owned()), 1)),
    ] {
        let mut options = options(&server, Role::Render, "left");
        options.server = middle.address.to_string();
        if let Some(credential) = credential {
            options.key = credential.into();
        }
        match error_of(options).await {
            LinkError::WrongServer { wanted, found, .. } => {
                assert_eq!(wanted, server.pin());
                assert_eq!(found, middle.pin);
            }
            other => panic!("{other}"),
        }
    }
    assert!(
        middle.heard.try_recv().is_err(),
        "the client said something"
    );
    assert!(server.clients().is_empty());
}

/// A credential that names another server, with a check that fits: what somebody would hand to a victim.
fn doctored(credential: &Credential, pin: ServerPin) -> Credential {
    let text = credential
        .to_text()
        .replace(&credential.pin().to_hex(), &pin.to_hex());
    let (lines, _) = text
        .split_once("check ")
        .unwrap_or_else(|| panic!("{text}"));
    let check: String = digest(&SHA256, lines.as_bytes()).as_ref()[..8]
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    must(Credential::parse(&format!("{lines}check {check}\n")))
}

/// Even a victim that was made to trust the man in the middle gives him nothing that the server takes.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_proof_that_is_passed_on_is_refused_by_the_server() {
    let server = server().await;
    let mut middle = Middle::between(&server);
    let credential = key('a').credential(Role::Render, Holder::Node("left".to_owned()), 1);
    let mut options = options(&server, Role::Render, "left");
    options.server = middle.address.to_string();
    options.key = doctored(&credential, middle.pin).into();
    let error = error_of(options).await;
    assert!(matches!(error, LinkError::WrongKey { .. }), "{error}");
    assert!(middle.heard.try_recv().is_ok(), "he did pass it on");
    assert_eq!(server.counters().wrong_key, 1);
    assert!(server.clients().is_empty());
}

/// Says `hello` on a connection of its own; what the server answers.
async fn answer(connection: &quinn::Connection, hello: Hello) -> ControlMessage {
    let (_send, mut recv) = say(connection, &frame(&ControlMessage::Hello(hello))).await;
    let mut length = [0; LENGTH_BYTES];
    must(recv.read_exact(&mut length).await);
    let mut body = vec![0; u32::from_le_bytes(length) as usize];
    must(recv.read_exact(&mut body).await);
    must(ControlMessage::from_frame_body(&body))
}

fn claim() -> Claim<'static> {
    Claim {
        role: Role::Render,
        node: "left",
        grant: Grant::Node { issue: 1 },
    }
}

fn assert_wrong_key(answer: &ControlMessage, what: &str) {
    match answer {
        ControlMessage::Refused(refusal) => {
            assert_eq!(refusal.code, RefusalCode::WrongKey, "{what}");
        }
        other => panic!("{what}: {}", other.name()),
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_proof_counts_on_its_own_connection_and_for_its_own_claim_only() {
    let server = server_with(limiting(JoinLimits {
        free_failures: u8::MAX - 1, // these attempts come from one address
        ..JoinLimits::default()
    }))
    .await;
    let secret = key('a').join_secret(claim().role, claim().node, claim().grant);
    let open = || raw_connection(server.quic_addr(), raw_config(server.pin()));

    let (one, other) = (open().await, open().await);
    let proof = secret.client_proof(&must(binding::proof_binding(&one)), claim());
    assert_wrong_key(&answer(&other, hello(claim(), proof)).await, "elsewhere");

    // The stolen secret of one credential, for everything that it is not.
    let (role, node, grant) = (claim().role, claim().node, claim().grant);
    for (role, node, grant) in [
        (Role::Device, node, grant),
        (Role::Operator, node, grant),
        (role, "right", grant),
        (role, node, Grant::Master),
        (role, node, Grant::Node { issue: 2 }),
        (role, node, Grant::AnyNode { issue: 1 }),
    ] {
        let wrong = Claim { role, node, grant };
        let connection = open().await;
        let exporter = must(binding::proof_binding(&connection));
        let proof = secret.client_proof(&exporter, wrong);
        let answer = answer(&connection, hello(wrong, proof)).await;
        assert_wrong_key(&answer, &format!("{wrong:?}"));
    }
    let own = open().await;
    let proof = secret.client_proof(&must(binding::proof_binding(&own)), claim());
    match answer(&own, hello(claim(), proof)).await {
        ControlMessage::Welcome(_) => {}
        other => panic!("where it belongs it counts: {}", other.name()),
    }
}

/// With other limits of joining.
fn limiting(joins: JoinLimits) -> ServerOptions {
    ServerOptions {
        limits: FloodLimits {
            joins,
            ..FloodLimits::default()
        },
        ..forgiving()
    }
}

/// The holder of a stolen render credential serves with a key of his own: nobody takes him for the server.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_credential_does_not_make_a_server() {
    let impostor = server_with(ServerOptions::loopback(key('b'))).await;
    let victim = key('a').credential(Role::Device, Holder::Node("bridge".to_owned()), 1);
    let error = error_of(ClientOptions {
        key: victim.into(),
        ..options(&impostor, Role::Device, "bridge")
    })
    .await;
    assert!(matches!(error, LinkError::WrongServer { .. }), "{error}");
    assert_eq!(impostor.counters().refused, 0, "no Hello came");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn guesses_are_slowed_down_and_who_holds_the_key_gets_in_all_the_same() {
    let server = server().await;
    let open = || async {
        let endpoint = raw_endpoint(raw_config(server.pin()));
        must(endpoint.connect(server.quic_addr(), "taut")).await
    };
    let mut answered = 0;
    while server.counters().turned_away == 0 {
        if let Ok(connection) = open().await {
            let answer = answer(&connection, hello(claim(), [0; 32])).await;
            assert_wrong_key(&answer, "a guess");
            answered += 1;
        }
        assert!(answered < 200, "nobody was turned away");
    }
    assert!(
        answered >= 4,
        "three guesses are free, the fourth costs a wait"
    );
    client(&server, Role::Render, "left").await.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn many_attempts_at_once_must_prove_their_address_and_are_bounded() {
    let server = server_with(limiting(JoinLimits {
        attempts: Rate {
            per_second: 1,
            burst: 20,
        },
        ..JoinLimits::default()
    }))
    .await;
    // Forty who say nothing: each would hold a place for as long as joining may take.
    let silent: Vec<_> = (0..40)
        .map(|_| {
            let (address, pin) = (server.quic_addr(), server.pin());
            tokio::spawn(async move {
                let endpoint = raw_endpoint(raw_config(pin));
                let connection = must(endpoint.connect(address, "taut")).await;
                tokio::time::sleep(PATIENCE).await;
                drop(connection);
            })
        })
        .collect();
    wait_until("checks and refusals", || {
        let counters = server.counters();
        counters.address_checks > 0 && counters.turned_away > 0
    })
    .await;
    for task in silent {
        task.abort();
    }
}

/// The first packet of an attempt to join `server`, kept from it.
fn first_packet(server: &ServerLink) -> Vec<u8> {
    let heard = must(UdpSocket::bind(ANY));
    must(heard.set_read_timeout(Some(PATIENCE)));
    let endpoint = raw_endpoint(raw_config(server.pin()));
    let joining = must(endpoint.connect(must(heard.local_addr()), "taut"));
    let mut packet = vec![0; 2048];
    let length = must(heard.recv(&mut packet));
    packet.truncate(length);
    drop(joining);
    packet
}

/// Whoever names a node's address as his own hears no answer, and uses up nothing of what that address may do.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn first_packets_under_a_node_s_address_do_not_keep_it_out() {
    const PACKETS: u64 = 16;
    let server = server_with(limiting(JoinLimits {
        attempts: Rate {
            per_second: 1,
            burst: 4,
        },
        ..JoinLimits::default()
    }))
    .await;
    let forger = must(UdpSocket::bind(ANY));
    for _ in 0..PACKETS {
        must(forger.send_to(&first_packet(&server), server.quic_addr()));
    }
    wait_until("an end of each packet", || {
        let counters = server.counters();
        counters.address_checks + counters.turned_away + 4 >= PACKETS
    })
    .await;
    assert_eq!(server.counters().turned_away, 0, "its attempts are used up");
    client(&server, Role::Render, "left").await.close().await;
    let counters = server.counters();
    assert_eq!(counters.turned_away, 0);
    assert!(
        counters.address_checks > PACKETS,
        "its own was checked, too"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_is_turned_away_for_long_is_told_so() {
    let server = server_with(limiting(JoinLimits {
        at_once: 0,
        ..JoinLimits::default()
    }))
    .await;
    let error = error_of(ClientOptions {
        connect_timeout: Duration::from_secs(1),
        ..options(&server, Role::Render, "left")
    })
    .await;
    assert!(matches!(error, LinkError::TurnedAway { .. }), "{error}");
    assert!(server.counters().turned_away > 0);
}

/// Somebody on the path has seen epoch and session number: what he sends costs the server no cryptography beyond his rate, and the client whose
/// number he uses none of its own.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn forged_datagrams_of_an_unknown_source_are_opened_at_its_rate_only() {
    let of_one = Rate {
        per_second: 1,
        burst: 8,
    };
    let server = server_with(ServerOptions {
        limits: FloodLimits {
            unknown_source: of_one,
            ..FloodLimits::default()
        },
        ..forgiving()
    })
    .await;
    let device = client(&server, Role::Device, "bridge").await;
    all_have_paths(&server).await;
    let header = Header {
        version: PROTOCOL_VERSION,
        kind: Kind::Input,
        epoch: server.epoch(),
        sender: device.session(),
        flags: 0,
        sequence: 1 << 30,
        length: 32,
    };
    let mut forged = header.to_bytes().to_vec();
    forged.resize(HEADER_BYTES + 32 + TAG_BYTES, 0x5a);
    let start = Instant::now();
    let socket = must(UdpSocket::bind(ANY));
    // However many the full buffer of the socket did not take.
    wait_until("many of them", || {
        for _ in 0..20 {
            must(socket.send_to(&forged, server.udp_addr()));
        }
        let counters = server.counters();
        counters.forged + counters.flooded >= 200
    })
    .await;
    a_reading_arrives(&device, &server).await;
    let most = 8.0 + start.elapsed().as_secs_f64() + 1.0;
    let opened = server.counters().forged as f64;
    assert!(opened >= 1.0 && opened <= most, "{opened} of {most}");
}
