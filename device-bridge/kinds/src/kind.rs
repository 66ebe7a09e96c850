//! What a declaration says of a kind of device, and how it is written on the command line.

use crate::command_line::{option_name, options_of};
use crate::key::{Key, Takes};

/// Which kind, for the drivers: a `match` on it asks for every one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KindId {
    /// A simulated device in a simulated hand.
    Simulated,
    /// A recorded trace.
    Trace,
    /// A Haply Inverse service.
    Haply,
    /// SPIDAR motor boards.
    Spidar,
    /// Polhem's text board.
    Polhem,
    /// A HID board of WoodenHaptics.
    Wooden,
    /// A shared library.
    Plugin,
    /// A file in Python.
    Python,
    /// A 3Dconnexion SpaceMouse.
    SpaceMouse,
    /// A VRPN tracker.
    Vrpn,
    /// The mouse of a render window.
    Mouse,
    /// Whatever joins over the network.
    Remote,
}

/// A kind of device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    /// For programs.
    pub id: KindId,
    /// For people, on the command line and in workbench files.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// What it is at: a file, a port, an address. On the command line it follows the name.
    pub place: Option<Key>,
    /// How the place is called in a form.
    pub place_word: &'static str,
    /// A place, for an error where it must be given.
    pub place_example: &'static str,
    /// Whether it must be given.
    pub needs_place: bool,
    /// Its keys.
    pub keys: &'static [Key],
    /// Options that it does not know go to what it opens; in a file by the key `options`.
    pub hands_on: bool,
    /// It may have motors: a person arms it, and one program at a time has it.
    pub has_motors: bool,
    /// `--device` knows it.
    pub on_command_line: bool,
}

impl Kind {
    /// Whether it has a key of this name.
    #[must_use]
    pub fn has(&self, key: &str) -> bool {
        self.every_key().any(|known| known.name == key)
    }

    /// Its place and its keys.
    pub fn every_key(&self) -> impl Iterator<Item = &Key> {
        self.place.iter().chain(self.keys)
    }

    /// How it is written on the command line, with its options.
    #[must_use]
    pub fn form(&self) -> String {
        let mut options: Vec<String> = options_of(self)
            .map(|key| format!("{}={}", option_name(key), looks(key)))
            .collect();
        if self.hands_on {
            options.push("...".to_owned());
        }
        let place = match (&self.place, self.needs_place) {
            (Some(_), true) => format!(":{}", self.place_word),
            (Some(_), false) => format!("[={}]", self.place_word),
            (None, _) => String::new(),
        };
        if options.is_empty() {
            format!("{}{place}", self.name)
        } else {
            format!("{}{place}[,{}]", self.name, options.join(","))
        }
    }

    /// The form without what may be left out.
    #[must_use]
    pub fn short_form(&self) -> String {
        match self.needs_place {
            true => format!("{}:{}", self.name, self.place_word),
            false => self.name.to_owned(),
        }
    }
}

/// How a value looks in a form.
fn looks(key: &Key) -> String {
    match key.takes {
        Takes::Number(..) => "X".to_owned(),
        Takes::Whole(..) => "N".to_owned(),
        Takes::OneOf(words) if words.len() <= 4 => words.join("|"),
        Takes::OneOf(_) | Takes::Text(_) | Takes::NameOrFile(_) => "NAME".to_owned(),
        Takes::YesOrNo => "yes|no".to_owned(),
        Takes::Axes | Takes::RightHandedAxes => "x y z".to_owned(),
        Takes::File => "FILE".to_owned(),
        Takes::Service => "HOST:PORT".to_owned(),
        Takes::Tracker => "TRACKER@HOST".to_owned(),
        Takes::Pose => "POSE".to_owned(),
    }
}
