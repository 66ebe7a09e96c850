//! When pictures light up, as a Wayland compositor tells it: weston without a screen, whose repaints are those of a timer.
#![cfg(target_os = "linux")]

use crate::live::{Server, barrier, can_draw, wait_for};
use crate::windows::program;

use std::process::{Child, Command, Stdio};

use taut_proto::barrier::Swap;

/// A Wayland compositor without a screen, until it is dropped.
struct Compositor {
    server: Child,
    folder: tempfile::TempDir,
}

impl Compositor {
    /// `None` where weston is not installed.
    fn start() -> Option<Self> {
        let folder = tempfile::tempdir().expect("a folder");
        let server = Command::new("weston")
            .args([
                "--backend=headless-backend.so",
                "--socket=light",
                "--no-config",
            ])
            .args(["--width=800", "--height=600", "--idle-time=0"])
            .env("XDG_RUNTIME_DIR", folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let compositor = Self { server, folder };
        let socket = compositor.folder.path().join("light");
        wait_for("the compositor's socket", || socket.exists());
        Some(compositor)
    }

    /// The program of a node in windows of this compositor.
    fn program(&self, server: &Server, node: &str, more: &[&str]) -> Command {
        let mut command = program(server, node, more);
        command
            .env_remove("DISPLAY")
            .env("XDG_RUNTIME_DIR", self.folder.path())
            .env("WAYLAND_DISPLAY", "light");
        command
    }
}

impl Drop for Compositor {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// A compositor, where there is one and pictures can be drawn; says so if not.
fn compositor() -> Option<Compositor> {
    if !can_draw() {
        return None;
    }
    let compositor = Compositor::start();
    if compositor.is_none() {
        taut_test_kit::left_out("no weston");
    }
    compositor
}

/// What a node that ended well said at its end.
fn said(node: Child) -> String {
    let output = node.wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The number before ` ms after the call in the median`, and that before ` frames; N never lit up`.
fn light_of(said: &str) -> (f64, u64) {
    let number = |before: &str| {
        let (text, _) = said.split_once(before).unwrap_or_else(|| panic!("{said}"));
        let word = text.rsplit(' ').next().expect("a word");
        word.parse::<f64>()
            .unwrap_or_else(|_| panic!("{word} in {said}"))
    };
    let median = number(" ms after the call in the median");
    let (before, _) = said
        .split_once(" never lit up")
        .unwrap_or_else(|| panic!("{said}"));
    let (before, _) = before
        .rsplit_once(" frames; ")
        .unwrap_or_else(|| panic!("{said}"));
    let frames = before.rsplit(' ').next().expect("a word");
    (
        median,
        frames
            .parse()
            .unwrap_or_else(|_| panic!("{frames} in {said}")),
    )
}

#[test]
fn a_compositor_tells_when_the_pictures_of_a_node_lit_up() {
    let Some(compositor) = compositor() else {
        return;
    };
    let server = Server::start();
    for node in ["both", "pair"] {
        let more = ["--frames", "12", "--width", "200"];
        let child = compositor.program(&server, node, &more).spawn();
        let said = said(child.expect("runs"));
        println!("{said}");
        // A headless compositor ticks by a timer, and says so.
        assert!(
            said.contains("told by the compositor (clock Monotonic"),
            "{said}"
        );
        assert!(said.contains("no display vouches for it"), "{said}");
        // Pictures of the last frames light up when the node has ended.
        let (median_ms, frames) = light_of(&said);
        assert!((4..=12).contains(&frames), "{said}");
        assert!((0.0..10_000.0).contains(&median_ms), "{said}");
    }
    server.stop();
}

#[test]
fn the_server_knows_how_far_apart_two_nodes_lit_up() {
    let Some(compositor) = compositor() else {
        return;
    };
    let server = Server::start_with(Some(barrier(Swap::Scheduled)));
    let nodes = ["both", "pair"].map(|node| {
        let more = ["--width", "160", "--fps", "8"];
        compositor
            .program(&server, node, &more)
            .spawn()
            .expect("runs")
    });
    let frames = || server.link.frame_report().unwrap_or_default();
    wait_for("the light of frames that both nodes showed", || {
        frames().light.count >= 3
    });
    let measured = frames();
    println!("calls {:?}, light {:?}", measured.skew, measured.light);
    let names = |nodes: &[(String, taut_link::Distribution)]| {
        let mut names: Vec<String> = nodes.iter().map(|(name, _)| name.clone()).collect();
        names.sort();
        names
    };
    assert_eq!(names(&measured.lit_nodes), ["both", "pair"], "{measured:?}");
    assert!(
        measured.skew.count >= 3,
        "calls are compared as ever: {measured:?}"
    );
    // The first node of each frame is the one that the others are compared with.
    let least = measured
        .lit_nodes
        .iter()
        .map(|(_, after)| after.p50)
        .fold(f64::INFINITY, f64::min);
    assert!(least <= measured.light.max, "{measured:?}");
    server.stop();
    for node in nodes {
        let said = said(node);
        assert!(said.contains("; light "), "{said}");
    }
}
