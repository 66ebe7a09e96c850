//! The plant against closed forms: friction, delay, lag, strings' inertia, reaction.

use std::time::Duration;

use nalgebra::{Matrix6, Vector3, Vector6};
use taut_plant::{
    Grip, Hand, MinJerkPath, Motors, Plant, Pose, REACTION_TIME, StringAnchors, string_inertia,
};

const TICK: Duration = Duration::from_millis(1);

fn grip() -> Grip {
    Grip::ball(0.2, 0.06, 2.0)
}

fn released(grip: Grip) -> Plant {
    Plant::new(grip, Hand::RELEASED, MinJerkPath::hold(Pose::identity()))
}

fn x(plant: &Plant) -> f64 {
    plant.pose().translation.vector.x
}

#[test]
fn less_force_than_the_friction_moves_nothing_for_ever() {
    let mut plant = released(Grip {
        coulomb_force: Vector3::repeat(0.1),
        coulomb_torque: Vector3::repeat(1e-3),
        ..grip()
    });
    for tick in 0..10_000 {
        plant.advance(TICK * tick);
        // Just below the limit, in alternating directions.
        let side = if tick % 7 < 4 { 1.0 } else { -1.0 };
        plant.command(&(Vector6::new(0.0999, -0.05, 0.0, 0.0, 9.9e-4, 0.0) * side));
    }
    assert_eq!(*plant.pose(), Pose::identity());
    assert_eq!(*plant.velocity(), Vector6::zeros());
}

#[test]
fn a_grip_that_slides_stops_where_friction_has_eaten_its_energy() {
    let friction = 0.1;
    let mut plant = released(Grip {
        damping: Vector3::zeros(),
        coulomb_force: Vector3::repeat(friction),
        ..grip()
    });
    let speed = 0.2;
    plant.place(Pose::identity(), Vector6::x() * speed);
    plant.advance(Duration::from_secs(2));
    let (mass, stopped) = (0.2, x(&plant));
    let exact = 0.5 * mass * speed * speed / friction;
    // The step in which it stops spreads its friction: f_c / m h^2 / 8 at most.
    assert!((stopped - exact).abs() < 1e-9, "{stopped} {exact}");
    assert_eq!(plant.velocity().x, 0.0);
    plant.advance(Duration::from_secs(10));
    assert_eq!(x(&plant), stopped);
}

#[test]
fn friction_takes_a_fixed_length_from_every_swing() {
    // A hand without damping as a spring: each half swing is shorter by 2 f_c / k.
    let (stiffness, friction) = (100.0, 0.05);
    let hand = Hand {
        stiffness,
        rotational_stiffness: 1.0,
        ..Hand::RELEASED
    };
    let device = Grip {
        damping: Vector3::zeros(),
        coulomb_force: Vector3::repeat(friction),
        ..grip()
    };
    let mut plant = Plant::new(device, hand, MinJerkPath::hold(Pose::identity()));
    let start = 5.25e-3;
    plant.place(Pose::translation(start, 0.0, 0.0), Vector6::zeros());
    let mut farthest = vec![start];
    let mut last_velocity = 0.0;
    for step in 1..400_000 {
        plant.advance(Duration::from_micros(20) * step);
        let velocity = plant.velocity().x;
        if last_velocity * velocity < 0.0 || (last_velocity != 0.0 && velocity == 0.0) {
            farthest.push(x(&plant).abs());
        }
        last_velocity = velocity;
    }
    let loss = 2.0 * friction / stiffness;
    for (n, reached) in farthest.iter().enumerate() {
        let exact = start - n as f64 * loss;
        assert!((reached - exact).abs() < 2e-7, "{n}: {reached} {exact}");
    }
    // It sticks where the spring is weaker than the friction: 5 swings, 0.25 mm aside.
    assert_eq!(farthest.len(), 6);
}

