//! What the service says, checked value by value, and what is said to it.
//!
//! Unknown keys are passed over: the service says far more than a driver needs. Lengths are m, forces N, quaternions w x y z. A value that is
//! missing where it must be, out of range or no number refuses the whole message: half a state is none.

use std::fmt::Write;

use serde::Deserialize;

/// The device's axes as this driver reads them: x right, y away from the user, z up.
pub(crate) const PERMUTATION: &str = "XYZ";
/// Farthest cursor that is believed, m from the origin: an arm of any model is shorter than half of this.
const FARTHEST: f64 = 1.0;
/// Fastest cursor that is believed along an axis, m/s: far beyond a hand; the port judges more strictly.
const FASTEST: f64 = 20.0;
/// By how much the norm of a grip's quaternion may be off: its components come in steps of 2^-14.
const NORM_TOLERANCE: f64 = 1e-2;
/// Most devices of a kind in one message.
const MAX_DEVICES: usize = 64;
/// Longest name of a device.
const MAX_ID: usize = 64;

/// Why a message of the service is not used.
#[derive(Debug, thiserror::Error)]
pub enum MessageError {
    /// Not JSON of the service's form.
    #[error("the Inverse service sent what is no state message: {0}")]
    NotUnderstood(#[from] serde_json::Error),
    /// A number that cannot be.
    #[error(
        "the Inverse service says that {what} of the device {device} is {value}, which cannot be"
    )]
    OutOfRange {
        /// Whose.
        device: String,
        /// Which.
        what: &'static str,
        /// As it came.
        value: f64,
    },
    /// More than can be plugged in, or names that are none.
    #[error(
        "the Inverse service names more than {MAX_DEVICES} devices of a kind, or one by no sensible name"
    )]
    Names,
}

/// Everything in one message that matters here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Said {
    /// Number of this client's session at the service.
    pub session: Option<u64>,
    /// The arms.
    pub arms: Vec<Arm>,
    /// Grips of all kinds.
    pub grips: Vec<GripSaid>,
}

/// One Inverse3, Inverse3x or Minverse.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// The service's name for it.
    pub id: String,
    /// `inverse3`, `inverse3x` or `minverse`, where its configuration was told.
    pub model: Option<String>,
    /// `left` or `right`, where it was told.
    pub handedness: Option<String>,
    /// Order of its axes, where it was told; see `PERMUTATION`.
    pub permutation: Option<String>,
    /// Of the cursor, m.
    pub position: Option<[f64; 3]>,
    /// Of the cursor, m/s.
    pub velocity: Option<[f64; 3]>,
    /// The force that the service says it renders, N.
    pub force: Option<[f64; 3]>,
    /// What keeps it from being used.
    pub calibrated: bool,
    /// It has been started and answers.
    pub ready: bool,
    /// Its motors have power.
    pub powered: bool,
}

/// A VerseGrip.
#[derive(Clone, Debug, PartialEq)]
pub struct GripSaid {
    /// Name of the array in which it stands: how it is connected.
    pub array: &'static str,
    /// The service's name for it.
    pub id: String,
    /// Unit quaternion, w x y z.
    pub orientation: Option<[f64; 4]>,
    /// Bit 0 is a (or the only one), 1 b, 2 c.
    pub buttons: u16,
    /// It is connected and ready, as far as it says.
    pub ready: bool,
}

#[derive(Deserialize)]
struct Message {
    session_id: Option<u64>,
    #[serde(default)]
    inverse3: Vec<ArmMessage>,
    #[serde(default)]
    wireless_verse_grip: Vec<GripMessage>,
    #[serde(default)]
    custom_verse_grip: Vec<GripMessage>,
    #[serde(default)]
    verse_grip: Vec<GripMessage>,
}

#[derive(Deserialize)]
struct ArmMessage {
    device_id: String,
    config: Option<ArmConfig>,
    state: Option<ArmState>,
    status: Option<ArmStatus>,
}

#[derive(Deserialize)]
struct ArmConfig {
    // A number in old services: only words are kept.
    #[serde(rename = "type")]
    model: Option<serde_json::Value>,
    handedness: Option<String>,
    #[serde(alias = "coordinate_system")]
    basis: Option<Basis>,
}

#[derive(Deserialize)]
struct Basis {
    permutation: Option<String>,
}

#[derive(Deserialize)]
struct ArmState {
    cursor_position: Option<Xyz>,
    cursor_velocity: Option<Xyz>,
    current_cursor_force: Option<Xyz>,
}

