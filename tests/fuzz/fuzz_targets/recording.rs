//! Feeds the decoder `recording` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("recording").feed)(bytes);
});
