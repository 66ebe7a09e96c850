//! What comes from force devices: the Inverse service's texts, and the wires of arms and motor boards.

use taut_bridge::haply::Said;
use taut_bridge::polhem;
use taut_bridge::spidar_uart::{BoardInfo, Cycle};
use taut_bridge::wooden::{BoardReport, HostReport};

/// A message of the Inverse service: what may be used of it can be, and names are plain.
pub(crate) fn haply_service(text: &str) {
    let said = match Said::parse(text) {
        Ok(said) => said,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    let plain = |id: &str| !id.is_empty() && id.len() <= 64 && !id.contains(['"', '\\']);
    for arm in &said.arms {
        assert!(plain(&arm.id), "{arm:?}");
        for (vector, most) in [(arm.position, 1.0), (arm.velocity, 20.0), (arm.force, 1e3)] {
            let parts = vector.unwrap_or_default();
            assert!(parts.iter().all(|part| part.abs() <= most), "{arm:?}");
        }
    }
    for grip in &said.grips {
        assert!(plain(&grip.id), "{grip:?}");
        if let Some(q) = grip.orientation {
            let norm = q.iter().map(|part| part * part).sum::<f64>().sqrt();
            assert!((norm - 1.0).abs() <= 1e-2, "{grip:?}");
        }
    }
}

/// A Polhem board's line and a WoodenHaptics board's report, each way: what is read is written again, and that is read as the same.
pub(crate) fn arm_board(bytes: &[u8]) {
    if let Some(frame) = polhem::Frame::parse(bytes) {
        assert!(frame.position.iter().all(|metres| metres.abs() <= 0.5));
        assert!(frame.angles.iter().all(|angle| angle.abs() <= 7.0));
        let norm = frame.orientation().norm();
        assert!((norm - 1.0).abs() < 1e-9, "{frame:?}");
        // Behind the longest of the other numbers there is room for two digits and a sign.
        if let Some(line) = frame.line() {
            let again = polhem::Frame::parse(&line).map(|again| again.info);
            assert_eq!(again, Some(frame.info));
        } else {
            assert!(frame.info.unsigned_abs() > 99, "{frame:?}");
        }
    }
    if let Some(force) = polhem::read_force(bytes) {
        assert!(force.iter().all(|part| part.is_finite()));
    }
    if let Some(report) = BoardReport::parse(bytes) {
        // A Teensy's says nothing behind that.
        assert_eq!(report.bytes(), bytes[..14]);
    }
    if let Some(report) = HostReport::parse(bytes) {
        assert_eq!(HostReport::parse(&report.bytes()), Some(report));
    }
}

/// Answers of motor boards: what a board says of itself, and a cycle of two boards of four motors and of one of eight.
pub(crate) fn motor_boards(bytes: &[u8]) {
    for board in 0..8 {
        if let Some(info) = BoardInfo::parse(board, bytes) {
            assert_eq!(info.answer(board), bytes);
            assert!(info.motors <= 8 && info.cycle_answer() <= 64, "{info:?}");
        }
    }
    for cycle in cycles() {
        if cycle.hear(bytes).is_ok() {
            // Nothing is read of an answer that lacks a byte.
            assert!(cycle.hear(&bytes[..bytes.len() / 2]).is_err());
        }
    }
}

fn cycles() -> [Cycle; 2] {
    [&[(0, 5), (1, 5)][..], &[(3, 7)]].map(|boards| {
        let boards = boards
            .iter()
            .filter_map(|(board, model)| Some((*board, BoardInfo::of_model(*model)?)));
        Cycle::new(boards.collect()).unwrap_or_else(|| panic!("eight motors"))
    })
}

pub(crate) fn haply_service_seeds() -> Vec<Vec<u8>> {
    let arm = r#"{"session_id":176,"inverse3":[{"device_id":"04C3","config":{"type":"inverse3","handedness":"right","basis":{"permutation":"XYZ"}},"state":{"cursor_position":{"x":0.12,"y":0.03,"z":-0.05},"cursor_velocity":{"x":-0.00018,"y":0,"z":0},"current_cursor_force":{"x":0.0,"y":0.5,"z":0.0}},"status":{"calibrated":true,"power_supply":true,"ready":true,"started":true}}]}"#;
    let grips = r#"{"verse_grip":[],"custom_verse_grip":[{"device_id":"1","state":{"button":true}}],"wireless_verse_grip":[{"device_id":"0","state":{"buttons":{"a":true,"b":false,"c":true},"orientation":{"x":0.34646606,"y":0.6608887,"z":-0.34802246,"w":0.5644226}},"status":{"connected":true,"ready":true}}]}"#;
    [arm, grips].map(|text| text.as_bytes().to_vec()).into()
}

pub(crate) fn arm_board_seeds() -> Vec<Vec<u8>> {
    let frame = polhem::Frame {
        position: [0.0125, -0.00325, 0.000125],
        angles: [0.1, -0.2, 0.3, -0.4],
        info: 1,
    };
    let report = BoardReport {
        encoders: [1, -2, 300, 4, 5, -6],
        info: 1,
        button: true,
    };
    vec![
        frame.line().unwrap_or_else(|| panic!("a line")).to_vec(),
        polhem::force_frame(&[0.5, -1.25, 2.0]).to_vec(),
        report.bytes().to_vec(),
        HostReport::Currents([1000, -1, 0]).bytes().to_vec(),
        HostReport::SetCounters([1, 2, 3, 4, 5, 6]).bytes().to_vec(),
    ]
}

pub(crate) fn motor_boards_seeds() -> Vec<Vec<u8>> {
    let info = |model| BoardInfo::of_model(model).unwrap_or_else(|| panic!("a known board"));
    let (four, eight) = (info(5), info(7));
    // A board answers with the command's header, its motors' counters, and zeros.
    let answer = |board: u8, of: &BoardInfo| {
        let mut bytes = vec![0; of.cycle_answer()];
        bytes[0] = 6 << 3 | board;
        for (at, byte) in bytes.iter_mut().enumerate().skip(1) {
            *byte = at as u8;
        }
        bytes
    };
    let closing = |board: u8, of: &BoardInfo| of.answer(board)[..5].to_vec();
    let seeds = vec![
        four.answer(1).to_vec(),
        [answer(0, &four), answer(1, &four), closing(0, &four)].concat(),
        [answer(3, &eight), closing(3, &eight)].concat(),
    ];
    let read = |seed: &Vec<u8>| cycles().iter().any(|cycle| cycle.hear(seed).is_ok());
    assert!(seeds[1..].iter().all(read), "a seed that is none");
    seeds
}
