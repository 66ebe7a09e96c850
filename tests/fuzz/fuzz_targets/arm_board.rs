//! Feeds the decoder `arm_board` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("arm_board").feed)(bytes);
});
