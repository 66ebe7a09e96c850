//! Feeds the decoder `join_key` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("join_key").feed)(bytes);
});
