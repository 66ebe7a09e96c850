//! Feeds the decoder `http_request` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("http_request").feed)(bytes);
});
