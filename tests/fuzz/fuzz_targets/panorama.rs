//! Feeds the decoder `panorama` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("panorama").feed)(bytes);
});
