//! Feeds the decoder `workbench_toml` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("workbench_toml").feed)(bytes);
});
