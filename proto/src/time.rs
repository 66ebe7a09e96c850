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

use crate::{codec::wire_struct, range::TIME};

wire_struct! {
    /// Client to server.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct TimeRequest {
        /// t1, ns.
        pub client_sent: u64 => TIME,
    }
}

wire_struct! {
    /// Server to client.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct TimeResponse {
        /// t1, ns, as received.
        pub client_sent: u64 => TIME,
        /// t2, ns.
        pub server_received: u64 => TIME,
        /// t3, ns.
        pub server_sent: u64 => TIME,
    }
}
