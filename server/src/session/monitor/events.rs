//! What happens in a session, as lines for the monitor's log: contacts, safety events, device faults, penetrations, stops without a force.
//!
//! Found by comparing the shared data with what it was at the last look, on the monitor's thread: the loops know nothing of it.
//! A contact shorter than the time between two looks goes unseen.

use std::sync::atomic::Ordering;
use std::time::Duration;

use taut_bridge::EventKind;

use super::Severity;
use crate::loops::incidents::line;
use crate::loops::statistics::Statistics;
use crate::report::said_of_stops;
use crate::shared::contact_snapshot::ContactSnapshot;

/// A contact begins when the gap is at most this many rest distances, and ends when it is more than the second number of them.
const CONTACT_BEGINS: f64 = 2.0;
const CONTACT_ENDS: f64 = 4.0;
/// Most lines about contacts per [`PERIOD`].
const MAX_CONTACT_LINES: u32 = 5;
/// Time over which lines are limited; the same incident is reported once in it.
const PERIOD: Duration = Duration::from_secs(1);

/// What was reported so far.
#[derive(Debug)]
pub(super) struct EventLog {
    rest_distance: f64,
    obstacles: Vec<ContactState>,
    contact_lines: ContactLines,
    incidents: [Repeated; EventKind::ALL.len()],
    penetrations: Repeated,
    stops: Repeated,
}

#[derive(Debug)]
struct ContactState {
    name: String,
    /// Smallest gap at this look; infinite when nothing is near.
    gap: f64,
    touching: bool,
}

/// How many lines about contacts there were in this period, and how many there would have been besides.
#[derive(Debug, Default)]
struct ContactLines {
    period_start: Duration,
    said: u32,
    unsaid: u32,
}

/// A count, as it was when it was reported last.
#[derive(Clone, Copy, Debug, Default)]
struct Repeated {
    reported: u64,
    reported_at: Option<Duration>,
}

impl Repeated {
    /// How much `count` has grown, if that is to be reported now.
    fn growth(&mut self, now: Duration, count: u64) -> Option<u64> {
        let is_early = self.reported_at.is_some_and(|at| now < at + PERIOD);
        if count <= self.reported || is_early {
            return None;
        }
        let growth = count - self.reported;
        (self.reported, self.reported_at) = (count, Some(now));
        Some(growth)
    }
}

impl EventLog {
    /// Nothing happened yet. Obstacles in the order of the world, lengths in metres.
    pub(super) fn new(obstacles: impl IntoIterator<Item = String>, rest_distance: f64) -> Self {
        let untouched = |name| ContactState {
            name,
            gap: f64::INFINITY,
            touching: false,
        };
        Self {
            rest_distance,
            obstacles: obstacles.into_iter().map(untouched).collect(),
            contact_lines: ContactLines::default(),
            incidents: Default::default(),
            penetrations: Repeated::default(),
            stops: Repeated::default(),
        }
    }

    /// Says what is new at session time `now`.
    pub(super) fn follow(
        &mut self,
        now: Duration,
        contacts: &ContactSnapshot,
        statistics: &Statistics,
        mut say: impl FnMut(Severity, &str),
    ) {
        self.follow_contacts(now, contacts, &mut say);
        for (kind, repeated) in EventKind::ALL.into_iter().zip(&mut self.incidents) {
            let incidents = &statistics.haptics.incidents;
            let Some(growth) = repeated.growth(now, incidents.of(kind)) else {
                continue;
            };
            let Some(newest) = incidents.newest(kind) else {
                continue;
            };
            let severity = if kind.is_warning() {
                Severity::Warning
            } else {
                Severity::Info
            };
            say(severity, &line(&newest, growth));
        }
        let checks = &statistics.checks;
        let count = checks.penetrations.load(Ordering::Relaxed);
        if self.penetrations.growth(now, count).is_some() {
            let obstacle = checks.first_penetrated.get().map_or("", String::as_str);
            say(
                Severity::Error,
                &format!(
                    "penetration: the god-object intersected \"{obstacle}\" first, {count} checked poses do by now"
                ),
            );
        }
        let stops = &statistics.god_object.stops_without_row;
        let growth = self.stops.growth(now, stops.load(Ordering::Relaxed));
        if let Some(stops) = growth.and_then(said_of_stops) {
            say(Severity::Error, &stops);
        }
    }

