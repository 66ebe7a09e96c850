//! A session and a bridge to it in this process, with a network between them that is not good.

use std::path::Path;
use std::thread::JoinHandle;

use taut::session::Session;
use taut::session::setup::SessionSetup;
use taut_bridge::{BridgeArgs, BridgeError, BridgeReport};
use taut_test_kit::relay::{Impairment, Relay, Treatment, Waiting};

/// A session whose datagrams go through a relay, both ways.
pub(crate) fn start_behind_relay(
    mut setup: SessionSetup,
    impairment: Impairment,
) -> (Session, Relay) {
    let waiting = Waiting::bind().expect("a port");
    setup.link.announced_udp_port = Some(waiting.address().port());
    let session = Session::start(setup).unwrap_or_else(|error| panic!("{error}"));
    let udp = session.udp_address().expect("listens");
    let treatments = vec![Treatment::both_ways(impairment)];
    let relay = waiting.start(udp, treatments, 7).expect("a relay");
    (session, relay)
}

/// A bridge with a firm hand on the path of this file.
pub(crate) fn start_bridge(
    server: &str,
    key: &Path,
    path: &Path,
    more: &[&str],
) -> JoinHandle<Result<BridgeReport, BridgeError>> {
    let [key, path] = [key, path].map(|path| path.to_str().expect("a plain path"));
    let server = ["bridge", "--server", server, "--key", key];
    let hand = ["--priority", "0", "--hand", "firm", "--path", path];
    let words = [&server[..], &hand, more].concat();
    let args = BridgeArgs::of_words(words).expect("valid");
    std::thread::Builder::new()
        .name("bridge".to_owned())
        .spawn(move || taut_bridge::run(&args))
        .expect("a thread")
}
