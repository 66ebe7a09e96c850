//! What the Inverse service tells of itself on a second WebSocket (port 10020): a device is plugged in or out, a value was refused, its own rate.
//!
//! Read by a thread of its own and told as lines of the log, bounded in size and rate. Nothing of it moves or stops anything: whether the device may
//! be used says the service's state messages. A service without this socket is looked for again, and no word is said of it.
//!
//! Source: the vendor's client `haply` 1.3.1, read for facts: `{"name", "data", "category", "level", "message"}`, names in kebab case.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use serde::Deserialize;
use taut_kinds::ServiceAddress;
use tungstenite::Message;

use super::socket::{GREETING_WITHIN, Socket, connect, is_late};
use crate::own_thread::OwnThread;
use crate::realtime::monotonic_now;

/// The service's own port for them.
pub const EVENTS_PORT: u16 = 10_020;
/// Largest message, bytes.
const MAX_MESSAGE: usize = 64 << 10;
/// Longest text of a part of a line, characters.
const MAX_TEXT: usize = 120;
/// Most values of an event that are told.
const MAX_VALUES: usize = 8;
/// Most events that are told in a second; the others are counted.
const MAX_LINES: u32 = 10;
/// Messages that are no events, one after the other, that end a connection.
const MAX_NONSENSE: u32 = 20;
/// Between two calls.
const RETRY: Duration = Duration::from_secs(2);
/// Between two looks whether it is over.
const LOOK: Duration = Duration::from_millis(50);

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Level {
    Info,
    Notice,
    Warning,
    Error,
    Critical,
    Panic,
}

#[derive(Deserialize)]
struct Raw {
    name: String,
    level: Level,
    message: Option<String>,
    #[serde(default)]
    data: serde_json::Map<String, serde_json::Value>,
}

/// An event as a line for people.
#[derive(Clone, Debug, PartialEq, Eq)]
struct ServiceEvent {
    level: tracing::Level,
    line: String,
}

impl ServiceEvent {
    fn parse(text: &str) -> Option<Self> {
        let raw: Raw = serde_json::from_str(text).ok()?;
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if raw.name.is_empty() || raw.name.len() > MAX_TEXT || !raw.name.chars().all(is_name) {
            return None;
        }
        let level = match raw.level {
            // It comes all the time.
            _ if raw.name == "system-rate-report" => tracing::Level::DEBUG,
            Level::Info | Level::Notice => tracing::Level::INFO,
            Level::Warning => tracing::Level::WARN,
            Level::Error | Level::Critical | Level::Panic => tracing::Level::ERROR,
        };
        let mut line = raw.name;
        for (key, value) in raw.data.iter().take(MAX_VALUES) {
            let value = match value {
                serde_json::Value::String(text) => plain(text),
                serde_json::Value::Number(number) => plain(&number.to_string()),
                serde_json::Value::Bool(yes) => yes.to_string(),
                _ => continue,
            };
            // Writing to a string does not fail.
            let _ = write!(line, ", {} {value}", plain(&key.replace('_', " ")));
        }
        if let Some(message) = raw.message.filter(|message| !message.trim().is_empty()) {
            let _ = write!(line, ": {}", plain(&message));
        }
        Some(Self { level, line })
    }
}

/// Without control characters, and not longer than a line bears.
fn plain(text: &str) -> String {
    let letters = text.chars().filter(|letter| !letter.is_control());
    letters.take(MAX_TEXT).collect()
}

/// Lines of a second, and those beyond.
#[derive(Default)]
struct LineLimit {
    second: Duration,
    lines: u32,
    left_out: u32,
}

impl LineLimit {
    /// Whether another line may be told at `now`, and how many were left out in the second before.
    fn another(&mut self, now: Duration) -> (bool, u32) {
        let mut before = 0;
        if now.saturating_sub(self.second) >= Duration::from_secs(1) {
            before = std::mem::take(&mut self.left_out);
            (self.second, self.lines) = (now, 0);
        }
        let may = self.lines < MAX_LINES;
        if may {
            self.lines += 1;
        } else {
            self.left_out = self.left_out.saturating_add(1);
        }
        (may, before)
    }
}

/// Listens to the service on this host and port. Dropping the thread ends it.
pub(crate) fn listen(host: &str, port: u16) -> std::io::Result<OwnThread> {
    listen_with(host, port, tell)
}

fn listen_with(
    host: &str,
    port: u16,
    tell: impl Fn(tracing::Level, &str) + Send + 'static,
) -> std::io::Result<OwnThread> {
    let address = ServiceAddress {
        host: host.to_owned(),
        port,
    };
    OwnThread::start("taut-haply-events", move |end| run(&address, end, &tell))
}

fn tell(level: tracing::Level, line: &str) {
    match level {
        tracing::Level::ERROR => tracing::error!("the Inverse service: {line}"),
        tracing::Level::WARN => tracing::warn!("the Inverse service: {line}"),
        tracing::Level::INFO => tracing::info!("the Inverse service: {line}"),
        _ => tracing::debug!("the Inverse service: {line}"),
    }
}

fn run(address: &ServiceAddress, end: &AtomicBool, tell: &dyn Fn(tracing::Level, &str)) {
    let is_over = || end.load(Ordering::Relaxed);
    let mut limit = LineLimit::default();
    while !is_over() {
        let connected = connect(address, GREETING_WITHIN, MAX_MESSAGE);
        if let Ok(mut socket) = connected
            && socket.get_ref().set_read_timeout(Some(LOOK)).is_ok()
        {
            tracing::debug!("listening to the events of the Inverse service at {address}");
            hear(&mut socket, end, &mut limit, tell);
        }
        let again = monotonic_now() + RETRY;
        while !is_over() && monotonic_now() < again {
            thread::sleep(LOOK);
        }
    }
}

