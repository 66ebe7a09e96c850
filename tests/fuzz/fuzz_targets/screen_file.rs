//! Feeds the decoder `screen_file` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("screen_file").feed)(bytes);
});
