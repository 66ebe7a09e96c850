//! Connections to a service, one after the other, without sockets: which arm and which grip are used, what they said last, and what is said next.

use crate::devices::ArmState;

use super::message::{MessageError, PERMUTATION, Said, Say};

/// What is wanted of a service.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExchangeSettings {
    /// Name under which the service lists this program.
    pub profile: String,
    /// The arm of this name; the first one without a name.
    pub arm: Option<String>,
    /// Whether a grip gives the orientation, where there is one.
    pub with_grip: bool,
}

impl Default for ExchangeSettings {
    fn default() -> Self {
        Self {
            profile: "taut".to_owned(),
            arm: None,
            with_grip: true,
        }
    }
}

/// Why a device that the service knows, or should know, gives no pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unusable {
    /// No connection.
    #[error("the Inverse service does not answer")]
    NoService,
    /// The service is there, the device is not.
    #[error("the Inverse service has no such device; plug it in")]
    NotPlugged,
    /// It does not know where it is.
    #[error("the device is not calibrated; move it to its calibration pose")]
    NotCalibrated,
    /// It has not started.
    #[error("the device is not ready; wait, or plug it in anew")]
    NotReady,
    /// Its motors have no power.
    #[error("the device's motors have no power; connect its power supply")]
    NoPower,
    /// The order of its axes was asked for, and is not confirmed yet: what it says until then may be in another.
    #[error("the device's axes are being set")]
    BasisPending,
    /// Its axes are in another order than was asked for.
    #[error(
        "the service gives the device's axes in another order than {PERMUTATION}, which was asked for; set its basis to {PERMUTATION}"
    )]
    OtherBasis,
    /// It says no position.
    #[error("the service tells no position of the device")]
    NoPosition,
    /// The grip that gave the orientation is gone or asleep.
    #[error("the grip is gone; switch it on, or do without by grip=no")]
    NoGrip,
}

/// The client's half. What it has once chosen it keeps: another arm is in another hand.
#[derive(Debug)]
pub struct Exchange {
    settings: ExchangeSettings,
    arm: Option<String>,
    grip: Option<(&'static str, String)>,
    /// Messages said in this connection with the arm there.
    said: u32,
    other_basis: bool,
    state: ArmState,
    unusable: Option<Unusable>,
    text: String,
}

/// The message, counted with the arm there, from which the configuration counts that was asked for in the first. It asks for all, so that its answer
/// confirms it.
const CONFIGURED: u32 = 2;

impl Exchange {
    /// Nothing said or heard yet.
    #[must_use]
    pub fn new(settings: ExchangeSettings) -> Self {
        Self {
            settings,
            arm: None,
            grip: None,
            said: 0,
            other_basis: false,
            state: ArmState::default(),
            unusable: Some(Unusable::NoService),
            text: String::with_capacity(512),
        }
    }

    /// Another connection, of which nothing is said or heard yet.
    pub fn begin(&mut self) {
        (self.said, self.other_basis) = (0, false);
        self.state.is_usable = false;
        self.unusable = Some(Unusable::NoService);
    }

    /// What the device said last.
    #[must_use]
    pub fn state(&self) -> &ArmState {
        &self.state
    }

    /// Why there is none to be used now.
    #[must_use]
    pub fn unusable(&self) -> Option<Unusable> {
        self.unusable
    }

    /// The arm that is used, once the service has named it.
    #[must_use]
    pub fn arm(&self) -> Option<&str> {
        self.arm.as_deref()
    }

    /// Takes a message of the service: the inventory, or the answer to what was said last.
    ///
    /// # Errors
    /// [`MessageError`]: the state is what it was before.
    pub fn hear(&mut self, text: &str) -> Result<(), MessageError> {
        let said = Said::parse(text)?;
        if self.arm.is_none() {
            self.choose(&said);
        }
        let next = self.judge(&said);
        match next {
            Ok(state) => (self.state, self.unusable) = (state, None),
            Err(unusable) => {
                self.state.is_usable = false;
                self.unusable = Some(unusable);
            }
        }
        Ok(())
    }

