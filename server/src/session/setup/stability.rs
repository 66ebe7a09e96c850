//! Whether a device bears what a scene asks of it: the stiffness of its walls against the loop's limits, before anything starts.
//!
//! | symbol | name in code | unit    | meaning                                                        |
//! |--------|--------------|---------|----------------------------------------------------------------|
//! | K_t    |              | N/m     | `k_h k_s m`: the stiffest that a wall can be along an axis     |
//! | K_r    |              | N m/rad | `k_h k_s I`: the same about one, I the largest principal moment |
//! | T      | `PERIOD_S`   | s       | of the haptics loop                                            |
//!
//! Any contact is at most as stiff as both together, so one axis of each kind tells. The force of a sample is rendered one tick
//! later, to which a device adds its own delay.

use god_object::{Body, RotationMetric, Settings};
use nalgebra::SymmetricEigen;
use taut_bridge::{Grip, Hand, InputChoice, SpidarPlacement, string_geometry, string_grip};
use taut_plant::stability::{DeclaredAxis, SampledLoop, StableLimit};
use taut_scene::{Device, DeviceDynamics, HandPreset};
use taut_spidar::Geometry;

use crate::shared::failure::Failure;

/// Period of the haptics loop, s.
const PERIOD_S: f64 = 1e-3;
/// A stiffness so much above a limit, as a share of it, is at the limit: limits are sought by bisection and told with three decimals.
const ROUNDING: f64 = 1e-5;

/// What is known of the device: `None` where nothing is declared, or where no force is rendered.
pub(super) fn declared(
    device: &Device,
    dynamics: Option<&DeviceDynamics>,
    scene_hand: Option<HandPreset>,
) -> Result<Option<DeviceDynamics>, Failure> {
    match (device, dynamics) {
        (Device::Simulated { .. }, Some(_)) => Err(Failure::bad_input(
            "the workbench file has [dynamics], which declares a real device, and a simulated device, which has its own; leave one out",
        )),
        (
            Device::Simulated {
                hand,
                strings: Some(strings),
                ..
            },
            None,
        ) => {
            let geometry = string_geometry(strings).map_err(Failure::bad_input)?;
            Ok(Some(of_strings(&geometry, hand.or(scene_hand))))
        }
        (Device::Simulated { hand, .. }, None) => {
            Ok(Some(of_grip(&Grip::workbench(), hand.or(scene_hand))))
        }
        // It feels nothing.
        (Device::Trace { .. }, _) => Ok(None),
        (_, dynamics) => Ok(dynamics.copied()),
    }
}

/// What a device that a driver opens is in the scene's metres, and whether it renders torque; `None` without motors. What the workbench file declares
/// of it (`in_file`) is in the device's own metres, and goes before what the driver assumes. A hand is taken as it is: its stiffness per metre of the
/// scene is not known.
pub(super) fn of_input(
    choice: &InputChoice,
    in_file: Option<DeviceDynamics>,
    display_scale: f64,
    scene_hand: Option<HandPreset>,
) -> Option<(DeviceDynamics, bool)> {
    let device = choice.force_device()?;
    let own = in_file.unwrap_or_else(|| DeviceDynamics {
        delay: device.delay_s,
        ..of_grip(&device.grip, scene_hand)
    });
    // The same force over another way.
    let shorter = device.scale.map_or(1.0, |scale| display_scale / scale);
    let dynamics = DeviceDynamics {
        mass: own.mass * shorter,
        damping: own.damping * shorter,
        resolution: own.resolution / shorter,
        ..own
    };
    Some((dynamics, device.renders_torque))
}

/// What a string-driven device is along and about its weakest axis, with the grip at the centre.
fn of_strings(geometry: &Geometry, hand: Option<HandPreset>) -> DeviceDynamics {
    let grip = string_grip(geometry, &SpidarPlacement::default());
    let inertia = grip.inertia();
    let least = |axes: std::ops::Range<usize>| {
        axes.map(|axis| inertia[(axis, axis)])
            .fold(f64::INFINITY, f64::min)
    };
    let count = geometry
        .metres_per_count
        .iter()
        .fold(0.0_f64, |most, count| most.max(count.abs()));
    DeviceDynamics {
        mass: least(0..3),
        resolution: count,
        inertia: least(3..6),
        angular_resolution: count / geometry.arm(),
        motor_lag: geometry.motor_time_constant,
        ..of_grip(&grip, hand)
    }
}

/// What a device of this grip is along and about its weakest axis, if it measures without steps and pushes at once.
fn of_grip(grip: &Grip, hand: Option<HandPreset>) -> DeviceDynamics {
    DeviceDynamics {
        mass: grip.mass,
        damping: grip.damping.min(),
        friction: grip.coulomb_force.min(),
        resolution: 0.0,
        inertia: grip.rotational_inertia,
        rotational_damping: grip.rotational_damping.min(),
        rotational_friction: grip.coulomb_torque.min(),
        angular_resolution: 0.0,
        delay: 0.0,
        motor_lag: 0.0,
        hand: hand.unwrap_or_default(),
    }
}

