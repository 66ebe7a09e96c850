//! The WoodenHaptics HID board: the driver on a socket in place of hidraw, under a virtual clock, and on reports that are damaged.
#![cfg(unix)]

use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::support::floor::{Direct, OnFloor, Wire, damaged, floor, placement};
use crate::support::ms;
use crate::support::stage::opened;
use nalgebra::Vector3;
use taut_bridge::spidar_uart::Counters;
use taut_bridge::wooden::{
    BoardReport, HostReport, SimulatedWooden, WOODEN_MODELS, WoodenModel, WoodenService,
};
use taut_bridge::{ArmDevice, ArmState, Hand, WoodenSettings};

#[test]
fn a_floor_is_felt_through_the_reports_and_again_after_the_cable_was_out() {
    for model in ["woodenhaptics-2019", "polhem-1"] {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("board");
        let numbers = WoodenModel::named(model).expect("published");
        let arm = Arc::new(Mutex::new(SimulatedWooden::new(
            numbers,
            Hand::LIGHT,
            None,
            None,
        )));
        let plug = || WoodenService::start(Arc::clone(&arm), &path).expect("a socket");
        let service = plug();
        let choice = format!("wooden={},model={model}", path.display());
        let device = opened(&choice).expect("it is there");
        let sensed = if model == "polhem-1" { 6 } else { 3 };
        assert_eq!(device.info().sensed_degrees_of_freedom, sensed);
        let held = OnFloor::new(device, &placement(), floor);
        held.outlives(service, plug, |service| {
            service.arm().held().rendered().norm()
        });
    }
}

#[test]
fn a_board_that_is_not_there_is_a_sentence() {
    let error = opened("wooden=/dev/no-such-hidraw").err();
    let error = error.expect("nothing there");
    assert!(
        error.contains("can be opened") && error.contains("udev"),
        "{error}"
    );
}

const MODEL: WoodenModel = WOODEN_MODELS[0];

/// An arm, and the encoders of its last report.
type Reporting = (SimulatedWooden, [i16; 6]);

impl Direct<Reporting> {
    /// A report and its answer.
    fn turn(&self, now: Duration) {
        let Wire { arm, state, force } = &mut *self.lock();
        let (arm, encoders) = arm;
        let currents = MODEL.currents(encoders, &Vector3::from(*force));
        let answer = arm.take(now, &HostReport::Currents(currents).bytes());
        *encoders = BoardReport::parse(&answer).expect("a report").encoders;
        *state = ArmState {
            reports: state.reports + 1,
            is_usable: true,
            position: MODEL.position(encoders).into(),
            ..ArmState::default()
        };
    }
}

#[test]
fn the_force_is_gone_120_ms_after_the_last_report_and_back_within_a_second() {
    let arm = SimulatedWooden::new(MODEL, Hand::LIGHT, None, None);
    let wire = Direct::of((arm, MODEL.home));
    let device = ArmDevice::new(
        Box::new(wire.clone()),
        WoodenSettings::default().arm(),
        placement(),
    );
    let mut held = OnFloor::new(Box::new(device), &placement(), floor);
    held.loses_and_finds(4500, |now| wire.turn(now));
}

/// Damages one report in ten: how many were damaged, and of these believed.
fn damaged_reports(reports: u64) -> (u64, u64) {
    let mut judge = Counters::new(MODEL.metres_per_count());
    let place = |time: u64| {
        let wave = |rate: f64| (rate * time as f64 * 1e-3).sin();
        Vector3::new(0.03 * wave(3.0), 0.03 * wave(2.1), 0.03 * wave(4.3))
    };
    let report = |time| {
        let report = BoardReport {
            encoders: MODEL.encoders(&place(time)).expect("within reach"),
            info: 1,
            button: false,
        };
        report.bytes().to_vec()
    };
    damaged(reports, report, |time, report| {
        let Some(heard) = BoardReport::parse(report) else {
            return false;
        };
        let [a, b, c, d, e, f] = heard.encoders;
        if judge.take(ms(time), &[a, b, c, d, e, f, 0, 0]).is_none() {
            return false;
        }
        let off = (MODEL.position(&heard.encoders) - place(time)).norm();
        // What a hand could have done meanwhile: 150 m/s^2 over two milliseconds, and the report before.
        assert!(off <= 4e-3, "{off} m at {time} ms");
        true
    })
}

#[test]
fn no_wrong_pose_is_believed_of_damaged_reports() {
    damaged_reports(100_000);
}

/// `cargo test --release -p taut-bridge --test all wooden:: -- --ignored --nocapture`
#[test]
#[ignore = "minutes"]
fn no_wrong_pose_is_believed_of_ten_million_reports() {
    let (damaged, believed) = damaged_reports(10_000_000);
    println!("{damaged} damaged of 10000000, {believed} of these within what a hand can do");
}