    fn choose(&mut self, said: &Said) {
        let wanted = self.settings.arm.as_deref();
        let found = said
            .arms
            .iter()
            .find(|arm| wanted.is_none_or(|id| arm.id == id));
        let Some(arm) = found else { return };
        self.arm = Some(arm.id.clone());
        if self.settings.with_grip {
            let grip = said.grips.iter().find(|grip| grip.orientation.is_some());
            self.grip = grip.map(|grip| (grip.array, grip.id.clone()));
        }
        let unknown = || "unknown".to_owned();
        tracing::info!(
            "{} {}, {}-handed; orientation {}",
            arm.model.clone().unwrap_or_else(|| "arm".to_owned()),
            arm.id,
            arm.handedness.clone().unwrap_or_else(unknown),
            self.grip
                .as_ref()
                .map_or("stays as it is: no grip".to_owned(), |(_, id)| format!(
                    "by grip {id}"
                )),
        );
    }

    fn judge(&mut self, said: &Said) -> Result<ArmState, Unusable> {
        let id = self.arm.as_deref().ok_or(Unusable::NotPlugged)?;
        let arm = said
            .arms
            .iter()
            .find(|arm| arm.id == id)
            .ok_or(Unusable::NotPlugged)?;
        if let Some(permutation) = arm.permutation.as_deref()
            && self.said >= CONFIGURED
        {
            self.other_basis = !permutation.eq_ignore_ascii_case(PERMUTATION);
        }
        for (good, unusable) in [
            (arm.calibrated, Unusable::NotCalibrated),
            (arm.ready, Unusable::NotReady),
            (arm.powered, Unusable::NoPower),
            (self.said > CONFIGURED, Unusable::BasisPending),
            (!self.other_basis, Unusable::OtherBasis),
        ] {
            if !good {
                return Err(unusable);
            }
        }
        let mut state = ArmState {
            reports: self.state.reports + 1,
            is_usable: true,
            position: arm.position.ok_or(Unusable::NoPosition)?,
            velocity: arm.velocity.unwrap_or_default(),
            ..ArmState::default()
        };
        if let Some((array, id)) = &self.grip {
            let mut grips = said.grips.iter();
            let grip = grips.find(|grip| grip.array == *array && grip.id == *id);
            let grip = grip.filter(|grip| grip.ready);
            let grip = grip.ok_or(Unusable::NoGrip)?;
            state.orientation = Some(grip.orientation.ok_or(Unusable::NoGrip)?);
            state.buttons = grip.buttons;
        }
        Ok(state)
    }

