//! Feeds the decoder `trace_csv` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("trace_csv").feed)(bytes);
});
