//! Tokens in files of their own: what a browser or a script shows to be let in.

use std::path::Path;

/// Shortest token: 16 characters of 64 are 96 bits.
const MIN_TOKEN: usize = 16;
/// Most bytes of a token's file.
const MAX_TOKEN_BYTES: u64 = 1024;

/// One line of at least 16 letters, digits, `-` and `_`, as `openssl rand -hex 32` writes it; `table` is who wants it.
pub(super) fn read_token(table: &str, path: &Path) -> Result<String, String> {
    let refuse = |reason: String| {
        format!(
            "the token of [{table}] cannot be read from {}: {reason}; make one with: openssl rand -hex 32",
            path.display()
        )
    };
    let length = std::fs::metadata(path)
        .map_err(|error| refuse(error.to_string()))?
        .len();
    if length > MAX_TOKEN_BYTES {
        return Err(refuse(format!("it has {length} bytes")));
    }
    let text = std::fs::read_to_string(path).map_err(|error| refuse(error.to_string()))?;
    let token = text.trim();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if token.len() < MIN_TOKEN || !token.chars().all(is_plain) {
        return Err(refuse(format!(
            "a token has at least {MIN_TOKEN} letters, digits, `-` or `_`"
        )));
    }
    Ok(token.to_owned())
}
