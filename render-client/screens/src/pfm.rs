//! Portable float maps: three lines of text, then rows of 32-bit floats.
//!
//! `PF` has three values for a pixel, `Pf` one. The second line has width and height. The third has a number whose sign says
//! the order of bytes (negative: little-endian); its size is a unit that no program agrees on, so only 1 is taken. Rows
//! come from the lowest to the highest, pixels from left to right.
//!
//! Source: pfm(5) of netpbm. That the values of a map of points belong to the middles of equal parts of the output, as
//! texels do, is how nDisplay and MPCDI's maps of one value for each pixel are used.

use crate::fault::Unnamed;
use crate::mesh::MAX_NODES;

/// Longest side, pixels.
pub const MAX_SIDE: usize = 16_384;
/// Longest header, bytes.
const MAX_HEADER: usize = 256;
/// Largest file, bytes.
pub(crate) const MAX_BYTES: u64 = MAX_HEADER as u64 + 12 * MAX_NODES as u64;

/// A float map.
#[derive(Clone, Debug, PartialEq)]
pub struct FloatMap {
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// 1 or 3.
    pub channels: usize,
    /// Row by row from the lower left.
    pub values: Vec<f32>,
}

impl FloatMap {
    /// The values of a pixel, column and row from 0 at the lower left.
    #[must_use]
    pub fn pixel(&self, column: usize, row: usize) -> &[f32] {
        let first = (row * self.width + column) * self.channels;
        &self.values[first..first + self.channels]
    }
}

/// Reads a map from the bytes of its file.
pub(crate) fn parse(bytes: &[u8]) -> Result<FloatMap, Unnamed> {
    let mut rest = bytes;
    let channels = match word(&mut rest)? {
        "PF" => 3,
        "Pf" => 1,
        _ => {
            return Err(Unnamed::new(
                "does not begin with PF or Pf; save it as a portable float map",
            ));
        }
    };
    let side = |text: &str| {
        let value = text.parse::<usize>().ok();
        value.filter(|side| (2..=MAX_SIDE).contains(side)).ok_or_else(|| {
            Unnamed::new(format!(
                "has a side of {text} pixels, but a map has 2 to {MAX_SIDE}; save it with so many"
            ))
        })
    };
    let (width, height) = (side(word(&mut rest)?)?, side(word(&mut rest)?)?);
    let count = width * height;
    if count > MAX_NODES {
        return Err(Unnamed::new(format!(
            "has {width} x {height} values, more than {MAX_NODES}; save every second of them, what is between is interpolated"
        )));
    }
    let scale = word(&mut rest)?;
    let little = match scale.parse::<f32>() {
        Ok(-1.0) => true,
        Ok(1.0) => false,
        _ => {
            return Err(Unnamed::new(format!(
                "has the scale {scale}, but must have -1.0 (little-endian) or 1.0 (big-endian); save the values in metres or shares, unscaled"
            )));
        }
    };
    let needed = 4 * channels * count;
    if rest.len() != needed {
        let what = if rest.len() < needed {
            "ends early"
        } else {
            "goes on"
        };
        return Err(Unnamed::new(format!(
            "{what}: {width} x {height} pixels of {channels} values are {needed} bytes, but {} follow its header; save it again",
            rest.len()
        )));
    }
    let value = |four: &[u8]| {
        let four = [four[0], four[1], four[2], four[3]];
        if little {
            f32::from_le_bytes(four)
        } else {
            f32::from_be_bytes(four)
        }
    };
    Ok(FloatMap {
        width,
        height,
        channels,
        values: rest.chunks_exact(4).map(value).collect(),
    })
}

/// The next word of the header, and one white space behind it.
fn word<'b>(rest: &mut &'b [u8]) -> Result<&'b str, Unnamed> {
    let bytes = *rest;
    let head = &bytes[..bytes.len().min(MAX_HEADER)];
    let end = head.iter().position(u8::is_ascii_whitespace);
    let word = end.and_then(|end| std::str::from_utf8(&bytes[..end]).ok());
    let (Some(end), Some(word)) = (end, word.filter(|word| !word.is_empty())) else {
        return Err(Unnamed::new(
            "has no header of a portable float map (PF, width and height, scale); save it as one",
        ));
    };
    *rest = &bytes[end + 1..];
    Ok(word)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, values: &[f32]) -> Vec<u8> {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes());
        header.bytes().chain(bytes).collect()
    }

    fn fault(bytes: &[u8]) -> String {
        parse(bytes).expect_err("refused").text
    }

    #[test]
    fn the_first_row_is_the_lowest_and_both_orders_of_bytes_are_read() {
        let values: Vec<f32> = (0..6).map(|n| n as f32).collect();
        let map = parse(&file("Pf\n3 2\n-1.0\n", &values)).expect("a map");
        assert_eq!((map.width, map.height, map.channels), (3, 2, 1));
        assert_eq!((map.pixel(2, 0), map.pixel(0, 1)), (&[2.0][..], &[3.0][..]));
        let mut big = b"Pf 3 2 1 ".to_vec();
        big.extend(values.iter().flat_map(|value| value.to_be_bytes()));
        assert_eq!(parse(&big), Ok(map));
    }

    #[test]
    fn headers_that_promise_what_is_not_there_take_no_memory() {
        for header in [
            "PF\n1000000000 1000000000\n-1\n",
            "PF\n16384 16384\n-1\n",
            "PF\n18446744073709551615 3\n-1\n",
            "PF\n-4 3\n-1\n",
            "PF\n1 3\n-1\n",
        ] {
            let text = fault(&file(header, &[0.0; 12]));
            assert!(text.contains("save"), "{text}");
        }
        assert!(fault(&file("PF\n2 2\n-1\n", &[0.0; 11])).contains("ends early: 2 x 2 pixels"));
        assert!(fault(&file("PF\n2 2\n-1\n", &[0.0; 13])).contains("goes on"));
    }

    #[test]
    fn a_scale_other_than_one_is_refused_by_its_value() {
        for scale in ["-2.5", "0", "NaN", "inf", "-1000", "x"] {
            let text = fault(&file(&format!("Pf\n2 2\n{scale}\n"), &[0.0; 4]));
            assert!(text.contains(&format!("the scale {scale}, but")), "{text}");
        }
    }

    #[test]
    fn what_is_no_float_map_says_so() {
        for bytes in [
            &b""[..],
            b"P",
            b"PF",
            b"PF\n3",
            b"\n\n\n",
            &[b'x'; 900],
            &[0xff; 9],
        ] {
            let text = fault(bytes);
            assert!(text.contains("portable float map"), "{text}");
        }
    }
}
