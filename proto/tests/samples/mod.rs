//! One sample of every datagram payload and control message, and strategies that vary them: a file per family.

use taut_proto::{
    DecodeError, Payload,
    header::{MAX_DATAGRAM_BYTES, MAX_PAYLOAD_BYTES},
    seal::Sealer,
};

/// Varies a value: each of its fields by a strategy of its own.
macro_rules! varied {
    (@of $field:ident) => { $field };
    (@of $field:ident: $strategy:expr) => { $strategy };
    (@all) => { Just(()) };
    (@all $first:expr, $($rest:expr,)*) => { ($first, varied!(@all $($rest,)*)) };
    (@fields) => { () };
    (@fields $first:ident, $($rest:ident,)*) => { ($first, varied!(@fields $($rest,)*)) };
    ($value:ident { $($field:ident $(: $strategy:expr)?,)* }) => {
        varied!(@all $(varied!(@of $field $(: $strategy)?),)*)
            .prop_map(|varied!(@fields $($field,)*)| $value { $($field,)* })
    };
}
pub(crate) use varied;

mod barrier;
mod constraints;
mod control;
mod coupling;
mod datagrams;
mod group;
mod hot;
mod scene;
mod values;

/// What there must be, or the test ends with the reason.
#[track_caller]
pub fn must<T, E: std::fmt::Display>(result: Result<T, E>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

/// The number that is out of its range.
#[track_caller]
pub fn refused<T: std::fmt::Debug>(result: Result<T, DecodeError>) -> &'static str {
    match result {
        Err(DecodeError::OutOfRange { number, .. }) => number,
        other => panic!("not refused: {other:?}"),
    }
}

pub fn bytes_of(payload: &Payload) -> Vec<u8> {
    let mut buffer = [0; MAX_PAYLOAD_BYTES];
    let used = must(payload.encode_into(&mut buffer));
    buffer[..used].to_vec()
}

pub fn sealed(sealer: &Sealer, payload: &Payload) -> Vec<u8> {
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    must(sealer.seal(payload, &mut buffer)).to_vec()
}

pub use barrier::{arrive, release};
pub use constraints::{any_row, part};
pub use control::messages;
pub use coupling::coupling;
pub use datagrams::{any_payload, datagrams};
pub use group::group;
pub use hot::hot;
pub use scene::{any_scene, scene};
