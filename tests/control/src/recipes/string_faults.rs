//! R36: faults of a string-driven device: motor dead, one string miscalibrated, slack, infeasible wrench, turned too far, near a
//! motor, not a number; on every shipped geometry.

use std::time::Duration;

use nalgebra::{Vector3, Vector6};
use taut_spidar::{
    Encoders, ForwardKinematics, Geometry, MotorState, Pose, ResidualMonitor, STRINGS,
    SimulatedStrings, StringFault, StringHardware, StringLosses, StringMatrix, TensionSettings,
    TensionSolver, TensionStatus,
};
use taut_test_kit::strings::{Random, apart, motion};

use crate::row::{Row, Rows};

/// Error of a miscalibrated string, m.
const SLIP: f64 = 1e-3;
/// When it slips, and by when it must have been noticed, ms.
const SLIPS: (u32, u32) = (1000, 1100);
/// Largest error of direction of a wrench that was scaled down, as a share of it.
const DIRECTION: f64 = 1e-3;

/// Every fault on every geometry.
pub(crate) fn run() -> Vec<Row> {
    let mut all = Vec::new();
    for geometry in Geometry::shipped_names().filter_map(Geometry::shipped) {
        let mut rows = Rows::of(&geometry.name);
        for fault in [
            infeasible,
            dead_motor,
            unknown_motor,
            slipped,
            slack,
            turned_too_far,
            near_a_motor,
            not_a_number,
            at_rest,
        ] {
            fault(&geometry, &mut rows);
        }
        all.extend(rows.all);
    }
    all
}

/// A wrench outside the feasible set keeps its direction, is as large as it can be, and is flagged.
fn infeasible(geometry: &Geometry, rows: &mut Rows) {
    let arm = geometry.arm();
    let mut solver = solver(geometry);
    let mut random = Random(11);
    let (mut scaled, mut unflagged, mut worst, mut not_largest) = (0, 0, 0.0_f64, 0);
    for _ in 0..1000 {
        let pose = random.pose(0.5 * reach(geometry), 0.2);
        let strings = StringMatrix::at(geometry, &pose);
        let force = random.direction() * (4.0 * geometry.tension_max);
        let torque = random.in_ball() * (geometry.tension_max * arm);
        let wrench = six(force, torque);
        let answer = solver.distribute(&strings, &wrench);
        unflagged += u32::from(answer.status == TensionStatus::Rendered);
        if answer.status != TensionStatus::Scaled {
            continue; // the zero wrench itself is at the edge here
        }
        scaled += 1;
        let off = size(&(answer.wrench - answer.scale * wrench), arm);
        let kept = answer.scale * size(&wrench, arm);
        worst = worst.max(off / (kept + 1.0));
        // A hundredth more cannot be rendered.
        let more = wrench * (1.01 * answer.scale);
        let bigger = solver.feasible_scale(&strings, &more);
        not_largest += u32::from(bigger.is_none_or(|scale| scale >= 0.995));
    }
    let what = "infeasible wrench, error of direction";
    rows.at_most(what, worst, DIRECTION, "of it");
    rows.holds(
        "infeasible wrenches of 1000",
        format!("{scaled} scaled, {unflagged} not flagged, {not_largest} too small"),
        "> 800 scaled, none of the others",
        scaled > 800 && unflagged == 0 && not_largest == 0,
    );
}

