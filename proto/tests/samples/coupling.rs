//! The coupling that a bridge computes at the edge.

use taut_proto::{
    EdgeCoupling, PoseF64,
    coupling::{EdgeAdaptation, EdgeSettings, EdgeSine, EdgeSurface},
};

pub fn coupling() -> EdgeCoupling {
    EdgeCoupling {
        mass: 1.0,
        inertia: [0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.25],
        reference_point: [0.0, 0.0, 0.5],
        radius: 0.125,
        settings: EdgeSettings {
            k_s: 0.5,
            k_h: 2000.0,
            damping_time: 0.015_625,
            radius_of_gyration: Some(0.0625),
            adaptation: Some(EdgeAdaptation {
                duration: 0.015_625,
                threshold: -0.000_976_562_5,
            }),
            look_ahead: true,
            passive: false,
            force_limit: 20.0,
            torque_limit: 0.5,
            rest_distance: 0.000_007_629_394_531_25,
            minimum_gap: 0.000_000_953_674_316_406_25,
            gap_tolerance: 0.000_000_119_209_289_550_781_25,
            activation_distance: 0.000_488_281_25,
            look_ahead_limit: 0.5,
            look_ahead_pairs: 1000,
            motion_tolerance: 0.000_000_029_802_322_387_695_312,
            max_constraints: 1024,
            max_substeps: 10,
            implicit_rounds: 2,
            max_advancement_steps: 200,
            work_budget: Some(40),
        },
        set_rate_hz: 1000.0,
        obstacles: vec![EdgeSurface {
            pose: PoseF64::IDENTITY,
            friction: 0.25,
            sine: Some(EdgeSine {
                axis: [1.0, 0.0, 0.0],
                wavelength: 0.001_953_125,
                amplitude: 0.125,
            }),
        }],
    }
}
