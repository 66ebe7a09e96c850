//! A VRPN tracker in a workbench file: `[viewer] tracker` and `[device] kind = "vrpn"` share its keys.

use god_object::Pose;
use taut_vrpn::{Address, Axes, SensorMapping};

use super::spec::VrpnSensor;
use crate::document::{Range, Section};
use crate::scene::pose_of;

/// Largest number of a sensor.
const MAX_SENSOR: i64 = 1 << 20;
/// Longest silence that may be allowed, s.
const MAX_SILENCE: f64 = 10.0;
/// Silence after which a tracker counts as lost unless the file says otherwise, s: six reports at 60 Hz.
const SILENCE: f64 = 0.1;

/// Reads the keys of a tracker; every fault is noted.
pub(super) fn vrpn_sensor(section: &Section<'_>) -> Option<VrpnSensor> {
    let example = "server = \"Tracker0@host:3883\"";
    let address = section
        .required_text("server", example)
        .and_then(|text| parsed::<Address>(section, "server", text));
    let axes = match section.text("axes") {
        Some(text) => parsed(section, "axes", text),
        None => Some(Axes::SAME),
    };
    let pose = |key| {
        let read = section.section(key).map(|table| {
            let pose = pose_of(&table);
            table.finish();
            pose
        });
        read.unwrap_or_else(|| Some(Pose::identity()))
    };
    let sensor = section.integer("sensor", 0, MAX_SENSOR).unwrap_or(0);
    let modes = [("tcp", false), ("udp", true)];
    let udp = section.choice("mode", &modes).unwrap_or(false);
    let scale = section.number_or("scale", Range::Positive, 1.0);
    let max_age = section.number_or("max_age", Range::PositiveUpTo(MAX_SILENCE), SILENCE);
    let (origin, mount) = (pose("origin"), pose("mount"));
    Some(VrpnSensor {
        address: address?,
        sensor: i32::try_from(sensor).ok()?,
        udp,
        mapping: SensorMapping {
            axes: axes?,
            scale,
            origin: origin?,
            mount: mount?,
        },
        max_age,
    })
}

/// The text of `key` as a value of its own; a complaint where it is none.
fn parsed<T: std::str::FromStr<Err: std::fmt::Display>>(
    section: &Section<'_>,
    key: &'static str,
    text: &str,
) -> Option<T> {
    text.parse()
        .map_err(|error| {
            let at = section.get(key).map_or(section.at(), |node| &node.at);
            section.complain(at, format!("`{key}` in {}: {error}", section.name()));
        })
        .ok()
}
