//! What the process of a device in Python is asked, and what it answers. `taut_host.py` is the other end. Little-endian.
//!
//! | message  | bytes                                                                                            |
//! |----------|--------------------------------------------------------------------------------------------------|
//! | request  | what (1), six numbers of 8: force, torque; zero but for a write                                   |
//! | answer   | code (1), length (4), and so many bytes: nothing, a sample, the device's information, or a text   |

use super::Answer;
use super::claims::{PluginInfo, RawInfo, RawSample, Worth};

pub(super) const REQUEST: usize = 49;
/// Bytes before an answer's content.
pub(super) const HEAD: usize = 5;
/// Most bytes of an answer's content: a text.
pub(super) const MAX_CONTENT: usize = 16 << 10;
const SAMPLE: usize = 14 * 8 + 2 * 4;
const INFO: usize = 64 + 2 * 4 + 5 * 8;
/// Code of the information.
const IS_INFO: u8 = 10;
/// Code of a text that says what went wrong.
const IS_ERROR: u8 = 11;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ask {
    Read,
    Write,
    Close,
}

pub(super) enum Said {
    /// To a read or a write; a sample to a read that brought one.
    Answer(Answer, Option<RawSample>),
    /// Once, after the open.
    Info(Box<RawInfo>),
    /// The device was closed, if it was open.
    Error(String),
}

pub(super) fn request(ask: Ask, wrench: &[f64; 6]) -> [u8; REQUEST] {
    let mut bytes = [0; REQUEST];
    bytes[0] = match ask {
        Ask::Read => b'R',
        Ask::Write => b'W',
        Ask::Close => b'C',
    };
    for (place, number) in bytes[1..].chunks_exact_mut(8).zip(wrench) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    bytes
}

/// Code and length of an answer; `None` for a length that none has.
pub(super) fn head(bytes: [u8; HEAD]) -> Option<(u8, usize)> {
    let [code, a, b, c, d] = bytes;
    let length = u32::from_le_bytes([a, b, c, d]) as usize;
    (length <= MAX_CONTENT).then_some((code, length))
}

/// The answer; `None` where it is none.
pub(super) fn answer(code: u8, content: &[u8]) -> Option<Said> {
    match (code, content.len()) {
        (0, SAMPLE) => Some(Said::Answer(Answer::Good, Some(sample(content)))),
        (0..=2, 0) => Some(Said::Answer(i32::from(code).into(), None)),
        (IS_INFO, INFO) => Some(Said::Info(Box::new(info(content)))),
        (IS_ERROR, _) => Some(Said::Error(
            String::from_utf8_lossy(content).trim().to_owned(),
        )),
        _ => None,
    }
}

/// What may be used of an answer.
#[derive(Clone, Debug, PartialEq)]
pub enum ReadAnswer {
    /// A sample of a device that measures an orientation: position, m, orientation w x y z, velocity, m/s.
    Sample([f64; 3], [f64; 4], [f64; 3]),
    /// What the device is.
    Info(PluginInfo),
    /// What went wrong.
    Text(String),
    /// An answer that brings nothing.
    Nothing,
}

/// The answer at the front of `bytes`, and how many bytes it takes; `None` where there is none, or where nothing of it may be used: as the driver reads and
/// judges what comes from the process, for those who feed it damage.
#[must_use]
pub fn read_answer(bytes: &[u8]) -> Option<(ReadAnswer, usize)> {
    let (first, rest) = bytes.split_first_chunk::<HEAD>()?;
    let (code, length) = head(*first)?;
    let read = match answer(code, rest.get(..length)?)? {
        Said::Answer(_, Some(sample)) if sample.worth(true) == Worth::Good => {
            ReadAnswer::Sample(sample.position, sample.orientation, sample.velocity)
        }
        Said::Answer(..) => ReadAnswer::Nothing,
        Said::Info(raw) => ReadAnswer::Info(PluginInfo::of(&raw).ok()?),
        Said::Error(text) => ReadAnswer::Text(text),
    };
    Some((read, HEAD + length))
}

/// Takes numbers from the front of bytes, of which there are enough.
struct Front<'a>(&'a [u8]);

impl Front<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        if let Some((front, rest)) = self.0.split_first_chunk::<N>() {
            (bytes, self.0) = (*front, rest);
        }
        bytes
    }

    fn number(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    fn numbers<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.number())
    }

    fn whole(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }
}

fn sample(bytes: &[u8]) -> RawSample {
    let mut front = Front(bytes);
    RawSample {
        position: front.numbers(),
        orientation: front.numbers(),
        velocity: front.numbers(),
        angular_velocity: front.numbers(),
        age: front.number(),
        buttons: front.whole(),
        measured: front.whole(),
    }
}

fn info(bytes: &[u8]) -> RawInfo {
    let mut front = Front(bytes);
    RawInfo {
        name: front.take(),
        sensed: front.whole(),
        actuated: front.whole(),
        max_force: front.number(),
        max_torque: front.number(),
        max_stiffness: front.number(),
        max_rotational_stiffness: front.number(),
        rate: front.number(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn requests_and_samples_have_the_layout_of_the_other_end() {
        let asked = request(Ask::Write, &[1.0, 0.0, 0.0, 0.0, 0.0, -2.0]);
        assert_eq!(asked[0], b'W');
        assert_eq!(asked[1..9], 1.0_f64.to_le_bytes());
        assert_eq!(asked[41..], (-2.0_f64).to_le_bytes());
        let mut bytes: Vec<u8> = (0..14).flat_map(|n| f64::from(n).to_le_bytes()).collect();
        bytes.extend(5_u32.to_le_bytes());
        bytes.extend(1_u32.to_le_bytes());
        let Some(Said::Answer(Answer::Good, Some(read))) = answer(0, &bytes) else {
            panic!("a sample");
        };
        assert_eq!(read.position, [0.0, 1.0, 2.0]);
        assert_eq!(read.orientation, [3.0, 4.0, 5.0, 6.0]);
        assert_eq!((read.age, read.buttons), (13.0, 5));
        assert_eq!(read.turning(), Some([10.0, 11.0, 12.0]));
    }

    proptest! {
        #[test]
        fn no_bytes_are_more_than_they_say(code in any::<u8>(), content in proptest::collection::vec(any::<u8>(), 0..300)) {
            match answer(code, &content) {
                Some(Said::Answer(_, sample)) => prop_assert_eq!(content.len(), if sample.is_some() { SAMPLE } else { 0 }),
                Some(Said::Info(_)) => prop_assert_eq!(content.len(), INFO),
                Some(Said::Error(_)) => prop_assert_eq!(code, IS_ERROR),
                None => {}
            }
        }

        #[test]
        fn no_length_is_beyond_the_bound(bytes in any::<[u8; HEAD]>()) {
            prop_assert!(head(bytes).is_none_or(|(_, length)| length <= MAX_CONTENT));
        }
    }
}
