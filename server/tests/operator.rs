//! The operator's page of a real `taut serve`: who may act, what comes of it at the device, and what is left of those who may not.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::{PATIENCE, Running, Workplace, refusal, taut, wait_until, workbench};

pub(crate) const TOKEN: &str = "0123456789abcdef0123456789abcdef";
/// A force that is one, N.
const FELT: f64 = 0.2;

/// The plain workbench with an operator's page, whose device a person arms.
fn with_page() -> String {
    let (before, page) = workbench_with_manual_arming();
    let page = page
        .replacen("enabled = false", "enabled = true", 1)
        .replacen("port = 4861", "port = 0", 1);
    format!("{before}[operator]{page}")
}

fn workbench_with_manual_arming() -> (String, String) {
    let text = workbench().replacen("# rearm = \"manual\"", "rearm = \"manual\"", 1);
    let (before, page) = text.split_once("[operator]").expect("a table");
    (before.to_owned(), page.to_owned())
}

pub(crate) fn with_token_file() -> String {
    let text = with_page();
    let named = text.replacen("# token_file = \"operator", "token_file = \"operator", 1);
    assert_ne!(text, named);
    named
}

fn write_token(place: &Workplace, token: &str, mode: u32) {
    place.write("operator.token", &format!("{token}\n"));
    let permissions = std::fs::Permissions::from_mode(mode);
    std::fs::set_permissions(place.path("operator.token"), permissions).expect("mine");
}

/// A running server with a page.
pub(crate) struct Served {
    process: Running,
    pub(crate) address: String,
    pub(crate) place: Workplace,
}

impl Served {
    fn start(text: &str) -> Self {
        Self::start_in(Workplace::new(), text, &[])
    }

    /// In a directory with files of its own, with more arguments.
    pub(crate) fn start_in(place: Workplace, text: &str, more: &[&str]) -> Self {
        place.write("workbench.toml", text);
        write_token(&place, TOKEN, 0o600);
        const MARK: &str = "operator's page: http://";
        let mut served = Self {
            process: Running::start(&place.serve("workbench.toml", "300", more)),
            address: String::new(),
            place,
        };
        wait_until("the page", || served.says(&[MARK, "/#token="]));
        let text = served.text();
        let rest = text.split_once(MARK).expect("was said").1;
        served.address = rest.split_once('/').expect("a path").0.to_owned();
        assert!(!text.contains(TOKEN), "a token of a file is not printed");
        served
    }

    pub(crate) fn text(&self) -> String {
        self.process.text()
    }

    /// What was said behind these words.
    pub(crate) fn word_after(&self, mark: &str) -> String {
        self.process.word_after(mark)
    }

    /// Whether there is a line with all of these.
    pub(crate) fn says(&self, parts: &[&str]) -> bool {
        self.lines_with(parts) > 0
    }

    pub(crate) fn lines_with(&self, parts: &[&str]) -> usize {
        let is_it = |line: &&str| parts.iter().all(|part| line.contains(part));
        self.text().lines().filter(is_it).count()
    }

    /// Sends a request; status and body of the answer.
    pub(crate) fn ask(&self, line: &str, headers: &str) -> (u16, String) {
        let mut stream = self.send(line, headers);
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        let (head, body) = answer.split_once("\r\n\r\n").expect("a head");
        let status = head.split(' ').nth(1).and_then(|word| word.parse().ok());
        (status.expect("a number"), body.trim().to_owned())
    }

    pub(crate) fn send(&self, line: &str, headers: &str) -> TcpStream {
        let mut stream = TcpStream::connect(&self.address).expect("the page's port");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        write!(stream, "{line} HTTP/1.1\r\n{headers}\r\n").expect("sent");
        stream
    }

    pub(crate) fn host(&self) -> String {
        format!("Host: {}\r\n", self.address)
    }

    /// What a program beside the page sends with a deed.
    pub(crate) fn with_token(&self) -> String {
        self.host() + &bearer(TOKEN) + "Content-Length: 0\r\n"
    }

    /// What the page itself sends.
    fn shown(&self) -> String {
        format!("Origin: http://{}\r\n", self.address) + &self.with_token()
    }

