//! CONFIRM payload: which states the server sent lately, told to a client that hears the group, under the keys of its own session.
//!
//! A group key proves a member and no more: any member can seal a state in the server's name. So a client believes the group for a moment only. It keeps
//! tick and fingerprint of every state that it took from the group, and compares them with what the server confirms, which comes with each time
//! exchange, twenty times a second. A state that the server did not send is found with the first confirmation that was asked for after it came.
//!
//! Chosen by measuring (`cargo run --release -p taut-proto --example state_proofs`, figures in `docs/pose-stream.md`): a signature for each batch of states
//! loads the thread that broadcasts, which must not be late, and costs every receiver four times as much, for a forgery that is found some tens of
//! milliseconds sooner. With many receivers it would cost the server as a whole less.

use crate::{
    DecodeError, EncodeError,
    codec::{Reader, Wire, Writer, read_elements},
    range::{COUNT, NAME, Number, TIME},
};
use arrayvec::ArrayVec;

/// Most states of one confirmation: a tenth of a second at 1 kHz, so that each is confirmed twice.
pub const MAX_CONFIRMED: usize = 100;
/// States from the group that wait to be confirmed: a quarter of a second at 1 kHz, and some.
pub const MAX_WAITING: usize = 512;
/// Longest that a state from the group may wait to be confirmed, ns: five exchanges. Then the group is left.
pub const PATIENCE_NS: u64 = 250_000_000;
/// Confirmations in a row of states none of which came by the group, after which it is left: what keeps it alive is not the server.
pub const MAX_UNHEARD: u32 = 2;

/// A state that the server sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SentState {
    /// [`crate::HotState::tick`].
    pub tick: u64,
    /// [`crate::state::payload_hash`] of its bytes.
    pub state_hash: u64,
}

/// The states that the server sent lately, newest first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Confirmation {
    /// [`crate::time::TimeRequest::client_sent`] of the request that this answers: every state that had come to the client by then is either
    /// here, or older than all that are here, or forged.
    pub asked_ns: u64,
    /// Ticks descending, by less than 65536 from one to the next.
    pub states: ArrayVec<SentState, MAX_CONFIRMED>,
}

const ASKED: Number = Number::new("Confirmation.asked_ns", TIME);
const TICK: Number = Number::new("SentState.tick", COUNT);
const HASH: Number = Number::new("SentState.state_hash", NAME);

impl Confirmation {
    /// Its numbers and what each may be.
    pub const NUMBERS: &'static [Number] = &[ASKED];

    /// Adds an older state; `false` if there is no room for it, or it is not older, or too far away to be written.
    pub fn add(&mut self, state: SentState) -> bool {
        let near = self.states.last().is_none_or(|last| {
            let back = last.tick.checked_sub(state.tick);
            back.is_some_and(|back| (1..=u64::from(u16::MAX)).contains(&back))
        });
        near && self.states.try_push(state).is_ok()
    }

    fn find(&self, tick: u64) -> Option<&SentState> {
        let place = self.states.binary_search_by(|sent| tick.cmp(&sent.tick));
        place.ok().map(|place| &self.states[place])
    }
}

impl SentState {
    /// Its numbers and what each may be.
    pub const NUMBERS: &'static [Number] = &[TICK, HASH];
}

/// On the wire: `asked_ns`, the number of states, the first one's tick and fingerprint, then how far each is back (u16) and its fingerprint.
impl Wire for Confirmation {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        ASKED.write(&self.asked_ns, to)?;
        (self.states.len() as u8).write(to)?; // MAX_CONFIRMED is below 256
        let mut last = None;
        for state in &self.states {
            match last {
                None => TICK.write(&state.tick, to)?,
                Some(last) => back(last, state.tick)?.write(to)?,
            }
            HASH.write(&state.state_hash, to)?;
            last = Some(state.tick);
        }
        Ok(())
    }

    fn read(from: &mut Reader<'_>) -> Result<Confirmation, DecodeError> {
        let asked_ns = ASKED.read(from)?;
        let count = u8::read(from)?;
        let mut states = ArrayVec::new();
        if count > 0 {
            states.push(SentState {
                tick: TICK.read(from)?,
                state_hash: HASH.read(from)?,
            });
            let older: ArrayVec<Older, { MAX_CONFIRMED - 1 }> = read_elements(from, count - 1)?;
            for Older { back, state_hash } in older {
                let last = states.last().map_or(0, |last: &SentState| last.tick);
                let tick = last.checked_sub(u64::from(back)).filter(|_| back > 0);
                let tick = tick.ok_or(DecodeError::Inconsistent {
                    what: "ticks of confirmed states",
                })?;
                states.push(SentState { tick, state_hash });
            }
        }
        Ok(Confirmation { asked_ns, states })
    }
}