#[derive(Deserialize)]
struct ArmStatus {
    calibrated: bool,
    power_supply: Option<bool>,
    ready: Option<bool>,
    started: Option<bool>,
}

#[derive(Deserialize)]
struct GripMessage {
    device_id: String,
    state: Option<GripState>,
    status: Option<GripStatus>,
}

#[derive(Deserialize)]
struct GripState {
    orientation: Option<Wxyz>,
    button: Option<bool>,
    buttons: Option<Buttons>,
}

#[derive(Deserialize)]
struct Buttons {
    #[serde(default)]
    a: bool,
    #[serde(default)]
    b: bool,
    #[serde(default)]
    c: bool,
}

#[derive(Deserialize)]
struct GripStatus {
    ready: Option<bool>,
    connected: Option<bool>,
}

#[derive(Deserialize)]
struct Xyz {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Deserialize)]
struct Wxyz {
    w: f64,
    x: f64,
    y: f64,
    z: f64,
}

impl Said {
    /// Reads one message.
    ///
    /// # Errors
    /// [`MessageError`]: nothing of it may be used.
    pub fn parse(text: &str) -> Result<Self, MessageError> {
        let message: Message = serde_json::from_str(text)?;
        let grips = [
            ("wireless_verse_grip", &message.wireless_verse_grip),
            ("custom_verse_grip", &message.custom_verse_grip),
            ("verse_grip", &message.verse_grip), // by cable
        ];
        let count = message
            .inverse3
            .len()
            .max(grips.iter().map(|(_, of)| of.len()).max().unwrap_or(0));
        if count > MAX_DEVICES {
            return Err(MessageError::Names);
        }
        let mut said = Self {
            session: message.session_id,
            ..Self::default()
        };
        for (array, of) in grips {
            for grip in of {
                said.grips.push(grip.checked(array)?);
            }
        }
        for arm in message.inverse3 {
            said.arms.push(arm.checked()?);
        }
        Ok(said)
    }
}

impl ArmMessage {
    fn checked(self) -> Result<Arm, MessageError> {
        let id = name(self.device_id)?;
        let vector = |xyz: Option<Xyz>, what, limit: f64| {
            let Some(xyz) = xyz else { return Ok(None) };
            let vector = [xyz.x, xyz.y, xyz.z];
            let fits = |value: &f64| value.abs() <= limit; // false for NaN
            match vector.into_iter().find(|value| !fits(value)) {
                None => Ok(Some(vector)),
                Some(value) => Err(MessageError::OutOfRange {
                    device: id.clone(),
                    what,
                    value,
                }),
            }
        };
        let (mut position, mut velocity, mut force) = (None, None, None);
        if let Some(state) = self.state {
            position = vector(state.cursor_position, "cursor_position", FARTHEST)?;
            velocity = vector(state.cursor_velocity, "cursor_velocity", FASTEST)?;
            force = vector(state.current_cursor_force, "current_cursor_force", 1e3)?;
        }
        let config = self.config;
        let status = self.status;
        Ok(Arm {
            model: config.as_ref().and_then(|config| {
                let model = config.model.as_ref()?.as_str()?;
                name(model.to_owned()).ok()
            }),
            handedness: config.as_ref().and_then(|config| config.handedness.clone()),
            permutation: config.and_then(|config| config.basis?.permutation),
            position,
            velocity,
            force,
            calibrated: status.as_ref().is_none_or(|status| status.calibrated),
            ready: status.as_ref().is_none_or(|status| {
                status.ready.unwrap_or(true) && status.started.unwrap_or(true)
            }),
            powered: status.is_none_or(|status| status.power_supply.unwrap_or(true)),
            id,
        })
    }
}

