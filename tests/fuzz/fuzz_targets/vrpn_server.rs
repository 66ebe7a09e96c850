//! Feeds the decoder `vrpn_server` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("vrpn_server").feed)(bytes);
});