/// A state by its distance from the one after it.
struct Older {
    back: u16,
    state_hash: u64,
}

impl Wire for Older {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        self.back.write(to)?;
        HASH.write(&self.state_hash, to)
    }

    fn read(from: &mut Reader<'_>) -> Result<Older, DecodeError> {
        Ok(Older {
            back: u16::read(from)?,
            state_hash: HASH.read(from)?,
        })
    }
}

fn back(last: u64, tick: u64) -> Result<u16, EncodeError> {
    let back = last.checked_sub(tick).filter(|back| *back > 0);
    back.and_then(|back| u16::try_from(back).ok())
        .ok_or(EncodeError::OutOfRange {
            number: "Confirmation.states",
        })
}

/// What is known of the group after a look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Trust {
    /// Nothing speaks against it.
    Kept,
    /// A member sealed a state in the server's name.
    Forged {
        /// The tick that it claimed.
        tick: u64,
    },
    /// States wait for their confirmation for longer than [`PATIENCE_NS`], or were never confirmed.
    Unconfirmed,
    /// The server sends states, and the group brings none of them.
    Unheard,
}

/// States that came by the group and are not confirmed yet. Times are ns on the client's clock.
#[derive(Clone, Debug, Default)]
pub struct Unconfirmed {
    /// In the order in which they came.
    waiting: ArrayVec<Waiting, MAX_WAITING>,
    /// Newest tick that was confirmed.
    newest: Option<u64>,
    unheard: u32,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    sent: SentState,
    came_ns: u64,
}

impl Unconfirmed {
    /// Notes a state that was taken from the group. No allocation.
    pub fn take(&mut self, tick: u64, state_hash: u64, now_ns: u64) -> Trust {
        let sent = SentState { tick, state_hash };
        let came_ns = now_ns;
        let full = self.waiting.try_push(Waiting { sent, came_ns }).is_err();
        match full || self.is_overdue(now_ns) {
            true => Trust::Unconfirmed,
            false => Trust::Kept,
        }
    }

    /// Whether a state has waited for too long.
    pub fn is_overdue(&self, now_ns: u64) -> bool {
        let oldest = self.waiting.first();
        oldest.is_some_and(|oldest| now_ns.saturating_sub(oldest.came_ns) >= PATIENCE_NS)
    }

    /// Compares with what the server says that it sent. No allocation.
    pub fn confirm(&mut self, confirmation: &Confirmation) -> Trust {
        let mut trust = Trust::Kept;
        let mut heard = false;
        let oldest = confirmation.states.last().map(|sent| sent.tick);
        self.waiting.retain(|waiting| {
            let Waiting { sent, came_ns } = *waiting;
            match confirmation.find(sent.tick) {
                Some(genuine) if *genuine == sent => heard = true,
                Some(_) => trust = Trust::Forged { tick: sent.tick },
                // Sent after the confirmation was made, perhaps: the next one tells.
                None if came_ns >= confirmation.asked_ns => return true,
                None if oldest.is_none_or(|oldest| sent.tick >= oldest) => {
                    trust = Trust::Forged { tick: sent.tick };
                }
                None if trust == Trust::Kept => trust = Trust::Unconfirmed,
                None => {}
            }
            false
        });
        let newest = confirmation.states.first().map(|sent| sent.tick);
        let fresh = newest > self.newest;
        self.newest = self.newest.max(newest);
        self.unheard = match (heard, fresh) {
            (true, _) => 0,
            (false, true) => self.unheard + 1,
            (false, false) => self.unheard,
        };
        match trust {
            Trust::Kept if self.unheard >= MAX_UNHEARD => Trust::Unheard,
            trust => trust,
        }
    }

    /// Newest tick that the server confirmed; `None` before the first.
    pub fn newest(&self) -> Option<u64> {
        self.newest
    }

    /// Forgets what waits: the group is left, or followed anew.
    pub fn clear(&mut self) {
        self.waiting.clear();
        self.unheard = 0;
    }
}
