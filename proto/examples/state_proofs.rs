//! What it costs to know that a state of a group is the server's: `cargo run --release -p taut-proto --example state_proofs`.
//!
//! Three ways, each with the processor time of the server and of a receiver for a second of 1000 states, the bytes, and how long a forged state may be
//! believed. Hash chains (TESLA) need one key and one MAC a state, and a disclosure that is later than the worst way of a datagram: what they cost is that of a hash.

use ring::{
    rand::SystemRandom,
    signature::{ED25519, Ed25519KeyPair, KeyPair, UnparsedPublicKey},
};
use std::{hint::black_box, time::Instant};
use taut_proto::{
    Confirmation, Kind, Payload,
    codec::{decode, encode_into},
    confirmation::SentState,
    header::{MAX_DATAGRAM_BYTES, MAX_PAYLOAD_BYTES},
    seal::{Opener, Sealer},
    state::payload_hash,
};

const TURNS: u32 = 2000;
const STATES: f64 = 1000.0;
/// A large state: a tool, bodies, contacts.
const STATE_BYTES: usize = 600;
/// Exchanges a second, each with a confirmation.
const EXCHANGES: f64 = 20.0;

/// Median of some turns, µs.
fn us(mut run: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..TURNS)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// To sign ten fingerprints, and to check the signature; `None` where the system gives no random numbers.
fn signature_us() -> Option<(f64, f64)> {
    let document = Ed25519KeyPair::generate_pkcs8(&SystemRandom::new()).ok()?;
    let Ok(pair) = Ed25519KeyPair::from_pkcs8(document.as_ref()) else {
        unreachable!("made above");
    };
    let digests = [3; 80]; // ten states
    let sign = us(|| {
        black_box(pair.sign(black_box(&digests)));
    });
    let signature = pair.sign(&digests);
    let public = UnparsedPublicKey::new(&ED25519, pair.public_key().as_ref());
    let verify = us(|| {
        let valid = public.verify(black_box(&digests), signature.as_ref());
        assert!(valid.is_ok());
    });
    Some((sign, verify))
}

/// To seal a confirmation and to open one, with its length.
fn confirmation_us() -> (f64, f64, usize) {
    let mut confirmation = Confirmation::default();
    for tick in (1..=100).rev() {
        confirmation.add(SentState {
            tick,
            state_hash: tick,
        });
    }
    let sealer = Sealer::new(&[1; 28], 1, 0);
    let mut opener = Opener::new(&[1; 28], 1, 0);
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    let mut payload = [0; MAX_PAYLOAD_BYTES];
    let length = encode_into(&confirmation, &mut payload).unwrap_or(0);
    let message = Payload::Confirm(confirmation);
    let seal = us(|| {
        black_box(sealer.seal(&message, &mut buffer).is_ok());
    });
    let open = us(|| {
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        if let Ok(datagram) = sealer.seal_bytes(Kind::Confirm, &payload[..length], &mut buffer) {
            assert!(opener.open(datagram).is_ok());
        }
    });
    assert!(decode::<Confirmation>(&payload[..length]).is_ok());
    (seal, open, length)
}

fn main() {
    let state = [7; STATE_BYTES];
    let hash = us(|| {
        black_box(payload_hash(black_box(&state)));
    });
    let Some((sign, verify)) = signature_us() else {
        return eprintln!("the system gives no random numbers");
    };
    let (seal, open, length) = confirmation_us();

    println!(
        "fingerprint of a state of {STATE_BYTES} bytes: {hash:.2} us; signature {sign:.1} us, check {verify:.1} us"
    );
    println!("| way | server, ms/s | each receiver, ms/s | bytes/s | believed for at most |");
    println!("| --- | --- | --- | --- | --- |");
    let hashes = STATES * hash;
    let batches = STATES / 10.0;
    let ways = [
        (
            "a signature for each state",
            STATES * sign,
            STATES * verify,
            STATES * 64.0,
            "not at all",
        ),
        (
            "a signature for ten states",
            batches * sign,
            hashes + batches * verify,
            batches * 64.0,
            "10 ms and a lost batch",
        ),
        (
            "hash chain, key disclosed after 50 ms",
            hashes,
            2.0 * hashes,
            STATES * 48.0,
            "50 ms and the clock's error",
        ),
        (
            "confirmed to each session, for each of them",
            EXCHANGES * seal,
            hashes + EXCHANGES * open,
            EXCHANGES * (length + 40) as f64,
            "50 ms and a round trip; 250 ms where confirmations are lost",
        ),
    ];
    for (way, server, receiver, bytes, latency) in ways {
        println!(
            "| {way} | {:.2} | {:.2} | {bytes:.0} | {latency} |",
            server * 1e-3,
            receiver * 1e-3
        );
    }
}
