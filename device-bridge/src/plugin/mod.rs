//! Force devices in shared libraries: the interface of `include/taut_device.h`.
//!
//! | file      | what                                                             |
//! |-----------|------------------------------------------------------------------|
//! | `library` | the C functions, with all that is unsafe                         |
//! | `claims`  | what a library may say of its device, and which samples are ones |
//! | `talker`  | the thread that calls them                                       |

mod claims;
mod library;
mod talker;

pub use claims::{Claim, PluginInfo};
pub use library::PluginError;
pub use talker::Plugin;
