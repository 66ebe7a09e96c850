//! Bytes as hexadecimal digits, for key files and fingerprints.

/// Two digits per byte.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// 64 digits and nothing else; the error is how many digits come before the first other character.
pub(crate) fn parse_hex(text: &str) -> Result<[u8; 32], usize> {
    let found = text.chars().take_while(char::is_ascii_hexdigit).count();
    if found != 64 || text.len() != 64 {
        return Err(found);
    }
    let (pairs, _) = text.as_bytes().as_chunks::<2>();
    let mut bytes = [0; 32];
    for (byte, [high, low]) in bytes.iter_mut().zip(pairs) {
        *byte = digit(*high) << 4 | digit(*low);
    }
    Ok(bytes)
}

/// Value of a digit that is known to be hexadecimal.
fn digit(digit: u8) -> u8 {
    match digit {
        b'0'..=b'9' => digit - b'0',
        _ => (digit.to_ascii_lowercase().wrapping_sub(b'a') + 10) & 0x0f,
    }
}
