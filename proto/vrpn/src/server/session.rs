//! The session: the greeting, what the client says, and what it is told.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::error::ServerError;
use super::outbox::Outbox;
use super::question::{ClientNumbers, Question};
use super::report::{Report, TYPES};
use crate::description;
use crate::message::{Header, Message, Stamp};
use crate::stream::{Part, receive};
use crate::tracker;

/// Sensors of the device: god-object, device, head.
pub(super) const SENSORS: i32 = 3;

/// One client of a server, from the greeting on: bytes in, reports and bytes out; there is one device.
#[derive(Clone, Debug)]
pub struct ServerSession {
    device: String,
    peer: Ipv4Addr,
    is_open: bool,
    /// The part of a message that has come so far.
    inbound: Vec<u8>,
    outbox: Outbox,
    numbers: ClientNumbers,
}

impl ServerSession {
    /// A session with a client at `peer`; `device` is the name under which it finds everything.
    #[must_use]
    pub fn new(device: &str, peer: Ipv4Addr) -> Self {
        Self {
            device: device.to_owned(),
            peer,
            is_open: false,
            inbound: Vec::new(),
            outbox: Outbox::new(),
            numbers: ClientNumbers::default(),
        }
    }

    /// Whether the client has greeted; before, it gets no reports.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Where the client takes datagrams, if it does.
    #[must_use]
    pub fn datagrams_to(&self) -> Option<SocketAddrV4> {
        self.outbox.datagrams_to
    }

    /// What is to be sent over TCP.
    #[must_use]
    pub fn pending(&self) -> &[u8] {
        &self.outbox.pending
    }

    /// The socket took the first `bytes` of [`pending`](Self::pending).
    pub fn sent(&mut self, bytes: usize) {
        let pending = &mut self.outbox.pending;
        pending.drain(..bytes.min(pending.len()));
    }

    /// The reports since the last call as one datagram, at most [`MAX_DATAGRAM_BYTES`](crate::message::MAX_DATAGRAM_BYTES), put in
    /// the place of what `into` holds; where it goes, if there is one.
    pub fn take_datagram(&mut self, into: &mut Vec<u8>) -> Option<SocketAddrV4> {
        self.outbox.take_datagram(into)
    }

    /// Takes bytes of the TCP stream, cut anywhere; `now` stamps the answers.
    ///
    /// # Errors
    /// [`ServerError`]: close the connection.
    pub fn receive(&mut self, bytes: &[u8], now: Stamp) -> Result<(), ServerError> {
        let mut inbound = std::mem::take(&mut self.inbound);
        inbound.extend_from_slice(bytes);
        self.inbound = receive(inbound, self.is_open, |part| match part {
            Part::Greeting(_) => {
                self.is_open = true;
                self.outbox.introduce(&self.device, &TYPES);
                Ok(())
            }
            Part::Message(message) => self.take(&message, now),
        })?;
        Ok(())
    }

    /// Says something of the device at `time`; nothing before the client has greeted.
    ///
    /// # Errors
    /// [`ServerError::Slow`].
    pub fn report(&mut self, report: &Report, time: Stamp) -> Result<(), ServerError> {
        if !self.is_open {
            return Ok(());
        }
        let (number, payload, is_lossy) = report.encode();
        self.outbox.say(number, &payload, time, is_lossy)
    }

    fn take(&mut self, message: &Message<'_>, now: Stamp) -> Result<(), ServerError> {
        let Header { kind, sender, .. } = message.header;
        match kind {
            description::SENDER => {
                let is_device = description::name(message.payload)? == self.device;
                self.numbers.learn_sender(sender, is_device);
            }
            description::TYPE => {
                let name = description::name(message.payload)?;
                if let Some(question) = self.numbers.learn_type(sender, &name)
                    && let Some(answer) = question.rare_answer()
                {
                    self.outbox.name_type(question.answer_number(), answer)?;
                }
            }
            description::UDP => {
                let address = description::udp(message)?;
                let is_own = *address.ip() == self.peer && address.port() != 0;
                self.outbox.datagrams_to = is_own.then_some(address);
            }
            // No log is kept.
            ..0 => {}
            _ => {
                if let Some(question) = self.numbers.question(&message.header) {
                    self.answer(question, now)?;
                }
            }
        }
        Ok(())
    }

    fn answer(&mut self, question: Question, now: Stamp) -> Result<(), ServerError> {
        let number = question.answer_number();
        let mut say = |payload: &[u8]| self.outbox.say(number, payload, now, false);
        match question {
            Question::Ping => say(&[]),
            Question::ToRoom => say(&tracker::to_room()),
            Question::UnitToSensor => {
                (0..SENSORS).try_for_each(|sensor| say(&tracker::unit_to_sensor(sensor)))
            }
        }
    }
}