/// With a motor dead, the nearest wrench is rendered, and flagged where it is not the one that was asked for.
fn dead_motor(geometry: &Geometry, rows: &mut Rows) {
    let arm = geometry.arm();
    let mut random = Random(12);
    let (mut pulled, mut residual, mut worst) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut motors_with_both = 0;
    for dead in 0..STRINGS {
        let mut solver = solver(geometry);
        solver.set_motor(dead, MotorState::Dead);
        let (mut exact, mut flagged) = (0, 0);
        for _ in 0..200 {
            let strings = StringMatrix::at(geometry, &random.pose(0.5 * reach(geometry), 0.2));
            let wrench = six(
                random.in_ball() * (0.2 * geometry.tension_max),
                random.in_ball() * (0.05 * geometry.tension_max * arm),
            );
            let answer = solver.distribute(&strings, &wrench);
            pulled = pulled.max(answer.tensions[dead]);
            residual = residual.max(answer.kkt_residual);
            if answer.status == TensionStatus::Rendered {
                exact += 1;
                let off = size(&(answer.wrench - wrench), arm);
                worst = worst.max(off / (size(&wrench, arm) + 0.1));
            } else {
                flagged += 1;
            }
        }
        motors_with_both += usize::from(exact > 0 && flagged > 0);
    }
    rows.at_most("dead motor, its tension", pulled, 0.0, "N");
    rows.at_most("dead motor, KKT residual", residual, 1e-10, "");
    let what = "dead motor, error of wrenches that are not flagged";
    rows.at_most(what, worst, 1e-3, "of it");
    rows.holds(
        "dead motor, motors with wrenches of both kinds",
        motors_with_both,
        STRINGS,
        motors_with_both == STRINGS,
    );
}

/// A motor of unknown pull states what it may add.
fn unknown_motor(geometry: &Geometry, rows: &mut Rows) {
    let mut solver = solver(geometry);
    solver.set_motor(3, MotorState::Unknown);
    let strings = StringMatrix::at(geometry, &Pose::identity());
    let answer = solver.distribute(&strings, &Vector6::zeros());
    let (stated, commanded) = (answer.uncertainty, answer.tensions[3]);
    rows.holds(
        "motor of unknown pull, stated",
        format!("{stated} N, commanded {commanded} N"),
        format!("{} N, commanded 0 N", geometry.tension_max),
        stated == geometry.tension_max && commanded == 0.0,
    );
}

/// A millimetre on one string of a moving device is noticed, and the string is named.
fn slipped(geometry: &Geometry, rows: &mut Rows) {
    let (mut latest, mut unnamed, mut innocents, mut worst) = (0, 0, 0, 0.0_f64);
    for bad in 0..STRINGS {
        let start = motion(0.0, reach(geometry), 0.5);
        let mut strings = SimulatedStrings::new(geometry, StringLosses::default(), start);
        // All counters are at zero there.
        let encoders = Encoders::calibrated(geometry, &start, &[0; STRINGS]);
        let mut kinematics = ForwardKinematics::new(geometry);
        let mut monitor = ResidualMonitor::new();
        kinematics.start_at(start);
        let (mut alarmed, mut named) = (None, false);
        for tick in 0..3000_u32 {
            let now = Duration::from_millis(tick.into());
            if tick == SLIPS.0 {
                strings.slip(bad, SLIP);
            }
            strings.advance(now, motion(now.as_secs_f64(), reach(geometry), 0.5));
            let Ok(reading) = strings.read_counts(now) else {
                continue;
            };
            let Ok(answer) = kinematics.solve(&encoders.lengths(&reading.counts)) else {
                continue;
            };
            let consistency = monitor.step(&answer);
            if consistency.alarm {
                alarmed.get_or_insert(tick);
            }
            if let Some(culprit) = consistency.culprit() {
                innocents += u32::from(culprit != bad);
                named |= culprit == bad;
                // The estimate sharpens as the grip moves on.
                if tick >= 2500 {
                    let error = consistency.suspect.map_or(0.0, |suspect| suspect.error);
                    worst = worst.max((error - SLIP).abs());
                }
            }
        }
        let alarmed = alarmed.filter(|tick| *tick >= SLIPS.0).unwrap_or(u32::MAX);
        latest = latest.max(alarmed);
        unnamed += u32::from(!named);
    }
    rows.holds(
        "string 1 mm off, alarm at the latest",
        format!("{} ms after", latest.saturating_sub(SLIPS.0)),
        format!("< {} ms", SLIPS.1 - SLIPS.0),
        latest < SLIPS.1,
    );
    rows.holds(
        "string 1 mm off, named",
        format!("{unnamed} of 8 not, {innocents} times another"),
        "0 and 0",
        unnamed == 0 && innocents == 0,
    );
    rows.at_most("string 1 mm off, its size", worst * 1e3, 0.1, "mm off");
}

