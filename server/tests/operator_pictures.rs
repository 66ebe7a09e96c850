//! Pictures of the screens at the operator's page of a real `taut serve`: who is shown them, what comes of nodes that answer badly, and how often.
#![cfg(unix)]

use std::io::Read;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde_json::Value;
use taut_link::{ClientLink, ClientOptions, Role, Shown, ShownPicture, connect, read_key_file};

use crate::operator::{Served, with_token_file};
use crate::support::{PATIENCE, Workplace, wait_until};

/// A picture of these pixels.
fn png_of(width: u16, height: u16) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width.into(), height.into());
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().expect("a head");
    let pixels = vec![90; 3 * usize::from(width) * usize::from(height)];
    writer.write_image_data(&pixels).expect("pixels");
    writer.finish().expect("an end");
    bytes
}

fn picture(screen: &str, size: (u16, u16), png: Vec<u8>) -> ShownPicture {
    ShownPicture {
        screen: screen.to_owned(),
        shown_ns: 1,
        size,
        png,
    }
}

/// A render node that answers every question with the same; and none with `None`.
struct Node {
    runtime: tokio::runtime::Runtime,
    link: Arc<ClientLink>,
    shown: Arc<Mutex<Option<Shown>>>,
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Node {
    fn join(served: &Served, name: &str, pictures: bool, shown: Option<Shown>) -> Self {
        let server = served.word_after("serving on ");
        let key = read_key_file(&served.place.path("cluster.key")).expect("a key");
        let runtime = tokio::runtime::Runtime::new().expect("threads");
        let options = ClientOptions {
            pictures,
            ..ClientOptions::new(server, key, Role::Render, name)
        };
        let link = Arc::new(runtime.block_on(connect(options)).expect("joined"));
        let (stop, shown) = (Arc::<AtomicBool>::default(), Arc::new(Mutex::new(shown)));
        let (of_thread, answer, ended) = (link.clone(), shown.clone(), stop.clone());
        let thread = std::thread::Builder::new()
            .name("node".to_owned())
            .spawn(move || {
                while !ended.load(Ordering::Relaxed) {
                    let shown = answer.lock().expect("no panic").clone();
                    if let (Some(shown), true) = (shown, of_thread.is_picture_asked())
                        && let Some(ask) = of_thread.take_picture_ask()
                    {
                        ask.answer(shown);
                    }
                    std::thread::sleep(Duration::from_millis(2));
                }
            });
        Self {
            runtime,
            link,
            shown,
            stop,
            thread: Some(thread.expect("a thread")),
        }
    }

    fn show(&self, shown: Option<Shown>) {
        *self.shown.lock().expect("no panic") = shown;
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        self.runtime.block_on(self.link.leave());
    }
}

impl Served {
    /// The newest pictures and what is missing, once it is time for them.
    fn lot(&self) -> Value {
        let begun = Instant::now();
        loop {
            let (status, text) = self.ask("POST /pictures", &self.with_token());
            if status == 200 {
                return serde_json::from_str(&text).expect("JSON");
            }
            assert!(
                status == 409 && text.contains("too soon"),
                "{status} {text}"
            );
            assert!(begun.elapsed() < PATIENCE);
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Status, head and body of the picture of this number.
    fn picture(&self, number: u64, headers: &str) -> (String, Vec<u8>) {
        let mut stream = self.send(&format!("POST /picture/{number}"), headers);
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        let end = answer
            .windows(4)
            .position(|at| at == b"\r\n\r\n")
            .expect("a head");
        let head = String::from_utf8_lossy(&answer[..end]).into_owned();
        (head, answer[end + 4..].to_vec())
    }
}

fn why<'l>(lot: &'l Value, node: &str) -> &'l str {
    let problems = lot["problems"].as_array().expect("a list");
    let of = problems.iter().find(|problem| problem["node"] == node);
    of.and_then(|problem| problem["why"].as_str())
        .unwrap_or_else(|| panic!("{lot}"))
}

#[test]
fn the_token_shows_the_screens_by_node_and_names_those_that_do_not_answer() {
    let served = Served::start_in(Workplace::new(), &with_token_file(), &[]);
    wait_until("a session", || served.status().is_some());
    assert_eq!(
        served.lot(),
        serde_json::json!({ "pictures": [], "problems": [] })
    );

    let png = png_of(64, 27);
    let good = vec![
        picture("left-right", (64, 27), png.clone()),
        picture("left-left", (64, 27), png_of(64, 27)),
    ];
    let front = Node::join(&served, "front", true, Some(Ok(good)));
    let _old = Node::join(&served, "table", false, None);
    let lot = served.lot();
    assert!(why(&lot, "table").contains("older taut"), "{lot}");
    let pictures = lot["pictures"].as_array().expect("a list");
    let screens: Vec<_> = pictures
        .iter()
        .map(|told| told["screen"].as_str())
        .collect();
    assert_eq!(screens, [Some("left-left"), Some("left-right")], "{lot}");
    let told = &pictures[1];
    assert_eq!(told["node"], "front");
    assert_eq!([&told["width"], &told["height"]], [64, 27]);
    let now = std::time::UNIX_EPOCH
        .elapsed()
        .expect("after 1970")
        .as_secs_f64();
    assert!(
        (told["shown_at"].as_f64().expect("a time") - now).abs() < 60.0,
        "{told}"
    );

    let number = told["number"].as_u64().expect("a number");
    let (head, body) = served.picture(number, &served.with_token());
    assert!(
        head.starts_with("HTTP/1.1 200") && head.contains("image/png"),
        "{head}"
    );
    assert_eq!(body, png);
    // Nobody without the token, and no page from elsewhere with it, sees a screen or asks a node.
    let foreign = format!("{}Origin: http://evil.example\r\n", served.with_token());
    for (headers, status) in [(served.host(), "401"), (foreign, "403")] {
        let (head, body) = served.picture(number, &headers);
        assert!(head.starts_with(&format!("HTTP/1.1 {status}")), "{head}");
        assert!(!body.starts_with(b"\x89PNG"));
        let (found, _) = served.ask("POST /pictures", &headers);
        assert_eq!(found.to_string(), status);
    }
    assert_eq!(served.ask("GET /pictures", &served.with_token()).0, 405);
    wait_until("it is audited", || {
        served.says(&[
            "taut::audit",
            "event=\"pictures\"",
            "operator-page",
            "address=127.0.0.1:",
        ])
    });

    // The next lot takes the place of this one.
    front.show(Some(Err("its windows are hidden".to_owned())));
    let lot = served.lot();
    assert_eq!(why(&lot, "front"), "its windows are hidden");
    assert!(
        served
            .picture(number, &served.with_token())
            .0
            .starts_with("HTTP/1.1 404")
    );
}

#[test]
fn what_is_no_picture_gets_to_no_browser_and_a_silent_node_keeps_the_rest_waiting_ten_seconds() {
    let served = Served::start_in(Workplace::new(), &with_token_file(), &[]);
    wait_until("a session", || served.status().is_some());
    let bad = vec![
        picture(
            "page",
            (64, 27),
            b"<html><script>alert(1)</script>".to_vec(),
        ),
        picture("other-size", (27, 64), png_of(64, 27)),
        picture(
            "more-behind",
            (64, 27),
            [png_of(64, 27), b"PK\x03\x04".to_vec()].concat(),
        ),
        picture("good", (64, 27), png_of(64, 27)),
    ];
    let front = Node::join(&served, "front", true, Some(Ok(bad)));
    let _silent = Node::join(&served, "table", true, None);
    let begun = Instant::now();
    let lot = served.lot();
    assert!(
        begun.elapsed() < Duration::from_secs(15),
        "{:?}",
        begun.elapsed()
    );
    assert!(why(&lot, "table").contains("showed no frame"), "{lot}");
    let pictures = lot["pictures"].as_array().expect("a list");
    assert_eq!(pictures.len(), 1, "{lot}");
    assert_eq!(pictures[0]["screen"], "good");
    let text = lot["problems"].to_string();
    for named in [
        "page is refused: it is no PNG",
        "64x27 pixels, and 27x64",
        "stands behind it",
    ] {
        assert!(text.contains(named), "{named}: {text}");
    }

    // A flood of questions: one at a time, and not more than one in two seconds.
    front.show(Some(Err("not now".to_owned())));
    drop(_silent);
    let begun = Instant::now();
    let mut taken = 0;
    for _ in 0..300 {
        let (status, text) = served.ask("POST /pictures", &served.with_token());
        match status {
            200 => taken += 1,
            409 => assert!(
                text.contains("too soon") || text.contains("being asked"),
                "{text}"
            ),
            _ => panic!("{status} {text}"),
        }
    }
    let at_most = 1 + begun.elapsed().as_secs() / 2;
    assert!(taken <= at_most, "{taken} in {:?}", begun.elapsed());
    assert!(served.now("t").is_number(), "the page lives");
}
