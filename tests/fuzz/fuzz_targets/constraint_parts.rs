//! Feeds the decoder `constraint_parts` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("constraint_parts").feed)(bytes);
});
