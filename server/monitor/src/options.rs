//! What the monitor does with what it is told: serve it, record it, how much it keeps.

use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;

/// How to monitor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MonitorOptions {
    /// Address to listen on. Whoever reaches it may look on, so the default is this machine only.
    pub bind: IpAddr,
    /// TCP port on which the native viewer and the web page fetch the stream; 0 takes a free one.
    pub grpc_port: u16,
    /// TCP port of the web page; 0 takes a free one.
    pub web_port: u16,
    /// Also write everything to this new `.rrd` file; one that is there is not written over.
    pub record: Option<PathBuf>,
    /// Most bytes of history kept for late observers, beside the scene; the oldest goes first.
    pub memory_limit_bytes: u64,
    /// Serve the stream and the web page. Without this and without `record` nothing is kept.
    pub serve: bool,
}

impl Default for MonitorOptions {
    fn default() -> MonitorOptions {
        MonitorOptions {
            bind: IpAddr::V4(Ipv4Addr::LOCALHOST),
            grpc_port: 9876,
            web_port: 9090,
            record: None,
            memory_limit_bytes: 128 * 1024 * 1024,
            serve: true,
        }
    }
}
