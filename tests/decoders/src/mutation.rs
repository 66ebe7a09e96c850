//! Changes to valid inputs, by a seed: what a broken network, a broken disk or somebody curious makes of them.

/// A source of numbers that every machine draws alike: SplitMix64.
///
/// Source: Steele, Lea, Flood: Fast splittable pseudorandom number generators (2014).
#[derive(Clone, Copy, Debug)]
pub struct Numbers(u64);

impl Numbers {
    /// Numbers of a seed.
    pub fn new(seed: u64) -> Numbers {
        Numbers(seed)
    }

    /// The next one.
    pub fn next_word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// One below `end`; 0 for an `end` of 0.
    pub fn below(&mut self, end: usize) -> usize {
        self.next_word().checked_rem(end as u64).unwrap_or(0) as usize
    }
}

/// Numbers that decoders stumble over, as little-endian bytes.
const BOUNDARIES: [u64; 8] = [
    0,
    1,
    0x7f,
    0xff,
    0x7fff_ffff,
    0xffff_ffff,
    0x7ff8_0000_0000_0000, // NaN
    u64::MAX,
];

/// Words that text formats stumble over.
const WORDS: [&[u8]; 12] = [
    b"-1",
    b"1e999",
    b"nan",
    b"inf",
    b"4294967295",
    b"99999999999999999999",
    b"\"",
    b"[",
    b"{",
    b"\n",
    b",",
    b"\xff",
];

/// Most changes to one input.
const MAX_CHANGES: usize = 4;
/// Most bytes of an input that grew.
const MAX_BYTES: usize = 1 << 16;

/// One to four changes to one of `seeds`: bits, bytes, boundary numbers, words, cuts, repetitions, parts of another seed.
pub fn mutated(seeds: &[Vec<u8>], numbers: &mut Numbers) -> Vec<u8> {
    let mut bytes = match seeds.get(numbers.below(seeds.len())) {
        Some(seed) => seed.clone(),
        None => Vec::new(),
    };
    for _ in 0..1 + numbers.below(MAX_CHANGES) {
        change(&mut bytes, seeds, numbers);
        bytes.truncate(MAX_BYTES);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], numbers: &mut Numbers) {
    let length = bytes.len();
    let at = numbers.below(length);
    match numbers.below(9) {
        0 if length > 0 => bytes[at] ^= 1 << numbers.below(8),
        1 if length > 0 => bytes[at] = numbers.next_word() as u8,
        2 => {
            let value = BOUNDARIES[numbers.below(BOUNDARIES.len())].to_le_bytes();
            let width = (1 << numbers.below(4)).min(length - at);
            bytes[at..at + width].copy_from_slice(&value[..width]);
        }
        3 => bytes.truncate(at),
        4 => bytes.extend((0..1 + numbers.below(40)).map(|_| numbers.next_word() as u8)),
        5 => {
            let end = at + numbers.below(length - at + 1);
            bytes.drain(at..end);
        }
        6 => {
            let end = at + numbers.below(length - at + 1);
            let repeated = bytes[at..end].to_vec();
            bytes.splice(at..at, repeated);
        }
        7 => {
            let word = WORDS[numbers.below(WORDS.len())];
            let end = (at + numbers.below(word.len() + 1)).min(length);
            bytes.splice(at..end, word.iter().copied());
        }
        _ => {
            let Some(other) = seeds.get(numbers.below(seeds.len())) else {
                return;
            };
            let from = numbers.below(other.len());
            let to = from + numbers.below(other.len() - from + 1);
            bytes.splice(at..at, other[from..to].iter().copied());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_inputs_again_and_another_seed_others() {
        let seeds = [b"one and two".to_vec(), b"{}".to_vec(), Vec::new()];
        let run = |seed| {
            let mut numbers = Numbers::new(seed);
            (0..1000)
                .map(|_| mutated(&seeds, &mut numbers))
                .collect::<Vec<_>>()
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
        assert!(run(1).iter().any(Vec::is_empty));
    }
}
