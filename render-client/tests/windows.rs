//! The program of a node, in windows where there is a display, and where there is none.

use crate::live::{Server, can_draw, wait_for};

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

/// The program `taut-render` for a node of `server`.
pub fn program(server: &Server, node: &str, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut-render"));
    command.args([
        "--server",
        &server.address,
        "--node",
        node,
        "--duration",
        "20",
    ]);
    command
        .arg("--key")
        .arg(server.folder.path().join("key"))
        .args(more);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// A display to open windows on.
enum Display {
    /// That of the session.
    Session,
    /// One in memory, until it is dropped.
    InMemory {
        server: std::process::Child,
        name: String,
    },
}

impl Display {
    /// The session's display, or else one of Xvfb's; `None` where there is neither.
    fn any() -> Option<Self> {
        if std::env::var_os("DISPLAY").is_some() || std::env::var_os("WAYLAND_DISPLAY").is_some() {
            return Some(Self::Session);
        }
        let mut server = Command::new("Xvfb")
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x800x24",
                "-nolisten",
                "tcp",
            ])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let mut number = String::new();
        let output = server.stdout.as_mut().expect("a pipe");
        BufReader::new(output)
            .read_line(&mut number)
            .expect("a number");
        let name = format!(":{}", number.trim());
        Some(Self::InMemory { server, name })
    }

    fn give_to(&self, command: &mut Command) {
        if let Self::InMemory { name, .. } = self {
            command.env("DISPLAY", name);
        }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        if let Self::InMemory { server, .. } = self {
            server.kill().expect("it runs");
            server.wait().expect("it ends");
        }
    }
}

#[test]
fn the_program_draws_in_windows_where_there_is_a_display() {
    let Some(display) = Display::any() else {
        taut_test_kit::left_out("no display, and no Xvfb to make one");
        return;
    };
    if !can_draw() {
        return;
    }
    let server = Server::start();
    for (node, stereo) in [
        ("both", "mono"),
        ("pair", "two-windows"),
        ("both", "anaglyph"),
    ] {
        let more = [
            "--frames", "4", "--stereo", stereo, "--width", "300", "--show", "ghost",
        ];
        let mut command = program(&server, node, &more);
        display.give_to(&mut command);
        let output = command.output().expect("runs");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}");
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(said.contains("4 frames"), "{said}");
        if matches!(display, Display::InMemory { .. }) {
            // X11 tells of no light, and nobody makes one up.
            let untold = "not known, the times told are those of calls alone: this window system is not Wayland";
            assert!(
                said.contains(untold) && !said.contains("; light "),
                "{said}"
            );
            assert!(said.contains("VK_EXT_present_timing is not used"), "{said}");
        }
    }
    server.stop();
}

#[test]
fn without_a_display_the_program_says_so_and_names_the_way_out() {
    let server = Server::start();
    let mut command = program(&server, "both", &[]);
    command
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET");
    let output = command.output().expect("runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.contains("no display") && text.contains("--headless"),
        "{text}"
    );
    server.stop();
}

#[test]
fn without_a_graphics_driver_the_program_says_what_to_install() {
    let server = Server::start();
    let mut command = program(&server, "both", &["--headless"]);
    command
        .env("VK_DRIVER_FILES", "/dev/null")
        .env("VK_ICD_FILENAMES", "/dev/null");
    let output = command
        .env("WGPU_BACKEND", "vulkan")
        .output()
        .expect("runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("mesa-vulkan-drivers"), "{text}");
    server.stop();
}

#[cfg(unix)]
#[test]
fn a_node_that_is_asked_to_end_leaves_in_good_order() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let child = program(&server, "both", &["--headless", "--width", "60"])
        .spawn()
        .expect("runs");
    wait_for("a report of frames", || server.frames("both") > 0);
    let asked = Command::new("kill")
        .args(["-TERM", &child.id().to_string()])
        .status();
    assert!(asked.is_ok_and(|status| status.success()));
    let output = child.wait_with_output().expect("ends");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    wait_for("the server knows", || server.link.clients().is_empty());
    server.stop();
}
