//! Whether bytes are the picture that a node says they are. A browser and a person look at them: nothing else than a plain PNG gets there.

use png::{BitDepth, ColorType, Decoder, Limits};

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
/// Bytes of a chunk around its content: length, kind and checksum.
const CHUNK_FRAME: usize = 12;
/// Most bytes that decoding takes: a picture of 1280 by 1280 pixels, three bytes each, is 4.7 MiB.
const MAX_DECODED_BYTES: usize = 16 << 20;

/// Looks at every chunk and decodes every pixel.
///
/// # Errors
/// Why it is no picture of this size, for people.
pub(super) fn check(bytes: &[u8], size: (u16, u16)) -> Result<(), String> {
    check_chunks(bytes)?;
    let no_png = |error: png::DecodingError| format!("it is no PNG ({error})");
    let limits = Limits {
        bytes: MAX_DECODED_BYTES,
    };
    let decoder = Decoder::new_with_limits(std::io::Cursor::new(bytes), limits);
    let mut reader = decoder.read_info().map_err(no_png)?;
    let info = reader.info();
    let (width, height) = (u32::from(size.0), u32::from(size.1));
    if (info.width, info.height) != (width, height) {
        return Err(format!(
            "it has {}x{} pixels, and {width}x{height} were announced",
            info.width, info.height
        ));
    }
    if (info.color_type, info.bit_depth) != (ColorType::Rgb, BitDepth::Eight) || info.interlaced {
        return Err("its pixels are not red, green and blue of 8 bits in rows".to_owned());
    }
    // The size was bounded when it was announced.
    let mut row = 0;
    while reader.next_row().map_err(no_png)?.is_some() {
        row += 1;
    }
    if row != height {
        return Err(format!("it has {row} of {height} rows"));
    }
    reader.finish().map_err(no_png) // the checksums behind the pixels
}

/// A plain PNG is its head, its pixels and its end: no text, no profile, no second picture, nothing behind it.
fn check_chunks(bytes: &[u8]) -> Result<(), String> {
    let mut rest = bytes.strip_prefix(SIGNATURE).ok_or("it is no PNG")?;
    let mut before: &[u8] = b"";
    loop {
        let (length, after) = rest.split_first_chunk::<4>().ok_or("it ends in between")?;
        let kind = after.get(..4).ok_or("it ends in between")?;
        match (before, kind) {
            (b"", b"IHDR") | (b"IHDR" | b"IDAT", b"IDAT") | (b"IDAT", b"IEND") => {}
            _ => {
                return Err(format!(
                    "it holds more than pixels ({})",
                    kind.escape_ascii()
                ));
            }
        }
        let whole = (u32::from_be_bytes(*length) as usize).saturating_add(CHUNK_FRAME);
        rest = rest.get(whole..).ok_or("it ends in between")?;
        if kind == b"IEND" {
            return match rest.is_empty() {
                true => Ok(()),
                false => Err("something stands behind it".to_owned()),
            };
        }
        before = kind;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use png::Encoder;

    fn encoded(
        width: u32,
        height: u32,
        prepare: impl FnOnce(&mut Encoder<'_, &mut Vec<u8>>),
    ) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, width, height);
        encoder.set_color(ColorType::Rgb);
        prepare(&mut encoder);
        let channels = 3;
        let pixels: Vec<u8> = (0..width * height * channels)
            .map(|i| (i * 37) as u8)
            .collect();
        let mut writer = encoder.write_header().expect("a head");
        writer.write_image_data(&pixels).expect("pixels");
        writer.finish().expect("an end");
        bytes
    }

    pub(in super::super) fn png_of(width: u32, height: u32) -> Vec<u8> {
        encoded(width, height, |_| {})
    }

    fn refused(bytes: &[u8], size: (u16, u16)) -> String {
        check(bytes, size).expect_err("refused")
    }

    #[test]
    fn a_plain_picture_of_the_announced_size_is_one() {
        assert_eq!(check(&png_of(8, 4), (8, 4)), Ok(()));
        assert_eq!(check(&png_of(1280, 3), (1280, 3)), Ok(()));
        let said = refused(&png_of(8, 4), (4, 8));
        assert!(
            said.contains("8x4 pixels, and 4x8 were announced"),
            "{said}"
        );
    }

    #[test]
    fn what_is_more_or_less_than_pixels_is_refused() {
        let text = encoded(8, 4, |encoder| {
            let added = encoder.add_ztxt_chunk("Comment".into(), "x".repeat(100_000));
            added.expect("a text");
        });
        assert!(refused(&text, (8, 4)).contains("zTXt"));
        let film = encoded(8, 4, |encoder| encoder.set_animated(1, 0).expect("a film"));
        assert!(refused(&film, (8, 4)).contains("acTL"));
        for bad in [&b""[..], b"GIF89a", b"<svg onload=alert(1)>", SIGNATURE] {
            assert!(check(bad, (8, 4)).is_err(), "{bad:?}");
        }
        let good = png_of(8, 4);
        let mut longer = good.clone();
        longer.extend_from_slice(b"PK\x03\x04");
        assert!(refused(&longer, (8, 4)).contains("behind it"));
    }

    #[test]
    fn no_cut_and_no_bent_byte_gets_by_as_another_picture() {
        let good = png_of(8, 4);
        for length in 0..good.len() {
            assert!(check(&good[..length], (8, 4)).is_err(), "cut to {length}");
        }
        for at in 0..good.len() {
            let mut bent = good.clone();
            bent[at] ^= 0x10;
            // A checksum stands behind everything but the signature, which has one value.
            assert!(check(&bent, (8, 4)).is_err(), "byte {at}");
        }
    }

    #[test]
    fn a_head_that_claims_a_world_takes_no_memory() {
        let mut bytes = SIGNATURE.to_vec();
        for (kind, content) in [
            (
                &b"IHDR"[..],
                &[
                    0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 8, 2, 0, 0, 0,
                ][..],
            ),
            (b"IDAT", &[0x78, 0x9c, 0x63, 0, 0]),
            (b"IEND", b""),
        ] {
            bytes.extend(u32::try_from(content.len()).expect("short").to_be_bytes());
            let body = [kind, content].concat();
            bytes.extend(&body);
            bytes.extend(crc(&body).to_be_bytes());
        }
        let said = refused(&bytes, (8, 4));
        assert!(
            said.contains("were announced") || said.contains("no PNG"),
            "{said}"
        );
    }

    /// Of PNG, section 5.5.
    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0_u32, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |c, _| {
                (c >> 1) ^ (0xedb8_8320 * (c & 1))
            })
        })
    }
}
