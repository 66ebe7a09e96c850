//! Values to bytes and back: the only module that names bincode.
//!
//! | on the wire        | as                                                        |
//! |--------------------|-----------------------------------------------------------|
//! | integers, floats   | fixed size, little-endian                                 |
//! | `Untrusted`, `Vec` | u16 count, then the bytes or the elements                 |
//! | `ArrayVec`         | u8 count, then the elements                               |
//! | `Option`           | u8 0 or 1, then the value                                 |
//! | enums              | u8 tag, then the fields                                   |
//!
//! Decoding arbitrary bytes never panics. Memory is taken only for elements that have been read already, so it is bounded by
//! the length of the input, whatever a count claims; a count larger than the bytes left is refused at once.
//! A number that is not finite is refused in both directions: no NaN reaches a device or a picture.

use crate::Untrusted;
use arrayvec::ArrayVec;
use bincode::{
    Decode, Encode,
    config::{Configuration, Fixint, Limit, LittleEndian},
    de::{
        Decoder, DecoderImpl,
        read::{Reader as Source, SliceReader},
    },
    enc::{Encoder, EncoderImpl, write::Writer as Sink},
};

/// Most bytes of one value, in either direction. A scene description of the largest lists fits; meshes travel otherwise.
pub const MAX_VALUE_BYTES: usize = 1 << 20;
/// Most bytes of one text.
pub const MAX_TEXT_BYTES: usize = 1024;
/// Most elements of one list.
pub const MAX_LIST: usize = 4096;

type Format = Configuration<LittleEndian, Fixint, Limit<MAX_VALUE_BYTES>>;
const FORMAT: Format = bincode::config::standard()
    .with_little_endian()
    .with_fixed_int_encoding()
    .with_limit::<MAX_VALUE_BYTES>();

/// Why a value was not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EncodeError {
    /// A number is NaN or infinite.
    #[error("a message holds a number that is not finite: mend the value before it is sent")]
    NotFinite,
    /// A text or list is longer than its limit.
    #[error("a message holds {what} of {len}, more than the limit of {max}: send less")]
    TooLong {
        /// "text" or "list".
        what: &'static str,
        /// Length found.
        len: usize,
        /// Length allowed.
        max: usize,
    },
    /// A number is out of its range.
    #[error("a message holds {number} out of its range: mend the value before it is sent")]
    OutOfRange {
        /// Message and field.
        number: &'static str,
    },
    /// The value does not fit the buffer or the limit of the message.
    #[error("a message does not fit its buffer: send less")]
    BufferFull,
}

/// Why bytes were refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The bytes end within a value.
    #[error("a message is truncated: the sender or the network is broken")]
    Truncated,
    /// Bytes are left after the value.
    #[error("a message has {left} bytes too many: the sender or the network is broken")]
    TrailingBytes {
        /// Bytes left over.
        left: usize,
    },
    /// A number is NaN or infinite.
    #[error("a message holds a number that is not finite: the sender is broken")]
    NotFinite,
    /// A number is out of its range.
    #[error("a message holds {number} out of its range ({range}): the sender is broken")]
    OutOfRange {
        /// Message and field.
        number: &'static str,
        /// The range, for people.
        range: &'static str,
    },
    /// A count is above its limit or above the bytes left.
    #[error(
        "a message claims {what} of {len}, more than the {max} possible: the sender or the network is broken"
    )]
    TooLong {
        /// "text", "list" or "message".
        what: &'static str,
        /// Length claimed.
        len: usize,
        /// Length possible.
        max: usize,
    },
    /// A tag that this version does not know.
    #[error("a message holds the unknown {what} {tag}: the sender is broken")]
    UnknownTag {
        /// What the tag selects.
        what: &'static str,
        /// The tag found.
        tag: u8,
    },
    /// A text is not UTF-8.
    #[error("a message holds text that is not UTF-8: the sender is broken")]
    NotText,
    /// The first two bytes are not ours.
    #[error("a message is not of taut: another program speaks to this port")]
    WrongMagic,
    /// The peer speaks another version.
    #[error(
        "the peer speaks protocol version {theirs}, this program speaks {ours}: install the same release on both"
    )]
    WrongVersion {
        /// What the peer speaks, as far as it said.
        theirs: crate::VersionRange,
        /// What is spoken here.
        ours: crate::VersionRange,
    },
    /// A field contradicts another one.
    #[error("a message contradicts itself in {what}: the sender or the network is broken")]
    Inconsistent {
        /// The field.
        what: &'static str,
    },
}

