//! Terminals, logs, observers and the running of the program.
//!
//! What needs the whole program stands elsewhere: `program.rs` here, signs of life in `server/tests/operation.rs`, rerun's ports in
//! `server/monitor/tests/serving.rs`.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use taut_link::proto::control::LogLevel;
use taut_link::{ClusterKey, LinkError, LinkEvent, Role, serve};
use taut_observers::{Hello, StreamServer, StreamSettings, state_channel};
use tokio::runtime::Runtime;

use super::{Attack, Finding};
use crate::bench::{BenchError, enter, server_options, small_content, wait_until};
use crate::report::Extent;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[
    Attack {
        name: "text-from-outside",
        tried: "a name, a log line and a refusal with terminal control sequences, line ends and turned writing",
        promised: "every text from outside is one line of printable characters wherever it is shown",
        run: text_from_outside,
    },
    Attack {
        name: "page-from-elsewhere",
        tried: "requests to the observers' port by rebound names and from pages of other origins and parts of such, also for /metrics",
        promised: "403 for each, nothing told",
        run: page_from_elsewhere,
    },
    Attack {
        name: "unit-that-was-taken-over",
        tried: "the shipped systemd units are asked what a process of theirs that is no longer ours may do, and how exposed systemd finds them",
        promised: "no new privilege, no capability, no write but to its own directory, no code that it wrote; what a unit leaves out stands in it with the reason",
        run: unit_that_was_taken_over,
    },
];

/// The units of docs/systemd.
const UNITS: [(&str, &str); 5] = [
    (
        "serve",
        include_str!("../../../../docs/systemd/taut-serve.service"),
    ),
    (
        "bridge",
        include_str!("../../../../docs/systemd/taut-bridge.service"),
    ),
    (
        "track",
        include_str!("../../../../docs/systemd/taut-track.service"),
    ),
    (
        "record",
        include_str!("../../../../docs/systemd/taut-record@.service"),
    ),
    (
        "render",
        include_str!("../../../../docs/systemd/taut-render@.service"),
    ),
];
/// What each unit has; a user's unit, which draws, cannot have those after the first five (systemd.exec(5): it needs privileges, or a driver's code).
const CONFINED: [&str; 14] = [
    "NoNewPrivileges=yes",
    "RestrictNamespaces=yes",
    "RestrictSUIDSGID=yes",
    "SystemCallFilter=@system-service",
    "LimitCORE=0",
    "CapabilityBoundingSet=",
    "ProtectSystem=strict",
    "ProtectHome=yes",
    "PrivateTmp=yes",
    "ProtectKernelModules=yes",
    "ProtectProc=invisible",
    "MemoryDenyWriteExecute=yes",
    "PrivateDevices=yes|DevicePolicy=closed",
    "RemoveIPC=yes",
];
const OF_A_USER: usize = 5;

/// Clears the screen, sets a title (with C0 and C1 controls), turns the writing, fakes a line, hides.
const HOSTILE: &str =
    "\u{1b}[2J\u{9d}0;owned\u{7}\u{202e}cod.exe\u{2066}\r\nERROR all is lost\u{200b}\u{2028}";

