//! What values of options may be, and what is said of those that may not.

use std::path::{Path, PathBuf};

use clap::builder::{PathBufValueParser, TypedValueParser};
use taut_scene::MAX_HOLE_EDGES;

/// Most pixels of a preview's side: a poster.
pub(super) const MOST_PIXELS: u32 = 8192;
/// Most pictures of a turn: ten to a degree.
pub(super) const MOST_VIEWS: i64 = 3600;

/// Ports of a demo: control, poses, the monitor's stream and page.
pub(super) const DEMO_PORTS: u16 = 4;
/// A day is longer than any session; NaN and infinity are no durations.
pub(super) const MAX_SECONDS: f64 = 86_400.0;
/// No part for a hand needs more.
pub(super) const MAX_LENGTH: f64 = 1.0;
/// No loop turns faster.
pub(super) const MAX_RATE_HZ: f64 = 1e6;
/// No tracker is faster, and the server would take it for a flood. Once in each period a sender looks whether it is to end, and shows that it lives.
pub(super) const TRACKING_RATES_HZ: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// The text of a device, as it is, if it names one.
pub(super) fn device_text(text: &str) -> Result<String, taut_kinds::UnknownDevice> {
    text.parse::<taut_bridge::DeviceChoice>()
        .map(|_| text.to_owned())
}

/// The first of [`DEMO_PORTS`] ports in a row, or 0.
pub(super) fn first_port(text: &str) -> Result<u16, String> {
    let largest = u16::MAX - (DEMO_PORTS - 1);
    match text.parse() {
        Ok(port) if port <= largest => Ok(port),
        _ => Err(format!(
            "give a port from 1 to {largest}, or 0 for free ones"
        )),
    }
}

pub(super) fn positive_seconds(text: &str) -> Result<f64, String> {
    positive(text, MAX_SECONDS, "seconds")
}

pub(super) fn positive_rate(text: &str) -> Result<f64, String> {
    positive(text, MAX_RATE_HZ, "Hz")
}

pub(super) fn positive_length(text: &str) -> Result<f64, String> {
    positive(text, MAX_LENGTH, "metres")
}

pub(super) fn hole_edges(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(edges) if edges <= MAX_HOLE_EDGES => Ok(edges),
        _ => Err(format!("give a number of edges up to {MAX_HOLE_EDGES}")),
    }
}

/// Where a file or a folder is written.
pub(super) fn output() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        if path == Path::new("-") {
            Err("standard output takes none of this; name a file or folder, ./- if it is to be called so")
        } else {
            Ok(path)
        }
    })
}

/// A name that says what is written.
pub(super) fn png_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_png = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if is_png && path.file_stem().is_some() {
        Ok(path)
    } else {
        Err("name a file that ends in .png".to_owned())
    }
}

pub(super) fn film_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s| (0.1..=60.0).contains(s));
    seconds.ok_or_else(|| "give seconds, from 0.1 to 60".to_owned())
}

pub(super) fn picture_size(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| {
        text.parse()
            .ok()
            .filter(|side| (1..=MOST_PIXELS).contains(side))
    };
    let sides = text.split_once(['x', 'X']);
    sides
        .and_then(|(width, height)| Some((side(width)?, side(height)?)))
        .ok_or_else(|| {
            format!("give a width and a height from 1 to {MOST_PIXELS}, such as 1280x960")
        })
}

pub(super) fn tracking_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse::<f64>().ok();
    let usable = rate.filter(|hz| TRACKING_RATES_HZ.contains(hz));
    usable.ok_or_else(|| "give a rate, from 1 to 1000 Hz".to_owned())
}

pub(super) fn positive(text: &str, limit: f64, unit: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= limit => Ok(value),
        _ => Err(format!("give a number of {unit} above 0 and up to {limit}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_sender_is_so_slow_that_its_period_is_no_time() {
        for rate in ["1e-300", "5e-20", "0.99", "1001", "NaN", "-1", "fast"] {
            assert!(tracking_rate(rate).is_err(), "{rate}");
        }
        for rate in ["1", "120", "1e3"] {
            assert_eq!(tracking_rate(rate).ok(), rate.parse::<f64>().ok());
        }
    }
}