/// A value with one layout on the wire.
pub trait Wire: Sized {
    /// Whether it is a number, which has a range wherever it is a field of a message ([`crate::range`]).
    const IS_NUMBER: bool = false;
    /// Appends the value.
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError>;
    /// Takes the value from the front.
    fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError>;
}

/// Writes `value` to the front of `buffer` and returns the bytes used. No allocation.
pub fn encode_into(value: &impl Wire, buffer: &mut [u8]) -> Result<usize, EncodeError> {
    let mut writer = Writer(EncoderImpl::new(Target::Slice { buffer, used: 0 }, FORMAT));
    value.write(&mut writer)?;
    Ok(writer.0.into_writer().len())
}

/// Appends `value` to `bytes`.
pub fn encode_onto(value: &impl Wire, bytes: &mut Vec<u8>) -> Result<(), EncodeError> {
    let mut writer = Writer(EncoderImpl::new(Target::Vec(bytes), FORMAT));
    value.write(&mut writer)
}

/// Reads one value that must fill `bytes` exactly.
pub fn decode<T: Wire>(bytes: &[u8]) -> Result<T, DecodeError> {
    match decode_front(bytes)? {
        (value, 0) => Ok(value),
        (_, left) => Err(DecodeError::TrailingBytes { left }),
    }
}

/// Reads one value from the front of `bytes`; how many bytes are left behind it.
pub(crate) fn decode_front<T: Wire>(bytes: &[u8]) -> Result<(T, usize), DecodeError> {
    if bytes.len() > MAX_VALUE_BYTES {
        return Err(DecodeError::TooLong {
            what: "message",
            len: bytes.len(),
            max: MAX_VALUE_BYTES,
        });
    }
    let mut reader = Reader {
        decoder: DecoderImpl::new(SliceReader::new(bytes), FORMAT, ()),
        left: bytes.len(),
    };
    let value = T::read(&mut reader)?;
    Ok((value, reader.left))
}

/// Where [`Wire::write`] puts bytes.
pub struct Writer<'a>(EncoderImpl<Target<'a>, Format>);

impl Writer<'_> {
    fn put(&mut self, value: impl Encode) -> Result<(), EncodeError> {
        value
            .encode(&mut self.0)
            .map_err(|_| EncodeError::BufferFull)
    }

    fn put_bytes(&mut self, bytes: &[u8]) -> Result<(), EncodeError> {
        Sink::write(Encoder::writer(&mut self.0), bytes).map_err(|_| EncodeError::BufferFull)
    }
}

/// Where [`Wire::read`] takes bytes from.
pub struct Reader<'a> {
    decoder: DecoderImpl<SliceReader<'a>, Format, ()>,
    /// Bytes not yet read.
    left: usize,
}

impl Reader<'_> {
    fn take<T: Decode<()>>(&mut self) -> Result<T, DecodeError> {
        let value = T::decode(&mut self.decoder).map_err(|_| DecodeError::Truncated)?;
        self.left = self.left.saturating_sub(size_of::<T>()); // fixed size encoding of plain numbers
        Ok(value)
    }

    fn take_bytes(&mut self, into: &mut [u8]) -> Result<(), DecodeError> {
        Source::read(Decoder::reader(&mut self.decoder), into)
            .map_err(|_| DecodeError::Truncated)?;
        self.left = self.left.saturating_sub(into.len());
        Ok(())
    }

    /// Whether every byte is read.
    pub(crate) fn is_at_end(&self) -> bool {
        self.left == 0
    }

    /// A u16 count, refused if above `max` or above the bytes left (an element has at least one byte).
    fn take_count(&mut self, what: &'static str, max: usize) -> Result<usize, DecodeError> {
        let len = usize::from(self.take::<u16>()?);
        let max = max.min(self.left);
        if len > max {
            return Err(DecodeError::TooLong { what, len, max });
        }
        Ok(len)
    }
}

/// A slice that may run full, or a vector up to [`MAX_VALUE_BYTES`] of growth.
enum Target<'a> {
    Slice { buffer: &'a mut [u8], used: usize },
    Vec(&'a mut Vec<u8>),
}

impl Target<'_> {
    fn len(&self) -> usize {
        match self {
            Target::Slice { used, .. } => *used,
            Target::Vec(bytes) => bytes.len(),
        }
    }
}

