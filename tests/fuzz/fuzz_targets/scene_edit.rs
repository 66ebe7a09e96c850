//! Feeds the decoder `scene_edit` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("scene_edit").feed)(bytes);
});
