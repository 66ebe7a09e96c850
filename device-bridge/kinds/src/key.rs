//! A key of a device: what it is called, what it takes, what it means.

use std::str::FromStr;

use taut_vrpn::{Address, Axes};

use crate::chosen::Value;
use crate::service_address::ServiceAddress;

/// A key of a kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// As a workbench file has it. The command line writes `-` for `_`.
    pub name: &'static str,
    /// What its value may be.
    pub takes: Takes,
    /// What it means, with its unit and default.
    pub what: &'static str,
    /// A workbench file alone has it.
    pub in_file_only: bool,
}

/// What a value may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Takes {
    /// A number from the one to the other, ends included.
    Number(f64, f64),
    /// The same, whole.
    Whole(i64, i64),
    /// One of these words.
    OneOf(&'static [&'static str]),
    /// `yes` or `no`; a boolean in a file.
    YesOrNo,
    /// Axes such as `x -z y`.
    Axes,
    /// Axes that are right-handed: a frame has no mirror image.
    RightHandedAxes,
    /// A text that is not empty; how one looks.
    Text(&'static str),
    /// A name of something shipped, or a file.
    NameOrFile(&'static str),
    /// A file or a port; relative to the workbench file's folder.
    File,
    /// Host and port of a service.
    Service,
    /// A device of a VRPN server.
    Tracker,
    /// A pose, with the keys of a pose: in a file alone.
    Pose,
}

impl Takes {
    /// What to write, for an error.
    #[must_use]
    pub fn wanted(&self) -> String {
        match self {
            Self::Number(low, high) => format!("a number from {low} to {high}"),
            Self::Whole(low, high) => format!("a whole number from {low} to {high}"),
            Self::OneOf(words) => words.join(" or "),
            Self::YesOrNo => "yes or no".to_owned(),
            Self::Axes => "such as `x -z y`".to_owned(),
            Self::RightHandedAxes => {
                "right-handed, such as `x -z y`: a frame has no mirror image".to_owned()
            }
            Self::Text(looks) | Self::NameOrFile(looks) => (*looks).to_owned(),
            Self::File => "a file".to_owned(),
            Self::Service => "HOST or HOST:PORT".to_owned(),
            Self::Tracker => "DEVICE@HOST or DEVICE@HOST:PORT".to_owned(),
            Self::Pose => "a pose, in a workbench file".to_owned(),
        }
    }

    /// The value that `text` is; `None` where it is none.
    #[must_use]
    pub fn read(&self, text: &str) -> Option<Value> {
        fn read<T: FromStr>(text: &str) -> Option<T> {
            text.parse().ok()
        }
        match self {
            // False for NaN.
            Self::Number(low, high) => read(text)
                .filter(|number| (*low..=*high).contains(number))
                .map(Value::Number),
            Self::Whole(low, high) => read(text)
                .filter(|number| (*low..=*high).contains(number))
                .map(Value::Whole),
            Self::OneOf(words) => {
                let word = words.iter().find(|word| **word == text);
                word.map(|word| Value::Word(word))
            }
            Self::YesOrNo => match text {
                "yes" => Some(Value::Yes(true)),
                "no" => Some(Value::Yes(false)),
                _ => None,
            },
            Self::Axes => read(text).map(Value::Axes),
            Self::RightHandedAxes => read::<Axes>(text)
                .filter(|axes| axes.matrix().determinant() > 0.0)
                .map(Value::Axes),
            Self::Text(_) | Self::NameOrFile(_) => {
                (!text.is_empty()).then(|| Value::Text(text.to_owned()))
            }
            Self::File => (!text.is_empty()).then(|| Value::File(text.into())),
            Self::Service => read::<ServiceAddress>(text).map(Value::Service),
            Self::Tracker => read::<Address>(text).map(Value::Tracker),
            Self::Pose => None,
        }
    }
}
