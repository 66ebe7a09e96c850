//! Feeds the decoder `motor_boards` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("motor_boards").feed)(bytes);
});
