//! The machines of the workbench: which of them serves, draws, holds the device, tracks the head. For `taut deploy`; nothing else reads it.

use std::net::IpAddr;

use super::displays::unique_name;
use super::spec::{Device, HeadTracking, Machine, Network, Node};
use crate::document::Section;

/// Longest name: it is a file's and a folder's.
const MAX_NAME: usize = 63;

/// What the machines are checked against.
pub(super) struct Named<'w> {
    pub(super) nodes: &'w [Node],
    pub(super) network: Option<&'w Network>,
    pub(super) device: Option<&'w Device>,
    pub(super) tracking: Option<&'w HeadTracking>,
}

/// Reads `[[machine]]`; a file without any is fine, one with some names the whole workbench's.
pub(super) fn machines(root: &Section<'_>, named: &Named<'_>) -> Vec<Machine> {
    let mut machines: Vec<Machine> = Vec::new();
    for section in root.sections("machine") {
        let machine = machine(&section, &machines);
        if let Some(machine) = machine {
            complain_of(&section, &machine, &machines, named);
            machines.push(machine);
        }
        section.finish();
    }
    if root.has("machine") {
        complain_of_all(root, &machines, named);
    }
    machines
}

fn machine(section: &Section<'_>, others: &[Machine]) -> Option<Machine> {
    let names = others.iter().map(|machine| machine.name.as_str());
    let name = unique_name(section, "machine", names);
    let address = section.required_text("address", "address = \"192.0.2.10\"");
    let machine = Machine {
        server: section.boolean("server").unwrap_or(false),
        nodes: section.words("nodes"),
        device: section.text("device").map(str::to_owned),
        tracker: section.text("tracker").map(str::to_owned),
        name: plain_name(section, name?)?,
        address: address_of(section, address?)?,
    };
    Some(machine)
}

/// Whether a machine may be called so: the name is a file's, and needs no quotes in a shell.
pub fn is_machine_name(name: &str) -> bool {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    name.len() <= MAX_NAME
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name.chars().all(is_plain)
}

fn plain_name(section: &Section<'_>, name: String) -> Option<String> {
    if is_machine_name(&name) {
        return Some(name);
    }
    let text = format!(
        "the machine's name \"{name}\" is to be a file's name: write 1 to {MAX_NAME} letters, digits, `-`, `_` or `.`, a letter or digit first"
    );
    section.complain_of("name", text);
    None
}

/// An address that is one machine's: firewalls and services take no names.
fn address_of(section: &Section<'_>, text: &str) -> Option<IpAddr> {
    let address = text.parse::<IpAddr>().ok();
    let address = address.filter(|ip| !ip.is_unspecified() && !ip.is_multicast());
    if address.is_none() {
        let text = format!(
            "`address` is \"{text}\", which is no machine's; write its IP address on the workbench's network, such as \"192.0.2.10\""
        );
        section.complain_of("address", text);
    }
    address
}

/// What is wrong with one machine, beside those before it.
fn complain_of(section: &Section<'_>, machine: &Machine, others: &[Machine], named: &Named<'_>) {
    let name = &machine.name;
    if let Some(other) = others.iter().find(|other| other.address == machine.address) {
        let text = format!(
            "{} and {name} have the same address; write each machine's own, or make them one machine",
            other.name
        );
        section.complain_of("address", text);
    }
    let of_other_kind = |other: &&Machine| other.address.is_ipv4() != machine.address.is_ipv4();
    if let Some(other) = others.iter().find(of_other_kind) {
        let text = format!(
            "{name} has the address {} and {} has {}: one of IPv4 and one of IPv6, between which nothing passes; write addresses of one kind for all",
            machine.address, other.name, other.address
        );
        section.complain_of("address", text);
    }
    complain_of_nodes(section, machine, others, named);
    if machine.device.is_some() && !matches!(named.device, Some(Device::Remote) | None) {
        let text = format!(
            "{name} has a device, but the server reads its own; write kind = \"remote\" in [device], or take `device` out here"
        );
        section.complain_of("device", text);
    }
    if machine.tracker.is_some() && !matches!(named.tracking, Some(HeadTracking::Remote) | None) {
        let text = format!(
            "{name} has a head tracker, but [viewer] does not wait for one; write remote_tracker = true there, or take `tracker` out here"
        );
        section.complain_of("tracker", text);
    }
    let does_nothing = !machine.server
        && machine.nodes.is_empty()
        && machine.device.is_none()
        && machine.tracker.is_none();
    if does_nothing {
        section.complain(
            section.at(),
            format!("{name} does nothing; write server = true, nodes = [...], device = \"...\" or tracker = \"...\""),
        );
    }
}

/// What is wrong with the nodes that a machine runs.
fn complain_of_nodes(
    section: &Section<'_>,
    machine: &Machine,
    others: &[Machine],
    named: &Named<'_>,
) {
    let name = &machine.name;
    let complain = |text: String| section.complain_of("nodes", text);
    for (place, node) in machine.nodes.iter().enumerate() {
        let elsewhere = others.iter().find(|other| other.nodes.contains(node));
        if !named.nodes.iter().any(|known| known.name == *node) {
            let known: Vec<&str> = named.nodes.iter().map(|n| n.name.as_str()).collect();
            let known = known.join(", ");
            complain(format!(
                "{name} runs the node \"{node}\", which does not exist; known nodes: {known}"
            ));
        } else if let Some(Machine { name: other, .. }) = elsewhere {
            complain(format!(
                "the node \"{node}\" runs on {other} and on {name}; take it out of one"
            ));
        } else if machine.nodes[..place].contains(node) {
            complain(format!(
                "{name} names the node \"{node}\" twice; remove one"
            ));
        }
    }
}

/// What is wrong with the machines together.
fn complain_of_all(root: &Section<'_>, machines: &[Machine], named: &Named<'_>) {
    let complain = |text: String| root.complain_of("machine", text);
    let count = |of: fn(&Machine) -> bool| machines.iter().filter(|machine| of(machine)).count();
    match count(|machine| machine.server) {
        1 => {}
        0 => complain("no [[machine]] is the haptic PC; write server = true in one".into()),
        more => complain(format!(
            "{more} machines have server = true; leave one, the haptic PC"
        )),
    }
    for (key, machines) in [
        ("device", count(|machine| machine.device.is_some())),
        ("tracker", count(|machine| machine.tracker.is_some())),
    ] {
        if machines > 1 {
            complain(format!(
                "{machines} machines have a `{key}`; a workbench has one"
            ));
        }
    }
    for node in named.nodes {
        if !machines
            .iter()
            .any(|machine| machine.nodes.contains(&node.name))
        {
            complain(format!(
                "the node \"{0}\" is on no machine; write nodes = [\"{0}\"] in one",
                node.name
            ));
        }
    }
    let server = machines.iter().find(|machine| machine.server);
    if let (Some(server), Some(network)) = (server, named.network) {
        if !network.bind.is_unspecified() && network.bind != server.address {
            complain(format!(
                "clients reach {} at {}, but it listens at {} alone; write bind = \"0.0.0.0\" in [network]",
                server.name, server.address, network.bind
            ));
        }
        if network.quic_port == 0 || network.udp_port == 0 {
            complain("the machines must know the server's ports; write others than 0 for `quic_port` and `udp_port` in [network]".into());
        }
    }
}