/// Until the end, or until the connection is gone or says nothing sensible.
fn hear(
    socket: &mut Socket,
    end: &AtomicBool,
    limit: &mut LineLimit,
    tell: &dyn Fn(tracing::Level, &str),
) {
    let mut nonsense = 0;
    while !end.load(Ordering::Relaxed) {
        let text = match socket.read() {
            Ok(Message::Text(text)) => text,
            Ok(Message::Close(_)) => return,
            Ok(_) => continue,
            Err(tungstenite::Error::Io(error)) if is_late(&error) => continue,
            Err(_) => return, // a message that is too long, too
        };
        let Some(event) = ServiceEvent::parse(&text) else {
            nonsense += 1;
            if nonsense > MAX_NONSENSE {
                tell(
                    tracing::Level::WARN,
                    "its events are none; they are not listened to for now",
                );
                return;
            }
            continue;
        };
        nonsense = 0;
        let (may, left_out) = limit.another(monotonic_now());
        if left_out > 0 {
            tell(tracing::Level::INFO, &format!("{left_out} events more"));
        }
        if may {
            tell(event.level, &event.line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::net::TcpListener;
    use std::sync::mpsc::channel;

    const CONNECTED: &str = r#"{"name":"device-connected","category":"device","level":"info","message":null,"data":{"device_family":"inverse3","device_id":"04C3"}}"#;

    #[test]
    fn events_become_lines() {
        let event = ServiceEvent::parse(CONNECTED).expect("an event");
        assert_eq!(event.level, tracing::Level::INFO);
        assert_eq!(
            event.line,
            "device-connected, device family inverse3, device id 04C3"
        );
        let rate = r#"{"name":"system-rate-report","category":"system","level":"info","data":{"min_frequency":980,"mean_frequency":1000}}"#;
        let event = ServiceEvent::parse(rate).expect("an event");
        assert_eq!(event.level, tracing::Level::DEBUG);
        let refused = r#"{"name":"invalid-value","category":"session","level":"error","message":"no\u001b[31m such field","data":{"field":"vector","more":[1,2]}}"#;
        let event = ServiceEvent::parse(refused).expect("an event");
        assert_eq!(event.level, tracing::Level::ERROR);
        assert_eq!(event.line, "invalid-value, field vector: no[31m such field");
    }

    #[test]
    fn hostile_frames_are_bounded() {
        let long = "x".repeat(60_000);
        let data: Vec<String> = (0..500).map(|n| format!("\"k{n}\":\"{long}\"")).collect();
        let wide = format!(
            r#"{{"name":"device-sleep","level":"notice","message":"{long}","data":{{{}}}}}"#,
            data.join(",")
        );
        let event = ServiceEvent::parse(&wide).expect("an event");
        assert!(
            event.line.len() < (MAX_VALUES + 2) * 2 * (MAX_TEXT + 10),
            "{}",
            event.line.len()
        );
        for wrong in [
            "",
            "[]",
            "null",
            "{}",
            r#"{"name":"a b","level":"info"}"#,
            r#"{"name":"","level":"info"}"#,
            r#"{"name":"a","level":"loud"}"#,
            r#"{"name":1,"level":"info"}"#,
            r#"{"name":"a","level":"info","data":[]}"#,
        ] {
            assert_eq!(ServiceEvent::parse(wrong), None, "{wrong}");
        }
        // As deep as a stack would not bear.
        let deep = format!(
            r#"{{"name":"a","level":"info","data":{{"x":{}}}}}"#,
            "[".repeat(60_000)
        );
        assert_eq!(ServiceEvent::parse(&deep), None);
        let mut limit = LineLimit::default();
        let second = Duration::from_secs(5);
        let lines = (0..1000).filter(|_| limit.another(second).0).count();
        assert_eq!(lines, MAX_LINES as usize);
        assert_eq!(limit.another(second * 2), (true, 1000 - MAX_LINES));
    }

    /// A service on a socket: what it says to each who calls, one after the other.
    fn service(says: Vec<Vec<String>>) -> u16 {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let port = listener.local_addr().expect("bound").port();
        thread::Builder::new()
            .name("events".to_owned())
            .spawn(move || {
                for texts in says {
                    let (stream, _) = listener.accept().expect("somebody calls");
                    let mut socket = tungstenite::accept(stream).expect("a WebSocket");
                    for text in texts {
                        // Whoever hung up hears no more.
                        let _ = socket.send(Message::text(text));
                    }
                    // Until the other end goes.
                    while socket.read().is_ok() {}
                }
            })
            .expect("a thread");
        port
    }

    #[test]
    fn a_connection_that_says_nonsense_or_too_much_is_left_and_called_again() {
        let port = service(vec![
            vec!["nonsense".to_owned(); 30],
            vec!["x".repeat(MAX_MESSAGE + 1)],
            vec![CONNECTED.to_owned()],
        ]);
        let (lines, heard) = channel();
        let events = listen_with("127.0.0.1", port, move |_, line: &str| {
            let _ = lines.send(line.to_owned());
        });
        let patience = Duration::from_secs(60);
        let line = heard
            .recv_timeout(patience)
            .expect("a word of the nonsense");
        assert!(line.contains("its events are none"), "{line}");
        let line = heard.recv_timeout(patience).expect("an event");
        assert!(line.starts_with("device-connected"), "{line}");
        drop(events);
    }

    proptest! {
        #[test]
        fn no_text_is_more_than_a_line(text in ".{0,400}") {
            if let Some(event) = ServiceEvent::parse(&text) {
                prop_assert!(!event.line.contains('\n'));
            }
        }
    }
}
