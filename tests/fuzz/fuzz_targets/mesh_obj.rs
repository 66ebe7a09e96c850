//! Feeds the decoder `mesh_obj` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("mesh_obj").feed)(bytes);
});