fn is_harmless(shown: &str) -> bool {
    let bad = |c: char| {
        c.is_control()
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    !shown.is_empty() && !shown.contains(bad)
}

fn text_from_outside(_: &Extent) -> Result<Finding, BenchError> {
    let (runtime, key) = (Runtime::new()?, ClusterKey::generate()?);
    let server = runtime.block_on(serve(server_options(&key), small_content()))?;
    // Rightly inside but for its name; then under a fair name, with lines that are not.
    let answer = match enter(&runtime, &server, &key, Role::Operator, HOSTILE) {
        Err(error @ LinkError::Refused { .. }) => error.to_string(),
        other => {
            let what = format!("a name of control sequences was taken: {:?}", other.err());
            return Err(BenchError::Missing(what));
        }
    };
    let client = enter(&runtime, &server, &key, Role::Operator, "alice")?;
    client.post_log(LogLevel::Error, HOSTILE.to_owned());
    let (mut shown, mut refused, mut logged) = (vec![answer], false, false);
    wait_until("the refusal and the line", || {
        while let Some(event) = server.try_event() {
            match event {
                LinkEvent::Refused { node, text, .. } => {
                    refused = true;
                    shown.extend([node.to_string(), format!("{node:?}"), text]);
                }
                LinkEvent::Log { event, .. } => {
                    logged = true;
                    shown.extend([event.text.to_string(), format!("{event:?}")]);
                }
                _ => {}
            }
        }
        refused && logged
    })?;
    runtime.block_on(client.close());
    runtime.block_on(server.shutdown());
    let harmless = shown.iter().filter(|text| is_harmless(text)).count();
    Ok(Finding {
        happened: format!("{harmless} of {} texts as shown were harmless", shown.len()),
        kept: harmless == shown.len(),
    })
}

fn page_from_elsewhere(_: &Extent) -> Result<Finding, BenchError> {
    let (_outlet, feed) = state_channel();
    let settings = StreamSettings {
        address: SocketAddr::from(([127, 0, 0, 1], 0)),
        rate: 60.0,
        token: None,
        max_observers: 64,
        naming: |_| None,
    };
    let hello = Hello {
        workbench: "secret-bench".to_owned(),
        program: "test".to_owned(),
        scene: small_content().description,
        rate: 60.0,
    };
    let server = StreamServer::start(settings, &hello, feed)?;
    server.publish_metrics("secret-metric 1\n".to_owned());
    let address = server.address();
    let (mut asked, mut refused) = (0, 0);
    for target in ["/", "/hello", "/stream", "/ws", "/metrics"] {
        for headers in [
            format!("Host: rebound.example:{}", address.port()),
            format!("Host: {address}\r\nOrigin: http://evil.example"),
            format!(
                "Host: {address}\r\nOrigin: http://127.0.0.1:{}",
                address.port() ^ 1
            ),
            format!("Host: {address}\r\nOrigin: null"),
            // A picture in a page, which the browser does not name.
            format!("Host: {address}\r\nSec-Fetch-Site: cross-site\r\nSec-Fetch-Dest: image"),
        ] {
            let answer = get(address, target, &headers)?;
            asked += 1;
            refused +=
                usize::from(answer.starts_with("HTTP/1.1 403 ") && !answer.contains("secret"));
        }
    }
    let own = get(address, "/metrics", &format!("Host: {address}"))?;
    Ok(Finding {
        happened: format!("{refused} of {asked} refused"),
        kept: refused == asked && own.contains("secret-metric"),
    })
}

pub(super) fn get(address: SocketAddr, target: &str, headers: &str) -> std::io::Result<String> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_read_timeout(Some(Duration::from_secs(30)))?;
    write!(
        stream,
        "GET {target} HTTP/1.1\r\n{headers}\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    )?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    Ok(answer)
}

fn unit_that_was_taken_over(_: &Extent) -> Result<Finding, BenchError> {
    let mut open = Vec::new();
    for (name, unit) in UNITS {
        let asked = if name == "render" {
            &CONFINED[..OF_A_USER]
        } else {
            &CONFINED[..]
        };
        let missing = asked.iter().filter(|wanted| {
            !wanted
                .split('|')
                .any(|one| unit.lines().any(|line| line == one))
        });
        open.extend(missing.map(|wanted| format!("{name}: {wanted}")));
    }
    // The whole judgement is systemd's own, where it is at hand.
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scripts/systemd-check");
    let judged = std::process::Command::new(script).output();
    let judgement = match judged {
        Ok(output) if output.status.code() != Some(2) => {
            if !output.status.success() {
                open.push("systemd-analyze".to_owned());
            }
            let lines = String::from_utf8_lossy(&output.stdout).into_owned();
            lines.trim().replace('\n', "; ")
        }
        _ => "systemd-analyze is not here".to_owned(),
    };
    Ok(Finding {
        happened: format!("left open: {open:?}; {judgement}"),
        kept: open.is_empty(),
    })
}
