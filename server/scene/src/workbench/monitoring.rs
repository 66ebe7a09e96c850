//! What rerun shows, and where.

use super::parts::{Files, bind, ports};
use super::spec::Monitoring;
use crate::document::Section;

pub(super) fn monitoring(section: &Section<'_>, files: &Files<'_>) -> Monitoring {
    let default = Monitoring::default();
    let mebibytes: Option<u64> = section.integer("memory_limit_mib", 16, 1 << 20);
    let [grpc_port, web_port] = ports(
        section,
        [
            ("grpc_port", default.grpc_port),
            ("web_port", default.web_port),
        ],
    );
    Monitoring {
        enabled: section.boolean("enabled").unwrap_or(default.enabled),
        bind: bind(section, default.bind),
        grpc_port,
        web_port,
        record: files.path(section, "record"),
        memory_limit: mebibytes.map_or(default.memory_limit, |mebibytes| mebibytes << 20),
    }
}
