//! Feeds the decoder `ros_wrench` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("ros_wrench").feed)(bytes);
});
