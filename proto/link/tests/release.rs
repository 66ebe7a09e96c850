//! Two releases meet: they agree on a version, or part by name, at both ends.

use crate::support::*;
use std::net::SocketAddr;
use taut_link::{ClientOptions, LinkError, LinkEvent, Role, ServerOptions, Transport};
use taut_proto::{
    PROTOCOL_VERSION, VersionRange,
    control::{ControlMessage, LENGTH_BYTES, RefusalCode},
};
use taut_test_kit::relay::Impairment;

/// The first messages of the release before versions were negotiated.
const VERSION_3: &str = include_str!("../../tests/golden_version_3.txt");
const NEXT: u8 = PROTOCOL_VERSION + 1;

fn range(min: u8, max: u8) -> VersionRange {
    VersionRange::new(min, max).expect("a range")
}

fn kept(name: &str) -> Vec<u8> {
    let line = VERSION_3
        .lines()
        .find_map(|line| line.strip_prefix(&format!("message/{name} ")))
        .expect("kept");
    (0..line.len() / 2)
        .map(|i| u8::from_str_radix(&line[2 * i..2 * i + 2], 16).expect("digits"))
        .collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_of_n_to_n_plus_1_and_a_client_of_n_plus_1_to_n_plus_2_speak_n_plus_1() {
    let port = relay_port();
    let server = server_with(ServerOptions {
        versions: range(PROTOCOL_VERSION, NEXT),
        announced_udp_port: Some(port.address().port()),
        ..forgiving()
    })
    .await;
    let relay = start_relay(port, server.udp_addr(), Impairment::default(), 1);
    let newer = |role, name: &str| ClientOptions {
        versions: range(NEXT, NEXT + 1),
        ..options(&server, role, name)
    };
    let render = join(newer(Role::Render, "left")).await;
    let device = join(newer(Role::Device, "bridge")).await;
    let quic = join(ClientOptions {
        transport: Transport::QuicDatagram,
        ..newer(Role::Observer, "watcher")
    })
    .await;
    // One of this release beside them is served in its own version.
    let older = join(options(&server, Role::Observer, "older")).await;
    for (link, version) in [
        (&render, NEXT),
        (&device, NEXT),
        (&quic, NEXT),
        (&older, PROTOCOL_VERSION),
    ] {
        assert_eq!(link.protocol_version(), version);
    }
    // Scene, coupling, meshes and events came; states come, by both ways.
    let mesh = render.description().god_object.mesh;
    must(render.mesh(mesh).await);
    assert!(device.coupling().is_some());
    let mut broadcaster = server.broadcaster();
    let mut tick = 0;
    let mut got = [false; 4];
    wait_until("states", || {
        tick += 1;
        broadcaster.send(&state(tick));
        for (link, got) in [&render, &device, &quic, &older].into_iter().zip(&mut got) {
            let mut states = Vec::new();
            link.drain_states(&mut states);
            *got |= !states.is_empty();
        }
        got == [true; 4]
    })
    .await;
    let sent = relay.upstream();
    for version in [NEXT, PROTOCOL_VERSION] {
        assert!(
            sent.iter().any(|datagram| datagram[2] == version),
            "{version}"
        );
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_a_common_version_both_ends_name_both() {
    let server = server().await;
    let newer = ClientOptions {
        versions: range(NEXT, NEXT + 1),
        ..options(&server, Role::Render, "left")
    };
    let error = match error_of(newer).await {
        error @ LinkError::WrongVersion { .. } => error.to_string(),
        other => panic!("{other}"),
    };
    let own = VersionRange::SUPPORTED.to_string();
    assert!(
        error.contains(&format!("speaks protocol version {own}")),
        "{error}"
    );
    assert!(
        error.contains(&format!("this program speaks {}", range(NEXT, NEXT + 1))),
        "{error}"
    );
    event(&server, "refusal", |event| {
        matches!(event, LinkEvent::Refused { code: RefusalCode::WrongVersion, text, .. }
            if text.contains(&format!("version {}", range(NEXT, NEXT + 1))) && text.contains(&format!("speaks {own}")))
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_of_the_release_before_is_told_in_words_that_it_can_read() {
    let server = server().await;
    let connection = raw_connection(server.quic_addr(), raw_config(server.pin())).await;
    let (_send, mut recv) = say(&connection, &kept("hello")).await;
    let answer = must(recv.read_to_end(4096).await);
    // Magic, a version that it does not look at, Refused, wrong version, the server's newest, a sentence.
    assert_eq!(
        answer[LENGTH_BYTES..LENGTH_BYTES + 2],
        kept("refused")[LENGTH_BYTES..LENGTH_BYTES + 2]
    );
    assert_eq!(
        answer[LENGTH_BYTES + 3..LENGTH_BYTES + 6],
        [0, 1, PROTOCOL_VERSION]
    );
    event(&server, "refusal", |event| {
        matches!(event, LinkEvent::Refused { code: RefusalCode::WrongVersion, text, .. }
            if text.contains("speaks protocol version 3") && text.contains(&format!("speaks {PROTOCOL_VERSION}")))
    })
    .await;
}

/// A server of the release before: its identity, and the refusal that it gives to a Hello of another version.
fn server_of_version_3() -> SocketAddr {
    let private = rustls::pki_types::PrivatePkcs8KeyDer::from(taut_proto::pin::ed25519_pkcs8(
        &key('a').identity_seed(),
    ));
    let signing = must(rcgen::KeyPair::from_pkcs8_der_and_sign_algo(
        &private,
        &rcgen::PKCS_ED25519,
    ));
    let parameters = must(rcgen::CertificateParams::new(["taut".to_owned()]));
    let certificate = must(parameters.self_signed(&signing));
    let endpoint = raw_server(certificate.der().clone(), private);
    let address = must(endpoint.local_addr());
    tokio::spawn(async move {
        let connection = must(endpoint.accept().await.expect("a client").await);
        let (mut send, mut recv) = must(connection.accept_bi().await);
        let mut head = [0; LENGTH_BYTES + 4];
        must(recv.read_exact(&mut head).await);
        assert_eq!(head[LENGTH_BYTES + 2..], [PROTOCOL_VERSION, 1], "a Hello");
        let text = format!(
            "the peer speaks protocol version {PROTOCOL_VERSION}, this program speaks 3: install the same release on both"
        );
        let mut refused = vec![0x57, 0x48, 3, 0, 1, 3];
        refused.extend(u16::try_from(text.len()).expect("short").to_le_bytes());
        refused.extend(text.as_bytes());
        let length = u32::try_from(refused.len()).expect("short").to_le_bytes();
        must(send.write_all(&[&length[..], &refused].concat()).await);
        let _ = send.finish();
        connection.closed().await;
    });
    address
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_of_the_release_before_is_named_with_both_versions() {
    // The layout that the fake server writes is the kept one.
    let Ok(ControlMessage::Refused(_)) =
        ControlMessage::from_frame_body(&kept("refused")[LENGTH_BYTES..])
    else {
        panic!("the kept refusal cannot be read");
    };
    let mut options = ClientOptions::new(
        server_of_version_3().to_string(),
        key('a'),
        Role::Render,
        "left",
    );
    options.connect_timeout = PATIENCE;
    match error_of(options).await {
        error @ LinkError::WrongVersion { theirs: 3, .. } => {
            let text = error.to_string();
            let both = format!("version 3, this program speaks {}", VersionRange::SUPPORTED);
            assert!(text.contains(&both), "{text}");
        }
        other => panic!("{other}"),
    }
}
