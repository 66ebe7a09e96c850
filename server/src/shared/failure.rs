//! Why a command ended without its result: a sentence, and the exit code that goes with it.

use std::fmt;

/// Exit code of a command that could not do its work.
pub const EXIT_FAILED: u8 = 1;
/// Exit code of bad usage or bad input.
pub const EXIT_BAD_INPUT: u8 = 2;

/// One sentence that says what, where and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// The user can mend it: a file, an option, a port, a key, an address.
    #[error("{0}")]
    BadInput(String),
    /// The program or the machine could not.
    #[error("{0}")]
    Failed(String),
}

impl Failure {
    /// Something the user can mend.
    pub fn bad_input(sentence: impl fmt::Display) -> Self {
        Self::BadInput(sentence.to_string())
    }

    /// Something the program or the machine could not do.
    pub fn failed(sentence: impl fmt::Display) -> Self {
        Self::Failed(sentence.to_string())
    }

    /// The exit code of the process.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::BadInput(_) => EXIT_BAD_INPUT,
            Self::Failed(_) => EXIT_FAILED,
        }
    }
}

impl From<taut_link::LinkError> for Failure {
    fn from(error: taut_link::LinkError) -> Self {
        use taut_link::LinkError as E;
        match error {
            // The link was there, or the machine is at its end: nothing that other input would mend.
            E::Closed { .. } | E::NoSuchMesh { .. } | E::BadMesh { .. } | E::System { .. } => {
                Self::failed(error)
            }
            E::PortInUse { .. }
            | E::Listen { .. }
            | E::BadAddress { .. }
            | E::UnknownHost { .. }
            | E::Unreachable { .. }
            | E::TurnedAway { .. }
            | E::WrongKey { .. }
            | E::WrongServer { .. }
            | E::NotAllowed { .. }
            | E::WrongVersion { .. }
            | E::Refused { .. }
            | E::Protocol { .. }
            | E::KeyFile { .. }
            | E::Content { .. }
            | E::NodeTimeout { .. } => Self::bad_input(error),
        }
    }
}

impl From<taut_scene::FileError> for Failure {
    fn from(error: taut_scene::FileError) -> Self {
        Self::bad_input(error)
    }
}

impl From<god_object::StartError> for Failure {
    fn from(error: god_object::StartError) -> Self {
        Self::bad_input(error)
    }
}
