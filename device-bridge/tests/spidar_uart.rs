//! SPIDAR's motor boards: the driver on a pseudo-terminal, under a virtual clock, and on answers that are damaged.
#![cfg(unix)]

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::support::faulty::{BAD_LINE, Faulty};
use crate::support::floor::{OnFloor, damaged, placement};
use crate::support::ms;
use crate::support::stage::{Faults, HANGS, Inside, VICE, no_write_jumps, opened};
use nalgebra::{Isometry3, Vector3, Vector6};
use taut_bridge::pseudo_terminal::{FarEnd, PseudoTerminal};
use taut_bridge::spidar_uart::{BoardInfo, Counters, Cycle, SimulatedBoards};
use taut_bridge::{
    Hand, MinJerkPath, Pose, SpidarDevice, SpidarPlacement, ViaPoint, string_geometry,
};
use taut_spidar::{
    Geometry, PerString, Reading, STRINGS, StringFault, StringHardware, StringMatrix,
};

fn geometry() -> Geometry {
    string_geometry("g6x4r").expect("shipped")
}

/// The hand holds still for a second, then goes 12 mm up and down along the frame's y for ever.
fn boards(one_board: bool, offsets: [i32; STRINGS]) -> SimulatedBoards {
    let at = |time_s, y| ViaPoint {
        time_s,
        pose: Pose::translation(0.0, y, 0.0),
    };
    let points = vec![
        at(0.0, 0.0),
        at(1.0, 0.0),
        at(1.5, -0.012),
        at(3.5, -0.012),
        at(4.0, 0.0),
    ];
    let path = MinJerkPath::new(points, true).expect("a path");
    SimulatedBoards::new(
        &geometry(),
        Hand::LIGHT,
        Some(path),
        None,
        one_board,
        offsets,
    )
    .expect("volts are known")
}

/// A floor half-way down along an axis.
fn floor<const UP: usize>(pose: &Pose) -> Vector6<f64> {
    let mut wrench = Vector6::zeros();
    wrench[UP] = 200.0 * (-0.004 - pose.translation.vector[UP]).max(0.0);
    wrench
}

#[test]
fn a_floor_is_felt_through_the_serial_line_and_again_after_the_cable_was_out() {
    for one_board in [false, true] {
        let folder = tempfile::tempdir().expect("a folder");
        let link = folder.path().join("boards");
        let boards = Arc::new(Mutex::new(boards(one_board, [20_000; STRINGS])));
        let plug = || PseudoTerminal::start(Arc::clone(&boards), Some(&link)).expect("a terminal");
        let terminal = plug();
        let device = opened(&format!("spidar:{}", link.display())).expect("it is there");
        // The frame's y is up, as the workbench's z is.
        let held = OnFloor::new(device, &placement(), floor::<2>);
        held.outlives(terminal, plug, |terminal| {
            let largest = terminal
                .device()
                .digits()
                .map(i16::unsigned_abs)
                .into_iter()
                .max();
            f64::from(largest.unwrap_or(0))
        });
    }
}

#[test]
fn no_cycle_of_the_boards_jumps() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("boards");
    let path = MinJerkPath::hold(Pose::identity());
    let boards = SimulatedBoards::new(&geometry(), VICE, Some(path), None, false, [0; STRINGS]);
    let boards = boards.expect("volts are known");
    let line = Faulty::of(
        boards,
        |boards| boards.cycles() / 2,
        |boards| {
            let digits = *boards.digits();
            let volts = geometry().volts(&[1.0; STRINGS]).expect("known");
            let tensions: PerString =
                std::array::from_fn(|i| f64::from(digits[i]) / (volts[i] * 4096.0 / 3.3));
            let strings = StringMatrix::at(&geometry(), &boards.held().true_pose());
            strings.wrench(&tensions).fixed_rows::<3>(0).into()
        },
    );
    let _terminal = PseudoTerminal::start(Arc::clone(&line), Some(&link));
    let choice = format!("spidar:{}", link.display());
    let faults = Faults {
        allowed: 550_000, // digits of eight motors
        ..BAD_LINE
    };
    no_write_jumps(&choice, &line, &faults);
}

