//! Coupling at the edge without delay, its determinism, and the wire's single precision. At 20 ms it is a recipe.

use std::time::Duration;

use god_object::{ConstraintSet, Coupling};
use taut_bridge::edge::{read_set, write_set};
use taut_bridge::{Device, Grip, Hand, SimulatedDevice};
use taut_control_tests::edge::{Mode, god_object, run};
use taut_control_tests::edge_network::{Impairment, through_the_codec};
use taut_control_tests::edge_scenes::Task;
use taut_proto::{Assembler, Division, Payload};

#[test]
fn without_delay_both_are_stable_and_the_edge_is_the_truer_one() {
    let task = Task::wall();
    let near = Impairment::new(0.0, 0.0);
    let (edge, shipped) = (
        run(&task, Mode::Edge, near, 1),
        run(&task, Mode::Shipped, near, 1),
    );
    assert!(edge.stable && shipped.stable);
    assert!(edge.error.max <= shipped.error.max, "{edge:?} {shipped:?}");
    assert!(edge.error.max < 0.1, "{edge:?}");
}

#[test]
fn a_run_is_determined_by_its_seed() {
    let task = Task::wall();
    let bad = Impairment::new(10.0, 10.0);
    let first = run(&task, Mode::Edge, bad, 5);
    assert_eq!(first, run(&task, Mode::Edge, bad, 5));
}

/// Force and torque from sets that went through the wire's single precision, against those from the sets themselves, at the poses
/// of a whole task.
#[test]
fn single_precision_on_the_wire_changes_the_force_by_less_than_1e_4_of_it() {
    for task in Task::all() {
        let scene = &task.scene;
        let mut body = god_object(&task);
        let mut exact = Coupling::new(&scene.world, &scene.settings);
        let mut wired = Coupling::new(&scene.world, &scene.settings);
        let mut device = SimulatedDevice::new(
            Grip::workbench(),
            Hand::LIGHT,
            task.intention.clone(),
            scene.reference_point(),
        );
        let mut wire = taut_proto::ConstraintSet::new();
        let mut arrived = ConstraintSet::with_capacity(scene.settings.max_constraints);
        let (mut worst, mut felt) = (0.0_f64, 0);
        for tick in 0..(task.duration * 1e3) as u32 {
            let now = Duration::from_millis(1) * tick;
            let pose = device.read(now).expect("no faults").pose;
            body.step(&pose, None);
            let set = body.constraint_set();
            write_set(set, scene.settings.implicit_rounds > 0, &mut wire);
            let mut assembler = Assembler::new();
            let division = Division::of(&wire);
            for part in 0..division.parts() {
                let part = Payload::Constraints(division.part(&wire, part));
                match through_the_codec(&part) {
                    Ok(Payload::Constraints(part)) => assembler.take(&part),
                    other => panic!("{other:?}"),
                };
            }
            let whole = assembler.newest().expect("nothing was lost");
            assert_eq!(read_set(whole, &mut arrived), Ok(()));
            let time = now.as_secs_f64();
            let right = exact.step(time, &pose, set).wrench;
            let here = wired.step(time, &pose, &arrived).wrench;
            for (first, least) in [(0, 0.1), (3, 0.005)] {
                let part = right.fixed_rows::<3>(first);
                if part.norm() > least {
                    felt += 1;
                    worst = worst.max((here.fixed_rows::<3>(first) - part).norm() / part.norm());
                }
            }
            device.write(now, &right);
        }
        println!("{}: {worst:.1e} of {felt} forces and torques", task.name);
        assert!(felt > 1000, "{}: {felt}", task.name);
        assert!(worst < 1e-4, "{}: {worst}", task.name);
    }
}
