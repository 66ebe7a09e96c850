//! What a running session measures: the loops' part of the end report, the network's counts, and the process's own needs.
//!
//! Taken once a second by the thread that looks after the session; read as text for Prometheus (OpenMetrics), and as lines of JSON.

use std::fmt;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric, text};
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::{ConstGauge, Gauge};
use prometheus_client::registry::{Registry, Unit};
use serde::Serialize;
use taut_link::{ClientStatus, Distribution};

use crate::report::SessionReport;
use crate::report::external::ExternalWrenchReport;

/// Time between two measurements.
pub(crate) const PERIOD: Duration = Duration::from_secs(1);

/// One measurement. As JSON, its keys are those of the end report and further ones; they may grow, and keep their meaning.
#[derive(Clone, Debug, Serialize)]
pub struct Metrics {
    /// Wall clock, s since 1970.
    pub time_s: f64,
    /// The loops since the start, under the end report's keys.
    #[serde(flatten)]
    pub session: SessionReport,
    /// What happened on the network since the start, by name.
    pub network: std::collections::BTreeMap<&'static str, u64>,
    /// Clients that are in.
    pub clients_present: u64,
    /// Round trip and drops of each client.
    pub client_links: Vec<ClientLink>,
    /// Those who look on with a browser.
    pub stream_observers: u64,
    /// Those of them that were given up because they took nothing.
    pub stream_observers_dropped: u64,
    /// Lines of the log that were lost because nobody took them.
    pub log_lines_lost: u64,
    /// Memory in RAM, bytes.
    pub memory_bytes: u64,
    /// Open file descriptors.
    pub open_files: u64,
}

/// The link to one client.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ClientLink {
    /// Its name.
    pub node: String,
    /// Its role.
    pub role: String,
    /// Round trip, ms.
    pub round_trip_ms: f64,
    /// Datagrams that the system did not take.
    pub send_errors: u64,
    /// States that it reports lost.
    pub packets_lost: u64,
    /// 99th percentile of the age of the state that it drew, ms, over its last second.
    pub pose_age_p99_ms: f64,
    /// Where its control plane comes from.
    pub address: String,
    /// How long it has been in, s.
    pub present_s: f64,
    /// How long ago it was heard last, s.
    pub heard_s: f64,
}

impl ClientLink {
    /// As the server sees it at session time `now`.
    pub fn of(status: &ClientStatus, now: Duration) -> Self {
        let stats = status.stats.as_ref();
        let since = |ns: u64| now.saturating_sub(Duration::from_nanos(ns)).as_secs_f64();
        Self {
            node: status.node.clone(),
            role: status.role.to_string(),
            round_trip_ms: status.round_trip_us as f64 * 1e-3,
            send_errors: status.send_errors,
            packets_lost: stats.map_or(0, |stats| stats.packets_lost),
            pose_age_p99_ms: stats.map_or(0.0, |stats| f64::from(stats.pose_age_ms_p99)),
            address: status.address.to_string(),
            present_s: since(status.joined_ns),
            heard_s: since(status.last_heard_ns),
        }
    }
}

impl Metrics {
    /// As Prometheus reads it.
    ///
    /// # Errors
    /// The text cannot be made; nothing that a user could mend.
    pub fn text(&self) -> Result<String, fmt::Error> {
        let mut registry = Registry::with_prefix("taut");
        registry.register_collector(Box::new(Exposition(self.clone())));
        let mut page = String::new();
        text::encode(&mut page, &registry)?;
        Ok(page)
    }
}

/// Seconds since 1970, by the system's clock.
pub(crate) fn wall_clock_s() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.unwrap_or_default().as_secs_f64()
}

/// Memory in RAM and open files of this process; 0 where the system does not say.
pub(crate) fn process() -> (u64, u64) {
    let pages = std::fs::read_to_string("/proc/self/statm")
        .ok()
        .and_then(|text| {
            let resident = text.split_whitespace().nth(1)?;
            resident.parse::<u64>().ok()
        });
    let files = std::fs::read_dir("/proc/self/fd").map_or(0, |list| list.count() as u64);
    (pages.unwrap_or(0) * page_bytes(), files.saturating_sub(1)) // one is the listing's own
}