    pub(crate) fn status(&self) -> Option<Value> {
        let (status, body) = self.ask("GET /status", &self.host());
        (status == 200).then(|| serde_json::from_str(&body).expect("JSON"))
    }

    pub(crate) fn now(&self, key: &str) -> Value {
        self.status()
            .map_or(Value::Null, |status| status["now"][key].clone())
    }

    pub(crate) fn wait_for_run(&self, run: &str) {
        wait_until(run, || self.now("run") == run);
    }
}

fn bearer(token: &str) -> String {
    format!("Authorization: Bearer {token}\r\n")
}

/// Nobody acts without the token, from another page or by anything but POST, and each is audited.
fn assert_refused(served: &Served) {
    let (host, shown) = (served.host(), served.shown());
    let wrong = host.clone() + &bearer("0123456789abcdef0123456789abcdeF");
    let rebound = format!("Host: rebound.example\r\n{}", bearer(TOKEN));
    let foreign = format!("{host}Origin: http://evil.example\r\n{}", bearer(TOKEN));
    for (line, headers, status, reason) in [
        ("POST /arm", &host, 401, "no token"),
        ("POST /arm", &wrong, 401, "a wrong token"),
        ("POST /arm", &rebound, 403, "a page from elsewhere"),
        ("POST /arm", &foreign, 403, "a page from elsewhere"),
        ("GET /arm", &shown, 405, "not by POST"),
        ("GET /disarm", &shown, 405, "not by POST"),
    ] {
        let (found, text) = served.ask(line, headers);
        assert_eq!(found, status, "{line} {headers} {text}");
        let parts = [
            "taut::audit",
            "event=\"refused\"",
            "operator-page",
            "address=127.0.0.1:",
            reason,
        ];
        wait_until(reason, || served.says(&parts));
    }
    // Of one address and reason only the first is told at once.
    for _ in 0..200 {
        let (status, _) = served.ask("POST /arm", &(host.clone() + &bearer("guess")));
        assert_eq!(status, 401);
    }
}

#[test]
fn the_token_arms_and_disarms_and_who_has_none_is_refused_and_audited() {
    let served = Served::start(&with_token_file());
    served.wait_for_run("paused");
    assert_refused(&served);
    assert_eq!(served.now("run"), "paused", "none of it armed");
    // The coupling computes forces meanwhile; the page tells what the hand feels.
    wait_until("contact", || served.now("contacts").as_u64() > Some(0));
    assert_eq!(served.now("force_n"), 0.0);
    assert_eq!(served.now("largest_force_n"), 0.0);

    let does = |line: &str, headers: &str, said: &str| {
        assert_eq!(served.ask(line, headers), (200, said.to_owned()));
    };
    let shown = served.shown();
    assert_eq!(served.ask("POST /token", &shown).0, 200);
    does("POST /arm", &shown, "armed: the force ramps in");
    served.wait_for_run("running");
    wait_until("the hand feels it", || {
        served.now("force_n").as_f64() > Some(FELT)
    });
    does("POST /arm", &shown, "armed already");
    wait_until("arming is audited", || {
        served.says(&[
            "taut::audit",
            "event=\"arm\"",
            "operator-page",
            "role=operator",
            "address=127.0.0.1:",
        ])
    });

    // A program with the token, beside the page, and beside many who connect and say nothing.
    let connect = |_| TcpStream::connect(&served.address).expect("the page's port");
    let _silent: Vec<TcpStream> = (0..100).map(connect).collect();
    does(
        "POST /disarm",
        &served.with_token(),
        "disarmed: the force fades",
    );
    served.wait_for_run("paused");
    wait_until("the hand feels nothing", || served.now("force_n") == 0.0);
    wait_until("disarming is audited", || {
        served.says(&["taut::audit", "event=\"disarm\"", "operator-page"])
    });
    let wrong = ["taut::audit", "event=\"refused\"", "a wrong token"];
    assert_eq!(served.lines_with(&wrong), 1, "{}", served.text());
    assert!(!served.text().contains(TOKEN));
}