/// A slack string shows, and the others still give the pose.
fn slack(geometry: &Geometry, rows: &mut Rows) {
    let start = Pose::identity();
    let mut strings =
        SimulatedStrings::new(geometry, StringLosses::default(), start).measuring_tensions();
    let encoders = Encoders::calibrated(geometry, &start, &[0; STRINGS]);
    let mut kinematics = ForwardKinematics::new(geometry);
    strings.set_dead(0, true);
    // Towards motor 0: its string is not wound up.
    let towards = geometry.motors[0].coords / geometry.motors[0].coords.norm() * 3e-3;
    for tick in 1..=200_u32 {
        let share = f64::from(tick) / 200.0;
        strings.advance(
            Duration::from_millis(tick.into()),
            Pose::from_parts((towards * share).into(), start.rotation),
        );
    }
    let Ok(reading) = strings.read_counts(Duration::from_millis(200)) else {
        return rows.holds("slack string", "no counts", "counts", false);
    };
    let tension = reading.tensions.map_or(f64::NAN, |tensions| tensions[0]);
    let lengths = encoders.lengths(&reading.counts);
    let alarmed = kinematics
        .solve(&lengths)
        .is_ok_and(|with| ResidualMonitor::new().step(&with).alarm);
    kinematics.use_string(0, false);
    let count = geometry.metres_per_count[0].abs();
    let off = kinematics.solve(&lengths).map_or(f64::NAN, |without| {
        let (distance, angle) = apart(&without.frame_from_grip, strings.pose());
        distance.max(angle * geometry.arm()) / count
    });
    kinematics.use_string(1, false);
    kinematics.use_string(2, false);
    let few = kinematics.solve(&lengths).err();
    rows.holds(
        "slack string, its tension",
        format!("{tension:.2} N"),
        format!("< {} N", geometry.tension_min),
        tension < geometry.tension_min,
    );
    rows.holds("slack string, lengths disagree", alarmed, true, alarmed);
    rows.at_most("slack string, pose from the others", off, 5.0, "counts");
    let expected = Some(StringFault::TooFewStrings(5));
    let (found, right) = (format!("{few:?}"), few == expected);
    rows.holds("five strings", found, format!("{expected:?}"), right);
}

/// A grip turned beyond a right angle is a fault, and before it none.
fn turned_too_far(geometry: &Geometry, rows: &mut Rows) {
    let axis = Vector3::new(0.2, 0.9, 0.1);
    let axis = axis / axis.norm();
    let mut kinematics = ForwardKinematics::new(geometry);
    let mut off = 0.0_f64;
    let mut fault_at = f64::NAN;
    for tick in 0..=200_u32 {
        let angle = f64::from(tick).to_radians() * 0.6;
        let pose = Pose::new(Vector3::zeros(), axis * angle);
        match kinematics.solve(&geometry.lengths(&pose)) {
            Ok(answer) => off = off.max(apart(&answer.frame_from_grip, &pose).1),
            Err(_) => {
                fault_at = angle;
                break;
            }
        }
    }
    let degrees = fault_at.to_degrees();
    rows.holds(
        "turned too far",
        format!("fault at {degrees:.1} degrees, {off:.1e} rad off before"),
        "86 to 91 degrees, < 1e-6 rad",
        (1.5..=std::f64::consts::FRAC_PI_2 + 0.6_f64.to_radians()).contains(&fault_at)
            && off < 1e-6,
    );
}

