//! Why a device of a user's own is none.

use std::path::PathBuf;

use super::claims::Claim;
use crate::own_thread::ThreadError;

/// Why a plug-in is no device.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PluginError {
    /// The file.
    #[error("there is no plug-in at {0} ({1}); write its whole path, {2}")]
    Missing(PathBuf, String, &'static str),
    /// The system cannot load it.
    #[error(
        "the plug-in {0} cannot be loaded: {1}; build it for this machine, and install the libraries that it needs"
    )]
    Load(PathBuf, String),
    /// It is another library.
    #[error(
        "{0} exports no function `taut_device_entry`, so it is no plug-in; a vendor's library needs one around it: docs/devices.md, Write a device in C"
    )]
    NoEntry(PathBuf),
    /// Another version of the interface, or half a table.
    #[error("the plug-in {0} does not fit: {1}; compile it with the taut_device.h of this release")]
    Table(PathBuf, String),
    /// It found no device.
    #[error(
        "the plug-in {0} cannot open its device: {1}; plug it in and switch it on, and look at the plug-in's options"
    )]
    Open(PathBuf, String),
    /// It says what no device is.
    #[error("the plug-in {0} says what no device is: {1}; mend its `info`")]
    Info(PathBuf, Claim),
    /// It does not come back.
    #[error(
        "the plug-in {0} did not open its device within {1} s; switch the device off and on, and end other programs that use it"
    )]
    Hangs(PathBuf, u64),
    /// The interpreter.
    #[error(
        "Python cannot be started as {0}: {1}; install Python 3.9 or later, or give the option interpreter=PATH"
    )]
    Interpreter(PathBuf, String),
    /// An option that is not NAME=VALUE.
    #[error("an option of a device in Python is NAME=VALUE, and `{0}` is none")]
    Option(String),
    /// A system without it.
    #[error("devices in Python can be used on Unix only")]
    NotHere,
    /// No thread.
    #[error(transparent)]
    Thread(#[from] ThreadError),
}
