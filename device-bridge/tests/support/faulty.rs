//! A serial line that answers wrongly for a while, and sees what is commanded.

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use nalgebra::Vector3;
use taut_bridge::pseudo_terminal::FarEnd;

use super::ms;
use super::stage::{Faults, GOOD, HANGS, Inside, NOT_A_NUMBER};

/// A line that hangs or answers what is no answer.
pub const BAD_LINE: Faults = Faults {
    modes: &[HANGS, NOT_A_NUMBER],
    ticks: &[1, 3, 10, 30, 100],
    floor: 0.003,
    allowed: 510_000,
    keeps_force: false,
    patience: ms(1000),
};

/// A device at the far end of a line.
pub struct Faulty<T> {
    pub device: T,
    /// Commands so far.
    commands: fn(&T) -> u64,
    /// The force of the last one, N.
    commanded: fn(&mut T) -> Vector3<f64>,
    mode: i64,
    served: i64,
    /// How often it took what was on the way: a driver that gets no answers writes on, and what waits was written long ago.
    takes: i64,
    seen: (u64, Vector3<f64>),
    jump: f64,
}

impl<T> Faulty<T> {
    pub fn of(
        device: T,
        commands: fn(&T) -> u64,
        commanded: fn(&mut T) -> Vector3<f64>,
    ) -> Arc<Mutex<Self>> {
        Arc::new(Mutex::new(Self {
            device,
            commands,
            commanded,
            mode: GOOD,
            served: 0,
            takes: 0,
            seen: (0, Vector3::zeros()),
            jump: 0.0,
        }))
    }

    fn see(&mut self) {
        let commands = (self.commands)(&self.device);
        if commands != self.seen.0 {
            let force = (self.commanded)(&mut self.device);
            // That a driver lets go is no jump: what comes after it may be one.
            if force.norm() > 1e-9 {
                self.jump = self.jump.max((force - self.seen.1).norm());
            }
            self.seen = (commands, force);
        }
    }
}

impl<T: FarEnd> FarEnd for Faulty<T> {
    fn take(&mut self, now: Duration, bytes: &[u8], out: &mut Vec<u8>) {
        let begun = out.len();
        // Byte by byte, so that no command is seen with half of the next.
        for byte in bytes {
            self.device.take(now, std::slice::from_ref(byte), out);
            self.see();
        }
        self.takes += 1;
        self.served += i64::from(self.mode != GOOD);
        match self.mode {
            HANGS => out.truncate(begun),
            NOT_A_NUMBER => out[begun..].iter_mut().for_each(|byte| *byte ^= 0x55),
            _ => {}
        }
    }
}

fn locked<T>(line: &Mutex<Faulty<T>>) -> MutexGuard<'_, Faulty<T>> {
    line.lock().expect("not poisoned")
}

impl<T> Inside for Arc<Mutex<Faulty<T>>> {
    fn get(&self, name: &str) -> i64 {
        let line = locked(self);
        match name {
            "force" => (line.seen.1.norm() * 1e6) as i64,
            "jump" => (line.jump * 1e6) as i64,
            "writes" => line.takes,
            "served" => line.served,
            other => panic!("{other}"),
        }
    }

    fn set(&self, name: &str, value: i64) {
        let mut line = locked(self);
        match name {
            "mode" => line.mode = value,
            "served" => line.served = value,
            "jump" => line.jump = value as f64 * 1e-6,
            other => panic!("{other}"),
        }
    }
}
