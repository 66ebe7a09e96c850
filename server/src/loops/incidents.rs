//! What goes wrong in the haptics loop, by kind: counted there without waiting, told elsewhere.

use std::sync::atomic::{AtomicU64, Ordering};

use taut_bridge::{DeviceFault, SafetyEvent};

/// One kind of incident; each is counted when it begins, not on every tick that it lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incident {
    /// The coupling's wrench was not finite.
    WrenchNotFinite,
    /// The coupling's wrench or its constraints were too old.
    WrenchStale,
    /// The coupling's wrench came from the future.
    WrenchNotOnClock,
    /// Fresh wrenches came again.
    WrenchRecovered,
    /// The norm of the force was limited.
    ForceLimited,
    /// The norm of the torque was limited.
    TorqueLimited,
    /// No sample of the device has ever come.
    DeviceNotStarted,
    /// The device's samples stopped.
    DeviceLost,
    /// The device sent what is no pose.
    DeviceNotFinite,
    /// The device's time stamps make no sense.
    DeviceNotOnClock,
    /// The device said that it is faulty.
    DeviceReportedFault,
    /// The device's bridge was replaced.
    DeviceReconnected,
    /// The recorded trace ended.
    DeviceEnded,
    /// The device gives good samples again.
    DeviceBack,
}

impl Incident {
    /// All kinds, each at the place that its number says.
    pub const ALL: [Self; 14] = [
        Self::WrenchNotFinite,
        Self::WrenchStale,
        Self::WrenchNotOnClock,
        Self::WrenchRecovered,
        Self::ForceLimited,
        Self::TorqueLimited,
        Self::DeviceNotStarted,
        Self::DeviceLost,
        Self::DeviceNotFinite,
        Self::DeviceNotOnClock,
        Self::DeviceReportedFault,
        Self::DeviceReconnected,
        Self::DeviceEnded,
        Self::DeviceBack,
    ];

    /// What happened, for people.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::WrenchNotFinite => "safety: the computed force is not finite, so there is none",
            Self::WrenchStale => "safety: the computed force is too old and fades",
            Self::WrenchNotOnClock => "safety: the computed force is ahead of the clock and fades",
            Self::WrenchRecovered => "safety: fresh forces come, the force ramps in",
            Self::ForceLimited => "safety: the force is limited",
            Self::TorqueLimited => "safety: the torque is limited",
            Self::DeviceNotStarted => "device: no sample has come yet, there is no force",
            Self::DeviceLost => "device: lost, there is no force",
            Self::DeviceNotFinite => "device: its pose is not finite, there is no force",
            Self::DeviceNotOnClock => {
                "device: its time stamps are not on this clock, there is no force"
            }
            Self::DeviceReportedFault => {
                "device: it reports a fault at the far end, there is no force"
            }
            Self::DeviceReconnected => "device: its bridge has just reconnected",
            Self::DeviceEnded => "device: the recorded trace ended, there is no force",
            Self::DeviceBack => "device: good samples come",
        }
    }

    /// Whether it is part of normal work.
    pub fn is_good_news(self) -> bool {
        matches!(
            self,
            Self::WrenchRecovered | Self::DeviceBack | Self::DeviceReconnected
        )
    }
}

impl From<&SafetyEvent> for Incident {
    fn from(event: &SafetyEvent) -> Self {
        match event {
            SafetyEvent::NotFinite => Self::WrenchNotFinite,
            SafetyEvent::Stale { .. } => Self::WrenchStale,
            SafetyEvent::TimeNotOnClock => Self::WrenchNotOnClock,
            SafetyEvent::Recovered => Self::WrenchRecovered,
            SafetyEvent::ForceLimited { .. } => Self::ForceLimited,
            SafetyEvent::TorqueLimited { .. } => Self::TorqueLimited,
        }
    }
}

impl From<&DeviceFault> for Incident {
    fn from(fault: &DeviceFault) -> Self {
        match fault {
            DeviceFault::NotStarted => Self::DeviceNotStarted,
            DeviceFault::Lost { .. } => Self::DeviceLost,
            DeviceFault::NotFinite => Self::DeviceNotFinite,
            DeviceFault::TimeNotOnClock => Self::DeviceNotOnClock,
            DeviceFault::ReportedFault | DeviceFault::Strings(_) => Self::DeviceReportedFault,
            DeviceFault::Reconnected => Self::DeviceReconnected,
            DeviceFault::Ended => Self::DeviceEnded,
        }
    }
}

/// How often each kind began. One writer; any thread may read.
#[derive(Debug, Default)]
pub struct IncidentCounts([AtomicU64; Incident::ALL.len()]);

impl IncidentCounts {
    /// Counts one. Wait-free.
    pub fn count(&self, incident: Incident) {
        self.0[incident as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// How often this kind began.
    pub fn of(&self, incident: Incident) -> u64 {
        self.0[incident as usize].load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_has_a_count_of_its_own() {
        let counts = IncidentCounts::default();
        for (place, incident) in Incident::ALL.into_iter().enumerate() {
            assert_eq!(place, incident as usize);
            for _ in 0..=place {
                counts.count(incident);
            }
        }
        for (place, incident) in Incident::ALL.into_iter().enumerate() {
            assert_eq!(counts.of(incident), place as u64 + 1, "{incident:?}");
        }
    }
}