#[test]
fn a_status_line_says_who_is_there_and_how_the_loops_do_and_ends_with_the_server() {
    let served = Served::start(&with_token_file());
    let quic = served.process.word_after("serving on ");
    let _recorder = Running::start(&[
        "record",
        "--server",
        &quic,
        "--key",
        &served.place.text("cluster.key"),
        "--out",
        &served.place.text("trace.csv"),
    ]);
    let (found, page) = served.ask("GET /", &served.host());
    assert!(found == 200 && page.ends_with("</html>"));
    let elsewhere = ["http:", "https:", "src=", "@import", "url("];
    assert!(!elsewhere.iter().any(|way| page.contains(way)));
    let stream = served.send("GET /stream", &served.host());
    let mut lines = BufReader::new(stream)
        .lines()
        .map(|line| line.expect("a line"));
    assert_eq!(lines.next().as_deref(), Some("HTTP/1.1 200 OK"));
    let mut lines = lines.skip_while(|line| !line.is_empty()).skip(1);
    let mut next = || lines.next();
    let mut last = 0.0;
    let begun = Instant::now();
    let status = loop {
        assert!(begun.elapsed() < PATIENCE, "everything is told");
        let line = next().expect("the server is there");
        let status: Value = serde_json::from_str(&line).expect("JSON");
        let t = status["now"]["t"].as_f64().expect("a number");
        assert!(t > last, "each line is newer");
        last = t;
        let links = status["metrics"]["client_links"].as_array();
        let measured = status["metrics"]["force_us"]["count"].as_u64() > Some(0);
        if measured && links.is_some_and(|links| !links.is_empty()) {
            break status;
        }
    };
    let (session, now, metrics) = (&status["session"], &status["now"], &status["metrics"]);
    assert_eq!(session["scene"], "sphere-on-plane");
    assert_eq!(session["manual"], true);
    assert!(session["force_limit_n"].as_f64() > Some(0.0));
    assert!(now["sample_age_s"].as_f64() < Some(1.0), "{now}");
    assert!(now["force_age_s"].is_number() && now["contacts"].is_number());
    let link = &metrics["client_links"][0];
    assert!(
        link["address"]
            .as_str()
            .is_some_and(|at| at.starts_with("127.0.0.1:")),
        "{link}"
    );
    assert!(link["present_s"].is_number() && link["heard_s"].is_number());
    for key in ["haptics_period_us", "force_us", "god_object_update_us"] {
        assert!(metrics[key]["p99"].as_f64() > Some(0.0), "{key}");
    }
    // One that stands says nothing more; one that ends, ends the stream.
    served.process.signal("-STOP");
    std::thread::sleep(Duration::from_millis(300));
    served.process.signal("-CONT");
    served.process.signal("-TERM");
    while next().is_some() {}
}

#[test]
fn arming_is_refused_where_taut_arm_is_and_disarming_is_not() {
    // No device: the port finds its inputs not in order, as it tells `taut arm`.
    let text = with_token_file();
    let remote = text.replacen("kind = \"simulated\"", "kind = \"remote\"", 1);
    let lonely = remote
        .replacen("tremor = ", "# tremor = ", 1)
        .replacen("seed = ", "# seed = ", 1);
    let served = Served::start(&lonely);
    served.wait_for_run("fault");
    let (status, said) = served.ask("POST /arm", &served.shown());
    assert_eq!(status, 409, "{said}");
    assert!(said.contains("not in order"), "{said}");
    assert_eq!(served.ask("POST /disarm", &served.shown()).0, 200);
    drop(served);

    // No operators: `[network] roles` counts while the server runs.
    let served = Served::start(&text);
    served.wait_for_run("paused");
    assert_eq!(served.now("why_not_armed"), Value::Null);
    let closed = text.replacen(
        "broadcast_rate = 1000",
        "roles = [\"render\"]\nbroadcast_rate = 1000",
        1,
    );
    served.place.write("workbench.toml", &closed);
    wait_until("operators are shut out", || {
        served.now("why_not_armed").is_string()
    });
    let (status, said) = served.ask("POST /arm", &served.shown());
    assert_eq!(status, 409, "{said}");
    assert!(said.contains("no operator"), "{said}");
    assert_eq!(served.now("run"), "paused");
    assert_eq!(served.ask("POST /disarm", &served.shown()).0, 200);
}

