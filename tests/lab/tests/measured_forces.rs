//! What is rendered for a person's measured motion, against what was measured of the force.

use taut_lab::method::{Method, Tuning};
use taut_lab::replay::{Choice, SHARES, STIFFNESSES, TARGETS, percentiles, replay};

/// A trial whose contour was registered by another one. All: `taut-lab measured`, docs/laboratory.md.
const TRIAL: &str = "e_2";

/// The softest spring, and the method's default but for the proxy's damping.
fn choice(method: Method) -> Choice {
    let tuning = if method == Method::VirtualCoupling {
        Tuning::Proxy {
            share: 0.02,
            damping_ratio: 0.3,
            goes_on: false,
        }
    } else {
        method.tunings()[0]
    };
    Choice {
        stiffness: STIFFNESSES[0],
        tuning,
    }
}

/// A laboratory in which only its own method finds the contour would measure how badly the others were built.
#[test]
fn the_force_of_a_measured_motion_points_where_the_measured_one_did() {
    for method in [Method::Ours, Method::Discrete, Method::VirtualCoupling] {
        let found = replay(TRIAL, method, choice(method)).expect("the trial is in the repository");
        assert_eq!(found.registered_by, "other trials");
        assert!(found.angles.len() > 100, "{} instants", found.angles.len());
        let [angles, _] = percentiles([&found.angles, &found.residuals]);
        for ((found, target), share) in angles.iter().zip(TARGETS[0]).zip(SHARES) {
            assert!(
                *found <= target,
                "{method:?}: {found} degrees, not {target}, at {share}"
            );
        }
    }
}

/// The comparison can fail: what does not look at the contour is not within the targets.
#[test]
fn a_random_force_does_not_point_where_the_measured_one_did() {
    let random = replay(TRIAL, Method::RandomForce, choice(Method::RandomForce))
        .expect("the trial is in the repository");
    let [angles, residuals] = percentiles([&random.angles, &random.residuals]);
    assert!(angles[0] > 10.0 * TARGETS[0][0] && residuals[0] > 10.0 * TARGETS[1][0]);
}
