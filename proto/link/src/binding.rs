//! What both ends take from their TLS connection: the bytes that proofs are bound to, and the keys of the hot plane.
//!
//! Source: RFC 5705 and RFC 8446, section 7.5 (exporters). The two ends of one connection get the same bytes, nobody else does.

use crate::LinkError;
use taut_proto::{
    group::SERVER_SENDER,
    proof::EXPORTER_BYTES,
    seal::{KEY_MATERIAL_BYTES, Opener, Sealer},
};
use zeroize::Zeroizing;

const PROOF_LABEL: &[u8] = b"EXPORTER-taut-proof-1";
const HOT_LABEL: &[u8] = b"EXPORTER-taut-hot-1";

/// Bytes that a proof of the cluster key is bound to.
pub fn proof_binding(connection: &quinn::Connection) -> Result<[u8; EXPORTER_BYTES], LinkError> {
    let mut bytes = [0; EXPORTER_BYTES];
    export(connection, &mut bytes, PROOF_LABEL)?;
    Ok(bytes)
}

/// Hot-plane keys of one end of `session`.
pub(crate) fn hot_keys(
    connection: &quinn::Connection,
    version: u8,
    epoch: u32,
    session: u16,
    at_server: bool,
) -> Result<(Sealer, Opener), LinkError> {
    let mut both = Zeroizing::new([[0; KEY_MATERIAL_BYTES]; 2]);
    export(connection, both.as_flattened_mut(), HOT_LABEL)?;
    let [down, up] = &*both;
    let (server, client) = ((down, SERVER_SENDER), (up, session));
    let [sent, heard] = if at_server {
        [server, client]
    } else {
        [client, server]
    };
    Ok((
        Sealer::new(sent.0, epoch, sent.1).speaking(version),
        Opener::new(heard.0, epoch, heard.1).speaking(version),
    ))
}

fn export(connection: &quinn::Connection, into: &mut [u8], label: &[u8]) -> Result<(), LinkError> {
    connection
        .export_keying_material(into, label, &[])
        .map_err(|_| LinkError::System {
            what: "derive keys from the TLS connection",
            reason: "the connection exports none".to_owned(),
        })
}