/// What to tell the user of the scene's stiffness: warnings, or the refusal where it cannot be stable. A rotational stiffness that is not rendered
/// is not judged.
///
/// # Errors
/// A wall of the scene is beyond the largest stable stiffness with the declared hand, and `allow_unstable` is not set.
pub(super) fn judge(
    device: &DeviceDynamics,
    renders_torque: bool,
    settings: &Settings,
    body: &Body,
    allow_unstable: bool,
) -> Result<Vec<String>, Failure> {
    let hand = Hand::from(device.hand);
    let mut warnings = Vec::new();
    let [along, about] = stiffnesses(settings, body);
    for (stiffness, unit, what) in [
        (along, "N/m", "stiffness"),
        (about, "N m/rad", "rotational stiffness"),
    ] {
        let linear = what == "stiffness";
        if !linear && !renders_torque {
            continue; // it is not rendered
        }
        let virtual_damping = stiffness * settings.damping_time;
        let axis = |hand: &Hand| declared_axis(device, hand, virtual_damping, linear);
        let held = axis(&hand).verdict();
        let released = axis(&Hand::RELEASED).verdict();
        let above = |limit: f64| stiffness > limit * (1.0 + ROUNDING);
        let asked = format!("the scene's {what} of {stiffness:.3} {unit}");
        if above(held.stable) {
            let mend = match held.stable_limit {
                StableLimit::VirtualDamping => "lower coupling.damping_time",
                _ => "lower coupling.k_h or the mass, or raise coupling.damping_time",
            };
            let sentence = format!(
                "{asked} is above the {:.3} {unit} that this device bears in this hand: {}; {mend}",
                held.stable, held.stable_limit
            );
            if !allow_unstable {
                return Err(Failure::BadInput(format!(
                    "{sentence}; --allow-unstable starts all the same"
                )));
            }
            warnings.push(sentence);
        } else if above(released.stable) {
            warnings.push(format!(
                "{asked} is stable in this hand, but not above {:.3} {unit} when the hand lets go: {}",
                released.stable, released.stable_limit
            ));
        } else if above(held.passive) {
            warnings.push(format!(
                "{asked} is stable, but above the largest passive one of {:.3} {unit}: {}; it may hum",
                held.passive, held.passive_limit
            ));
        }
    }
    Ok(warnings)
}

/// The loop that device and hand close along an axis, or about one.
fn declared_axis(
    device: &DeviceDynamics,
    hand: &Hand,
    virtual_damping: f64,
    linear: bool,
) -> DeclaredAxis {
    let damped = SampledLoop {
        delay: PERIOD_S + device.delay,
        motor_lag: device.motor_lag,
        virtual_damping,
        ..SampledLoop::at_period(PERIOD_S)
    };
    if linear {
        DeclaredAxis {
            sampled: SampledLoop {
                mass: device.mass,
                damping: device.damping,
                ..damped
            }
            .held_along(hand),
            coulomb: device.friction,
            resolution: device.resolution,
        }
    } else {
        DeclaredAxis {
            sampled: SampledLoop {
                mass: device.inertia,
                damping: device.rotational_damping,
                ..damped
            }
            .held_about(hand),
            coulomb: device.rotational_friction,
            resolution: device.angular_resolution,
        }
    }
}

