//! The ports that a machine needs, as rules for nftables.

use std::fmt::Write as _;
use std::net::IpAddr;

use taut_scene::{Machine, TransportKind, Workbench};

/// Ports that Linux gives to sockets that ask for none (`net.ipv4.ip_local_port_range`): where render nodes hear each other.
const FREE_PORTS: &str = "32768-60999";

/// Rules of one machine; empty where it needs none.
struct Rules(Vec<String>);

impl Rules {
    /// Lets `what` in from these machines, or from all where `from` is `None`.
    fn accept(&mut self, from: Option<&[IpAddr]>, what: &str, why: &str) {
        let Some(from) = from else {
            self.0
                .push(format!("{what} accept comment \"taut: {why}\""));
            return;
        };
        for (family, is_family) in [
            ("ip", IpAddr::is_ipv4 as fn(&IpAddr) -> bool),
            ("ip6", IpAddr::is_ipv6),
        ] {
            let those: Vec<String> = from
                .iter()
                .filter(|ip| is_family(ip))
                .map(ToString::to_string)
                .collect();
            if !those.is_empty() {
                let set = those.join(", ");
                self.0.push(format!(
                    "{family} saddr {{ {set} }} {what} accept comment \"taut: {why}\""
                ));
            }
        }
    }
}

/// What this machine lets in, and nothing beside; `None` where it opens nothing.
pub(super) fn rules(workbench: &Workbench, machine: &Machine) -> Option<String> {
    let mut rules = Rules(Vec::new());
    let others = workbench
        .machines
        .iter()
        .filter(|other| other.name != machine.name);
    if machine.server {
        let all: Vec<IpAddr> = others.clone().map(|other| other.address).collect();
        for_clients(&mut rules, workbench, &all);
        for_watchers(&mut rules, workbench);
    }
    if !machine.nodes.is_empty() {
        let nodes: Vec<IpAddr> = others
            .clone()
            .filter(|other| !other.nodes.is_empty())
            .map(|other| other.address)
            .collect();
        let ports = format!("udp dport {FREE_PORTS}");
        rules.accept(
            Some(&nodes),
            &ports,
            "frames among render nodes without a server",
        );
        if workbench.network.transport == TransportKind::Multicast {
            let group = workbench.network.multicast_group;
            let server: Vec<IpAddr> = workbench
                .machines
                .iter()
                .filter(|m| m.server)
                .map(|m| m.address)
                .collect();
            let what = format!("ip daddr {} udp dport {}", group.ip(), group.port());
            rules.accept(Some(&server), &what, "poses by multicast");
            rules.accept(
                None,
                "ip protocol igmp",
                "the switch asks who hears multicast",
            );
        }
    }
    (!rules.0.is_empty()).then(|| text(machine, &rules.0))
}

/// Render nodes, device, tracker.
fn for_clients(rules: &mut Rules, workbench: &Workbench, all: &[IpAddr]) {
    let network = &workbench.network;
    let ports = match network.transport {
        TransportKind::QuicDatagram => format!("udp dport {}", network.quic_port),
        _ => format!(
            "udp dport {{ {}, {} }}",
            network.quic_port, network.udp_port
        ),
    };
    rules.accept(Some(all), &ports, "control and poses");
}

/// Those who look on, where the workbench file lets them in from other machines; it does not say who they are.
fn for_watchers(rules: &mut Rules, workbench: &Workbench) {
    let (monitor, vrpn, observers) = (&workbench.monitoring, &workbench.vrpn, &workbench.observers);
    let mut open = |is_open: bool, what: String, why: &str| {
        if is_open {
            rules.accept(None, &what, why);
        }
    };
    let (grpc, web) = (monitor.grpc_port, monitor.web_port);
    open(
        monitor.enabled && !monitor.bind.is_loopback(),
        format!("tcp dport {{ {grpc}, {web} }}"),
        "rerun, no password: restrict it",
    );
    let port = vrpn.port;
    let is_open = vrpn.enabled && !vrpn.bind.is_loopback();
    open(
        is_open,
        format!("tcp dport {port}"),
        "VRPN, no password: restrict it",
    );
    open(
        is_open,
        format!("udp dport {port}"),
        "VRPN, no password: restrict it",
    );
    open(
        observers.enabled && !observers.bind.is_loopback(),
        format!("tcp dport {}", observers.port),
        "observers, by token",
    );
}

fn text(machine: &Machine, rules: &[String]) -> String {
    let mut text = format!(
        "# What {} lets in for taut, before the other rules of the table `inet filter`, as Debian has it.\n\
         # Once, until the next start: nft -f /etc/taut/firewall.nft\n\
         # For good: add  include \"/etc/taut/firewall.nft\"  at the end of /etc/nftables.conf, and systemctl reload nftables\n\
         add table inet filter\n\
         add chain inet filter input\n",
        machine.name
    );
    for rule in rules {
        // Writing to a string does not fail.
        let _ = writeln!(text, "insert rule inet filter input {rule}");
    }
    text
}
