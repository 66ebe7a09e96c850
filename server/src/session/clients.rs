//! What the clients of a session reported, for the end report.
//!
//! A client reports about once a second. Its distributions here are made of those reports: the median of the seconds' medians, the
//! largest of the seconds' 99th percentiles, and the largest of all for p99.9 and max.

use taut_link::proto::barrier::MAX_MEMBERS;
use taut_link::{ClientStats, ClientStatus, Distribution, LinkEvent, Role, Transport};

use crate::report::ClientReport;
use crate::shared::timing::Histogram;

/// Names that are remembered: as many as may be in at once, and those who left last. Beyond it the one that was heard of longest ago is forgotten.
const MAX_REMEMBERED: usize = 256;
/// Reports are in milliseconds, histograms in nanoseconds.
const NS_PER_MS: f64 = 1e6;

/// The clients of a session by name, in the order in which they joined. Its memory does not grow with time.
#[derive(Debug, Default)]
pub(super) struct ClientLedger {
    clients: Vec<ClientRecord>,
    /// Counts what was heard of clients: who is forgotten first.
    heard: u64,
    /// Those that are remembered no more, but for render nodes and bridges.
    forgotten_observers: u64,
}

#[derive(Debug)]
struct ClientRecord {
    node: String,
    role: Role,
    transport: Transport,
    newest: ClientStats,
    state_hash_mismatches: u64,
    pose_ages: AgesMs,
    drawn_ages: AgesMs,
    heard: u64,
}

/// One age, of all reports of a client.
#[derive(Debug, Default)]
struct AgesMs {
    /// Made with the first report: most clients make none.
    medians: Option<Histogram>,
    p99: f64,
    max: f64,
}

impl AgesMs {
    fn follow(&mut self, median: f32, p99: f32, max: f32) {
        // What is no number counts as 0.
        self.medians
            .get_or_insert_default()
            .record((f64::from(median.max(0.0)) * NS_PER_MS) as u64);
        self.p99 = self.p99.max(f64::from(p99));
        self.max = self.max.max(f64::from(max));
    }
}

impl ClientLedger {
    /// Notes an event; the line that tells it, if it is worth one.
    pub(super) fn follow(&mut self, event: &LinkEvent) -> Option<String> {
        match event {
            LinkEvent::Joined(status) => {
                self.note(status);
                Some(format!(
                    "{} joined as {} over {} from {}",
                    status.node,
                    status.role.title(),
                    transport_name(status.transport),
                    status.address
                ))
            }
            LinkEvent::Left { status, reason } => {
                self.note(status);
                Some(format!(
                    "{} ({} over {}) left: {reason}",
                    status.node,
                    status.role.title(),
                    transport_name(status.transport)
                ))
            }
            LinkEvent::Silent { node, silence } => Some(format!(
                "{node} has been silent for {} ms",
                silence.as_millis()
            )),
            LinkEvent::Refused {
                address,
                node,
                text,
                ..
            } => Some(if node == "" {
                format!("a client at {address} was refused: {text}")
            } else {
                format!("{node} at {address} was refused: {text}")
            }),
            LinkEvent::Forbidden { node, role, act } => Some(format!(
                "{node} ({}) tried to {act}, which its role may not: refused",
                role.title()
            )),
            LinkEvent::Stats { node, stats } => {
                self.follow_stats(node, stats);
                None
            }
            LinkEvent::Log { node, event } => Some(format!("{node}: {}", event.text)),
            LinkEvent::FreeRunning { node, free: true } => Some(format!(
                "{node} runs free: it draws fewer frames than the least rate, or than it says (--fps); the others do not wait for it"
            )),
            LinkEvent::FreeRunning { node, free: false } => {
                Some(format!("{node} is in step with the others again"))
            }
            LinkEvent::NoPlace { node } => Some(format!(
                "{node} swaps on its own: {MAX_MEMBERS} nodes swap together already, and there is no place for more"
            )),
            LinkEvent::StatesForged { node } => Some(format!(
                "{node} says that a member of the multicast group forges this server's states: it takes them by unicast until the membership changes; look at who is in"
            )),
            LinkEvent::Arm { node, arm: true } => Some(format!("{node} asks for force")),
            LinkEvent::Arm { node, arm: false } => Some(format!("{node} asks for no force")),
        }
    }

    /// Notes how the clients are now.
    pub(super) fn look_at(&mut self, clients: &[ClientStatus]) {
        for status in clients {
            self.note(status);
        }
    }

    fn note(&mut self, status: &ClientStatus) {
        let known = self
            .clients
            .iter()
            .position(|client| client.node == status.node);
        let index = known.unwrap_or_else(|| {
            self.make_room();
            self.clients.push(ClientRecord::new(status));
            self.clients.len() - 1
        });
        self.heard += 1;
        let client = &mut self.clients[index];
        client.heard = self.heard;
        client.state_hash_mismatches = status.state_hash_mismatches;
        client.transport = status.transport;
        if let Some(stats) = &status.stats {
            client.newest = stats.clone();
        }
    }

    fn make_room(&mut self) {
        if self.clients.len() < MAX_REMEMBERED {
            return;
        }
        let order = self.clients.iter().enumerate();
        if let Some((oldest, _)) = order.min_by_key(|(_, client)| client.heard) {
            let forgotten = self.clients.remove(oldest);
            self.forgotten_observers += u64::from(forgotten.observes());
        }
    }

    fn follow_stats(&mut self, node: &str, stats: &ClientStats) {
        let Some(client) = self.clients.iter_mut().find(|client| client.node == node) else {
            return;
        };
        client.newest = stats.clone();
        if stats.fps == 0.0 {
            return; // a second without a frame has no ages
        }
        client.pose_ages.follow(
            stats.pose_age_ms_p50,
            stats.pose_age_ms_p99,
            stats.pose_age_ms_max,
        );
        client.drawn_ages.follow(
            stats.drawn_age_ms_p50,
            stats.drawn_age_ms_p99,
            stats.drawn_age_ms_max,
        );
    }

