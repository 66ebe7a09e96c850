//! Arguments of the command line that a command reads for itself.

#[cfg(feature = "render")]
pub use taut_render::RenderArgs;

use std::path::PathBuf;
use std::str::FromStr;

use taut_bridge::{DeviceChoice, InputChoice, VrpnSettings};
use taut_kinds::UnknownDevice;

/// `taut render` of a build that cannot draw: takes any arguments and says so.
#[cfg(not(feature = "render"))]
#[derive(Clone, Debug, clap::Args)]
pub struct RenderArgs {
    /// Not looked at
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    pub rest: Vec<String>,
}

/// Where the head's poses come from.
#[derive(Clone, Debug, PartialEq)]
pub enum HeadFrom {
    /// It stays where the workbench file has it.
    Still,
    /// A recorded trace of the head, workbench frame, again and again.
    Trace(PathBuf),
    /// A sensor of a VRPN tracker.
    Vrpn(Box<VrpnSettings>),
}

/// A text that names no source.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnknownHeadSource {
    /// Not one of the three.
    #[error("\"{0}\" gives no head: write still, trace:FILE or vrpn:TRACKER@HOST")]
    Name(String),
    /// The tracker.
    #[error(transparent)]
    Tracker(#[from] UnknownDevice),
}

impl FromStr for HeadFrom {
    type Err = UnknownHeadSource;

    fn from_str(text: &str) -> Result<Self, UnknownHeadSource> {
        match text.split_once(':').map_or(text, |(name, _)| name) {
            "still" if text == "still" => Ok(Self::Still),
            "trace" | "vrpn" => match text.parse()? {
                DeviceChoice::Trace(path) => Ok(Self::Trace(path)),
                DeviceChoice::Input(InputChoice::Vrpn(settings)) => Ok(Self::Vrpn(settings)),
                _ => Err(UnknownHeadSource::Name(text.to_owned())),
            },
            _ => Err(UnknownHeadSource::Name(text.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_one_of_three() {
        assert_eq!("still".parse(), Ok(HeadFrom::Still));
        assert_eq!(
            "trace:head.csv".parse(),
            Ok(HeadFrom::Trace("head.csv".into()))
        );
        assert!(matches!(
            "vrpn:Head@lab,sensor=1".parse(),
            Ok(HeadFrom::Vrpn(settings)) if settings.source.sensor == 1
        ));
        for bad in ["", "stil", "still:now", "trace:", "vrpn:", "space-mouse"] {
            assert!(bad.parse::<HeadFrom>().is_err(), "{bad}");
        }
    }
}
