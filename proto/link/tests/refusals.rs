//! Who is not let in, and what they are told: wrong key, other version, taken name, wrong address.

use crate::support::*;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use taut_link::{
    ClientOptions, LinkError, LinkEvent, Role, ServerLink, ServerOptions, connect, serve,
};
use taut_proto::{
    PROTOCOL_VERSION, VersionRange,
    control::{ControlMessage, LENGTH_BYTES, Refusal, RefusalCode},
    proof::{Claim, Grant},
};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_key_of_another_workbench_meets_the_wrong_server_and_says_nothing_to_it() {
    let server = server().await;
    let error = error_of(ClientOptions {
        key: key('b').into(),
        ..options(&server, Role::Render, "left")
    })
    .await;
    assert!(matches!(error, LinkError::WrongServer { .. }), "{error}");
    let text = error.to_string();
    for named in [
        server.quic_addr().to_string(),
        key('a').server_pin().to_string(),
        key('b').server_pin().to_string(),
        "--key".to_owned(),
    ] {
        assert!(text.contains(&named), "{text}");
    }
    assert_eq!(
        server.counters().wrong_key,
        0,
        "no proof was sent to a stranger"
    );
    assert!(server.clients().is_empty());
}

/// What the server answers to one who says `frame` first, and its code.
async fn refusal(server: &ServerLink, frame: &[u8]) -> Refusal {
    let connection = raw_connection(server.quic_addr(), raw_config(server.pin())).await;
    let (_send, mut recv) = say(&connection, frame).await;
    let answer = must(recv.read_to_end(4096).await);
    match must(ControlMessage::from_frame_body(&answer[LENGTH_BYTES..])) {
        ControlMessage::Refused(refusal) => refusal,
        other => panic!("{other:?}"),
    }
}

