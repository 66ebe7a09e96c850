//! Feeds the decoder `vrpn_client` of `taut-decoders`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    (taut_decoders::named("vrpn_client").feed)(bytes);
});
