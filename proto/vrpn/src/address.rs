//! Where a device is: `Tracker0@host:3883`.

use std::fmt;
use std::str::FromStr;

/// TCP and UDP port of a VRPN server.
pub const DEFAULT_PORT: u16 = 3883;

/// Most bytes of a device's name: the protocol's names end within 100 bytes, the closing zero included.
const MAX_NAME_BYTES: usize = 99;

/// A device of a VRPN server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// The device's name at the server.
    pub device: String,
    /// Name or IPv4 address of the server.
    pub host: String,
    /// Its port.
    pub port: u16,
}

/// A text that is no [`Address`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no VRPN address; write DEVICE@HOST or DEVICE@HOST:PORT, such as Tracker0@192.168.1.5:3883"
)]
pub struct AddressError(String);

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let error = || AddressError(text.to_owned());
        let (device, server) = text.split_once('@').ok_or_else(error)?;
        let (host, port) = match server.split_once(':') {
            None => (server, DEFAULT_PORT),
            Some((host, port)) => (host, port.parse().map_err(|_| error())?),
        };
        let named = !device.is_empty() && device.len() <= MAX_NAME_BYTES && !device.contains('\0');
        let placed = !host.is_empty() && !host.contains(['/', '@', ' ']) && port != 0;
        if !(named && placed) {
            return Err(error());
        }
        Ok(Self {
            device: device.to_owned(),
            host: host.to_owned(),
            port,
        })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}:{}", self.device, self.host, self.port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_port_may_be_left_out() {
        let address: Address = "Tracker0@lab-pc".parse().expect("valid");
        assert_eq!(address.to_string(), "Tracker0@lab-pc:3883");
        assert_eq!(address.to_string().parse(), Ok(address));
    }

    #[test]
    fn what_cannot_be_dialled_is_refused_with_the_form() {
        for text in [
            "Tracker0",
            "@host",
            "Tracker0@",
            "Tracker0@host:",
            "Tracker0@host:0",
            "Tracker0@host:70000",
            "Tracker0@tcp://host",
            "a@b@c",
        ] {
            let error = text.parse::<Address>().expect_err(text).to_string();
            assert!(error.contains("DEVICE@HOST:PORT"), "{error}");
        }
    }
}
