//! Feeds the decoder `mesh_blob` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("mesh_blob").feed)(bytes);
});
