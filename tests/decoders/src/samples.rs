//! The golden bytes of everything that travels: the file that the wire types are tested by, so that what is new there is fed here too.

use taut_proto::seal::{KEY_MATERIAL_BYTES, Opener};

const GOLDEN: &str = include_str!("../../../proto/tests/golden.txt");

/// Key material, epoch and sender under which the golden datagrams are sealed.
pub(crate) fn golden_opener() -> Opener {
    let material: [u8; KEY_MATERIAL_BYTES] = std::array::from_fn(|i| i as u8);
    Opener::new(&material, 0x0102_0304, 5)
}

/// Bytes of every golden line whose name begins so.
pub(crate) fn golden(beginning: &str) -> Vec<Vec<u8>> {
    let lines = GOLDEN.lines().filter(|line| line.starts_with(beginning));
    let digits = lines.filter_map(|line| line.split_once(' '));
    digits.map(|(_, digits)| bytes(digits)).collect()
}

fn bytes(digits: &str) -> Vec<u8> {
    (0..digits.len() / 2)
        .filter_map(|i| u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).ok())
        .collect()
}
