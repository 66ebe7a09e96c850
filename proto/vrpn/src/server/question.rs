//! What a client may ask of the device, under the numbers that it chose for device and questions.

use super::report;
use crate::description::learn;
use crate::message::Header;
use crate::tracker;

/// A question that is answered. Whatever else a client wants of a device, this one only reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Question {
    /// For a sign of life.
    Ping,
    /// How the tracker stands in the room.
    ToRoom,
    /// Where the sensors are on what is tracked.
    UnitToSensor,
}

impl Question {
    /// In the order of their numbers.
    const ALL: [Self; 3] = [Self::Ping, Self::ToRoom, Self::UnitToSensor];

    /// The type that asks it.
    fn name(self) -> &'static str {
        match self {
            Self::Ping => "vrpn_Base ping_message",
            Self::ToRoom => tracker::REQUEST_TO_ROOM,
            Self::UnitToSensor => tracker::REQUEST_UNIT_TO_SENSOR,
        }
    }

    /// The number of the answer's type.
    pub(super) fn answer_number(self) -> i32 {
        match self {
            Self::Ping => report::PONG_NUMBER,
            Self::ToRoom => report::TYPES.len() as i32,
            Self::UnitToSensor => report::TYPES.len() as i32 + 1,
        }
    }

    /// The name of the answer's type where few clients ask for it: it is named to those that do.
    pub(super) fn rare_answer(self) -> Option<&'static str> {
        match self {
            Self::Ping => None,
            Self::ToRoom => Some(tracker::TO_ROOM),
            Self::UnitToSensor => Some(tracker::UNIT_TO_SENSOR),
        }
    }
}

/// The client's numbers of the device and of what it asks.
#[derive(Clone, Debug, Default)]
pub(super) struct ClientNumbers {
    device: Option<i32>,
    /// As [`Question::ALL`].
    questions: [Option<i32>; Question::ALL.len()],
}

impl ClientNumbers {
    /// The client's sender `number` is the device, or is not.
    pub(super) fn learn_sender(&mut self, number: i32, is_device: bool) {
        learn(&mut self.device, number, is_device);
    }

    /// The client's type `number` has this name: the question that it is.
    pub(super) fn learn_type(&mut self, number: i32, name: &str) -> Option<Question> {
        let mut named = None;
        for (question, known) in Question::ALL.into_iter().zip(&mut self.questions) {
            let is_it = name == question.name();
            learn(known, number, is_it);
            if is_it {
                named = Some(question);
            }
        }
        named
    }

    /// What a message asks of the device.
    pub(super) fn question(&self, header: &Header) -> Option<Question> {
        if self.device != Some(header.sender) {
            return None;
        }
        let asked = Some(header.kind);
        let place = self.questions.iter().position(|known| *known == asked)?;
        Some(Question::ALL[place])
    }
}
