//! The ports of a demo: its own four where somebody asks for them, and none that another program has.

use std::net::{TcpListener, UdpSocket};

use crate::session::setup::SessionSetup;

pub(super) fn use_free_ports(setup: &mut SessionSetup, first: Option<u16>) {
    if let Some(first) = first {
        use_ports(setup, first);
    }
    take_free_ports(setup);
}

/// Puts the demo on four ports from `first` on, or on free ones where that is 0.
fn use_ports(setup: &mut SessionSetup, first: u16) {
    let port = |index: u16| {
        if first == 0 {
            0
        } else {
            first.saturating_add(index)
        }
    };
    setup.link.quic.set_port(port(0));
    setup.link.udp.set_port(port(1));
    if let Some(monitor) = &mut setup.monitor {
        (monitor.grpc_port, monitor.web_port) = (port(2), port(3));
    }
}

/// Replaces every port that somebody else has by a free one, and says so.
fn take_free_ports(setup: &mut SessionSetup) {
    let make_usable = |port: &mut u16, is_free: bool, what: &str| {
        if !is_free {
            taut_log::say(&format!("port {port} is in use; {what} takes a free one"));
            *port = 0;
        }
    };
    for (address, what) in [
        (&mut setup.link.quic, "the control plane"),
        (&mut setup.link.udp, "the pose stream"),
    ] {
        let mut port = address.port();
        make_usable(&mut port, UdpSocket::bind(*address).is_ok(), what);
        address.set_port(port);
    }
    if let Some(monitor) = setup.monitor.as_mut().filter(|monitor| monitor.serve) {
        for (port, what) in [
            (&mut monitor.grpc_port, "the monitor's stream"),
            (&mut monitor.web_port, "the monitor's page"),
        ] {
            let is_free = TcpListener::bind((monitor.bind, *port)).is_ok();
            make_usable(port, is_free, what);
        }
    }
}
