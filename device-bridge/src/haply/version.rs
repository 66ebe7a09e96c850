//! Which service is there. Before 3.5 the fields of a force had other names, so that an old service would take it for none.

use std::fmt::{Display, Formatter};
use std::time::Duration;

use serde::Deserialize;
use taut_kinds::ServiceAddress;

/// The first whose messages are understood.
const FIRST: ServiceVersion = ServiceVersion(3, 5);
/// How long the answer may take.
const PATIENCE: Duration = Duration::from_secs(2);
/// Largest answer that is read, bytes.
const MAX_ANSWER: u64 = 1 << 16;

/// The first two numbers of an Inverse service's version.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ServiceVersion(u32, u32);

/// Why no version is known, or which one is too old.
#[derive(Debug, thiserror::Error)]
pub enum VersionError {
    /// Too old.
    #[error(
        "the Inverse service at {0} has version {1}, but its messages are understood from {FIRST} on; install a newer one"
    )]
    TooOld(ServiceAddress, ServiceVersion),
    /// No answer, or one that says no version.
    #[error("the Inverse service at {0} does not tell its version ({1})")]
    Unknown(ServiceAddress, String),
}

#[derive(Deserialize)]
struct Answer {
    project_version: String,
}

impl ServiceVersion {
    /// Of a text such as `3.5.1.0`.
    fn parse(text: &str) -> Option<Self> {
        let mut numbers = text.trim_start_matches('v').split(['.', '-', '+']);
        let mut number = || numbers.next()?.parse().ok();
        Some(Self(number()?, number()?))
    }
}

impl Display for ServiceVersion {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.0, self.1)
    }
}

/// Asks the service for its version, `GET /version`; waits at most two seconds.
pub(super) fn check_version(address: &ServiceAddress) -> Result<(), VersionError> {
    let unknown = |cause: String| VersionError::Unknown(address.clone(), cause);
    let agent: ureq::Agent = ureq::Agent::config_builder()
        .timeout_global(Some(PATIENCE))
        .proxy(None)
        .build()
        .into();
    let asked = agent.get(format!("http://{address}/version")).call();
    let mut answer = asked.map_err(|error| unknown(error.to_string()))?;
    let body = answer
        .body_mut()
        .with_config()
        .limit(MAX_ANSWER)
        .read_to_string();
    let body = body.map_err(|error| unknown(error.to_string()))?;
    let answer: Answer = serde_json::from_str(&body).map_err(|error| unknown(error.to_string()))?;
    let found = ServiceVersion::parse(&answer.project_version)
        .ok_or_else(|| unknown(format!("`{}` is none", answer.project_version)))?;
    if found < FIRST {
        return Err(VersionError::TooOld(address.clone(), found));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_compared_by_number() {
        let of = |text| ServiceVersion::parse(text).unwrap_or_else(|| panic!("{text}"));
        assert!(of("3.0.0.0") < FIRST && of("3.4.9") < FIRST && of("2.10") < FIRST);
        assert!(of("3.5.0") == FIRST && of("v3.10.2-rc1") > FIRST && of("4.0") > FIRST);
        assert_eq!(ServiceVersion::parse("main"), None);
    }
}