impl GripMessage {
    fn checked(&self, array: &'static str) -> Result<GripSaid, MessageError> {
        let id = name(self.device_id.clone())?;
        let orientation = self
            .state
            .as_ref()
            .and_then(|state| state.orientation.as_ref());
        let orientation = orientation.map(|q| [q.w, q.x, q.y, q.z]);
        if let Some(q) = orientation {
            let norm = q.iter().map(|part| part * part).sum::<f64>().sqrt();
            let is_unit = (norm - 1.0).abs() <= NORM_TOLERANCE; // false for NaN
            if !is_unit {
                return Err(MessageError::OutOfRange {
                    device: id,
                    what: "the norm of the orientation",
                    value: norm,
                });
            }
        }
        let state = self.state.as_ref();
        let single = state.and_then(|state| state.button).unwrap_or(false);
        let of = state.and_then(|state| state.buttons.as_ref());
        let buttons = of.map_or(u16::from(single), |of| {
            u16::from(of.a) | u16::from(of.b) << 1 | u16::from(of.c) << 2
        });
        let ready = self
            .status
            .as_ref()
            .is_none_or(|status| status.ready.unwrap_or(true) && status.connected.unwrap_or(true));
        Ok(GripSaid {
            array,
            id,
            orientation,
            buttons,
            ready,
        })
    }
}

/// A device's name, if it may be one: it is written into messages as it came.
fn name(text: String) -> Result<String, MessageError> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if text.is_empty() || text.len() > MAX_ID || !text.chars().all(plain) {
        return Err(MessageError::Names);
    }
    Ok(text)
}

/// What is said to the service in one message.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Say<'a> {
    /// Name of the session's profile, in the first message alone.
    pub(crate) profile: Option<&'a str>,
    /// Asks for everything with its configuration.
    pub(crate) full: bool,
    /// The arm that is moved, once one is known.
    pub(crate) arm: Option<&'a str>,
    /// Sets the order of its axes.
    pub(crate) set_basis: bool,
    /// N; without one its state alone is asked for, and its motors go idle.
    pub(crate) force: Option<[f64; 3]>,
    /// The grip that is read: its array and its name.
    pub(crate) grip: Option<(&'static str, &'a str)>,
}