fn stranger() -> Vec<u8> {
    let claim = Claim {
        role: Role::Render,
        node: "stranger",
        grant: Grant::Master,
    };
    frame(&ControlMessage::Hello(hello(claim, [0; 32])))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn another_protocol_version_is_refused_and_counted() {
    let server = server().await;
    let mut frame = stranger();
    // The range stands first in Hello.
    frame[LENGTH_BYTES + 4] = PROTOCOL_VERSION + 1;
    frame[LENGTH_BYTES + 5] = PROTOCOL_VERSION + 2;
    let refusal = refusal(&server, &frame).await;
    assert_eq!(refusal.code, RefusalCode::WrongVersion);
    assert_eq!(refusal.version, PROTOCOL_VERSION);
    let both = format!(
        "version {} to {}, this program speaks {}",
        PROTOCOL_VERSION + 1,
        PROTOCOL_VERSION + 2,
        VersionRange::SUPPORTED
    );
    assert!(refusal.text.raw().contains(&both), "{}", refusal.text);
    assert_eq!(server.counters().wrong_version, 1);
    assert!(server.clients().is_empty());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_hello_without_proof_or_sense_is_refused() {
    let server = server().await;
    for (frame, code) in [
        (stranger(), RefusalCode::WrongKey),
        (b"GET / HTTP/1.1\r\n\r\n".to_vec(), RefusalCode::BadHello),
        (
            vec![8, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8],
            RefusalCode::BadHello,
        ),
    ] {
        assert_eq!(refusal(&server, &frame).await.code, code);
    }
    assert_eq!(server.counters().refused, 3);
    assert_eq!(server.counters().wrong_key, 1);
    assert!(server.clients().is_empty());
    event(&server, "refusal", |event| {
        matches!(event, LinkEvent::Refused { code: RefusalCode::WrongKey, node, .. } if node == "stranger")
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_node_of_one_name_is_refused_and_the_first_stays() {
    let server = server().await;
    let first = client(&server, Role::Render, "left").await;
    let (code, text) = refusal_of(options(&server, Role::Render, "left")).await;
    assert_eq!(code, RefusalCode::NameTaken);
    let said = "a node named \"left\" is connected already";
    assert!(text.contains(said), "{text}");
    assert_eq!(first.is_closed(), None);
    assert_eq!(server.clients().len(), 1);
    first.close().await;
    wait_until("name free", || server.clients().is_empty()).await;
    client(&server, Role::Render, "left").await.close().await;
}

/// Clients could not be told of it: nobody would get in.
#[tokio::test]
async fn a_node_timeout_that_is_none_is_refused_at_the_start() {
    for (micros, refused) in [
        (0, true),
        (999, true),
        (1000, false),
        (60_000_000, false),
        (60_001_000, true),
        (u64::MAX, true),
    ] {
        let options = ServerOptions {
            node_timeout: Duration::from_micros(micros),
            ..ServerOptions::loopback(key('a'))
        };
        match serve(options, content()).await {
            Err(LinkError::NodeTimeout { .. }) => assert!(refused, "{micros} us"),
            Err(error) => panic!("{micros} us: {error}"),
            Ok(server) => {
                assert!(!refused, "{micros} us");
                drop(server);
            }
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_server_says_so() {
    let server = server_with(ServerOptions {
        max_clients: 1,
        ..forgiving()
    })
    .await;
    // The workbench's own node has its place; another one finds none.
    let _first = client(&server, Role::Render, "left").await;
    let (code, text) = refusal_of(options(&server, Role::Render, "right")).await;
    assert_eq!(code, RefusalCode::Full, "{text}");
}

/// Whoever may be any observer fills the house; those whom the workbench cannot do without get in all the same.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_house_full_of_observers_has_room_for_device_tracker_operator_and_named_nodes() {
    let server = server_with(ServerOptions {
        max_clients: 8,
        ..forgiving()
    })
    .await;
    let mut inside = Vec::new();
    let refusal = loop {
        let name = format!("watcher-{}", inside.len());
        match connect(options(&server, Role::Observer, &name)).await {
            Ok(link) => inside.push(link),
            Err(error) => break error,
        }
        assert!(inside.len() <= 8);
    };
    // 8 less device, tracker, operator and the one node of the workbench.
    assert_eq!(inside.len(), 4);
    assert!(
        refusal.to_string().contains("raise max_clients"),
        "{refusal}"
    );
    for (role, name) in [
        (Role::Device, "bridge"),
        (Role::Operator, "alice"),
        (Role::Tracker, "head"),
        (Role::Render, "left"),
    ] {
        inside.push(client(&server, role, name).await);
    }
    assert_eq!(server.clients().len(), 8);
}

/// A bridge that proves its key and then takes nothing: its place is free when its time to join is over.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_join_that_stalls_leaves_no_session_behind() {
    let server = server().await;
    let mut narrow = quinn::TransportConfig::default();
    narrow.stream_receive_window(quinn::VarInt::from_u32(16)); // less than a Welcome
    let mut config = raw_config(server.pin());
    config.transport_config(Arc::new(narrow));
    let connection = raw_connection(server.quic_addr(), config).await;
    let claim = Claim {
        role: Role::Device,
        node: "bridge",
        grant: Grant::Master,
    };
    let hello = ControlMessage::Hello(proved_hello(&connection, claim));
    let _control = say(&connection, &frame(&hello)).await;
    wait_until("its place", || server.clients().len() == 1).await;
    wait_until("the end of its time", || server.clients().is_empty()).await;
    client(&server, Role::Device, "bridge").await.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn names_that_cannot_be_shown_are_refused() {
    let server = server().await;
    for name in ["", "  ", "a\nb", &"x".repeat(65)] {
        let (code, text) = refusal_of(options(&server, Role::Render, name)).await;
        assert_eq!(code, RefusalCode::BadHello, "{name:?}: {text}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_in_use_is_named() {
    let first = server().await;
    for (quic, udp, busy) in [
        (first.quic_addr(), ANY, first.quic_addr()),
        (ANY, first.udp_addr(), first.udp_addr()),
    ] {
        let options = ServerOptions {
            quic,
            udp,
            ..ServerOptions::loopback(key('a'))
        };
        match not_served(options, content()).await {
            LinkError::PortInUse { address, .. } => assert_eq!(address, busy),
            other => panic!("{other}"),
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_unreachable_server_is_given_up_in_time() {
    // A port that was free a moment ago, where nobody listens.
    let socket = must(std::net::UdpSocket::bind(ANY));
    let address = must(socket.local_addr());
    drop(socket);
    let start = Instant::now();
    let error = error_of(ClientOptions {
        connect_timeout: Duration::from_secs(1),
        ..ClientOptions::new(address.to_string(), key('a'), Role::Observer, "o")
    })
    .await;
    assert!(matches!(error, LinkError::Unreachable { .. }), "{error}");
    assert!(error.to_string().contains(&address.to_string()));
    assert!(start.elapsed() < PATIENCE);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_no_address_is_said_to_be_none() {
    for bad in ["", "host:", "host:99999", ":4857", "host:0"] {
        let error = error_of(ClientOptions::new(bad, key('a'), Role::Observer, "o")).await;
        assert!(
            matches!(error, LinkError::BadAddress { .. }),
            "{bad:?}: {error}"
        );
    }
}

#[test]
fn a_key_file_is_made_once_private_and_read_again() {
    let folder = must(tempfile::tempdir());
    let path = folder.path().join("cluster.key");
    let made = must(taut_link::create_key_file(&path));
    assert_eq!(taut_link::read_key_file(&path).ok(), Some(made));
    let again = taut_link::create_key_file(&path);
    assert!(matches!(
        &again,
        Err(error @ LinkError::KeyFile { .. }) if error.to_string().contains("never overwritten")
    ));
    let nowhere = taut_link::create_key_file(&folder.path().join("none").join("cluster.key"));
    assert!(nowhere.is_err_and(|error| error.to_string().contains("make its directory")));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::metadata(&path).map(|meta| meta.permissions().mode() & 0o777);
        assert_eq!(mode.ok(), Some(0o600));
    }
    let short = folder.path().join("short.key");
    assert!(std::fs::write(&short, "abc").is_ok());
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let private = std::fs::Permissions::from_mode(0o600);
        assert!(std::fs::set_permissions(&short, private).is_ok());
    }
    for (bad, remedy) in [
        (short, "`taut keys`"),
        (folder.path().join("missing.key"), "`taut keys`"),
        (folder.path().to_owned(), "name a file in it"),
    ] {
        let error = taut_link::read_key_file(&bad)
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default();
        assert!(error.contains(&bad.display().to_string()), "{error}");
        assert!(error.contains(remedy), "{error}");
    }
}
