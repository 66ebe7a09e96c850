//! Feeds the decoder `haply_service` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("haply_service").feed)(bytes);
});
