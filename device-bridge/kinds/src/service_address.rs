//! Where a service listens.

use std::fmt;
use std::str::FromStr;

/// Host and port of an Inverse service.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ServiceAddress {
    /// Name or address.
    pub host: String,
    /// TCP.
    pub port: u16,
}

impl ServiceAddress {
    /// The service's own, since 3.5.
    pub const DEFAULT_PORT: u16 = 10_001;
}

impl Default for ServiceAddress {
    /// On this machine.
    fn default() -> Self {
        Self {
            host: "127.0.0.1".to_owned(),
            port: Self::DEFAULT_PORT,
        }
    }
}

/// A text that is no address.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no address of an Inverse service; write HOST or HOST:PORT, such as localhost:10001"
)]
pub struct AddressError(String);

impl FromStr for ServiceAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let wrong = || AddressError(text.to_owned());
        let (host, port) = match text.rsplit_once(':') {
            Some((host, port)) => (host, port.parse().map_err(|_| wrong())?),
            None => (text, Self::DEFAULT_PORT),
        };
        let plain = |c: char| c.is_ascii_alphanumeric() || "-._[]:".contains(c);
        if host.is_empty() || !host.chars().all(plain) || port == 0 {
            return Err(wrong());
        }
        Ok(Self {
            host: host.to_owned(),
            port,
        })
    }
}

impl fmt::Display for ServiceAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.host, self.port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_may_be_left_out() {
        let of = |text: &str| text.parse::<ServiceAddress>().map(|a| a.to_string());
        assert_eq!(of("lab-pc"), Ok("lab-pc:10001".to_owned()));
        assert_eq!(of("10.0.0.7:10000"), Ok("10.0.0.7:10000".to_owned()));
        for wrong in ["", ":1", "pc:", "pc:70000", "pc:0", "a b:1", "pc/x:1"] {
            let error = of(wrong).expect_err(wrong).to_string();
            assert!(error.contains("HOST:PORT"), "{error}");
        }
    }
}