#[allow(unsafe_code, reason = "asks the system for a constant")]
fn page_bytes() -> u64 {
    // SAFETY: `sysconf` takes any number and touches no memory of ours.
    u64::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).unwrap_or(4096)
}

#[derive(Debug)]
struct Exposition(Metrics);

type Labels = [(&'static str, String); 1];

impl Collector for Exposition {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let (metrics, session) = (&self.0, &self.0.session);
        let to = &mut encoder;
        rates(to, session)?;
        times(to, session)?;
        felt(to, session)?;
        counts(to, metrics)?;
        if let Some(external) = &session.external_wrench {
            external_wrench(to, external)?;
        }
        network(to, metrics)?;
        clients(to, metrics)?;
        this_process(to, metrics)
    }
}

/// How long and how fast the loops run.
fn rates(to: &mut DescriptorEncoder<'_>, session: &SessionReport) -> fmt::Result {
    gauge(
        to,
        "session_duration",
        "how long the loops have run",
        Some(Unit::Seconds),
        session.duration_s,
    )?;
    gauge(
        to,
        "haptics_rate",
        "ticks of the haptics loop per second since the start",
        Some(HERTZ()),
        session.haptics_hz,
    )?;
    gauge(
        to,
        "god_object_rate",
        "god-object updates per second since the start",
        Some(HERTZ()),
        session.god_object_hz,
    )
}

/// Periods, computing times and latencies of the loops.
fn times(to: &mut DescriptorEncoder<'_>, session: &SessionReport) -> fmt::Result {
    for (name, help, of) in [
        (
            "haptics_period",
            "time between two ticks of the haptics loop",
            &session.haptics_period_us,
        ),
        (
            "god_object_update",
            "thread CPU time of a god-object update",
            &session.god_object_update_us,
        ),
        (
            "force_computation",
            "thread CPU time of one force",
            &session.force_us,
        ),
        (
            "answer_wait",
            "reading of a device sample to the start of its force",
            &session.answer_wait_us,
        ),
        (
            "force_latency",
            "reading of a device sample to the rendering of its force",
            &session.force_latency_us,
        ),
        (
            "constraint_latency",
            "device sample to the rendering of a force whose constraints answer it",
            &session.constraint_latency_us,
        ),
        (
            "constraint_age",
            "age of the constraint set that a force rests on",
            &session.constraint_age_us,
        ),
    ] {
        quantiles(to, name, help, of)?;
    }
    Ok(())
}

/// Force and energy at the hand.
fn felt(to: &mut DescriptorEncoder<'_>, session: &SessionReport) -> fmt::Result {
    gauge(
        to,
        "largest_force",
        "largest norm of a force that the hand felt since the start",
        Some(Unit::Other("newtons".to_owned())),
        session.largest_force_n,
    )?;
    gauge(
        to,
        "energy_injected",
        "energy given to the hand beyond what it had put in",
        Some(Unit::Joules),
        session.energy_injected_j,
    )?;
    gauge(
        to,
        "energy_generated",
        "energy that the coupling made",
        Some(Unit::Joules),
        session.energy_generated_j,
    )
}

/// What must stay rare.
fn counts(to: &mut DescriptorEncoder<'_>, metrics: &Metrics) -> fmt::Result {
    for (name, help, count) in [
        (
            "deadline_misses",
            "deadlines of the haptics loop without a tick in their period",
            metrics.session.deadline_misses,
        ),
        (
            "safety_events",
            "times at which the safety stage or a device fault changed the force",
            metrics.session.safety_events,
        ),
        (
            "penetrations",
            "published poses at which the bodies intersect",
            metrics.session.penetrations,
        ),
        (
            "penetration_checks",
            "published poses that were checked",
            metrics.session.penetration_checks,
        ),
        (
            "stops_without_force",
            "updates in which something stopped the body that gives no force",
            metrics.session.stops_without_force,
        ),
        (
            "solver_fallbacks",
            "projections that the chosen solver did not certify",
            metrics.session.solver_fallbacks,
        ),
        (
            "log_lines_lost",
            "log lines that nobody took",
            metrics.log_lines_lost,
        ),
        (
            "stream_observers_dropped",
            "observers given up because they took nothing",
            metrics.stream_observers_dropped,
        ),
    ] {
        counter(to, name, help, count)?;
    }
    Ok(())
}

fn network(to: &mut DescriptorEncoder<'_>, metrics: &Metrics) -> fmt::Result {
    for (name, count) in &metrics.network {
        counter(
            to,
            &format!("network_{name}"),
            "counted on the network since the start",
            *count,
        )?;
    }
    Ok(())
}

/// Who is in, and how its link fares.
fn clients(to: &mut DescriptorEncoder<'_>, metrics: &Metrics) -> fmt::Result {
    gauge(
        to,
        "clients",
        "clients that are in",
        None,
        metrics.clients_present as f64,
    )?;
    gauge(
        to,
        "stream_observers",
        "observers of the JSON lines",
        None,
        metrics.stream_observers as f64,
    )?;
    let links = |value: fn(&ClientLink) -> f64| {
        metrics
            .client_links
            .iter()
            .map(move |link| ([("node", link.node.clone())], value(link)))
    };
    labelled(
        to,
        "client_round_trip",
        "round trip to a client",
        Some(Unit::Seconds),
        links(|link| 1e-3 * link.round_trip_ms),
    )?;
    labelled(
        to,
        "client_pose_age_p99",
        "age of the state that a node drew, 99th percentile of its last second",
        Some(Unit::Seconds),
        links(|link| 1e-3 * link.pose_age_p99_ms),
    )?;
    labelled(
        to,
        "client_send_errors",
        "datagrams that the system did not take for a client",
        None,
        links(|link| link.send_errors as f64),
    )?;
    labelled(
        to,
        "client_packets_lost",
        "states that a client reports lost",
        None,
        links(|link| link.packets_lost as f64),
    )
}

/// What the program takes of the machine.
fn this_process(to: &mut DescriptorEncoder<'_>, metrics: &Metrics) -> fmt::Result {
    gauge(
        to,
        "process_memory",
        "memory in RAM",
        Some(Unit::Bytes),
        metrics.memory_bytes as f64,
    )?;
    gauge(
        to,
        "process_open_files",
        "open file descriptors",
        None,
        metrics.open_files as f64,
    )
}

fn external_wrench(to: &mut DescriptorEncoder<'_>, of: &ExternalWrenchReport) -> fmt::Result {
    gauge(
        to,
        "wrench_in_age",
        "age of the force from outside that is felt now; NaN while none is",
        Some(Unit::Seconds),
        of.age_ms.map_or(f64::NAN, |ms| 1e-3 * ms),
    )?;
    gauge(
        to,
        "wrench_in_force",
        "norm of the force from outside that is added now",
        Some(Unit::Other("newtons".to_owned())),
        of.force_n,
    )?;
    for (name, help, count) in [
        (
            "wrench_in_taken",
            "values from outside that were felt",
            of.taken,
        ),
        (
            "wrench_in_lost",
            "values from outside that never came",
            of.lost,
        ),
        (
            "wrench_in_dropped",
            "values from outside that were overtaken, came again or could not be read",
            of.dropped,
        ),
    ] {
        counter(to, name, help, count)?;
    }
    let refused = of.refused.iter();
    labelled(
        to,
        "wrench_in_refused",
        "values from outside that were not felt",
        None,
        refused.map(|(why, count)| ([("reason", why.clone())], *count as f64)),
    )
}

#[allow(
    non_snake_case,
    reason = "a constant in all but the type, which holds a string"
)]
fn HERTZ() -> Unit {
    Unit::Other("hertz".to_owned())
}