/// A grip near a motor is a fault.
fn near_a_motor(geometry: &Geometry, rows: &mut Rows) {
    // The hole of the grip moves to motor 5.
    let to = geometry.motors[5] - geometry.grips[5];
    let mut kinematics = ForwardKinematics::new(geometry);
    let found = (0..=1000_u32).find_map(|tick| {
        let pose = Pose::from_parts(
            (to * (f64::from(tick) / 1000.0)).into(),
            Pose::identity().rotation,
        );
        let lengths = geometry.lengths(&pose);
        let fault = kinematics.solve(&lengths).err()?;
        Some((lengths[5], fault))
    });
    let right = found.is_some_and(|(length, fault)| {
        matches!(fault, StringFault::NearMotor { string: 5, .. })
            && (0.008..=0.010).contains(&length)
    });
    let measured = found.map_or_else(
        || "no fault".to_owned(),
        |(length, fault)| format!("{:.1} mm: {fault}", length * 1e3),
    );
    rows.holds("near motor 6", measured, "8 to 10 mm, motor 6", right);
}

/// What is not a number is a fault, and pulls no harder than pretension.
fn not_a_number(geometry: &Geometry, rows: &mut Rows) {
    let mut kinematics = ForwardKinematics::new(geometry);
    let good = geometry.lengths(&Pose::identity());
    let mut lengths = good;
    lengths[4] = f64::NAN;
    let fault = kinematics.solve(&lengths).err();
    let goes_on = kinematics.solve(&good).is_ok();
    let strings = StringMatrix::at(geometry, &Pose::identity());
    let answer = solver(geometry).distribute(&strings, &(Vector6::x() * f64::NAN));
    rows.holds(
        "length not a number",
        format!("{fault:?}, the next one good: {goes_on}"),
        "Some(NotFinite(4)), the next one good: true",
        fault == Some(StringFault::NotFinite(4)) && goes_on,
    );
    rows.holds(
        "wrench not a number",
        format!("{:?}, {:.2} N", answer.status, answer.tensions[0]),
        format!("NotFinite, {:.2} N", geometry.tension_min),
        answer.status == TensionStatus::NotFinite
            && answer.tensions == [geometry.tension_min; STRINGS],
    );
}

/// At rest a millimetre raises the alarm at the centre, and never is an innocent string named.
fn at_rest(geometry: &Geometry, rows: &mut Rows) {
    let mut random = Random(31);
    let (mut innocents, mut silent) = (0, 0);
    for bad in 0..STRINGS {
        for pose in [Pose::identity(), random.pose(reach(geometry), 0.5)] {
            let mut lengths = geometry.lengths(&pose);
            lengths[bad] += SLIP;
            let mut kinematics = ForwardKinematics::new(geometry);
            let mut monitor = ResidualMonitor::new();
            for _ in 0..500 {
                let Ok(answer) = kinematics.solve(&lengths) else {
                    silent += 1;
                    continue;
                };
                let consistency = monitor.step(&answer);
                let culprit = consistency.culprit();
                innocents += u32::from(culprit.is_some_and(|culprit| culprit != bad));
                silent += u32::from(!consistency.alarm && pose == Pose::identity());
            }
        }
    }
    rows.holds(
        "string 1 mm off at rest",
        format!("{silent} samples without alarm, {innocents} innocents named"),
        "0 and 0",
        silent == 0 && innocents == 0,
    );
}

fn solver(geometry: &Geometry) -> TensionSolver {
    TensionSolver::new(geometry, TensionSettings::default())
}

/// N; N m over G counts like N.
fn six(force: Vector3<f64>, torque: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}

/// Size with torque over G.
fn size(wrench: &Vector6<f64>, arm: f64) -> f64 {
    let (force, torque) = (wrench.fixed_rows::<3>(0), wrench.fixed_rows::<3>(3));
    (force.norm_squared() + torque.norm_squared() / (arm * arm)).sqrt()
}

/// Where a hand moves in a device: radius of positions, m.
fn reach(geometry: &Geometry) -> f64 {
    geometry.half_width() / 3.0
}
