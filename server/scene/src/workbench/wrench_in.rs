//! `[wrench_in]`: a force from outside (a robot's sensor, a simulation) that the hand feels beside the contact's. Off unless the file says otherwise.

use super::looking_on::Zenoh;
use super::ros_names::is_topic;
use super::spec::{Device, Network, Passivity, Safety};
use crate::document::{Range, Section};

/// Longest age of a value, ms: what docs/safety.md promises of every force.
const LONGEST_AGE_MS: f64 = 120.0;
/// Shortest, ms: less would leave no time to fade.
const SHORTEST_AGE_MS: f64 = 20.0;
/// Largest limits that make sense: N, N m.
const MAX_FORCE: f64 = 200.0;
const MAX_TORQUE: f64 = 20.0;

/// Where values come from.
#[derive(Clone, Debug, PartialEq)]
pub enum WrenchSource {
    /// taut's own sealed datagrams, from a client of the role force.
    Taut,
    /// `geometry_msgs/msg/WrenchStamped` of a topic of ROS 2, through the routers of `[zenoh]`.
    Ros {
        /// Absolute name.
        topic: String,
        /// The routers may be such as prove nobody.
        allow_unproven: bool,
    },
}

/// In which axes values are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WrenchFrame {
    /// The workbench's.
    #[default]
    Workbench,
    /// Those of the body in the hand, as the device turns it.
    Body,
}

/// A force from outside.
#[derive(Clone, Debug, PartialEq)]
pub struct WrenchIn {
    /// Whether there is any.
    pub enabled: bool,
    /// Where it comes from.
    pub source: WrenchSource,
    /// Its axes. It acts at the reference point.
    pub frame: WrenchFrame,
    /// Largest norm of the force, N.
    pub max_force: f64,
    /// Largest norm of the torque, N m.
    pub max_torque: f64,
    /// Age from which on nothing of a value is felt, ms.
    pub max_age_ms: f64,
}

impl Default for WrenchIn {
    fn default() -> Self {
        Self {
            enabled: false,
            source: WrenchSource::Taut,
            frame: WrenchFrame::Workbench,
            max_force: 5.0,
            max_torque: 0.2,
            max_age_ms: LONGEST_AGE_MS,
        }
    }
}

impl WrenchIn {
    /// Age up to which a value is felt in full, ms: 20 of 120.
    #[must_use]
    pub fn hold_ms(&self) -> f64 {
        self.max_age_ms / 6.0
    }

    /// Time in which it then fades, ms. The 5 ms that are left of `max_age_ms` are a period of 1 kHz and what a loop may be late.
    #[must_use]
    pub fn fade_ms(&self) -> f64 {
        self.max_age_ms - self.hold_ms() - 5.0
    }

    /// Whether clients of the role force have anything to do here.
    #[must_use]
    pub fn takes_clients(&self) -> bool {
        self.enabled && self.source == WrenchSource::Taut
    }
}

/// What the force from outside is checked against.
type Beside<'w> = (Option<&'w Device>, &'w Safety, &'w Zenoh);

/// Reads `[wrench_in]`. Without clients that send forces, the network has no role for them.
pub(super) fn wrench_in(
    root: &Section<'_>,
    beside: Beside<'_>,
    network: Option<&mut Network>,
) -> WrenchIn {
    let section = root.section("wrench_in");
    let wanted = section
        .as_ref()
        .map_or_else(WrenchIn::default, wrench_in_of);
    if let Some(network) = network.filter(|_| !wanted.takes_clients()) {
        let roles = &mut network.admission.roles;
        roles.retain(|role| *role != taut_proto::Role::Force);
    }
    if let Some(section) = section {
        if wanted.enabled {
            complain_beside(&section, &wanted, beside);
        }
        section.finish();
    }
    wanted
}

fn wrench_in_of(section: &Section<'_>) -> WrenchIn {
    let default = WrenchIn::default();
    let sources = [("taut", false), ("ros", true)];
    let frames = [
        ("workbench", WrenchFrame::Workbench),
        ("body", WrenchFrame::Body),
    ];
    let is_ros = section.choice("source", &sources).unwrap_or(false);
    let topic = section.text("topic");
    let allow_unproven = section.boolean("allow_unproven").unwrap_or(false);
    let source = if is_ros {
        WrenchSource::Ros {
            topic: ros_topic(section, topic).unwrap_or_default(),
            allow_unproven,
        }
    } else {
        for key in ["topic", "allow_unproven"] {
            if section.has(key) {
                section.fault(key, "is for source = \"ros\"; leave it out");
            }
        }
        WrenchSource::Taut
    };
    let up_to = Range::PositiveUpTo;
    WrenchIn {
        enabled: section.boolean("enabled").unwrap_or(false),
        source,
        frame: section.choice("frame", &frames).unwrap_or_default(),
        max_force: section.number_or("max_force", up_to(MAX_FORCE), default.max_force),
        max_torque: section.number_or("max_torque", up_to(MAX_TORQUE), default.max_torque),
        max_age_ms: age(section).unwrap_or(default.max_age_ms),
    }
}

fn age(section: &Section<'_>) -> Option<f64> {
    let age = section.number("max_age_ms", Range::PositiveUpTo(LONGEST_AGE_MS))?;
    if age < SHORTEST_AGE_MS {
        let wanted = format_args!("{SHORTEST_AGE_MS} to {LONGEST_AGE_MS}");
        let what = format!("is {age}, which leaves no time to fade; write {wanted}");
        section.fault("max_age_ms", what);
        return None;
    }
    Some(age)
}

fn ros_topic(section: &Section<'_>, topic: Option<&str>) -> Option<String> {
    match topic {
        Some(text) if is_topic(text) => Some(text.to_owned()),
        Some(text) => {
            let what =
                "which is no absolute name of ROS 2; write one such as \"/ft_sensor/wrench\"";
            section.fault("topic", format_args!("is \"{text}\", {what}"));
            None
        }
        None => {
            section.complain_missing("topic", "topic = \"/ft_sensor/wrench\"");
            None
        }
    }
}

/// Complains of what does not go with it.
fn complain_beside(section: &Section<'_>, wanted: &WrenchIn, (device, safety, zenoh): Beside<'_>) {
    // A bridge keeps the energy itself, or feels nothing of it.
    if device != Some(&Device::Remote) && safety.passivity != Passivity::Control {
        section.complain_of(
            "enabled",
            "[wrench_in] needs passivity = \"control\" in [safety]: who sends a force could give the hand energy without end otherwise",
        );
    }
    if let WrenchSource::Ros { .. } = &wanted.source
        && !zenoh.enabled
    {
        section.complain_of(
            "source",
            "source = \"ros\" in [wrench_in] comes through the routers of [zenoh], which is off; set enabled = true there",
        );
    }
    let fade = wanted.fade_ms();
    for (key, limit, slew, unit) in [
        ("max_force", wanted.max_force, safety.force_slew, "N"),
        ("max_torque", wanted.max_torque, safety.torque_slew, "N m"),
    ] {
        if limit > slew * fade {
            let most = slew * fade;
            let what = format!(
                "is {limit} {unit}, which cannot fade in {fade:.0} ms at {slew} {unit}/ms of [safety]; use at most {most:.2}, or a longer `max_age_ms`"
            );
            section.fault(key, what);
        }
    }
}
