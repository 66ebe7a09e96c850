//! A way of the network under a virtual clock: the bytes that a socket would carry, sealed, late, out of order and sometimes lost.

use taut_method_tests::hand::Random;
use taut_proto::header::MAX_DATAGRAM_BYTES;
use taut_proto::seal::{KEY_MATERIAL_BYTES, Opener, Sealer};
use taut_proto::{DecodeError, Payload};

/// What a network does to datagrams, each way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impairment {
    /// Least time on the way, ns.
    pub delay_ns: u64,
    /// Up to this much more, evenly spread, ns; what is overtaken arrives out of order.
    pub jitter_ns: u64,
    /// Share that is lost, in [0, 1].
    pub loss: f64,
}

impl Impairment {
    /// `delay_ms` with a tenth of it as jitter, and `loss` in percent.
    pub fn new(delay_ms: f64, loss_percent: f64) -> Self {
        Self {
            delay_ns: (delay_ms * 1e6) as u64,
            jitter_ns: (delay_ms * 1e5) as u64,
            loss: loss_percent * 1e-2,
        }
    }
}

/// One direction. Seeded: the same sends give the same arrivals.
pub struct Way {
    impairment: Impairment,
    sealer: Sealer,
    opener: Opener,
    random: Random,
    /// Arrival time, number of the send, bytes.
    under_way: Vec<(u64, u64, Vec<u8>)>,
    sends: u64,
    bytes: u64,
    /// What is sent now is lost, and leaves no trace in what comes later.
    pub(crate) loses_all: bool,
}

impl Way {
    /// A way with a key of its own.
    pub fn new(impairment: Impairment, seed: u64) -> Self {
        let material = [seed as u8; KEY_MATERIAL_BYTES];
        Self {
            impairment,
            sealer: Sealer::new(&material, 1, 0),
            opener: Opener::new(&material, 1, 0),
            random: Random(seed),
            under_way: Vec::new(),
            sends: 0,
            bytes: 0,
            loses_all: false,
        }
    }

    /// From now on the least time on the way is this, ns.
    pub fn set_delay(&mut self, delay_ns: u64) {
        self.impairment.delay_ns = delay_ns;
    }

    /// Seals `payload` and lets it go at `now_ns`.
    pub fn send(&mut self, now_ns: u64, payload: &Payload) {
        if self.loses_all {
            return;
        }
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        let datagram = match self.sealer.seal(payload, &mut buffer) {
            Ok(datagram) => datagram.to_vec(),
            Err(error) => panic!("{error}"),
        };
        self.sends += 1;
        self.bytes += datagram.len() as u64;
        let lost = self.random.unit() < self.impairment.loss;
        let late = (self.random.unit() * self.impairment.jitter_ns as f64) as u64;
        if !lost {
            let arrival = now_ns + self.impairment.delay_ns + late;
            self.under_way.push((arrival, self.sends, datagram));
        }
    }

    /// Hands over what has arrived by `now_ns`, earliest first.
    pub fn receive(&mut self, now_ns: u64, mut take: impl FnMut(Payload)) {
        self.under_way
            .sort_unstable_by_key(|(arrival, send, _)| (*arrival, *send));
        let arrived = self
            .under_way
            .partition_point(|(arrival, ..)| *arrival <= now_ns);
        for (_, _, datagram) in self.under_way.drain(..arrived) {
            match self.opener.open(&datagram) {
                Ok(opened) => take(opened.payload),
                Err(error) => panic!("{error}"),
            }
        }
    }

    /// Datagrams and bytes sent.
    pub fn sent(&self) -> (u64, u64) {
        (self.sends, self.bytes)
    }
}

/// Bytes to a payload and back, for what travels without a network.
pub fn through_the_codec(payload: &Payload) -> Result<Payload, DecodeError> {
    let mut buffer = [0; taut_proto::header::MAX_PAYLOAD_BYTES];
    let used = payload.encode_into(&mut buffer).unwrap_or(0);
    Payload::decode(payload.kind(), &buffer[..used])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_delays_and_loses_as_asked_and_the_same_way_each_time() {
        let arrivals = || {
            let mut way = Way::new(Impairment::new(20.0, 5.0), 3);
            let mut seen = Vec::new();
            for tick in 0..4000_u64 {
                way.send(tick * 1_000_000, &Payload::Heartbeat);
                way.receive(tick * 1_000_000, |_| seen.push(tick));
            }
            seen
        };
        let seen = arrivals();
        assert!(seen[0] >= 20, "{}", seen[0]);
        let lost = 1.0 - seen.len() as f64 / 3979.0;
        assert!((lost - 0.05).abs() < 0.01, "{lost}");
        assert_eq!(seen, arrivals());
    }
}
