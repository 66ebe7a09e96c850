//! Constraint adaptation as the hand feels it, on constraint sets made by hand: an unexpected constraint enters without a
//! jump, and new names for an old constraint change nothing. Source: Ortega et al. 2007, Section 5, Figure 6.

use crate::support;

use god_object::constraint::{Feature, FeaturePair, Separation};
use god_object::nalgebra::{Point3, Vector3};
use god_object::{ConstraintSet, Coupling, NonPenetrationConstraint, Pose, Settings};

/// Translational stiffness k_h k_s m of `coupling`, N/m.
const STIFFNESS: f64 = 1000.0;
/// How deep the device is behind the constraint, m: beyond the threshold of the adaptation.
const DEPTH: f64 = 0.006;
const DURATION: f64 = 0.02;

fn coupling() -> Coupling {
    let world = support::box_on_table();
    let settings = Settings::for_size(0.04);
    assert_eq!(
        settings.adaptation.map(|adaptation| adaptation.duration),
        Some(DURATION)
    );
    assert!((settings.stiffness(world.body.mass) - STIFFNESS).abs() < 1e-9);
    Coupling::new(&world, &settings)
}

/// One constraint under the body's middle that points up, named by the table's triangle `face`.
fn touching(sequence: u64, face: u32) -> ConstraintSet {
    let mut set = ConstraintSet::with_capacity(1);
    set.sequence = sequence;
    set.constraints.push(NonPenetrationConstraint {
        features: FeaturePair {
            obstacle: 0,
            on_body: Feature::Vertex(0),
            on_obstacle: Feature::Face(face),
        },
        point: Point3::new(0.0, 0.0, -0.01),
        normal: Vector3::z(),
        gap: 0.0,
        separation: Separation::default(),
        obstacle_displacement: Vector3::zeros(),
        shading_normal: None,
    });
    set
}

fn force(coupling: &mut Coupling, time: f64, set: &ConstraintSet) -> f64 {
    coupling
        .step(time, &Pose::translation(0.0, 0.0, -DEPTH), set)
        .wrench[2]
}

#[test]
fn a_constraint_that_appears_behind_the_device_enters_over_the_adaptation_s_time() {
    let mut coupling = coupling();
    let empty = ConstraintSet::with_capacity(1);
    assert_eq!(force(&mut coupling, 0.0, &empty), 0.0);
    let set = touching(1, 7);
    let felt: Vec<f64> = (0..=20)
        .map(|step| force(&mut coupling, 0.001 * f64::from(step), &set))
        .collect();
    assert!(felt[0].abs() < 1e-9, "a jump of {} N", felt[0]);
    assert!(
        felt.windows(2).all(|two| two[0] <= two[1] + 1e-9),
        "{felt:?}"
    );
    assert!(
        (felt[10] - 0.5 * STIFFNESS * DEPTH).abs() < 1e-6,
        "half way it is {} N",
        felt[10]
    );
    assert!(
        (felt[20] - STIFFNESS * DEPTH).abs() < 1e-6,
        "in the end it is {} N",
        felt[20]
    );
}

/// Found on the shipped sphere that goes round on a plane of two triangles: 6.0 N fell to 0.3 N for 20 ms at the diagonal.
#[test]
fn a_body_that_slides_from_one_triangle_to_the_next_keeps_its_force() {
    let mut coupling = coupling();
    let full = STIFFNESS * DEPTH;
    for step in 0_u32..100 {
        // The first constraint after an empty start comes at once; then the name of the face changes every 30 ms.
        let sequence = u64::from(step);
        let felt = force(
            &mut coupling,
            0.001 * f64::from(step),
            &touching(sequence, step / 30),
        );
        assert!((felt - full).abs() < 1e-6, "{felt} N after {step} ms");
    }
}

#[test]
fn the_step_after_a_lost_contact_enters_gradually_again() {
    let mut coupling = coupling();
    let full = STIFFNESS * DEPTH;
    assert!((force(&mut coupling, 0.0, &touching(1, 0)) - full).abs() < 1e-6);
    let mut empty = ConstraintSet::with_capacity(1);
    empty.sequence = 2;
    assert_eq!(force(&mut coupling, 0.001, &empty), 0.0);
    assert!(force(&mut coupling, 0.002, &touching(3, 0)).abs() < 1e-9);
}
