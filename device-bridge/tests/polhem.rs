//! The Polhem text board: the driver on a pseudo-terminal, under a virtual clock, and on lines that are damaged.
#![cfg(unix)]

use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::support::faulty::{BAD_LINE, Faulty};
use crate::support::floor::{Direct, OnFloor, Wire, damaged, floor, placement};
use crate::support::ms;
use crate::support::stage::{VICE, no_write_jumps, opened};
use taut_bridge::polhem::{Frame, SimulatedPolhem, force_frame};
use taut_bridge::pseudo_terminal::{FarEnd, PseudoTerminal};
use taut_bridge::spidar_uart::Counters;
use taut_bridge::{ArmDevice, ArmState, Hand, MinJerkPath, PolhemSettings, Pose};

#[test]
fn a_floor_is_felt_through_the_serial_line_and_again_after_the_cable_was_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("polhem");
    let arm = Arc::new(Mutex::new(SimulatedPolhem::new(Hand::LIGHT, None, None)));
    let plug = || PseudoTerminal::start(Arc::clone(&arm), Some(&link)).expect("a terminal");
    let terminal = plug();
    let device = opened(&format!("polhem:{}", link.display())).expect("it is there");
    let held = OnFloor::new(device, &placement(), floor);
    held.outlives(terminal, plug, |terminal| {
        terminal.device().held().rendered().norm()
    });
}

#[test]
fn no_line_to_the_board_jumps() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("polhem");
    let path = MinJerkPath::hold(Pose::translation(0.01, 0.02, 0.03));
    let arm = SimulatedPolhem::new(VICE, Some(path), None);
    let line = Faulty::of(arm, SimulatedPolhem::lines, |arm| arm.held().commanded());
    let _terminal = PseudoTerminal::start(Arc::clone(&line), Some(&link));
    no_write_jumps(&format!("polhem:{}", link.display()), &line, &BAD_LINE);
}

impl Direct<SimulatedPolhem> {
    /// A line and its answer.
    fn turn(&self, now: Duration) {
        let Wire { arm, state, force } = &mut *self.lock();
        let mut answer = Vec::new();
        arm.take(now, &force_frame(force), &mut answer);
        let frame = Frame::parse(&answer).expect("a line");
        let q = frame.orientation();
        *state = ArmState {
            reports: state.reports + 1,
            is_usable: true,
            position: frame.position,
            orientation: Some([q.w, q.i, q.j, q.k]),
            ..ArmState::default()
        };
    }
}

#[test]
fn the_force_is_gone_120_ms_after_the_last_line_and_back_within_a_second() {
    let arm = SimulatedPolhem::new(Hand::LIGHT, None, None);
    let wire = Direct::of(arm);
    let device = ArmDevice::new(
        Box::new(wire.clone()),
        PolhemSettings::at("here").arm(),
        placement(),
    );
    let mut held = OnFloor::new(Box::new(device), &placement(), floor);
    held.loses_and_finds(3000, |now| wire.turn(now));
}

/// Damages one line in ten: how many were damaged, and of these believed.
fn damaged_lines(lines: u64) -> (u64, u64) {
    let mut judge = Counters::new(1e-5);
    let truth = |time: u64| {
        let wave = |rate: f64| (rate * time as f64 * 1e-3).sin();
        Frame {
            position: [0.1 * wave(3.0), 0.08 * wave(4.1), 0.12 * wave(5.3)],
            angles: [
                0.7 * wave(2.0),
                0.5 * wave(1.7),
                0.9 * wave(2.9),
                0.4 * wave(3.7),
            ],
            info: 1,
        }
    };
    let line = |time| truth(time).line().expect("short enough").to_vec();
    damaged(lines, line, |time, line| {
        let Some(frame) = Frame::parse(line) else {
            return false;
        };
        let [x, y, z] = frame.position.map(|part| (part / 1e-5) as i16);
        let [a, b, c, d] = frame.angles.map(|part| (part / 1e-4) as i16);
        if judge.take(ms(time), &[x, y, z, a, b, c, d, 0]).is_none() {
            return false;
        }
        let truth = truth(time);
        let off = (0..3)
            .map(|i| (frame.position[i] - truth.position[i]).abs())
            .fold(0.0, f64::max);
        let turned = frame.orientation().angle_to(&truth.orientation());
        // What a hand could have done meanwhile: 150 m/s^2 over two milliseconds, and the line before.
        assert!(
            off <= 3e-3 && turned <= 0.03,
            "{off} m, {turned} rad at {time} ms"
        );
        true
    })
}

#[test]
fn no_wrong_pose_is_believed_of_damaged_lines() {
    damaged_lines(100_000);
}

/// `cargo test --release -p taut-bridge --test all polhem:: -- --ignored --nocapture`
#[test]
#[ignore = "minutes"]
fn no_wrong_pose_is_believed_of_ten_million_lines() {
    let (damaged, believed) = damaged_lines(10_000_000);
    println!("{damaged} damaged of 10000000, {believed} of these within what a hand can do");
}