#[test]
fn a_delay_is_a_delay_whatever_fraction_of_a_step_it_is() {
    for micros in [0, 130, 500, 999, 2345] {
        let delay = Duration::from_micros(micros);
        let mut plant = released(grip()).with_motors(Motors {
            delay,
            lag: Duration::ZERO,
        });
        plant.advance(TICK);
        plant.command(&Vector6::x());
        plant.advance(TICK * 20);
        let (mass, damping) = (0.2, 2.0);
        let time: f64 = (TICK * 19 - delay).as_secs_f64();
        let exact = time / damping - mass / damping / damping * -(-damping * time / mass).exp_m1();
        assert!((x(&plant) - exact).abs() < 1e-15, "{micros}");
    }
}

#[test]
fn motors_that_lag_rise_exponentially() {
    let lag = Duration::from_micros(1500);
    let mut plant = released(grip()).with_motors(Motors { delay: TICK, lag });
    plant.command(&(Vector6::x() * 3.0));
    plant.advance(TICK * 5);
    let exact = 3.0 * -(-4.0 / 1.5_f64).exp_m1();
    assert!((plant.rendered_wrench().x - exact).abs() < 1e-12);
}

#[test]
fn the_longest_step_does_not_matter_without_friction() {
    let run = |longest: Duration| {
        let hand = MinJerkPath::hold(Pose::identity());
        let mut plant = Plant::new(grip(), Hand::LIGHT, hand).with_longest_step(longest);
        plant.place(Pose::translation(0.01, 0.0, 0.0), Vector6::zeros());
        plant.command(&Vector6::new(0.5, 1.0, 0.0, 0.0, 0.0, 0.0));
        plant.advance(Duration::from_millis(123));
        plant.pose().translation.vector
    };
    let fine = run(Duration::from_micros(10));
    assert!((run(TICK) - fine).norm() < 1e-15);
    assert!((run(TICK * 50) - fine).norm() < 1e-15);
}

#[test]
fn strings_that_couple_the_axes_conserve_momentum() {
    // An uneven set of strings: pushed along x, the grip also turns, as the inertia says.
    let strings: Vec<_> = (0..8)
        .map(|i| {
            let side = |bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
            StringAnchors {
                motor: nalgebra::Point3::new(0.9 * side(1), 0.6 * side(2), 0.4 + 0.2 * side(4)),
                grip: nalgebra::Point3::new(0.06 * side(2), 0.01, 0.0),
            }
        })
        .collect();
    let added = string_inertia(&strings, &Pose::identity(), 4e-6, 0.008);
    let device = Grip {
        damping: Vector3::zeros(),
        rotational_damping: Vector3::zeros(),
        string_inertia: added,
        ..grip()
    };
    let mut plant = released(device);
    let wrench = Vector6::new(0.3, 0.0, 0.1, 0.0, 1e-3, 0.0);
    plant.command(&wrench);
    plant.advance(TICK * 10);
    let momentum: Vector6<f64> = device.inertia() * plant.velocity();
    assert!((momentum - wrench * 0.01).norm() < 1e-12);
    assert!(added != Matrix6::zeros() && plant.velocity()[4].abs() > 1e-6);
}

#[test]
fn a_hand_that_decides_moves_after_its_reaction_time() {
    let mut plant = Plant::new(grip(), Hand::FIRM, MinJerkPath::hold(Pose::identity()));
    plant.advance(TICK * 100);
    plant.decide(MinJerkPath::hold(Pose::translation(0.01, 0.0, 0.0)));
    let acts = TICK * 100 + REACTION_TIME;
    plant.advance(acts - TICK);
    assert_eq!(x(&plant), 0.0);
    plant.advance(acts + TICK * 10);
    assert!(x(&plant) > 1e-5);
}

#[test]
fn energy_only_falls_without_motors_and_hand() {
    let mut plant = released(Grip {
        coulomb_force: Vector3::repeat(0.02),
        ..grip()
    });
    plant.place(
        Pose::identity(),
        Vector6::new(0.1, -0.2, 0.05, 1.0, 2.0, -3.0),
    );
    let mut last = plant.kinetic_energy();
    for tick in 1..3000 {
        plant.advance(TICK * tick);
        let energy = plant.kinetic_energy();
        assert!(energy <= last);
        last = energy;
    }
    assert!(last < 1e-12);
}