impl Sink for Target<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), bincode::error::EncodeError> {
        match self {
            Target::Slice { buffer, used } => {
                let end = *used + bytes.len();
                let Some(place) = buffer.get_mut(*used..end) else {
                    return Err(bincode::error::EncodeError::UnexpectedEnd);
                };
                place.copy_from_slice(bytes);
                *used = end;
            }
            Target::Vec(all) => {
                if all.len() + bytes.len() > MAX_VALUE_BYTES {
                    return Err(bincode::error::EncodeError::UnexpectedEnd);
                }
                all.extend_from_slice(bytes);
            }
        }
        Ok(())
    }
}

macro_rules! wire_number {
    ($($kind:ty),*) => { $(
        impl Wire for $kind {
            const IS_NUMBER: bool = true;
            fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
                to.put(*self)
            }
            fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
                from.take()
            }
        }
    )* };
}
wire_number!(u8, i16, u16, i32, u32, u64);

macro_rules! wire_float {
    ($($kind:ty),*) => { $(
        impl Wire for $kind {
            const IS_NUMBER: bool = true;
            fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
                if !self.is_finite() {
                    return Err(EncodeError::NotFinite);
                }
                to.put(*self)
            }
            fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
                let value: $kind = from.take()?;
                if !value.is_finite() {
                    return Err(DecodeError::NotFinite);
                }
                Ok(value)
            }
        }
    )* };
}
wire_float!(f32, f64);

impl Wire for bool {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        to.put(u8::from(*self))
    }
    fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match from.take::<u8>()? {
            0 => Ok(false),
            1 => Ok(true),
            tag => Err(DecodeError::UnknownTag { what: "bool", tag }),
        }
    }
}

impl<const N: usize> Wire for [u8; N] {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        to.put_bytes(self)
    }
    fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let mut bytes = [0; N];
        from.take_bytes(&mut bytes)?;
        Ok(bytes)
    }
}

macro_rules! wire_array {
    ($($kind:ty),*) => { $(
        impl<const N: usize> Wire for [$kind; N] {
            const IS_NUMBER: bool = true;
            fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
                self.iter().try_for_each(|element| element.write(to))
            }
            fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
                let mut array = [<$kind>::default(); N];
                for element in &mut array {
                    *element = Wire::read(from)?;
                }
                Ok(array)
            }
        }
    )* };
}
wire_array!(u16, f32, f64);

/// All text: `String` itself has no decoder, so that nobody formats what a peer wrote by accident.
impl Wire for Untrusted {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        to.put(count("text", self.raw().len(), MAX_TEXT_BYTES)?)?;
        to.put_bytes(self.raw().as_bytes())
    }
    fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let len = from.take_count("text", MAX_TEXT_BYTES)?;
        let mut bytes = vec![0; len];
        from.take_bytes(&mut bytes)?;
        let text = String::from_utf8(bytes).map_err(|_| DecodeError::NotText)?;
        Ok(Untrusted::from(text))
    }
}

impl<T: Wire> Wire for Vec<T> {
    const IS_NUMBER: bool = T::IS_NUMBER;
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        to.put(count("list", self.len(), MAX_LIST)?)?;
        self.iter().try_for_each(|element| element.write(to))
    }
    fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let len = from.take_count("list", MAX_LIST)?;
        let mut list = Vec::new(); // grows with what has been read, not with what is claimed
        for _ in 0..len {
            list.push(T::read(from)?);
        }
        Ok(list)
    }
}

impl<T: Wire> Wire for Option<T> {
    const IS_NUMBER: bool = T::IS_NUMBER;
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        self.is_some().write(to)?;
        self.iter().try_for_each(|value| value.write(to))
    }
    fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(if bool::read(from)? {
            Some(T::read(from)?)
        } else {
            None
        })
    }
}

impl<T: Wire, const N: usize> Wire for ArrayVec<T, N> {
    const IS_NUMBER: bool = T::IS_NUMBER;
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        const { assert!(N <= u8::MAX as usize, "its length is one byte") };
        to.put(self.len() as u8)?;
        self.iter().try_for_each(|element| element.write(to))
    }
    fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let len = from.take()?;
        read_elements(from, len)
    }
}

