//! A kind of device with the values that somebody gave for its keys. Every value is within what its key takes.

use std::path::{Path, PathBuf};

use nalgebra::Isometry3;
use taut_vrpn::{Address, Axes};

use crate::key::Takes;
use crate::kind::Kind;
use crate::service_address::ServiceAddress;

/// A device as it was asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// Which.
    pub kind: &'static Kind,
    values: Vec<(&'static str, Value)>,
    /// Options that the kind hands on as they are written, with commas between.
    pub handed_on: String,
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// With the key's own unit.
    Number(f64),
    /// Whole.
    Whole(i64),
    /// One of the key's words.
    Word(&'static str),
    /// Or no.
    Yes(bool),
    /// Which axis is which.
    Axes(Axes),
    /// A text.
    Text(String),
    /// A file or a port.
    File(PathBuf),
    /// Of a service.
    Service(ServiceAddress),
    /// Of a VRPN server.
    Tracker(Address),
    /// m.
    Pose(Isometry3<f64>),
}

impl Chosen {
    /// A kind with nothing said of it.
    #[must_use]
    pub fn plain(kind: &'static Kind) -> Self {
        Self {
            kind,
            values: Vec::new(),
            handed_on: String::new(),
        }
    }

    /// Sets the value of a key of the kind; the last one counts.
    pub fn set(&mut self, key: &'static str, value: Value) {
        self.values.retain(|(name, _)| *name != key);
        self.values.push((key, value));
    }

    fn value(&self, key: &str) -> Option<&Value> {
        debug_assert!(
            self.kind.has(key),
            "`{}` declares no key `{key}`",
            self.kind.name
        );
        let found = self.values.iter().find(|(name, _)| *name == key);
        found.map(|(_, value)| value)
    }

    /// The files that it names, ports left out: what must be where the device is read.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        self.values.iter().filter_map(|(name, value)| match value {
            Value::File(path) if !path.starts_with("/dev") => Some(path.clone()),
            // Something shipped has a name; a file has an ending or a folder.
            Value::Text(text) if text.contains(['.', '/', '\\']) => {
                let mut keys = self.kind.every_key();
                let key = keys.find(|key| key.name == *name)?;
                matches!(key.takes, Takes::NameOrFile(_)).then(|| text.into())
            }
            _ => None,
        })
    }

    /// The number of `key`, if it was given; so with the others.
    #[must_use]
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.value(key)? {
            Value::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// A whole number.
    #[must_use]
    pub fn whole(&self, key: &str) -> Option<i64> {
        match self.value(key)? {
            Value::Whole(number) => Some(*number),
            _ => None,
        }
    }

    /// What goes by one of the key's words.
    #[must_use]
    pub fn named<T: Copy>(&self, key: &str, names: &[(&str, T)]) -> Option<T> {
        let Value::Word(word) = self.value(key)? else {
            return None;
        };
        let found = names.iter().find(|(name, _)| name == word);
        found.map(|(_, named)| *named)
    }

    /// Yes or no.
    #[must_use]
    pub fn yes(&self, key: &str) -> Option<bool> {
        match self.value(key)? {
            Value::Yes(yes) => Some(*yes),
            _ => None,
        }
    }

    /// Axes.
    #[must_use]
    pub fn axes(&self, key: &str) -> Option<Axes> {
        match self.value(key)? {
            Value::Axes(axes) => Some(*axes),
            _ => None,
        }
    }

    /// A text.
    #[must_use]
    pub fn text(&self, key: &str) -> Option<&str> {
        match self.value(key)? {
            Value::Text(text) => Some(text),
            Value::Word(word) => Some(word),
            _ => None,
        }
    }

    /// A file or a port.
    #[must_use]
    pub fn file(&self, key: &str) -> Option<&Path> {
        match self.value(key)? {
            Value::File(file) => Some(file),
            _ => None,
        }
    }

    /// A service.
    #[must_use]
    pub fn service(&self, key: &str) -> Option<&ServiceAddress> {
        match self.value(key)? {
            Value::Service(address) => Some(address),
            _ => None,
        }
    }

    /// A device of a VRPN server.
    #[must_use]
    pub fn tracker(&self, key: &str) -> Option<&Address> {
        match self.value(key)? {
            Value::Tracker(address) => Some(address),
            _ => None,
        }
    }

    /// A pose, m.
    #[must_use]
    pub fn pose(&self, key: &str) -> Option<Isometry3<f64>> {
        match self.value(key)? {
            Value::Pose(pose) => Some(*pose),
            _ => None,
        }
    }
}