fn metric(
    to: &mut DescriptorEncoder<'_>,
    name: &str,
    help: &str,
    unit: Option<&Unit>,
    value: &impl EncodeMetric,
) -> fmt::Result {
    value.encode(to.encode_descriptor(name, help, unit, value.metric_type())?)
}

fn gauge(
    to: &mut DescriptorEncoder<'_>,
    name: &str,
    help: &str,
    unit: Option<Unit>,
    value: f64,
) -> fmt::Result {
    metric(to, name, help, unit.as_ref(), &ConstGauge::new(value))
}

fn counter(to: &mut DescriptorEncoder<'_>, name: &str, help: &str, value: u64) -> fmt::Result {
    metric(to, name, help, None, &ConstCounter::new(value))
}

fn labelled(
    to: &mut DescriptorEncoder<'_>,
    name: &str,
    help: &str,
    unit: Option<Unit>,
    values: impl Iterator<Item = (Labels, f64)>,
) -> fmt::Result {
    let family = Family::<Labels, Gauge<f64, std::sync::atomic::AtomicU64>>::default();
    for (labels, value) in values {
        family.get_or_create(&labels).set(value);
    }
    metric(to, name, help, unit.as_ref(), &family)
}

/// Quantiles since the start; the distribution is given in us.
fn quantiles(
    to: &mut DescriptorEncoder<'_>,
    name: &str,
    help: &str,
    of: &Distribution,
) -> fmt::Result {
    let values = [
        ("0.5", of.p50),
        ("0.99", of.p99),
        ("0.999", of.p999),
        ("1", of.max),
    ];
    let values = values.map(|(quantile, us)| ([("quantile", quantile.to_owned())], 1e-6 * us));
    labelled(to, name, help, Some(Unit::Seconds), values.into_iter())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metrics() -> Metrics {
        let us = |p50| Distribution {
            p50,
            p99: 2.0 * p50,
            p999: 3.0 * p50,
            max: 4.0 * p50,
            count: 7,
        };
        Metrics {
            time_s: 1.0,
            session: SessionReport {
                haptics_hz: 999.5,
                haptics_period_us: us(1000.0),
                deadline_misses: 3,
                ..SessionReport::default()
            },
            network: [("forged", 5)].into(),
            clients_present: 2,
            client_links: vec![ClientLink {
                node: "a\"b\\c\nd".to_owned(),
                round_trip_ms: 0.5,
                ..ClientLink::default()
            }],
            stream_observers: 1,
            stream_observers_dropped: 0,
            log_lines_lost: 9,
            memory_bytes: 1 << 20,
            open_files: 12,
        }
    }

    #[test]
    fn prometheus_reads_units_quantiles_counts_and_labels() {
        let text = metrics().text().expect("text");
        for line in [
            "taut_haptics_rate_hertz 999.5",
            "# TYPE taut_haptics_period_seconds gauge",
            "taut_haptics_period_seconds{quantile=\"0.99\"} 0.002",
            "taut_deadline_misses_total 3",
            "taut_network_forged_total 5",
            "taut_log_lines_lost_total 9",
            "taut_clients 2.0",
            "taut_process_memory_bytes 1048576.0",
            // What a name may hold is escaped as the format says.
            "taut_client_round_trip_seconds{node=\"a\\\"b\\\\c\\nd\"} 0.0005",
        ] {
            assert!(text.lines().any(|found| found == line), "{line} in\n{text}");
        }
        assert!(text.ends_with("# EOF\n"));
    }

    #[test]
    fn a_line_of_json_has_the_end_report_s_keys() {
        let line = serde_json::to_value(metrics()).expect("JSON");
        assert_eq!(line["haptics_period_us"]["p99"], 2000.0);
        assert_eq!(line["network"]["forged"], 5);
        assert_eq!(line["memory_bytes"], 1 << 20);
    }

    #[test]
    fn the_process_knows_what_it_takes() {
        let (memory, files) = process();
        assert!(memory > 1 << 20 && files > 2, "{memory} {files}");
    }
}
