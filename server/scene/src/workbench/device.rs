//! The device in the user's hand.

use super::parts::Files;
use super::spec::Device;
use super::tracker::vrpn_sensor;
use crate::document::{Range, Section};
use crate::scene::HandPreset;

pub(super) fn device(section: &Section<'_>, files: &Files<'_>) -> Option<Device> {
    #[derive(Clone, Copy)]
    enum Kind {
        Simulated,
        Trace,
        Vrpn,
        SpaceMouse,
        Remote,
    }
    if !section.has("kind") {
        section.complain_missing("kind", "kind = \"simulated\"");
    }
    let kinds = [
        ("simulated", Kind::Simulated),
        ("trace", Kind::Trace),
        ("vrpn", Kind::Vrpn),
        ("space-mouse", Kind::SpaceMouse),
        ("mouse", Kind::Remote),
        ("remote", Kind::Remote),
    ];
    let Some(kind) = section.choice("kind", &kinds) else {
        // Which keys belong here depends on the kind: complain of nothing else.
        for key in ["hand", "path", "tremor", "seed", "strings", "loop"]
            .iter()
            .chain(&["server", "sensor", "mode", "axes", "scale", "max_age"])
            .chain(&[
                "origin",
                "mount",
                "anchor",
                "dead_zone",
                "speed",
                "turn_rate",
            ])
            .chain(&["reach", "tilt", "yield_force", "yield_torque"])
        {
            section.has(key);
        }
        return None;
    };
    match kind {
        Kind::Simulated => Some(Device::Simulated {
            hand: section.choice("hand", &HandPreset::NAMED),
            path: files.path(section, "path"),
            tremor: section.number_or("tremor", Range::UpTo(1e-3), 0.0),
            seed: section
                .integer("seed", 0, i64::MAX)
                .unwrap_or(0)
                .unsigned_abs(),
            strings: section.text("strings").map(|named| files.named(named)),
        }),
        Kind::Trace => {
            section.required_text("path", "path = \"trace.csv\"")?;
            Some(Device::Trace {
                path: files.path(section, "path")?,
                repeat: section.boolean("loop").unwrap_or(false),
            })
        }
        Kind::Vrpn => {
            let anchors = [("start", false), ("workbench", true)];
            let on_workbench = section.choice("anchor", &anchors).unwrap_or(false);
            Some(Device::Vrpn {
                sensor: Box::new(vrpn_sensor(section)?),
                on_workbench,
            })
        }
        Kind::SpaceMouse => {
            let number = |key, most| section.number(key, Range::PositiveUpTo(most));
            Some(Device::SpaceMouse {
                position: section
                    .choice("mode", &[("rate", false), ("position", true)])
                    .unwrap_or(false),
                dead_zone: section.number("dead_zone", Range::UpTo(0.9)),
                speed: number("speed", 10.0),
                turn_rate: number("turn_rate", 100.0),
                reach: number("reach", 10.0),
                tilt: number("tilt", 3.0),
                yield_force: number("yield_force", 1e3),
                yield_torque: number("yield_torque", 1e3),
            })
        }
        Kind::Remote => Some(Device::Remote),
    }
}
