//! What this machine says of itself: defaults of the questions.

use std::fmt;
use std::fs;
use std::net::{IpAddr, Ipv4Addr, UdpSocket};

use taut_bridge::haply::{self, ServiceAddress};
use taut_bridge::{HidPort, PluggedPort, ReportPort, plugged_ports};

struct Monitor {
    /// Its output, such as DP-1.
    name: String,
    /// Pixels.
    size: (u32, u32),
}

pub(super) struct Found {
    pub(super) host: String,
    /// Of the interface by which others are reached; loopback where there is none.
    pub(super) address: IpAddr,
    monitors: Vec<Monitor>,
    /// As `taut bridge --device` takes it.
    pub(super) device: Option<String>,
}

impl Found {
    /// Looks at this machine. Nothing is moved, and nobody is asked but an Inverse service of its own, for states alone.
    pub(super) fn here() -> Self {
        let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let host = host.split('.').next().unwrap_or_default().trim();
        let is_name = taut_scene::is_machine_name(host) && host != "localhost";
        Self {
            host: if is_name { host } else { "haptic-pc" }.to_owned(),
            address: own_address().unwrap_or(IpAddr::V4(Ipv4Addr::LOCALHOST)),
            monitors: monitors(),
            device: device(
                plugged_ports().unwrap_or_default(),
                &ServiceAddress::default(),
            ),
        }
    }

    /// Size of a window, pixels, and whether it covers its monitor.
    pub(super) fn window(&self) -> (u32, u32, bool) {
        match self.monitors.first() {
            Some(monitor) => (monitor.size.0, monitor.size.1, true),
            None => (1280, 720, false),
        }
    }
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let monitors: Vec<String> = self
            .monitors
            .iter()
            .map(|monitor| format!("{} {}x{}", monitor.name, monitor.size.0, monitor.size.1))
            .collect();
        write!(
            f,
            "this machine: {}, address {}, monitors: {}, device: {}",
            self.host,
            self.address,
            if monitors.is_empty() {
                "none known".to_owned()
            } else {
                monitors.join(", ")
            },
            self.device.as_deref().unwrap_or("none known"),
        )
    }
}

/// The address that a datagram to elsewhere would come from; none is sent.
fn own_address() -> Option<IpAddr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9)).ok()?;
    let address = socket.local_addr().ok()?.ip();
    (!address.is_unspecified()).then_some(address)
}

/// The first address after `first` in its network of 256 that is not taken.
pub(super) fn next_address(taken: &[IpAddr], first: IpAddr) -> IpAddr {
    let IpAddr::V4(first) = first else {
        return first; // refused as taken: an address of the sixth version is not to be guessed
    };
    let [a, b, c, d] = first.octets();
    let after = (1..=253u8)
        .map(|step| Ipv4Addr::new(a, b, c, 1 + (d.wrapping_add(step).wrapping_sub(1)) % 254));
    let mut free = after.map(IpAddr::V4).filter(|ip| !taken.contains(ip));
    free.next().unwrap_or(IpAddr::V4(first))
}

/// As the kernel knows them.
fn monitors() -> Vec<Monitor> {
    let Ok(outputs) = fs::read_dir("/sys/class/drm") else {
        return Vec::new();
    };
    let mut monitors: Vec<Monitor> = outputs
        .flatten()
        .filter_map(|output| {
            let folder = output.path();
            let status = fs::read_to_string(folder.join("status")).ok()?;
            if status.trim() != "connected" {
                return None;
            }
            let modes = fs::read_to_string(folder.join("modes")).ok()?;
            let (width, height) = modes.lines().next()?.split_once('x')?;
            let name = folder.file_name()?.to_str()?.split_once('-')?.1.to_owned();
            Some(Monitor {
                name,
                size: (width.parse().ok()?, height.parse().ok()?),
            })
        })
        .collect();
    monitors.sort_by(|one, other| one.name.cmp(&other.name));
    monitors
}

/// A force device whose board is on a port or whose service has an arm, else a SpaceMouse. What may be any adapter is nobody's default: a bridge would
/// write to whatever is there.
fn device(ports: Vec<PluggedPort>, service: &ServiceAddress) -> Option<String> {
    let mut boards = ports.into_iter().filter(|port| port.is_its_board);
    let on_port = boards.find_map(|port| port.device);
    let has_arm = || haply::look(service).is_ok_and(|found| !found.said.arms.is_empty());
    on_port
        .or_else(|| has_arm().then(|| format!("haply={service}")))
        .or_else(|| HidPort.open().is_ok().then(|| "space-mouse".to_owned()))
}

#[cfg(test)]
mod tests {
    use taut_bridge::Hand;
    use taut_bridge::haply::{HaplyService, SimulatedInverse, SimulatedSettings};

    use super::*;

    #[test]
    fn an_adapter_is_no_device_by_default_and_a_service_with_an_arm_is() {
        let port = |device: &str, is_its_board| PluggedPort {
            path: "/dev/ttyUSB0".to_owned(),
            what: "0403:6001, FTDI".to_owned(),
            device: Some(device.to_owned()),
            is_its_board,
        };
        let inverse = SimulatedInverse::new(&SimulatedSettings::held(Hand::LIGHT));
        let any = "127.0.0.1:0".parse().expect("an address");
        let service = HaplyService::start(any, inverse).expect("a free port");
        let at: ServiceAddress = service.address().to_string().parse().expect("an address");

        let adapter = port("spidar:/dev/ttyUSB0", false);
        let found = device(vec![adapter.clone()], &at);
        assert_eq!(found, Some(format!("haply={at}")));
        let found = device(vec![adapter.clone(), port("wooden=/dev/x", true)], &at);
        assert_eq!(found.as_deref(), Some("wooden=/dev/x"));
        drop(service);
        let found = device(vec![adapter], &at);
        assert!(found.is_none_or(|found| found == "space-mouse"));
    }

    #[test]
    fn guessed_addresses_are_the_next_free_ones_of_the_network() {
        let ip = |text: &str| text.parse::<IpAddr>().expect("an address");
        assert_eq!(
            next_address(&[ip("10.0.0.5")], ip("10.0.0.5")),
            ip("10.0.0.6")
        );
        assert_eq!(
            next_address(&[ip("10.0.0.6")], ip("10.0.0.5")),
            ip("10.0.0.7")
        );
        assert_eq!(next_address(&[], ip("10.0.0.254")), ip("10.0.0.1"));
    }
}