#[test]
fn a_token_that_others_know_or_may_read_does_not_start() {
    let refusal = |place: &Workplace| refusal(&taut(&place.serve("workbench.toml", "1", &[])));
    let place = Workplace::new();
    // A fresh token would go to a file or a journal.
    place.write("workbench.toml", &with_page());
    let said = refusal(&place);
    assert!(
        said.contains("token_file") && !said.contains("#token="),
        "{said}"
    );

    place.write("workbench.toml", &with_token_file());
    write_token(&place, TOKEN, 0o644);
    let said = refusal(&place);
    assert!(said.contains("chmod 600"), "{said}");
    write_token(&place, "short", 0o600);
    let said = refusal(&place);
    assert!(said.contains("at least 16"), "{said}");

    write_token(&place, TOKEN, 0o600);
    let shared = with_token_file().replacen(
        "port = 4860",
        "port = 0\ntoken_file = \"operator.token\"",
        1,
    );
    let (before, observers) = shared.split_once("[observers]").expect("a table");
    let observers = observers.replacen("enabled = false", "enabled = true", 1);
    place.write("workbench.toml", &format!("{before}[observers]{observers}"));
    let said = refusal(&place);
    assert!(said.contains("that of [observers]"), "{said}");
}

/// So that the same command starts when the port is free.
#[test]
fn a_page_whose_port_is_taken_leaves_no_recording() {
    let place = Workplace::new();
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port();
    let text = with_token_file();
    let (before, page) = text.split_once("[operator]").expect("a table");
    let page = page.replacen("port = 0", &format!("port = {port}"), 1);
    place.write("workbench.toml", &format!("{before}[operator]{page}"));
    write_token(&place, TOKEN, 0o600);
    let (recording, named) = (place.path("recording"), place.text("recording"));
    for was_there in [false, true] {
        if was_there {
            std::fs::create_dir(&recording).expect("made");
        }
        let serve = place.serve("workbench.toml", "1", &["--recording", &named]);
        let said = refusal(&taut(&serve));
        assert!(said.contains("[operator] cannot listen"), "{said}");
        let left = std::fs::read_dir(&recording).map(Iterator::count).ok();
        assert_eq!(left, was_there.then_some(0), "{said}");
    }
}

/// `script` gives the server a terminal.
#[cfg(target_os = "linux")]
#[test]
fn on_a_terminal_the_address_with_a_fresh_token_is_printed_once_and_opens() {
    let place = Workplace::new();
    place.write("workbench.toml", &with_page());
    let program = std::iter::once(env!("CARGO_BIN_EXE_taut").to_owned());
    let command: Vec<String> = program
        .chain(place.serve("workbench.toml", "300", &[]))
        .map(|word| format!("'{word}'"))
        .collect();
    let mut terminal = std::process::Command::new("script")
        .args(["-qfec", &command.join(" "), "/dev/null"])
        .env_remove("TAUT_KEY_FILE")
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .spawn()
        .expect("script, of util-linux");
    let lines = BufReader::new(terminal.stdout.take().expect("a pipe")).lines();
    let mut said = lines.map(|line| line.expect("text"));
    let line = said.find(|line| line.contains("/#token=")).expect("said");
    let address = line.split_once("http://").expect("an address").1;
    let (host, rest) = address.split_once("/#token=").expect("a token");
    let token = rest.split(' ').next().expect("a word");
    assert!(token.len() == 64 && token.chars().all(|c| c.is_ascii_hexdigit()));
    let ask = |token: &str| {
        let mut stream = TcpStream::connect(host).expect("the page's port");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        let head = format!("Host: {host}\r\nAuthorization: Bearer {token}\r\n");
        write!(stream, "POST /disarm HTTP/1.1\r\n{head}\r\n").expect("sent");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        answer
    };
    assert!(ask(TOKEN).starts_with("HTTP/1.1 401"));
    assert!(ask(token).starts_with("HTTP/1.1 200"));
    // What is typed there reaches the server: Ctrl-C.
    let keyboard = terminal.stdin.as_mut().expect("a pipe");
    keyboard.write_all(b"\x03").expect("typed");
    assert!(!said.any(|line| line.contains(token)), "said once");
    let _ = terminal.wait();
}