/// `K_t` and `K_r`.
pub(crate) fn stiffnesses(settings: &Settings, body: &Body) -> [f64; 2] {
    let along = settings.stiffness(body.mass);
    let moment = match settings.rotation_metric {
        RotationMetric::Inertia => SymmetricEigen::new(body.inertia).eigenvalues.max(),
        RotationMetric::RadiusOfGyration(radius) => body.mass * radius * radius,
    };
    [along, settings.k_h * settings.k_s * moment]
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_scene::Scene;

    fn scene() -> taut_scene::BuiltScene {
        Scene::named_or_file("peg-in-a-hole")
            .and_then(|scene| scene.build())
            .unwrap_or_else(|error| panic!("{error}"))
    }

    fn light() -> DeviceDynamics {
        let simulated = Device::Simulated {
            hand: Some(HandPreset::Firm),
            path: None,
            tremor: 0.0,
            seed: 0,
            strings: None,
        };
        declared(&simulated, None, None)
            .ok()
            .flatten()
            .expect("a simulated device is known")
    }

    /// A device that is opened, as the command line has it.
    fn input(text: &str) -> InputChoice {
        match text.parse::<taut_bridge::DeviceChoice>() {
            Ok(taut_bridge::DeviceChoice::Input(input)) => input,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn the_shipped_scene_suits_the_simulated_device() {
        let scene = scene();
        assert_eq!(
            judge(&light(), true, &scene.settings, &scene.world.body, false),
            Ok(vec![])
        );
    }

    #[test]
    fn what_only_a_hand_holds_stable_is_a_warning_and_what_nobody_does_is_refused() {
        let scene = scene();
        let asked = |stiffness: f64| Settings {
            k_h: stiffness / (scene.settings.k_s * scene.world.body.mass),
            ..scene.settings
        };
        let body = &scene.world.body;
        let warned = judge(&light(), true, &asked(2000.0), body, false).expect("the hand holds it");
        assert!(warned.iter().any(|w| w.contains("lets go")), "{warned:?}");
        let refused =
            judge(&light(), true, &asked(50_000.0), body, false).expect_err("far too stiff");
        assert!(refused.to_string().contains("--allow-unstable"));
        assert!(judge(&light(), true, &asked(50_000.0), body, true).is_ok_and(|w| !w.is_empty()));
        let stuck = Settings {
            damping_time: 1.0,
            ..scene.settings
        };
        let refused = judge(&light(), true, &stuck, body, false).expect_err("too much damping");
        assert!(
            refused
                .to_string()
                .contains("; lower coupling.damping_time"),
            "{refused}"
        );
    }

    #[test]
    fn an_arm_without_torque_is_judged_by_its_force_in_the_scene_s_metres() {
        let scene = scene();
        let arm = input("haply");
        let judged = |display_scale: f64, stiffness: f64| {
            let (dynamics, torque) = of_input(&arm, None, display_scale, None).expect("motors");
            assert!(!torque);
            let settings = Settings {
                k_h: stiffness / (scene.settings.k_s * scene.world.body.mass),
                ..scene.settings
            };
            judge(&dynamics, torque, &settings, &scene.world.body, false)
        };
        let warned = judged(1.0, 1000.0).expect("a hand holds it");
        assert_eq!(warned.len(), 1, "{warned:?}");
        assert!(warned[0].contains("scene's stiffness") && warned[0].contains("lets go"));
        // Drawn three times as large, a hand moves three times as far for the same force.
        assert_eq!(judged(3.0, 1000.0).map(|w| w.len()), Ok(0));
        assert!(judged(1.0, 50_000.0).is_err());
    }

    #[test]
    fn what_the_file_declares_of_an_arm_is_in_the_arm_s_own_metres() {
        let declared = DeviceDynamics {
            resolution: 3e-5,
            ..light()
        };
        let arm = input("haply,scale=2");
        let (dynamics, _) = of_input(&arm, Some(declared), 6.0, None).expect("motors");
        // A metre of the scene is three of the arm.
        for (found, own) in [
            (dynamics.mass, declared.mass * 3.0),
            (dynamics.damping, declared.damping * 3.0),
            (dynamics.resolution, declared.resolution / 3.0),
            (dynamics.inertia, declared.inertia),
            (dynamics.friction, declared.friction),
        ] {
            assert!((found - own).abs() <= 1e-12 * own, "{found} {own}");
        }
    }

    #[test]
    fn strings_bear_the_same_however_large_the_scene_is_drawn() {
        let strings = input("spidar:/dev/ttyUSB0");
        let drawn = |display_scale| of_input(&strings, None, display_scale, None);
        assert!(drawn(1.0).is_some());
        assert_eq!(drawn(5.0), drawn(1.0));
    }

    #[test]
    fn an_encoder_without_friction_is_said_to_hum() {
        let scene = scene();
        let counted = DeviceDynamics {
            resolution: 3e-5,
            ..light()
        };
        let warned =
            judge(&counted, true, &scene.settings, &scene.world.body, false).expect("stable");
        assert!(warned.iter().any(|w| w.contains("encoder")), "{warned:?}");
    }

    #[test]
    fn a_stiffness_at_the_limit_is_not_above_it() {
        let scene = scene();
        let (body, counted) = (
            &scene.world.body,
            DeviceDynamics {
                resolution: 3e-5,
                friction: 0.012,
                ..light()
            },
        );
        let judged = |stiffness: f64| {
            let settings = Settings {
                k_h: stiffness / (scene.settings.k_s * body.mass),
                ..scene.settings
            };
            judge(&counted, false, &settings, body, false).expect("stable")
        };
        let warned = judged(1000.0);
        let limit = warned.first().and_then(|warning| {
            let (_, limit) = warning.split_once("passive one of ")?;
            limit.split_once(' ')?.0.parse::<f64>().ok()
        });
        let limit = limit.expect("a limit");
        // What is told has three decimals.
        assert_eq!(judged(limit + 6e-4), [""; 0]);
        assert_eq!(judged(limit * 1.001).len(), 1);
    }
}
