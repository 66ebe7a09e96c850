//! Whether there is an operator's page, and what opens its deeds.

use std::io::IsTerminal;
use std::path::PathBuf;

use taut_observers::{OperatorSettings, fresh_token};
use taut_scene::Workbench;

use crate::shared::failure::Failure;

/// An operator's page, before it is started.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OperatorSetup {
    /// Name of the workbench.
    pub workbench: String,
    /// Port and token.
    pub server: OperatorSettings,
    /// Where the token is from; `None`: it was made for this start.
    pub token_file: Option<PathBuf>,
}

impl OperatorSetup {
    /// What the workbench file wants; `None` where it wants no page.
    ///
    /// # Errors
    /// The token cannot be read, or is one that others know; or there is none, and no terminal to show a fresh one on.
    pub fn of(workbench: &Workbench) -> Result<Option<Self>, Failure> {
        let wanted = &workbench.operator;
        if !wanted.enabled {
            return Ok(None);
        }
        let token = match operator_token(workbench)? {
            Some(token) => token,
            // What goes to a journal or a file others may read.
            None if !std::io::stderr().is_terminal() => {
                return Err(Failure::bad_input(
                    "[operator] names no token_file, and standard error is no terminal on which a fresh token would stay with you; make one with: openssl rand -hex 32 > operator.token && chmod 600 operator.token",
                ));
            }
            None => fresh_token().ok_or_else(|| {
                Failure::failed("the system has no random numbers for the token of [operator]")
            })?,
        };
        Ok(Some(Self {
            workbench: workbench.name.clone(),
            server: OperatorSettings {
                port: wanted.port,
                token,
            },
            token_file: wanted.token_file.clone(),
        }))
    }
}

/// The token that the workbench file names, which nobody else may know.
pub(crate) fn operator_token(workbench: &Workbench) -> Result<Option<String>, Failure> {
    let wanted = &workbench.operator;
    let Some(file) = wanted.token_file.as_ref().filter(|_| wanted.enabled) else {
        return Ok(None);
    };
    taut_link::check_secret_file(file).map_err(|reason| {
        Failure::BadInput(format!(
            "cannot use the token of [operator] in {}: {reason}",
            file.display()
        ))
    })?;
    match wanted.token().map_err(Failure::bad_input)? {
        Some(token) if known_to_observers(workbench, &token)? => Err(Failure::bad_input(
            "the token of [operator] is that of [observers], which those who look on know; make another with: openssl rand -hex 32",
        )),
        token => Ok(token),
    }
}

fn known_to_observers(workbench: &Workbench, token: &str) -> Result<bool, Failure> {
    let observers = &workbench.observers;
    if !observers.enabled {
        return Ok(false);
    }
    let theirs = observers.token().map_err(Failure::bad_input)?;
    Ok(theirs.as_deref() == Some(token))
}
