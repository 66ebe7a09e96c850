//! Force shading and passivity: directions on a polygonised cylinder and over an edge, energy on closed paths.

use crate::geometry_shapes;

use std::f64::consts::TAU;
use std::sync::Arc;

use god_object::geometry::mass_properties;
use god_object::nalgebra::{Point3, UnitQuaternion, Vector3};
use god_object::spatial::linear;
use god_object::surface::EnergyObserver;
use god_object::{
    Body, Coupling, ForceShading, GodObject, Mesh, Obstacle, Pose, Settings, Surface, World,
};

const RADIUS: f64 = 0.02;
const TIP: f64 = 2e-3;
const DEPTH: f64 = 3e-3;

/// A ball of 2 mm and 1 kg.
fn tip() -> Body {
    let mesh = geometry_shapes::mesh(geometry_shapes::icosphere(TIP, 2));
    let properties = mass_properties(&mesh);
    Body {
        primitive: None,
        inertia: properties.inertia_per_density / properties.volume,
        mesh,
        mass: 1.0,
        reference_point: Point3::origin(),
    }
}

fn world(mesh: Mesh, crease_angle: Option<f64>) -> Arc<World> {
    Arc::new(World {
        body: tip(),
        obstacles: vec![Obstacle {
            primitive: None,
            name: "obstacle".into(),
            mesh,
            pose: Pose::identity(),
            surface: Surface {
                shading: crease_angle.map(|crease_angle| ForceShading { crease_angle }),
                ..Surface::default()
            },
        }],
    })
}

/// A prism along z with its vertices at `RADIUS`.
fn prism(sides: u32) -> Mesh {
    geometry_shapes::mesh(geometry_shapes::peg(RADIUS, 0.03, sides))
}

struct Run {
    god_object: GodObject,
    coupling: Coupling,
    observer: EnergyObserver,
    time: f64,
}

impl Run {
    fn new(world: Arc<World>, passive: bool, start: Vector3<f64>) -> Self {
        let settings = Settings {
            passive,
            ..Settings::for_size(2.0 * TIP)
        };
        Self {
            coupling: Coupling::new(&world, &settings),
            god_object: GodObject::new(world, settings, place(start)).expect("a free start"),
            observer: EnergyObserver::new(),
            time: 0.0,
        }
    }

    /// One millisecond of all loops; the force, N.
    fn tick(&mut self, device: Vector3<f64>) -> Vector3<f64> {
        self.time += 1e-3;
        let device = place(device);
        let set = self.god_object.constraint_set().clone();
        let felt = self.coupling.step(self.time, &device, &set);
        self.god_object.step(&device, felt.shaded.as_ref());
        self.observer.arrive(&device);
        self.observer.hold(&device, &felt.wrench);
        linear(&felt.wrench)
    }
}

fn place(at: Vector3<f64>) -> Pose {
    Pose::from_parts(at.into(), UnitQuaternion::identity())
}

fn on_circle(radius: f64, angle: f64) -> Vector3<f64> {
    Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
}

/// Out of the free down to the circle of `DEPTH`, within 100 ms.
fn approach(run: &mut Run) {
    for i in 0..100 {
        let depth = -1e-3 + (DEPTH + 1e-3) * f64::from(i) / 99.0;
        run.tick(on_circle(RADIUS + TIP - depth, 0.0));
    }
}

fn start() -> Vector3<f64> {
    on_circle(RADIUS + TIP + 1e-3, 0.0)
}

/// Energy given to the hand in each of `turns` turns, J.
fn turns(run: &mut Run, turns: usize, backwards: bool) -> Vec<f64> {
    let steps = 500;
    let sign = if backwards { -1.0 } else { 1.0 };
    (0..turns)
        .map(|_| {
            let before = run.observer.given();
            for i in 1..=steps {
                let angle = sign * TAU * f64::from(i) / f64::from(steps);
                run.tick(on_circle(RADIUS + TIP - DEPTH, angle));
            }
            run.observer.given() - before
        })
        .collect()
}