#[test]
fn boards_that_are_gone_keep_nobody_from_an_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("boards");
    let line = Faulty::of(boards(false, [0; STRINGS]), |_| 0, |_| Vector3::zeros());
    let _terminal = PseudoTerminal::start(Arc::clone(&line), Some(&link));
    let device = opened(&format!("spidar:{}", link.display())).expect("it is there");
    line.set("mode", HANGS);
    // More than are asked before they are given up: they are looked for, for seconds.
    line.wait("they are looked for", &|| line.get("served") > 60);
    let begun = Instant::now();
    drop(device);
    let took = begun.elapsed();
    assert!(took < ms(2000), "it was left to itself: {took:?}");
}

#[test]
fn a_line_without_boards_is_a_sentence() {
    let open = |path: &str| {
        let opened = opened(&format!("spidar:{path}"));
        opened.err().expect("nothing there")
    };
    let error = open("/dev/no-such-port");
    assert!(
        error.contains("/dev/no-such-port cannot be opened") && error.contains("dialout"),
        "{error}"
    );
    // A terminal at whose other end nobody speaks.
    let (_master, slave) = serialport::TTYPort::pair().expect("a terminal");
    let path = serialport::SerialPort::name(&slave).expect("named");
    drop(slave);
    let error = open(&path);
    assert!(error.contains("needs 8"), "{error}");
}

/// The wire without a port, under a virtual clock.
struct Direct {
    boards: Arc<Mutex<SimulatedBoards>>,
    plugged: Arc<Mutex<bool>>,
    cycle: Cycle,
    counters: Counters,
    digits: [i16; STRINGS],
    seen: Option<(Duration, [i32; STRINGS])>,
    heard: Vec<u8>,
}

impl StringHardware for Direct {
    fn read_counts(&mut self, now: Duration) -> Result<Reading, StringFault> {
        if *self.plugged.lock().expect("not poisoned") {
            let mut sent = Vec::new();
            self.cycle.send(&self.digits, &mut sent);
            self.heard.clear();
            let mut boards = self.boards.lock().expect("not poisoned");
            boards.take(now, &sent, &mut self.heard);
            let raw = self.cycle.hear(&self.heard).expect("whole");
            if let Some(counts) = self.counters.take(now, &raw) {
                self.seen = Some((now, counts));
            }
        }
        let fresh = self
            .seen
            .filter(|(time, _)| now.saturating_sub(*time) <= ms(20));
        let (time, counts) = fresh.ok_or(StringFault::Hardware)?;
        Ok(Reading {
            time,
            counts,
            tensions: None,
            buttons: 0,
        })
    }

    fn write_tensions(&mut self, _now: Duration, tensions: &PerString) {
        let volts = geometry().volts(tensions).expect("known");
        self.digits =
            volts.map(|volts| (volts * 4096.0 / 3.3).round().clamp(-4095.0, 4095.0) as i16);
    }
}

