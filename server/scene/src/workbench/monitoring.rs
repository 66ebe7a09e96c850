//! What rerun shows, and where.

use std::net::{IpAddr, Ipv4Addr};

use super::parts::{Files, bind, port};
use super::spec::Monitoring;
use crate::document::Section;

pub(super) fn monitoring(
    section: Option<Section<'_>>,
    root: &Section<'_>,
    files: &Files<'_>,
) -> Option<Monitoring> {
    let loopback = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let mut monitoring = Monitoring {
        enabled: true,
        bind: loopback,
        grpc_port: 9876,
        web_port: 9090,
        record: None,
        memory_limit: 256 << 20,
    };
    let Some(section) = section else {
        return (!root.has("monitoring")).then_some(monitoring);
    };
    monitoring.enabled = section.boolean("enabled").unwrap_or(true);
    monitoring.bind = bind(&section, loopback).unwrap_or(loopback);
    monitoring.grpc_port = port(&section, "grpc_port", monitoring.grpc_port);
    monitoring.web_port = port(&section, "web_port", monitoring.web_port);
    monitoring.record = files.path(&section, "record");
    if let Some(mebibytes) = section.integer("memory_limit_mib", 16, 1 << 20) {
        monitoring.memory_limit = mebibytes.unsigned_abs() << 20;
    }
    if monitoring.grpc_port == monitoring.web_port && monitoring.web_port != 0 {
        let at = section.at_key("web_port");
        section.complain(
            at,
            format!(
                "`grpc_port` and `web_port` in {} are both {}; choose another for one",
                section.name(),
                monitoring.web_port
            ),
        );
    }
    section.finish();
    Some(monitoring)
}