    /// One report per render node or bridge that is remembered, in the order in which they joined, and the number of all others.
    pub(super) fn reports(&self) -> (Vec<ClientReport>, u64) {
        let reports = self
            .clients
            .iter()
            .filter(|client| !client.observes())
            .map(ClientRecord::report)
            .collect();
        let observers = self.clients.iter().filter(|client| client.observes());
        (reports, self.forgotten_observers + observers.count() as u64)
    }
}

impl ClientRecord {
    fn new(status: &ClientStatus) -> Self {
        Self {
            node: status.node.clone(),
            role: status.role,
            transport: status.transport,
            newest: ClientStats::default(),
            state_hash_mismatches: 0,
            pose_ages: AgesMs::default(),
            drawn_ages: AgesMs::default(),
            heard: 0,
        }
    }

    /// Whether it has no report of its own.
    fn observes(&self) -> bool {
        !matches!(self.role, Role::Render | Role::Device)
    }

    fn report(&self) -> ClientReport {
        let frames = self.newest.frames;
        let of_ages = |ages: &AgesMs| {
            let medians = ages.medians.as_ref().map(Histogram::distribution);
            Distribution {
                p50: medians.unwrap_or_default().p50 / NS_PER_MS,
                p99: ages.p99,
                p999: ages.max,
                max: ages.max,
                count: frames,
            }
        };
        ClientReport {
            node: self.node.clone(),
            draws: self.role == Role::Render,
            transport: transport_name(self.transport).into(),
            frames,
            fps: f64::from(self.newest.fps),
            pose_age_ms: of_ages(&self.pose_ages),
            drawn_age_ms: of_ages(&self.drawn_ages),
            swap_skew_us: None, // the barrier's own measure: `frames::FramesReport::new`
            light_skew_us: None, // the same
            free_running: false, // the same
            packets_lost: self.newest.packets_lost,
            state_hash_mismatches: self.state_hash_mismatches,
        }
    }
}

fn transport_name(transport: Transport) -> &'static str {
    match transport {
        Transport::Udp => "udp",
        Transport::QuicDatagram => "quic",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(node: &str, role: Role) -> LinkEvent {
        LinkEvent::Joined(ClientStatus {
            session: 1,
            node: node.into(),
            role,
            grant: taut_link::proto::proof::Grant::Master,
            transport: Transport::QuicDatagram,
            rate_hz: 0,
            address: ([127, 0, 0, 1], 1000).into(),
            udp_address: None,
            joined_ns: 0,
            last_heard_ns: 0,
            round_trip_us: 0,
            packets_sent: 0,
            bytes_sent: 0,
            by_multicast: false,
            lowered_rate: false,
            send_errors: 0,
            stats: None,
            state_hash_matches: 0,
            state_hash_mismatches: 3,
        })
    }

    fn stats(node: &str, frames: u64, age_ms: f32) -> LinkEvent {
        let stats = ClientStats {
            frames,
            fps: 60.0,
            pose_age_ms_p50: age_ms,
            pose_age_ms_p99: 2.0 * age_ms,
            pose_age_ms_max: 3.0 * age_ms,
            drawn_age_ms_p50: 4.0 * age_ms,
            drawn_age_ms_p99: 5.0 * age_ms,
            drawn_age_ms_max: 6.0 * age_ms,
            ..ClientStats::default()
        };
        LinkEvent::Stats {
            node: node.into(),
            stats,
        }
    }

    #[test]
    fn a_client_is_reported_from_all_its_reports_even_after_it_left() {
        let mut ledger = ClientLedger::default();
        assert!(
            ledger
                .follow(&joined("left", Role::Render))
                .is_some_and(|line| line.contains("left joined as render node over quic"))
        );
        ledger.follow(&joined("watcher", Role::Observer));
        for (frames, age) in [(60, 8.0), (120, 9.0), (180, 20.0)] {
            assert_eq!(ledger.follow(&stats("left", frames, age)), None);
        }
        let (reports, observers) = ledger.reports();
        assert_eq!(observers, 1);
        assert_eq!(reports.len(), 1);
        let report = &reports[0];
        assert_eq!(
            (
                report.frames,
                report.transport.as_str(),
                report.state_hash_mismatches
            ),
            (180, "quic", 3)
        );
        for (age, median, p99, max) in [
            (report.pose_age_ms, 9.0, 40.0, 60.0),
            (report.drawn_age_ms, 36.0, 100.0, 120.0),
        ] {
            // The width of a histogram's bucket.
            assert!((age.p50 / median - 1.0).abs() < 0.016, "{age:?}");
            assert_eq!((age.p99, age.p999, age.max), (p99, max, max));
            assert_eq!(age.count, 180);
        }
    }

    #[test]
    fn clients_that_come_and_go_for_years_take_no_more_room() {
        let mut ledger = ClientLedger::default();
        ledger.follow(&joined("left", Role::Render));
        for number in 0..10 * MAX_REMEMBERED {
            ledger.follow(&joined(&format!("watcher-{number}"), Role::Observer));
            // Who is here is seen ten times a second, and is not forgotten for those who went.
            ledger.follow(&joined("left", Role::Render));
        }
        assert_eq!(ledger.clients.len(), MAX_REMEMBERED);
        let (reports, observers) = ledger.reports();
        assert_eq!(reports.len(), 1);
        assert_eq!(observers, 10 * MAX_REMEMBERED as u64);
    }
}
