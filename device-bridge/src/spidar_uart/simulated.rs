//! The boards' side of the line, byte by byte, with strings and a hand behind it.
//!
//! Each byte that comes in clocks one byte of an answer out. A board that hears nothing keeps its last currents: nothing else is known of one.
//! The hand holds the grip at the centre until the motors pull for the first time: who takes it to be there may take his time.

use std::collections::VecDeque;
use std::time::Duration;

use nalgebra::Isometry3;
use taut_plant::{Hand, MinJerkPath, Tremor};
use taut_spidar::{Geometry, STRINGS, StringHardware, StringLosses};

use super::converter::digits_per_newton;
use super::error::BoardsError;
use super::packet::{BoardInfo, COMMANDS, CURRENT, INFO, SET_LENGTHS, header};
use crate::devices::{HeldStrings, SpidarPlacement};
use crate::pseudo_terminal::FarEnd;

/// What the hand does without a path: 15 mm to either side, a cycle in 4 s.
const SWAY: (f64, f64) = (0.015, 4.0);

/// Boards with eight motors together, and the strings on them.
pub struct SimulatedBoards {
    boards: Vec<(u8, BoardInfo)>,
    digits_per_newton: [f64; STRINGS],
    held: HeldStrings,
    /// When the motors pulled first.
    begun: Option<Duration>,
    digits: [i16; STRINGS],
    /// Where counting began.
    offsets: [i32; STRINGS],
    packet: Vec<u8>,
    answers: VecDeque<u8>,
    cycles: u64,
}

impl SimulatedBoards {
    /// Two boards of four motors, or one of eight, on strings of this geometry; the grip begins at the centre of the frame, where the
    /// counters are at `offsets`.
    pub fn new(
        geometry: &Geometry,
        hand: Hand,
        path: Option<MinJerkPath>,
        tremor: Option<Tremor>,
        one_board: bool,
        offsets: [i32; STRINGS],
    ) -> Result<Self, BoardsError> {
        let path = path.unwrap_or_else(|| MinJerkPath::sway(Isometry3::identity(), SWAY.0, SWAY.1));
        let placement = SpidarPlacement::default();
        let losses = StringLosses::default();
        let known = |board, model| BoardInfo::of_model(model).map(|info| (board, info));
        let boards = if one_board {
            [known(0, 7), None]
        } else {
            [known(0, 5), known(1, 5)]
        };
        Ok(Self {
            boards: boards.into_iter().flatten().collect(),
            digits_per_newton: digits_per_newton(geometry)?,
            held: HeldStrings::new(geometry, losses, placement, hand, path, tremor),
            begun: None,
            digits: [0; STRINGS],
            offsets,
            packet: Vec::with_capacity(64),
            answers: VecDeque::with_capacity(128),
            cycles: 0,
        })
    }

    /// The hand and its strings.
    pub fn held(&mut self) -> &mut HeldStrings {
        &mut self.held
    }

    /// Currents that the motors have, digits.
    #[must_use]
    pub fn digits(&self) -> &[i16; STRINGS] {
        &self.digits
    }

    /// Packets of currents taken so far.
    #[must_use]
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// Length of the packet that has begun: the addressed board's, or that of a command without more.
    fn length(&self) -> usize {
        let (board, command) = (self.packet[0] & 0b111, usize::from(self.packet[0] >> 3));
        let lengths = self.boards.iter().find(|(number, _)| *number == board);
        match lengths {
            Some((_, info)) if command < COMMANDS => usize::from(info.command_lengths()[command]),
            _ => 1,
        }
    }

    fn obey(&mut self, now: Duration) {
        let (board, command) = (self.packet[0] & 0b111, self.packet[0] >> 3);
        let mut motor = 0;
        let mut found = None;
        for (number, info) in &self.boards {
            if *number == board {
                found = Some((motor, *info));
                break;
            }
            motor += usize::from(info.motors);
        }
        let Some((first, info)) = found else { return };
        match command {
            INFO => self.answers.extend(info.answer(board)),
            SET_LENGTHS => {} // the lengths are those of the models
            CURRENT => self.obey_currents(now, board, first, &info),
            _ => {}
        }
    }

    fn obey_currents(&mut self, now: Duration, board: u8, first: usize, info: &BoardInfo) {
        self.cycles += 1;
        let motors = first..first + usize::from(info.motors);
        for (motor, bytes) in motors.clone().zip(self.packet[1..].chunks_exact(2)) {
            self.digits[motor] = i16::from_le_bytes([bytes[0], bytes[1]]);
        }
        if self.digits != [0; STRINGS] {
            self.begun.get_or_insert(now);
        }
        let now = self.begun.map_or(Duration::ZERO, |begun| now - begun);
        let reading = self.held.read_counts(now);
        let counts = reading.map_or([0; STRINGS], |reading| reading.counts);
        let tensions = std::array::from_fn(|i| {
            (f64::from(self.digits[i]) / self.digits_per_newton[i]).max(0.0) // a motor winds up only
        });
        self.held.write_tensions(now, &tensions);
        self.answers.push_back(header(board, CURRENT));
        for motor in motors.clone() {
            let counter = counts[motor].wrapping_add(self.offsets[motor]) as i16; // it wraps
            self.answers.extend(counter.to_le_bytes());
        }
        // Velocities, in a unit that is not published, and forces.
        let rest = 2 * motors.len() + 2 * usize::from(info.forces);
        self.answers.extend(std::iter::repeat_n(0, rest));
    }
}

impl FarEnd for SimulatedBoards {
    fn take(&mut self, now: Duration, bytes: &[u8], out: &mut Vec<u8>) {
        for byte in bytes {
            out.extend(self.answers.pop_front());
            let is_padding = self.packet.is_empty() && byte >> 3 == 0;
            if is_padding {
                continue;
            }
            self.packet.push(*byte);
            if self.packet.len() >= self.length() {
                self.obey(now);
                self.packet.clear();
            }
        }
    }
}
