//! Feeds the decoder of `taut-decoders` that the environment variable `TAUT_FUZZ_DECODER` names.
#![no_main]

use std::sync::LazyLock;

use taut_decoders::Decoder;

static DECODER: LazyLock<Decoder> = LazyLock::new(|| {
    let name = std::env::var("TAUT_FUZZ_DECODER").expect("TAUT_FUZZ_DECODER names no decoder");
    taut_decoders::named(&name)
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (DECODER.feed)(bytes);
});
