//! Why a device of a user's own is none.

use std::path::PathBuf;

use super::claims::Claim;

/// Why a plug-in is no device.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PluginError {
    /// The file.
    #[error("there is no plug-in at {path} ({cause}); write its whole path, {example}")]
    Missing {
        /// As written.
        path: PathBuf,
        /// How one of this language is named.
        example: &'static str,
        /// What the system says.
        cause: String,
    },
    /// The system cannot load it.
    #[error(
        "the plug-in {path} cannot be loaded: {cause}; build it for this machine, and install the libraries that it needs"
    )]
    Load {
        /// Whole.
        path: PathBuf,
        /// What the system says.
        cause: String,
    },
    /// It is another library.
    #[error(
        "{path} exports no function `taut_device_entry`, so it is no plug-in; a vendor's library needs one around it: docs/devices.md, Write a device in C"
    )]
    NoEntry {
        /// Whole.
        path: PathBuf,
    },
    /// Another version of the interface, or half a table.
    #[error(
        "the plug-in {path} does not fit: {what}; compile it with the taut_device.h of this release"
    )]
    Table {
        /// Whole.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// It found no device.
    #[error(
        "the plug-in {path} cannot open its device: {cause}; plug it in and switch it on, and look at the plug-in's options"
    )]
    Open {
        /// Whole.
        path: PathBuf,
        /// What it says.
        cause: String,
    },
    /// It says what no device is.
    #[error("the plug-in {path} says what no device is: {claim}; mend its `info`")]
    Info {
        /// Whole.
        path: PathBuf,
        /// What.
        claim: Claim,
    },
    /// It does not come back.
    #[error(
        "the plug-in {path} did not open its device within {seconds} s; switch the device off and on, and end other programs that use it"
    )]
    Hangs {
        /// As written.
        path: PathBuf,
        /// That were waited.
        seconds: u64,
    },
    /// The interpreter.
    #[error(
        "Python cannot be started as {interpreter}: {cause}; install Python 3.9 or later, or give the option interpreter=PATH"
    )]
    Interpreter {
        /// As written.
        interpreter: PathBuf,
        /// What the system says.
        cause: String,
    },
    /// An option that is not NAME=VALUE.
    #[error("an option of a device in Python is NAME=VALUE, and `{0}` is none")]
    Option(String),
    /// A system without it.
    #[error("devices in Python can be used on Unix only")]
    NotHere,
    /// No thread.
    #[error("cannot start a thread for the plug-in: {0}; end other programs or raise the limit")]
    Thread(String),
}
