//! The device's pose as it comes over a wire: how finely it is counted and how often it is sent, against bytes a second.
//!
//! | symbol | name in code | unit | meaning                                          |
//! |--------|--------------|------|--------------------------------------------------|
//! | b      | `bits`       |      | of each of six coordinates                       |
//! | f_w    | `rate`       | Hz   | poses sent a second; between two the last is held |
//!
//! Coordinates are counts of a range of 2 m, and of one turn about each axis. Single precision sends a quaternion as it is. A datagram has the header and the
//! tag of the protocol, time and number beside the pose. No loss, no delay: those are the control recipes' of coupling at the edge.

use god_object::Pose;
use nalgebra::{UnitQuaternion, Vector3};
use taut_proto::header::{HEADER_BYTES, TAG_BYTES};

use super::{Case, Cost, Runs, Sweep};
use crate::recipe::Recipe;
use crate::recipes::{Extent, all, named};

pub(super) const SWEEP: Sweep = Sweep {
    name: "wire",
    about: "device poses by bits of a coordinate and poses sent a second, held between; forces at 1 kHz",
    error: "J",
    cost: Cost::Bandwidth,
    runs: Runs::Recipes(cases),
};

/// Poses sent a second, Hz.
const RATES: [u32; 4] = [60, 250, 500, 1000];
/// Bits of a coordinate; `None` is single precision.
const BITS: [Option<u32>; 4] = [Some(10), Some(14), Some(18), None];
/// m and rad.
const RANGE: f64 = 2.0;
const TURN: f64 = std::f64::consts::TAU;
/// Time and number of a pose, bytes.
const STAMP: f64 = 16.0;
/// Updates of the god-object a second, Hz.
const UPDATES: u32 = 1000;
const RECIPES: [(&str, &str); 4] = [
    ("R02", "ball on a plane"),
    ("R08", "edge of 90 degrees"),
    ("R10b", "bar past a pin"),
    ("R12", "radius 20 mm, 0.2 m/s"),
];

fn cases(extent: Extent) -> Vec<Case> {
    let mut cases = Vec::new();
    for (name, case) in RECIPES {
        for bits in BITS {
            for rate in RATES {
                cases.push(Case {
                    recipe: sent(named(all(extent), name, case), bits, rate),
                    label: format!("{}, {rate} Hz", label(bits)),
                    rate: UPDATES,
                    cost: Some(bandwidth(bits, rate)),
                });
            }
        }
    }
    cases
}

fn label(bits: Option<u32>) -> String {
    bits.map_or_else(|| "single precision".into(), |bits| format!("{bits} bits"))
}

/// kB/s.
fn bandwidth(bits: Option<u32>, rate: u32) -> f64 {
    let pose = bits.map_or(7.0 * 4.0, |bits| (6.0 * f64::from(bits) / 8.0).ceil());
    let datagram = (HEADER_BYTES + TAG_BYTES) as f64 + STAMP + pose;
    datagram * f64::from(rate) * 1e-3
}

/// The recipe with its device as it arrives; the right answer stays that of the device itself.
fn sent(recipe: Recipe, bits: Option<u32>, rate: u32) -> Recipe {
    recipe.answer();
    let device = recipe.device;
    let rate = f64::from(rate);
    // A hundred-thousandth of a period more: a pose that is due now is not one of a period ago for a rounding.
    let arrived = move |time: f64| {
        counted(
            &device(((time * rate + 1e-5).floor() / rate).max(0.0)),
            bits,
        )
    };
    Recipe {
        device: Box::new(arrived),
        ..recipe
    }
}

/// The pose that comes out at the other end.
fn counted(pose: &Pose, bits: Option<u32>) -> Pose {
    let place = pose.translation.vector;
    let Some(bits) = bits else {
        let q = pose.rotation.coords.map(|x| f64::from(x as f32));
        let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_vector(q));
        return Pose::from_parts(place.map(|x| f64::from(x as f32)).into(), rotation);
    };
    let counts = f64::from(2_u32.pow(bits));
    let round =
        |v: Vector3<f64>, range: f64| v.map(|x| (x * counts / range).round() * range / counts);
    Pose::new(
        round(place, RANGE),
        round(pose.rotation.scaled_axis(), TURN),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counted_pose_is_off_by_half_a_count_at_most() {
        let pose = Pose::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.4, -0.5, 0.6));
        for (bits, least) in [(Some(10), 1e-5), (Some(18), 1e-8), (None, 0.0)] {
            let off = counted(&pose, bits);
            let by = (off.translation.vector - pose.translation.vector).amax();
            let turned = (off.rotation.scaled_axis() - pose.rotation.scaled_axis()).amax();
            let counts = f64::from(2_u32.pow(bits.unwrap_or(23)));
            assert!(
                by >= least && by <= 0.5 * RANGE / counts,
                "{bits:?}: {by} m"
            );
            assert!(turned <= 0.5 * TURN / counts, "{bits:?}: {turned} rad");
        }
    }

    #[test]
    fn what_is_sent_is_held_to_the_answer_of_the_device_itself() {
        let recipe = || named(all(Extent::Quick), "R10b", "bar past a pin");
        let sent = sent(recipe(), Some(10), 60);
        assert_eq!(sent.answer().wrenches, recipe().answer().wrenches);
    }

    #[test]
    fn a_pose_is_held_until_the_next_is_sent() {
        let recipe = named(all(Extent::Quick), "R02", "ball on a plane");
        // In the middle of the path the hand slides.
        let sent_at = recipe.ticks() / 8 * 4;
        let slow = sent(recipe, None, 250);
        let at = |ms: u32| (slow.device)(f64::from(sent_at + ms) * 1e-3);
        assert_eq!(at(0), at(3));
        assert_ne!(at(3), at(4));
        assert!(bandwidth(Some(10), 1000) < bandwidth(None, 1000));
    }
}
