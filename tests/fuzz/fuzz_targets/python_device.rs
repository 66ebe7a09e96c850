//! Feeds the decoder `python_device` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("python_device").feed)(bytes);
});
