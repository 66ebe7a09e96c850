//! The options of each driver.

use std::time::Duration;

use taut_vrpn::{Axes, SensorMapping};

use super::UnknownDevice;
use super::option_text::OptionText;
#[cfg(unix)]
use crate::devices::WoodenSettings;
use crate::devices::{
    Anchor, CapMode, CapSettings, HaplySettings, PluginSettings, PolhemSettings,
    SpidarUartSettings, VrpnSettings,
};
use crate::simulated_strings::string_geometry;
use crate::vrpn::{VrpnMode, VrpnSource};
pub(super) fn strings_option(options: &str) -> Result<Option<String>, UnknownDevice> {
    let mut strings = None;
    for option in options.split(',').filter(|option| !option.is_empty()) {
        let mut option = OptionText::new("simulated", option);
        if let Some(named) = option.asked("strings") {
            if named.is_empty() {
                return Err(option.wrong("strings", "g6x3r, g6x4r, g6x5r, wb or a geometry file"));
            }
            strings = Some(named.to_owned());
        }
        option.finish()?;
    }
    Ok(strings)
}

pub(super) fn cap_settings(options: &str) -> Result<CapSettings, UnknownDevice> {
    let mut settings = CapSettings::default();
    for option in options.split(',').filter(|option| !option.is_empty()) {
        let mut option = OptionText::new("space-mouse", option);
        option.choice("mode", &CapMode::NAMED, &mut settings.mode)?;
        option.number("dead-zone", 0.0, 0.9, &mut settings.dead_zone)?;
        option.number("speed", 1e-3, 10.0, &mut settings.speed)?;
        option.number("turn-rate", 1e-2, 100.0, &mut settings.turn_rate)?;
        option.number("reach", 1e-3, 10.0, &mut settings.reach)?;
        option.number("tilt", 1e-2, 3.0, &mut settings.tilt)?;
        option.number("yield-force", 1e-2, 1e3, &mut settings.yield_force)?;
        option.number("yield-torque", 1e-3, 1e3, &mut settings.yield_torque)?;
        option.finish()?;
    }
    Ok(settings)
}

pub(super) fn vrpn_settings(text: &str) -> Result<VrpnSettings, UnknownDevice> {
    let (address, options) = text.split_once(',').unwrap_or((text, ""));
    let mut settings = VrpnSettings {
        source: VrpnSource {
            address: address.parse()?,
            sensor: 0,
            mode: VrpnMode::default(),
        },
        mapping: SensorMapping::identity(),
        anchor: Anchor::default(),
        max_age: VrpnSettings::DEFAULT_MAX_AGE,
    };
    for option in options.split(',').filter(|option| !option.is_empty()) {
        let mut option = OptionText::new("vrpn", option);
        let (mut sensor, mut max_age) = (None, None);
        option.number("sensor", 0.0, 1e6, sensor.get_or_insert(0.0))?;
        option.choice("mode", &VrpnMode::NAMED, &mut settings.source.mode)?;
        option.choice("anchor", &Anchor::NAMED, &mut settings.anchor)?;
        option.number("scale", 1e-6, 1e6, &mut settings.mapping.scale)?;
        option.number("max-age", 1e-3, 10.0, max_age.get_or_insert(0.0))?;
        option.parsed("axes", "such as `x -z y`", &mut settings.mapping.axes)?;
        match option.name {
            "sensor" => settings.source.sensor = sensor.unwrap_or(0.0) as i32,
            "max-age" => settings.max_age = Duration::from_secs_f64(max_age.unwrap_or(0.1)),
            _ => {}
        }
        option.finish()?;
    }
    Ok(settings)
}

pub(super) fn spidar_settings(text: &str) -> Result<SpidarUartSettings, UnknownDevice> {
    let (path, options) = text.split_once(',').unwrap_or((text, ""));
    let (mut named, mut axes) = ("g6x4r", SpidarUartSettings::AXES);
    let mut right = true;
    for option in options.split(',').filter(|option| !option.is_empty()) {
        let mut option = OptionText::new("spidar", option);
        named = option.asked("geometry").unwrap_or(named);
        let mut wanted = Axes::SAME;
        option.parsed("axes", "such as `x -z y`", &mut wanted)?;
        if option.name == "axes" {
            right = wanted.matrix().determinant() > 0.0;
            axes = wanted;
        }
        if !right {
            return Err(option.wrong(
                "axes",
                "right-handed, such as `x -z y`: a frame has no mirror image",
            ));
        }
        option.finish()?;
    }
    let geometry =
        string_geometry(named).map_err(|error| UnknownDevice::Geometry(error.to_string()))?;
    Ok(SpidarUartSettings {
        path: path.to_owned(),
        geometry,
        axes,
    })
}