    fn follow_contacts(
        &mut self,
        now: Duration,
        contacts: &ContactSnapshot,
        say: &mut impl FnMut(Severity, &str),
    ) {
        for touch in &mut self.obstacles {
            touch.gap = f64::INFINITY;
        }
        for constraint in &contacts.set.constraints {
            let index = usize::from(constraint.features.obstacle);
            if let Some(touch) = self.obstacles.get_mut(index) {
                touch.gap = touch.gap.min(constraint.gap);
            }
        }
        let lines = &mut self.contact_lines;
        if now >= lines.period_start + PERIOD {
            if lines.unsaid > 0 {
                say(
                    Severity::Info,
                    &format!("contacts began or ended {} times more", lines.unsaid),
                );
            }
            *lines = ContactLines {
                period_start: now,
                ..ContactLines::default()
            };
        }
        for touch in &mut self.obstacles {
            let reach = if touch.touching {
                CONTACT_ENDS
            } else {
                CONTACT_BEGINS
            };
            let touching = touch.gap <= reach * self.rest_distance;
            if touching == touch.touching {
                continue;
            }
            touch.touching = touching;
            if lines.said == MAX_CONTACT_LINES {
                lines.unsaid += 1;
                continue;
            }
            lines.said += 1;
            let what = if touching { "begins" } else { "ends" };
            say(
                Severity::Info,
                &format!("contact with \"{}\" {what}", touch.name),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::contact_snapshot::constraint;
    use god_object::spatial::Pose;
    use taut_bridge::SafetyEvent;

    const REST: f64 = 1e-5;

    /// The log of a session with two obstacles, and the lines it has said.
    struct Watched {
        log: EventLog,
        statistics: Statistics,
        lines: Vec<(Severity, String)>,
    }

    impl Watched {
        fn new() -> Self {
            Self {
                log: EventLog::new(["box".to_owned(), "table".to_owned()], REST),
                statistics: Statistics::default(),
                lines: Vec::new(),
            }
        }

        /// Looks `at_ms` with this gap to the table; what is said then.
        fn look(&mut self, at_ms: u64, gap: f64) -> Vec<String> {
            let mut contacts = ContactSnapshot::at_start(&Pose::identity(), 4);
            contacts.set.constraints.push(constraint(1, gap));
            let before = self.lines.len();
            let lines = &mut self.lines;
            self.log.follow(
                Duration::from_millis(at_ms),
                &contacts,
                &self.statistics,
                |severity, line| lines.push((severity, line.to_owned())),
            );
            let new = &self.lines[before..];
            new.iter().map(|(_, line)| line.clone()).collect()
        }
    }

    #[test]
    fn a_contact_is_told_when_it_begins_and_when_it_ends() {
        let mut watched = Watched::new();
        assert_eq!(watched.look(0, 100.0 * REST), [""; 0]);
        assert_eq!(watched.look(20, REST), ["contact with \"table\" begins"]);
        assert_eq!(watched.look(40, 3.0 * REST), [""; 0], "it rests there");
        assert_eq!(
            watched.look(60, 5.0 * REST),
            ["contact with \"table\" ends"]
        );
        assert_eq!(watched.look(80, 3.0 * REST), [""; 0], "not yet again");
    }

    #[test]
    fn chattering_contacts_are_told_five_times_a_second_and_then_counted() {
        let mut watched = Watched::new();
        for look in 0..20u64 {
            let gap = if look % 2 == 0 { REST } else { 1.0 };
            watched.look(20 * look, gap);
        }
        assert_eq!(watched.lines.len(), 5, "{:?}", watched.lines);
        assert_eq!(
            watched.look(1000, 1.0),
            ["contacts began or ended 15 times more"]
        );
    }

    #[test]
    fn incidents_and_penetrations_are_told_once_and_counted_after() {
        let mut watched = Watched::new();
        let haptics = watched.statistics.haptics.clone();
        let lost = |number| SafetyEvent {
            number,
            time: Duration::from_millis(7),
            kind: EventKind::DeviceLost,
            value: 0.021,
        };
        haptics.incidents.count(&lost(1));
        assert_eq!(
            watched.look(0, 1.0),
            ["device: lost, the force fades (0.021 s) at 0.007 s, no. 1"]
        );
        haptics.incidents.count(&lost(2));
        haptics.incidents.count(&lost(3));
        assert_eq!(watched.look(20, 1.0), [""; 0], "reported a moment ago");
        let again = watched.look(1100, 1.0);
        assert!(
            again.len() == 1 && again[0].ends_with("(2 times)"),
            "{again:?}"
        );

        let checks = watched.statistics.checks.clone();
        assert!(checks.first_penetrated.set("box".to_owned()).is_ok());
        checks.penetrations.store(3, Ordering::Relaxed);
        let lines = watched.look(1200, 1.0);
        assert!(lines[0].contains("\"box\""), "{lines:?}");
        assert_eq!(
            watched.lines.last().map(|(severity, _)| *severity),
            Some(Severity::Error)
        );
        assert_eq!(watched.look(3000, 1.0), [""; 0]);

        let stops = watched.statistics.god_object.clone();
        stops.stops_without_row.store(4, Ordering::Relaxed);
        let lines = watched.look(4100, 1.0);
        assert!(lines[0].contains("in 4 updates"), "{lines:?}");
        assert_eq!(watched.look(6000, 1.0), [""; 0]);
    }
}