fn count(what: &'static str, len: usize, max: usize) -> Result<u16, EncodeError> {
    match u16::try_from(len) {
        Ok(count) if len <= max => Ok(count),
        _ => Err(EncodeError::TooLong { what, len, max }),
    }
}

/// Reads `len` elements into a list of fixed capacity; more than the capacity is refused.
pub(crate) fn read_elements<T: Wire, const N: usize>(
    from: &mut Reader<'_>,
    len: u8,
) -> Result<ArrayVec<T, N>, DecodeError> {
    let len = usize::from(len);
    if len > N {
        return Err(DecodeError::TooLong {
            what: "list",
            len,
            max: N,
        });
    }
    let mut list = ArrayVec::new();
    for _ in 0..len {
        list.push(T::read(from)?);
    }
    Ok(list)
}

/// Declares a message: its fields in the order of their bytes, each number with its range behind `=>`. A number without one does not compile.
/// Behind `check`: the method that refuses what was read where fields contradict each other.
macro_rules! wire_struct {
    (
        $(#[$about:meta])*
        pub struct $name:ident { $( $(#[$what:meta])* pub $field:ident: $kind:ty $(=> $bounds:ident)? ),* $(,)? }
        $(check $check:ident)?
    ) => {
        $(#[$about])*
        pub struct $name { $( $(#[$what])* pub $field: $kind, )* }

        impl $name {
            /// Its numbers and what each may be.
            pub const NUMBERS: &'static [$crate::range::Number] = &[ $( $(
                $crate::range::Number::new(concat!(stringify!($name), ".", stringify!($field)), $bounds),
            )? )* ];
        }
        impl $crate::codec::Wire for $name {
            fn write(&self, to: &mut $crate::codec::Writer<'_>) -> Result<(), $crate::EncodeError> {
                $( $crate::codec::wire_struct!(@write $name self to $field $($bounds)?); )*
                Ok(())
            }
            fn read(from: &mut $crate::codec::Reader<'_>) -> Result<Self, $crate::DecodeError> {
                let read = Self { $( $field: $crate::codec::wire_struct!(@read $name from $field $($bounds)?), )* };
                $( read.$check()?; )?
                Ok(read)
            }
        }
    };
    (@write $name:ident $self:ident $to:ident $field:ident $bounds:ident) => {
        const { $crate::range::Number::new(concat!(stringify!($name), ".", stringify!($field)), $bounds) }
            .write(&$self.$field, $to)?
    };
    (@write $name:ident $self:ident $to:ident $field:ident) => {
        $crate::codec::write_plain(&$self.$field, $to)?
    };
    (@read $name:ident $from:ident $field:ident $bounds:ident) => {
        const { $crate::range::Number::new(concat!(stringify!($name), ".", stringify!($field)), $bounds) }
            .read($from)?
    };
    (@read $name:ident $from:ident $field:ident) => {
        $crate::codec::Wire::read($from)?
    };
}
pub(crate) use wire_struct;

/// Writes what is no number.
pub(crate) fn write_plain<T: Wire>(value: &T, to: &mut Writer<'_>) -> Result<(), EncodeError> {
    const { assert!(!T::IS_NUMBER, "a number of a message has a range") };
    value.write(to)
}

/// The number of each variant of an enum without fields.
macro_rules! codes {
    ($name:ty, $what:literal { $($variant:ident = $code:literal),* $(,)? }) => {
        impl $name {
            pub(crate) const fn code(self) -> u8 {
                match self { $( Self::$variant => $code, )* }
            }
            pub(crate) fn from_code(code: u8) -> Result<Self, $crate::DecodeError> {
                match code {
                    $( $code => Ok(Self::$variant), )*
                    tag => Err($crate::DecodeError::UnknownTag { what: $what, tag }),
                }
            }
        }
    };
}
pub(crate) use codes;

/// Layout of an enum without fields: one byte, its number.
macro_rules! wire_tag {
    ($name:ty, $what:literal { $($codes:tt)* }) => {
        $crate::codec::codes!($name, $what { $($codes)* });

        impl $crate::codec::Wire for $name {
            fn write(&self, to: &mut $crate::codec::Writer<'_>) -> Result<(), $crate::EncodeError> {
                self.code().write(to)
            }
            fn read(from: &mut $crate::codec::Reader<'_>) -> Result<Self, $crate::DecodeError> {
                <$name>::from_code(u8::read(from)?)
            }
        }
    };
}
pub(crate) use wire_tag;