pub(super) fn polhem_settings(text: &str) -> Result<PolhemSettings, UnknownDevice> {
    let (path, options) = text.split_once(',').unwrap_or((text, ""));
    let mut settings = PolhemSettings::at(path);
    for option in options.split(',').filter(|option| !option.is_empty()) {
        let mut option = OptionText::new("polhem", option);
        option.parsed("axes", "such as `y -x z`", &mut settings.mapping.axes)?;
        option.number("scale", 1e-2, 1e2, &mut settings.mapping.scale)?;
        option.choice("anchor", &Anchor::NAMED, &mut settings.anchor)?;
        option.finish()?;
    }
    Ok(settings)
}

pub(super) fn plugin_settings(text: &str) -> Result<PluginSettings, UnknownDevice> {
    let (path, options) = text.split_once(',').unwrap_or((text, ""));
    let mut settings = PluginSettings {
        path: path.into(),
        options: String::new(),
        mapping: SensorMapping::identity(),
        anchor: Anchor::default(),
    };
    let mut others = Vec::new();
    for text in options.split(',').filter(|option| !option.is_empty()) {
        let mut option = OptionText::new("plugin", text);
        option.parsed("axes", "such as `x -z y`", &mut settings.mapping.axes)?;
        option.number("scale", 1e-2, 1e2, &mut settings.mapping.scale)?;
        option.choice("anchor", &Anchor::NAMED, &mut settings.anchor)?;
        if !["axes", "scale", "anchor"].contains(&option.name) {
            others.push(text);
        }
    }
    settings.options = others.join(",");
    Ok(settings)
}

#[cfg(unix)]
pub(super) fn wooden_settings(text: &str) -> Result<WoodenSettings, UnknownDevice> {
    use crate::wooden::{WOODEN_MODELS, WoodenModel};

    let mut settings = WoodenSettings::default();
    let (path, options) = match text.strip_prefix('=') {
        Some(rest) => rest.split_once(',').unwrap_or((rest, "")),
        None => ("", text.trim_start_matches(',')),
    };
    settings.path = (!path.is_empty()).then(|| path.into());
    for option in options.split(',').filter(|option| !option.is_empty()) {
        let mut option = OptionText::new("wooden", option);
        if let Some(model) = option.asked("model") {
            settings.model = WoodenModel::named(model).ok_or_else(|| {
                let names: Vec<_> = WOODEN_MODELS.iter().map(|model| model.name).collect();
                option.wrong("model", names.join(" or "))
            })?;
        }
        option.parsed("axes", "such as `y -x z`", &mut settings.mapping.axes)?;
        option.number("scale", 1e-2, 1e2, &mut settings.mapping.scale)?;
        option.choice("anchor", &Anchor::NAMED, &mut settings.anchor)?;
        option.finish()?;
    }
    Ok(settings)
}

pub(super) fn haply_settings(text: &str) -> Result<HaplySettings, UnknownDevice> {
    let mut settings = HaplySettings::default();
    let (address, options) = match text.strip_prefix('=') {
        Some(rest) => rest.split_once(',').unwrap_or((rest, "")),
        None => ("", text.trim_start_matches(',')),
    };
    if text.starts_with('=') {
        settings.address = address.parse()?;
    }
    for option in options.split(',').filter(|option| !option.is_empty()) {
        let mut option = OptionText::new("haply", option);
        let exchange = &mut settings.exchange;
        if let Some(arm) = option.asked("arm") {
            if arm.is_empty() {
                return Err(option.wrong("arm", "the service's name of the arm, such as 04C3"));
            }
            exchange.arm = Some(arm.to_owned());
        }
        let yes_or_no = [("yes", true), ("no", false)];
        option.choice("grip", &yes_or_no, &mut exchange.with_grip)?;
        option.parsed("axes", "such as `x -z y`", &mut settings.mapping.axes)?;
        option.number("scale", 1e-2, 1e2, &mut settings.mapping.scale)?;
        option.choice("anchor", &Anchor::NAMED, &mut settings.anchor)?;
        option.finish()?;
    }
    Ok(settings)
}
