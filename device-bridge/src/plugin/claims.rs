//! What a library may say of its device, and which of its samples are ones.

use crate::device::DeviceLimits;

/// `TAUT_DEVICE_HAS_ANGULAR_VELOCITY`.
const HAS_ANGULAR_VELOCITY: u32 = 1;
/// Largest position along an axis, m.
const MAX_POSITION: f64 = 10.0;
/// Largest velocity along an axis, m/s.
const MAX_VELOCITY: f64 = 100.0;
/// Largest angular velocity about an axis, rad/s.
const MAX_ANGULAR_VELOCITY: f64 = 1000.0;
/// Of a quaternion's length.
const UNIT_TOLERANCE: f64 = 1e-3;
/// From this age on a sample is nothing new, s.
const STALE: f64 = 0.02;
/// An age beyond this is none, s.
const MAX_AGE: f64 = 1.0;

/// `taut_device_info`.
#[repr(C)]
pub(super) struct RawInfo {
    pub(super) name: [u8; 64],
    pub(super) sensed: u32,
    pub(super) actuated: u32,
    pub(super) max_force: f64,
    pub(super) max_torque: f64,
    pub(super) max_stiffness: f64,
    pub(super) max_rotational_stiffness: f64,
    pub(super) rate: f64,
}

/// `taut_device_sample`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct RawSample {
    pub(super) position: [f64; 3],
    pub(super) orientation: [f64; 4],
    pub(super) velocity: [f64; 3],
    pub(super) angular_velocity: [f64; 3],
    pub(super) age: f64,
    pub(super) buttons: u32,
    pub(super) measured: u32,
}

impl RawInfo {
    /// What a library gets: a number that it does not set is none.
    pub(super) const UNSET: Self = Self {
        name: [0; 64],
        sensed: 0,
        actuated: 0,
        max_force: f64::NAN,
        max_torque: f64::NAN,
        max_stiffness: f64::NAN,
        max_rotational_stiffness: f64::NAN,
        rate: f64::NAN,
    };
}

impl RawSample {
    /// What a library gets: a number that it does not set is none.
    pub(super) const UNSET: Self = Self {
        position: [f64::NAN; 3],
        orientation: [f64::NAN; 4],
        velocity: [f64::NAN; 3],
        angular_velocity: [f64::NAN; 3],
        age: f64::NAN,
        buttons: 0,
        measured: 0,
    };
}

/// The text before the first 0.
pub(super) fn until_zero(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0);
    String::from_utf8_lossy(&bytes[..end.unwrap_or(bytes.len())])
        .trim()
        .to_owned()
}

/// What a library says of its device and no device is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Claim {
    /// Degrees of freedom.
    #[error(
        "{sensed} degrees of freedom sensed and {actuated} actuated, but 3 or 6 are sensed, and 0, 3 or 6 actuated, no more than sensed"
    )]
    Freedoms {
        /// As said.
        sensed: u32,
        /// As said.
        actuated: u32,
    },
    /// A number.
    #[error("{what} is {value}, but must be from {low} to {high}")]
    Number {
        /// Which.
        what: &'static str,
        /// As said.
        value: f64,
        /// Least.
        low: f64,
        /// Largest.
        high: f64,
    },
}

/// What a library's device is.
#[derive(Clone, Debug, PartialEq)]
pub struct PluginInfo {
    /// For people.
    pub name: String,
    /// It measures an orientation.
    pub with_orientation: bool,
    /// It has motors.
    pub has_motors: bool,
    /// What it bears, in its own metres.
    pub limits: DeviceLimits,
    /// At which it may be called, Hz.
    pub rate_hz: f64,
}

impl PluginInfo {
    /// What `raw` says, where a device can be so.
    pub(super) fn of(raw: &RawInfo) -> Result<Self, Claim> {
        let (sensed, actuated) = (raw.sensed, raw.actuated);
        if !([3, 6].contains(&sensed) && [0, 3, 6].contains(&actuated) && actuated <= sensed) {
            return Err(Claim::Freedoms { sensed, actuated });
        }
        let within = |what, value: f64, low, high| {
            // False for NaN.
            if (low..=high).contains(&value) {
                Ok(value)
            } else {
                Err(Claim::Number {
                    what,
                    value,
                    low,
                    high,
                })
            }
        };
        let mut limits = DeviceLimits::UNLIMITED;
        if actuated > 0 {
            limits = DeviceLimits {
                max_force: within("max_force", raw.max_force, 1e-3, 1e3)?,
                max_stiffness: within("max_stiffness", raw.max_stiffness, 1e-3, 1e6)?,
                max_torque: 0.0,
                max_rotational_stiffness: 0.0,
            };
        }
        if actuated == 6 {
            limits.max_torque = within("max_torque", raw.max_torque, 1e-6, 1e2)?;
            let stiffness = raw.max_rotational_stiffness;
            limits.max_rotational_stiffness =
                within("max_rotational_stiffness", stiffness, 1e-6, 1e4)?;
        }
        let name: String = until_zero(&raw.name)
            .chars()
            .filter(|letter| !letter.is_control())
            .collect();
        Ok(Self {
            name: if name.is_empty() {
                "a plug-in's device without a name".to_owned()
            } else {
                name
            },
            with_orientation: sensed == 6,
            has_motors: actuated > 0,
            limits,
            rate_hz: within("rate", raw.rate, 200.0, 1e5)?,
        })
    }
}

