//! What is rendered for a person's measured motion, against what was measured of the force.

use taut_lab::method::Method;
use taut_lab::replay::{SHARES, TARGETS, percentiles, replay};

/// A trial whose contour was registered by another one. All nine: `taut-lab measured`, docs/laboratory.md.
const TRIAL: &str = "e_2";

#[test]
fn the_force_of_a_measured_motion_points_where_the_measured_one_did() {
    let ours = replay(TRIAL, Method::Ours).expect("the trial is in the repository");
    assert_eq!(ours.registered_by, "other trials");
    assert!(ours.angles.len() > 100, "{} instants", ours.angles.len());
    let [angles, _] = percentiles([&ours.angles, &ours.residuals]);
    for ((found, target), share) in angles.iter().zip(TARGETS[0]).zip(SHARES) {
        assert!(
            *found <= target,
            "{found} degrees, not {target}, at {share}"
        );
    }
}

/// The comparison can fail: what does not look at the contour is not within the targets.
#[test]
fn a_random_force_does_not_point_where_the_measured_one_did() {
    let random = replay(TRIAL, Method::RandomForce).expect("the trial is in the repository");
    let [angles, residuals] = percentiles([&random.angles, &random.residuals]);
    assert!(angles[0] > 10.0 * TARGETS[0][0] && residuals[0] > 10.0 * TARGETS[1][0]);
}
