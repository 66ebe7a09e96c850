//! Feeds the decoder `environment_hdr` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("environment_hdr").feed)(bytes);
});
