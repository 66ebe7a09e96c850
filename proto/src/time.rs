//! TIME payloads: the four-timestamp exchange that ties a client's clock to session time.
//!
//! | symbol | field             | clock  | taken when                     |
//! |--------|-------------------|--------|--------------------------------|
//! | t1     | `client_sent`     | client | the request leaves             |
//! | t2     | `server_received` | server | the request arrives            |
//! | t3     | `server_sent`     | server | the response leaves            |
//! | t4     | (not sent)        | client | the response arrives           |
//!
//! All in ns: of the session at the server, since any fixed moment at the client.

use crate::{codec::wire_ranged, range::TIME};

/// Client to server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeRequest {
    /// t1, ns.
    pub client_sent: u64,
}

/// Server to client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeResponse {
    /// t1, ns, as received.
    pub client_sent: u64,
    /// t2, ns.
    pub server_received: u64,
    /// t3, ns.
    pub server_sent: u64,
}

wire_ranged!(TimeRequest {
    client_sent in TIME
});
wire_ranged!(TimeResponse {
    client_sent in TIME,
    server_received in TIME,
    server_sent in TIME
});
