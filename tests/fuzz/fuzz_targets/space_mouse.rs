//! Feeds the decoder `space_mouse` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("space_mouse").feed)(bytes);
});