    /// The next message. `force` (N, the device's axes) goes out only while the device may be used; without one its motors go idle.
    pub fn say(&mut self, force: Option<[f64; 3]>) -> &str {
        let arm = self.arm.as_deref();
        // One that is not there yet is configured when it comes.
        let is_there = arm.is_some() && self.unusable != Some(Unusable::NotPlugged);
        let first = is_there && self.said == 0;
        let say = Say {
            profile: first.then_some(self.settings.profile.as_str()),
            // Until the arm is there; and once the configuration should hold, to see whether it does.
            full: !is_there || self.said == CONFIGURED,
            arm,
            set_basis: first,
            force: force.filter(|_| self.unusable.is_none()),
            grip: self.grip.as_ref().map(|(array, id)| (*array, id.as_str())),
        };
        say.write(&mut self.text);
        // One that comes again is configured again: it may be a restarted one.
        self.said = if is_there {
            self.said.saturating_add(1)
        } else {
            0
        };
        &self.text
    }
}

/// What a service is asked that is only looked at: the state of its first arm. Nothing is set that another program may have set.
pub(super) fn question(said: &Said) -> String {
    let arm = said.arms.first();
    let say = Say {
        profile: None,
        full: arm.is_none(),
        arm: arm.map(|arm| arm.id.as_str()),
        set_basis: false,
        force: None,
        grip: None,
    };
    let mut text = String::new();
    say.write(&mut text);
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a service says that has these arms and grips, in this order.
    fn inventory(arms: &[&str], grips: &[&str]) -> String {
        let list = |names: &[&str], state: &str| {
            let device = |name: &&str| format!(r#"{{"device_id":"{name}","state":{state}}}"#);
            names.iter().map(device).collect::<Vec<_>>().join(",")
        };
        let arms = list(arms, r#"{"cursor_position":{"x":0.1,"y":0.0,"z":0.0}}"#);
        let grips = list(
            grips,
            r#"{"orientation":{"w":1.0,"x":0.0,"y":0.0,"z":0.0}}"#,
        );
        format!(r#"{{"inverse3":[{arms}],"wireless_verse_grip":[{grips}]}}"#)
    }

    #[test]
    fn who_looks_at_a_service_sets_nothing_there() {
        let said = Said::parse(&inventory(&["A", "B"], &["1"])).expect("an inventory");
        assert_eq!(
            question(&said),
            r#"{"session":{},"inverse3":[{"device_id":"A","commands":{"probe_position":{}}}]}"#
        );
        assert_eq!(
            question(&Said::default()),
            r#"{"session":{"force_render_full_state":{}}}"#
        );
    }

    #[test]
    fn no_pose_counts_in_axes_that_are_not_confirmed() {
        let mut exchange = Exchange::new(ExchangeSettings::default());
        let answer = inventory(&["A"], &["1"]);
        for other_program in [false, true] {
            exchange.begin();
            exchange.hear(&answer).expect("the greeting");
            for _ in 0..CONFIGURED {
                assert_eq!(exchange.unusable(), Some(Unusable::BasisPending));
                assert!(!exchange.state().is_usable);
                let said = exchange.say(Some([1.0, 0.0, 0.0]));
                assert!(!said.contains("set_cursor_force"), "{said}");
                exchange.hear(&answer).expect("an answer");
            }
            assert!(exchange.say(None).contains("force_render_full_state"));
            let basis = if other_program { "XZY" } else { "XYZ" };
            let config = format!(r#""config":{{"basis":{{"permutation":"{basis}"}}}},"state""#);
            let full = answer.replacen(r#""state""#, &config, 1);
            exchange.hear(&full).expect("an answer");
            let wanted = other_program.then_some(Unusable::OtherBasis);
            assert_eq!(exchange.unusable(), wanted);
            assert_eq!(exchange.state().reports, 1);
        }
    }

    #[test]
    fn every_connection_is_for_the_arm_and_the_grip_of_the_first() {
        let mut exchange = Exchange::new(ExchangeSettings::default());
        let heard = |exchange: &mut Exchange, arms: &[&str], grips: &[&str]| {
            for _ in 0..CONFIGURED + 2 {
                let heard = exchange.hear(&inventory(arms, grips));
                heard.expect("an inventory");
                let _ = exchange.say(None);
            }
            exchange.unusable()
        };
        assert_eq!(heard(&mut exchange, &["A", "B"], &["1", "2"]), None);

        exchange.begin();
        assert_eq!(exchange.unusable(), Some(Unusable::NoService));
        // It may be plugged in late, and again.
        for _ in 0..2 {
            let other_arm = heard(&mut exchange, &["B"], &["1"]);
            assert_eq!(other_arm, Some(Unusable::NotPlugged));
            assert!(!exchange.say(None).contains("configure"), "it is not there");
            exchange
                .hear(&inventory(&["B", "A"], &["1"]))
                .expect("an inventory");
            let said = exchange.say(None);
            assert!(said.contains(PERMUTATION), "its axes are set now: {said}");
            assert!(!exchange.say(None).contains(PERMUTATION), "and once");
        }
        let other_grip = heard(&mut exchange, &["B", "A"], &["2"]);
        assert_eq!(other_grip, Some(Unusable::NoGrip));
        assert_eq!(heard(&mut exchange, &["B", "A"], &["2", "1"]), None);
        let said = exchange.say(Some([1.0, 0.0, 0.0]));
        let pushed = r#""device_id":"A","commands":{"set_cursor_force""#;
        assert!(said.contains(pushed), "{said}");
    }
}
