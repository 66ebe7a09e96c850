//! Feeds the decoder `string_geometry` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("string_geometry").feed)(bytes);
});