#[test]
fn sliding_on_a_cylinder_the_shaded_direction_is_nearer_to_the_round_one() {
    for (sides, speed) in [(16, 0.05), (16, 0.2), (64, 0.05), (64, 0.2)] {
        let error = |crease: Option<f64>| {
            let mut run = Run::new(world(prism(sides), crease), false, start());
            approach(&mut run);
            let (mut sum, mut worst, mut step, mut count) = (0.0, 0.0f64, 0.0f64, 0.0);
            let mut last: Option<Vector3<f64>> = None;
            for i in 0..600 {
                let angle = speed / RADIUS * 1e-3 * f64::from(i);
                let force = run.tick(on_circle(RADIUS + TIP - DEPTH, angle));
                let error = force.angle(&on_circle(1.0, angle)).to_degrees();
                sum += error;
                worst = worst.max(error);
                count += 1.0;
                if let Some(last) = last {
                    step = step.max(last.angle(&force).to_degrees());
                }
                last = Some(force);
            }
            (sum / count, worst, step)
        };
        let (plain, shaded) = (error(None), error(Some(1.0)));
        println!(
            "{sides} sides, {speed} m/s: direction error mean, worst, step per ms: unshaded {plain:.2?}, shaded {shaded:.2?} degrees"
        );
        assert!(shaded.0 < plain.0, "{sides} {speed}: {shaded:?} {plain:?}");
    }
}

#[test]
fn shading_turns_the_force_over_an_edge_by_five_degrees_a_millisecond_at_most() {
    // R08: along the top of a box, 3 mm deep, over its edge at 0.1 m/s.
    let half = 0.03;
    let steps = |crease: Option<f64>| {
        let mesh = geometry_shapes::mesh(geometry_shapes::cuboid([half; 3]));
        let top = half + TIP;
        let mut run = Run::new(
            world(mesh, crease),
            false,
            Vector3::new(0.0, 0.001, top + 1e-3),
        );
        let mut worst = 0.0f64;
        let mut last = Vector3::zeros();
        for i in 0..500 {
            let t = f64::from(i) * 1e-3;
            let z = top + 1e-3 - (DEPTH + 1e-3) * (t / 0.1).min(1.0);
            let force = run.tick(Vector3::new(0.1 * (t - 0.1).max(0.0), 0.001, z));
            if force.norm() > 0.1 && last.norm() > 0.1 {
                worst = worst.max(force.angle(&last).to_degrees());
            }
            last = force;
        }
        worst
    };
    let (plain, kept, shaded) = (steps(None), steps(Some(0.6)), steps(Some(1.7)));
    println!(
        "largest turn in a millisecond: unshaded {plain:.2}, edge kept {kept:.2}, shaded {shaded:.2} degrees"
    );
    assert!(shaded <= 5.0, "{shaded}");
}

#[test]
fn energy_on_a_closed_path_is_never_given_shaded_or_not() {
    let measure = |crease: Option<f64>, passive: bool| {
        let mut run = Run::new(world(prism(32), crease), passive, start());
        approach(&mut run);
        let mut per_turn = turns(&mut run, 10, false);
        per_turn.extend(turns(&mut run, 10, true));
        let worst = per_turn.iter().copied().fold(f64::MIN, f64::max);
        let mean = per_turn.iter().sum::<f64>() / per_turn.len() as f64;
        (mean, worst, run.observer.highest())
    };
    let plain = measure(None, false);
    let shaded = measure(Some(1.0), false);
    let bounded = measure(Some(1.0), true);
    println!(
        "J per turn, mean and worst, highest of the run: unshaded {plain:?}, shaded {shaded:?}, passive {bounded:?}"
    );
    assert!(shaded.1 <= 0.0 && plain.1 <= 0.0);
    // Where nothing is taken out, the bound changes nothing.
    assert_eq!(shaded, bounded);
    assert!(bounded.2 <= 1e-9);
}

#[test]
fn with_passivity_enforced_nobody_pumps_energy_out_of_a_held_force() {
    // In and out of a facet: a force held for a millisecond gives back K v T dx more than it took.
    let pump = |passive: bool| {
        let mut run = Run::new(world(prism(32), Some(1.0)), passive, start());
        let mut most = 0.0f64;
        for i in 0..2000 {
            let t = f64::from(i) * 1e-3;
            let depth = 3e-3 * (TAU * 3.0 * t).sin() - 1e-4;
            let force = run.tick(on_circle(RADIUS + TIP - depth, 0.1));
            most = most.max(force.norm());
        }
        (run.observer.highest(), most)
    };
    let (free, free_force) = pump(false);
    let (bounded, force) = pump(true);
    println!("most energy taken out: {free:e} J, with passivity {bounded:e} J");
    assert!(free > 1e-4, "{free}");
    assert!(bounded <= 1e-9, "{bounded}");
    // What is pressed in is felt as before.
    assert!((force - free_force).abs() < 0.05 * free_force);
}
