//! From what was chosen to the settings of each driver.

use std::time::Duration;

use taut_kinds::{Chosen, UnknownDevice};
use taut_vrpn::SensorMapping;

#[cfg(unix)]
use crate::devices::WoodenSettings;
use crate::devices::{
    Anchor, CapMode, CapSettings, HaplySettings, PluginSettings, PolhemSettings,
    SpidarUartSettings, VrpnSettings,
};
use crate::plugin::Language;
use crate::simulated_strings::string_geometry;
use crate::vrpn::{VrpnMode, VrpnSource};

pub(super) fn cap_settings(chosen: &Chosen) -> CapSettings {
    let standard = CapSettings::default();
    let number = |key, default| chosen.number(key).unwrap_or(default);
    CapSettings {
        mode: chosen
            .named("mode", &CapMode::NAMED)
            .unwrap_or(standard.mode),
        dead_zone: number("dead_zone", standard.dead_zone),
        speed: number("speed", standard.speed),
        turn_rate: number("turn_rate", standard.turn_rate),
        reach: number("reach", standard.reach),
        tilt: number("tilt", standard.tilt),
        yield_force: number("yield_force", standard.yield_force),
        yield_torque: number("yield_torque", standard.yield_torque),
    }
}

/// Axes, scale and anchor, where they were given.
fn stand(chosen: &Chosen, mapping: &mut SensorMapping, anchor: &mut Anchor) {
    mapping.axes = chosen.axes("axes").unwrap_or(mapping.axes);
    mapping.scale = chosen.number("scale").unwrap_or(mapping.scale);
    *anchor = chosen.named("anchor", &Anchor::NAMED).unwrap_or(*anchor);
}

/// A sensor of a tracker; `None` without an address, which the kind demands.
#[must_use]
pub fn vrpn_settings(chosen: &Chosen) -> Option<VrpnSettings> {
    let mut settings = VrpnSettings {
        source: VrpnSource {
            address: chosen.tracker("server")?.clone(),
            sensor: i32::try_from(chosen.whole("sensor").unwrap_or(0)).ok()?,
            mode: chosen.named("mode", &VrpnMode::NAMED).unwrap_or_default(),
        },
        mapping: SensorMapping::identity(),
        anchor: Anchor::default(),
        max_age: chosen
            .number("max_age")
            .map_or(VrpnSettings::DEFAULT_MAX_AGE, Duration::from_secs_f64),
    };
    stand(chosen, &mut settings.mapping, &mut settings.anchor);
    let mapping = &mut settings.mapping;
    mapping.origin = chosen.pose("origin").unwrap_or(mapping.origin);
    mapping.mount = chosen.pose("mount").unwrap_or(mapping.mount);
    Some(settings)
}

pub(super) fn spidar_settings(chosen: &Chosen) -> Result<SpidarUartSettings, UnknownDevice> {
    let named = chosen.text("geometry").unwrap_or("g6x4r");
    let geometry =
        string_geometry(named).map_err(|error| UnknownDevice::Geometry(error.to_string()))?;
    Ok(SpidarUartSettings {
        path: port(chosen),
        geometry,
        axes: chosen.axes("axes").unwrap_or(SpidarUartSettings::AXES),
    })
}

fn port(chosen: &Chosen) -> String {
    let path = chosen.file("port");
    path.map_or_else(String::new, |path| path.display().to_string())
}

pub(super) fn polhem_settings(chosen: &Chosen) -> PolhemSettings {
    let mut settings = PolhemSettings::at(&port(chosen));
    stand(chosen, &mut settings.mapping, &mut settings.anchor);
    settings
}

/// `place` is the key of the file.
pub(super) fn plugin_settings(chosen: &Chosen, place: &str, language: Language) -> PluginSettings {
    let mut settings = PluginSettings {
        path: chosen.file(place).unwrap_or("".as_ref()).to_owned(),
        language,
        options: match chosen.text("options") {
            Some(options) => options.to_owned(),
            None => chosen.handed_on.clone(),
        },
        mapping: SensorMapping::identity(),
        anchor: Anchor::default(),
    };
    stand(chosen, &mut settings.mapping, &mut settings.anchor);
    settings
}

#[cfg(unix)]
pub(super) fn wooden_settings(chosen: &Chosen) -> WoodenSettings {
    use crate::wooden::WoodenModel;

    let mut settings = WoodenSettings {
        path: chosen.file("port").map(Into::into),
        ..WoodenSettings::default()
    };
    let model = chosen.text("model").and_then(WoodenModel::named);
    settings.model = model.unwrap_or(settings.model);
    stand(chosen, &mut settings.mapping, &mut settings.anchor);
    settings
}

pub(super) fn haply_settings(chosen: &Chosen) -> HaplySettings {
    let mut settings = HaplySettings::default();
    if let Some(address) = chosen.service("address") {
        settings.address = address.clone();
    }
    settings.exchange.arm = chosen.text("arm").map(str::to_owned);
    if let Some(grip) = chosen.yes("grip") {
        settings.exchange.with_grip = grip;
    }
    if let Some(port) = chosen.whole("events") {
        // 0 is none, and the range is that of ports.
        settings.events_port = u16::try_from(port).ok().filter(|port| *port > 0);
    }
    stand(chosen, &mut settings.mapping, &mut settings.anchor);
    settings
}
