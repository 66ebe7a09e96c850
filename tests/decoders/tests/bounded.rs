//! Golden samples, changed by a seed, through every decoder: no panic, and no more memory than the input's size allows.
//!
//! The bounded stand-in for `scripts/fuzz` on machines without the nightly compiler. `TAUT_DECODER_INPUTS` sets the inputs per decoder.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

use taut_decoders::mutation::{Numbers, mutated};
use taut_decoders::{DECODERS, Decoder, FIXED_MEMORY};

/// Changed inputs per decoder.
const INPUTS: u64 = 4000;

thread_local! {
    static HELD: Cell<usize> = const { Cell::new(0) };
    static MOST: Cell<usize> = const { Cell::new(0) };
}

/// The system's memory, counted per thread.
struct Counting;

#[allow(unsafe_code, reason = "an allocator is an unsafe trait")]
// SAFETY: every call goes on to the system's allocator as it came; the counters are plain thread-local numbers without destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        HELD.set(HELD.get().wrapping_add(layout.size()));
        MOST.set(MOST.get().max(HELD.get()));
        // SAFETY: the caller's promise about `layout` is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // What another thread allocated may be freed here: below zero is zero.
        HELD.set(HELD.get().saturating_sub(layout.size()));
        // SAFETY: the caller's promise about `memory` and `layout` is passed on.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Most memory held during one input, bytes.
fn memory_of(decoder: &Decoder, input: &[u8]) -> usize {
    let before = HELD.get();
    MOST.set(before);
    let fed = catch_unwind(AssertUnwindSafe(|| (decoder.feed)(input)));
    assert!(
        fed.is_ok(),
        "{} panics on {} bytes: {}",
        decoder.name,
        input.len(),
        input.escape_ascii()
    );
    MOST.get().saturating_sub(before)
}

fn inputs() -> u64 {
    let set = std::env::var("TAUT_DECODER_INPUTS");
    set.ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(INPUTS)
}

/// Feeds the decoders whose turn is `turn` of `TURNS`: the test harness runs the turns side by side.
fn feed_turn(turn: usize) {
    for (number, decoder) in DECODERS
        .iter()
        .enumerate()
        .filter(|(n, _)| n % TURNS == turn)
    {
        let seeds = (decoder.seeds)();
        assert!(!seeds.is_empty(), "{} has no samples", decoder.name);
        for seed in &seeds {
            let _ = memory_of(decoder, seed); // buffers that are kept are made here
        }
        let mut numbers = Numbers::new(number as u64 + 1);
        let mut most = (0, 0);
        for _ in 0..inputs() {
            let input = mutated(&seeds, &mut numbers);
            let held = memory_of(decoder, &input);
            most = most.max((held, input.len()));
            let allowed = FIXED_MEMORY + decoder.memory_per_byte * input.len();
            assert!(
                held <= allowed,
                "{} holds {held} bytes for {} of input: {}",
                decoder.name,
                input.len(),
                input.escape_ascii()
            );
        }
        println!(
            "{}: at most {} bytes, for {} of input",
            decoder.name, most.0, most.1
        );
    }
}

const TURNS: usize = 2;

#[test]
fn changed_samples_are_read_or_refused_within_bounded_memory() {
    feed_turn(0);
}

#[test]
fn changed_samples_are_read_or_refused_within_bounded_memory_the_other_half() {
    feed_turn(1);
}

#[test]
fn names_are_unique() {
    let mut names: Vec<_> = DECODERS.iter().map(|decoder| decoder.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), DECODERS.len());
}
