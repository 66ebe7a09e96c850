//! Feeds the decoder `key_file` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("key_file").feed)(bytes);
});