#[test]
fn the_force_is_gone_120_ms_after_the_last_answer_and_back_within_a_second() {
    let boards = Arc::new(Mutex::new(boards(false, [0; STRINGS])));
    let plugged = Arc::new(Mutex::new(true));
    let four = BoardInfo::of_model(5).expect("known");
    let mut hardware = Direct {
        boards: Arc::clone(&boards),
        plugged: Arc::clone(&plugged),
        cycle: Cycle::new(vec![(0, four), (1, four)]).expect("eight motors"),
        counters: Counters::new(3.485e-5),
        digits: [0; STRINGS],
        seen: None,
        heard: Vec::new(),
    };
    // One reading alone is not believed, nor are two.
    for time in 0..2 {
        assert_eq!(
            hardware.read_counts(ms(time)).err(),
            Some(StringFault::Hardware)
        );
    }
    let at_centre = SpidarPlacement::default();
    let device = SpidarDevice::calibrated_at_centre(geometry(), hardware, at_centre, ms(2));
    let device = Box::new(device.expect("counts"));
    let mut held = OnFloor::new(device, &placement(), floor::<1>);
    let truth = || {
        let mut boards = boards.lock().expect("not poisoned");
        boards.held().true_pose().translation.vector
    };
    let plug = |is_in| *plugged.lock().expect("not poisoned") = is_in;
    let _ = held.run(1000, |_| ());
    for time in 1001..2500 {
        let _ = held.run(time, |_| ());
        // What is read is where the grip is: within a count of eight strings.
        let read = held.port.tick(ms(time), |_| None).reading.sample.pose;
        let off = (truth() - read.translation.vector).norm();
        assert!(off < 1e-4, "{off} m at {time} ms");
    }
    assert_eq!(held.run(2500, |_| ()), None, "no floor is felt");
    plug(false);
    let gone = held.run(2800, |_| ()).expect("a force without counts");
    assert!(gone <= 2620, "{gone}");
    plug(true);
    let _ = held.run(3400, |_| ());
    assert_eq!(held.run(3500, |_| ()), None, "no force after 0.6 s");
}

/// Damages one answer in ten of strings that a hand moves: how many were damaged, and of these believed.
fn damaged_cycles(cycles: u64) -> (u64, u64) {
    let four = BoardInfo::of_model(5).expect("known");
    let cycle = Cycle::new(vec![(0, four), (1, four)]).expect("eight motors");
    let mut counters = Counters::new(3.485e-5);
    // Counters of 16 bits say where counting began up to 65,536.
    let mut begun: Option<[i32; STRINGS]> = None;
    let truth = |time: u64| -> [i32; STRINGS] {
        std::array::from_fn(|i| {
            let phase = 6.3 * time as f64 * 1e-3 + i as f64;
            (1000.0 * phase.sin() + 400.0 * (2.3 * phase).cos()) as i32 + 32_000
        })
    };
    let answer = |time| {
        let mut answer = Vec::with_capacity(64);
        for (board, counts) in truth(time).chunks(4).enumerate() {
            answer.push(6 << 3 | board as u8);
            for count in counts {
                answer.extend((*count as i16).to_le_bytes());
            }
            answer.extend([0; 8]);
        }
        answer.extend([0x08, 5, 12, 4, 4]);
        answer
    };
    damaged(cycles, answer, |time, answer| {
        let raw = cycle.hear(answer).ok();
        let Some(counts) = raw.and_then(|raw| counters.take(ms(time), &raw)) else {
            return false;
        };
        let truth = truth(time);
        let begun = *begun
            .get_or_insert_with(|| std::array::from_fn::<_, STRINGS, _>(|i| counts[i] - truth[i]));
        let off = (0..STRINGS)
            .map(|i| (counts[i] - truth[i] - begun[i]).abs())
            .max()
            .expect("eight");
        // What may pass is what a hand could have done since the last believed cycle: 150 m/s^2 over a few milliseconds, and the cycle before.
        assert!(
            off <= 40,
            "{off} counts, {:.2} mm at {time} ms",
            f64::from(off) * 3.485e-2
        );
        true
    })
}

#[test]
fn no_wrong_length_is_believed_of_damaged_answers() {
    damaged_cycles(100_000);
}

/// `cargo test --release -p taut-bridge --test all spidar_uart:: -- --ignored --nocapture`
#[test]
#[ignore = "minutes"]
fn no_wrong_length_is_believed_of_ten_million_answers() {
    let (damaged, believed) = damaged_cycles(10_000_000);
    println!("{damaged} damaged of 10000000, {believed} of these within what a hand can do");
}

#[test]
fn the_published_geometry_can_be_held_at_its_centre() {
    let geometry = geometry();
    let lengths = geometry.lengths(&Isometry3::identity());
    assert!(
        lengths
            .iter()
            .all(|length| *length > 0.09 && *length < 0.14),
        "{lengths:?}"
    );
}