impl Say<'_> {
    /// Writes it. A force that is not finite is none.
    pub(crate) fn write(&self, out: &mut String) {
        out.clear();
        out.push_str("{\"session\":{");
        if self.full {
            out.push_str("\"force_render_full_state\":{}");
        }
        if let Some(profile) = self.profile {
            let comma = if self.full { "," } else { "" };
            // A profile's name is this program's own: no letters to escape.
            let _ = write!(
                out,
                "{comma}\"configure\":{{\"profile\":{{\"name\":\"{profile}\"}}}}"
            );
        }
        out.push('}');
        if let Some(arm) = self.arm {
            let _ = write!(
                out,
                ",\"inverse3\":[{{\"device_id\":\"{arm}\",\"commands\":{{"
            );
            match self
                .force
                .filter(|force| force.iter().all(|part| part.is_finite()))
            {
                Some([x, y, z]) => {
                    let _ = write!(
                        out,
                        "\"set_cursor_force\":{{\"vector\":{{\"x\":{x:.6},\"y\":{y:.6},\"z\":{z:.6}}}}}"
                    );
                }
                None => out.push_str("\"probe_position\":{}"),
            }
            out.push('}');
            if self.set_basis {
                let _ = write!(
                    out,
                    ",\"configure\":{{\"basis\":{{\"permutation\":\"{PERMUTATION}\"}}}}"
                );
            }
            out.push_str("}]");
        }
        if let Some((array, id)) = self.grip {
            let _ = write!(
                out,
                ",\"{array}\":[{{\"device_id\":\"{id}\",\"commands\":{{\"probe_orientation\":{{}}}}}}]"
            );
        }
        out.push('}');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the service's documentation and the vendor's client have it, shortened by what is passed over.
    const FULL: &str = r#"{"session_id":176,
      "inverse3":[{"device_id":"04C3",
        "config":{"type":"inverse3","device_info":{"major_version":7,"minor_version":1,"id":"04C3","device_type":4,"uuid":"9AB1"},
          "port":"COM15","gravity_compensation":{"enabled":true,"scaling_factor":0.75},"handedness":"right","torque_scaling":{"enabled":true},
          "basis":{"permutation":"XYZ"},"preset":"defaults","mount":{},"filters":{"force_gate":{"gain":0.0},"damping":{"scalar":0.0}}},
        "state":{"angular_position":{"a0":-89.66,"a1":222.8,"a2":-22.7},"angular_velocity":{"a0":0,"a1":0,"a2":0},
          "body_orientation":{"x":0.0266,"y":0.7089,"z":-0.0001,"w":0.7047},
          "cursor_position":{"x":0.12794551,"y":0.038903017,"z":-0.05089721},"cursor_velocity":{"x":-0.00018,"y":-0.00002,"z":-0.00025},
          "current_cursor_force":{"x":0.0,"y":0.5,"z":0.0},"mode":"idle","control_domain":"undefined","control_mode":"idle"},
        "status":{"calibrated":true,"in_use":false,"power_supply":true,"ready":true,"started":true}}],
      "verse_grip":[],
      "wireless_verse_grip":[{"device_id":"0","config":{"port":"COM4","type":"wireless_verse_grip"},
        "state":{"battery_level":0.89,"buttons":{"a":true,"b":false,"c":true},"hall":15,
          "orientation":{"x":0.34646606,"y":0.6608887,"z":-0.34802246,"w":0.5644226}},
        "status":{"connected":true,"awake":true,"ready":true}}]}"#;

    #[test]
    fn a_documented_message_is_read() {
        let said = Said::parse(FULL).expect("the service's own");
        assert_eq!(said.session, Some(176));
        let [arm] = &said.arms[..] else {
            panic!("one arm")
        };
        assert_eq!(
            (arm.id.as_str(), arm.model.as_deref()),
            ("04C3", Some("inverse3"))
        );
        assert_eq!(arm.position, Some([0.12794551, 0.038903017, -0.05089721]));
        assert_eq!(arm.force, Some([0.0, 0.5, 0.0]));
        assert_eq!(arm.permutation.as_deref(), Some("XYZ"));
        assert!(arm.calibrated && arm.ready && arm.powered);
        let [grip] = &said.grips[..] else {
            panic!("one grip")
        };
        assert_eq!((grip.buttons, grip.ready), (0b101, true));
        assert_eq!(
            grip.orientation,
            Some([0.5644226, 0.34646606, 0.6608887, -0.34802246])
        );
    }

    #[test]
    fn what_cannot_be_is_refused_with_its_name() {
        for (from, to, part) in [
            ("0.12794551", "12.794551", "cursor_position"),
            ("0.12794551", "1e999", "state message"),
            ("0.12794551", "NaN", "state message"),
            ("0.12794551", "null", "state message"),
            ("-0.00018", "-100", "cursor_velocity"),
            ("0.6608887", "0.8608887", "orientation"),
            ("\"04C3\"", "\"04\\\"C3\"", "sensible name"),
            ("\"z\":-0.05089721", "\"q\":0", "missing field `z`"),
            (
                "\"cursor_velocity\"",
                "\"cursor_position\"",
                "duplicate field",
            ),
        ] {
            assert!(FULL.contains(from), "{from}");
            let text =
                FULL.replacen(from, to, 1)
                    .replacen("\"id\":\"04\\\"C3\"", "\"id\":\"x\"", 1);
            let error = Said::parse(&text).expect_err(to).to_string();
            assert!(error.contains(part), "{from} -> {to}: {error}");
        }
        let many = format!(
            "{{\"inverse3\":[{}]}}",
            vec!["{\"device_id\":\"a\"}"; 65].join(",")
        );
        assert!(Said::parse(&many).is_err());
    }

    #[test]
    fn messages_to_the_service_are_to_the_letter() {
        let mut out = String::new();
        let mut say = Say {
            profile: Some("taut"),
            full: false,
            arm: Some("04C3"),
            set_basis: true,
            force: None,
            grip: Some(("wireless_verse_grip", "0")),
        };
        say.write(&mut out);
        assert_eq!(
            out,
            r#"{"session":{"configure":{"profile":{"name":"taut"}}},"inverse3":[{"device_id":"04C3","commands":{"probe_position":{}},"configure":{"basis":{"permutation":"XYZ"}}}],"wireless_verse_grip":[{"device_id":"0","commands":{"probe_orientation":{}}}]}"#
        );
        (say.profile, say.set_basis, say.grip) = (None, false, None);
        say.force = Some([0.5, -1.25, 2.0]);
        say.write(&mut out);
        assert_eq!(
            out,
            r#"{"session":{},"inverse3":[{"device_id":"04C3","commands":{"set_cursor_force":{"vector":{"x":0.500000,"y":-1.250000,"z":2.000000}}}}]}"#
        );
        say.force = Some([0.5, f64::NAN, 2.0]);
        say.write(&mut out);
        assert!(out.contains("probe_position") && !out.contains("NaN"));
        (say.arm, say.full) = (None, true);
        say.write(&mut out);
        assert_eq!(out, r#"{"session":{"force_render_full_state":{}}}"#);
        assert!(serde_json::from_str::<serde_json::Value>(&out).is_ok());
    }
}