/// What a sample is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Worth {
    /// It may be used.
    Good,
    /// Too old.
    Stale,
    /// Not finite, out of range, or no rotation.
    NotFinite,
}

impl RawSample {
    /// Its worth for a device that does or does not measure an orientation.
    pub(super) fn worth(&self, with_orientation: bool) -> Worth {
        let within = |parts: &[f64], most: f64| parts.iter().all(|part| part.abs() <= most);
        let norm = self.orientation.iter().map(|q| q * q).sum::<f64>().sqrt();
        let turns = self
            .turning()
            .is_none_or(|turning| within(&turning, MAX_ANGULAR_VELOCITY));
        let good = within(&self.position, MAX_POSITION)
            && within(&self.velocity, MAX_VELOCITY)
            && turns
            && (!with_orientation || (norm - 1.0).abs() <= UNIT_TOLERANCE)
            && (0.0..=MAX_AGE).contains(&self.age);
        match good {
            false => Worth::NotFinite,
            true if self.age >= STALE => Worth::Stale,
            true => Worth::Good,
        }
    }

    /// The angular velocity, where it is measured.
    pub(super) fn turning(&self) -> Option<[f64; 3]> {
        (self.measured & HAS_ANGULAR_VELOCITY != 0).then_some(self.angular_velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const INFO: RawInfo = RawInfo {
        name: [b'a'; 64],
        sensed: 6,
        actuated: 6,
        max_force: 10.0,
        max_torque: 0.4,
        max_stiffness: 2000.0,
        max_rotational_stiffness: 2.0,
        rate: 1000.0,
    };
    const SAMPLE: RawSample = RawSample {
        position: [0.0; 3],
        orientation: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        age: 0.0,
        ..RawSample::UNSET
    };

    #[test]
    fn what_no_device_is_is_refused() {
        const NUMBERS: [fn(&mut RawInfo) -> &mut f64; 5] = [
            |info| &mut info.max_force,
            |info| &mut info.max_torque,
            |info| &mut info.max_stiffness,
            |info| &mut info.max_rotational_stiffness,
            |info| &mut info.rate,
        ];
        assert_eq!(PluginInfo::of(&INFO).expect("it fits").name.len(), 64);
        for (sensed, actuated) in [(0, 0), (3, 6), (6, 4), (7, 6), (u32::MAX, 3)] {
            let info = RawInfo {
                sensed,
                actuated,
                ..INFO
            };
            assert_eq!(
                PluginInfo::of(&info),
                Err(Claim::Freedoms { sensed, actuated })
            );
        }
        for bad in [f64::INFINITY, f64::NAN, -1.0, 0.0, 1e9] {
            for number in NUMBERS {
                let mut info = INFO;
                *number(&mut info) = bad;
                let refused = PluginInfo::of(&info);
                assert!(matches!(refused, Err(Claim::Number { .. })), "{bad}");
            }
        }
        // Without motors nothing is said of them.
        let free = RawInfo {
            actuated: 0,
            max_force: f64::NAN,
            ..INFO
        };
        assert_eq!(
            PluginInfo::of(&free).expect("it fits").limits,
            DeviceLimits::UNLIMITED
        );
    }

    #[test]
    fn what_is_not_set_is_no_sample() {
        assert_eq!(SAMPLE.worth(true), Worth::Good);
        assert_eq!(RawSample::UNSET.worth(false), Worth::NotFinite);
        let old = RawSample {
            age: 0.03,
            ..SAMPLE
        };
        assert_eq!(old.worth(true), Worth::Stale);
        let long = RawSample {
            orientation: [1.1, 0.0, 0.0, 0.0],
            ..SAMPLE
        };
        assert_eq!(long.worth(true), Worth::NotFinite);
        assert_eq!(long.worth(false), Worth::Good);
        let unset = RawSample {
            measured: HAS_ANGULAR_VELOCITY,
            ..SAMPLE
        };
        assert_eq!(unset.worth(true), Worth::NotFinite);
    }

    proptest! {
        #[test]
        fn whatever_is_claimed_the_limits_are_finite(
            force in any::<f64>(), stiffness in any::<f64>(), rate in any::<f64>(), sensed in 0_u32..8, actuated in 0_u32..8,
        ) {
            let info = RawInfo { max_force: force, max_stiffness: stiffness, rate, sensed, actuated, ..INFO };
            if let Ok(info) = PluginInfo::of(&info) {
                prop_assert!((200.0..=1e5).contains(&info.rate_hz));
                prop_assert!(!info.has_motors || info.limits.max_force <= 1e3 && info.limits.max_stiffness <= 1e6);
            }
        }
    }
}
