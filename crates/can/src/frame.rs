//! One classical CAN frame.

use embedded_can::{ExtendedId, Id, StandardId};

/// Bit 31 of [`Frame::key`]: the identifier has 29 bits.
const EXTENDED: u32 = 1 << 31;
/// Bit 30 of [`Frame::key`]: remote transmission request.
const REMOTE: u32 = 1 << 30;

/// A classical CAN frame: 11- or 29-bit identifier, data or remote, 0 to 8 bytes.
///
/// Bytes past [`Frame::len`] are always zero, so two equal frames compare equal.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Frame {
    key: u32,
    len: u8,
    data: [u8; 8],
}

impl Frame {
    /// A data frame. `None` if `data` is longer than 8 bytes.
    pub fn data_frame(id: impl Into<Id>, data: &[u8]) -> Option<Frame> {
        let mut bytes = [0; 8];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Frame {
            key: Frame::key_of(id),
            len: data.len() as u8,
            data: bytes,
        })
    }

    /// A remote frame that asks for `len` bytes. `None` if `len` is over 8.
    pub fn remote_frame(id: impl Into<Id>, len: u8) -> Option<Frame> {
        (len <= 8).then(|| Frame {
            key: Frame::key_of(id) | REMOTE,
            len,
            data: [0; 8],
        })
    }

    /// A data frame with an 11-bit identifier, of which only the low 11 bits count, and the first
    /// `len` (at most 8) of `data`. Never fails: the form for code that has checked already.
    #[inline]
    pub fn classic(id: u16, data: [u8; 8], len: u8) -> Frame {
        Frame::keyed(u32::from(id & 0x7FF), data, len)
    }

    /// A data frame whose identifier is that of `key` (see [`Frame::key`]; the bits of a remote
    /// frame and beyond the identifier are left out), and the first `len` (at most 8) of `data`.
    /// Never fails.
    #[inline]
    pub fn keyed(key: u32, data: [u8; 8], len: u8) -> Frame {
        // All ones for 29 bits, without a branch.
        let extended = (key.cast_signed() >> 31).cast_unsigned();
        let id_bits = 0x7FF | extended & (EXTENDED | 0x1FFF_FFFF);
        let len = if len > 8 { 8 } else { len };
        // Clear what lies past the length, so that equality means equality on the wire.
        // In two steps, because a shift by all 64 bits is none.
        let half = 32 - 4 * u32::from(len);
        let keep = u64::MAX >> half >> half;
        let data = (u64::from_le_bytes(data) & keep).to_le_bytes();
        Frame {
            key: key & id_bits,
            len,
            data,
        }
    }

    /// The identifier.
    pub fn id(&self) -> Id {
        if self.is_extended() {
            // The key holds 29 bits by construction, so the fallback never happens.
            Id::Extended(ExtendedId::new(self.key & 0x1FFF_FFFF).unwrap_or(ExtendedId::ZERO))
        } else {
            Id::Standard(StandardId::new((self.key & 0x7FF) as u16).unwrap_or(StandardId::ZERO))
        }
    }

    /// Identifier as a number, 11 or 29 bits.
    #[inline]
    pub fn raw_id(&self) -> u32 {
        self.key & 0x1FFF_FFFF
    }

    /// Identifier and kind in one word: bits 0–28 identifier, bit 30 remote, bit 31 extended.
    /// A data frame with an 11-bit identifier is just its identifier.
    #[inline]
    pub fn key(&self) -> u32 {
        self.key
    }

    /// The [`Frame::key`] of data frames with the identifier `id`.
    pub fn key_of(id: impl Into<Id>) -> u32 {
        match id.into() {
            Id::Standard(id) => u32::from(id.as_raw()),
            Id::Extended(id) => id.as_raw() | EXTENDED,
        }
    }

    /// Whether the identifier has 29 bits.
    #[inline]
    pub fn is_extended(&self) -> bool {
        self.key & EXTENDED != 0
    }

    /// Whether this is a remote transmission request.
    #[inline]
    pub fn is_remote(&self) -> bool {
        self.key & REMOTE != 0
    }

    /// Data length code, 0 to 8 (of a remote frame: the bytes asked for).
    #[inline]
    #[allow(
        clippy::len_without_is_empty,
        reason = "a frame of length 0 is not empty: it is a frame"
    )]
    pub fn len(&self) -> u8 {
        self.len
    }

    /// The data bytes; empty for a remote frame.
    #[inline]
    pub fn data(&self) -> &[u8] {
        if self.is_remote() {
            &[]
        } else {
            self.data.get(..usize::from(self.len)).unwrap_or(&[])
        }
    }

    /// All eight data bytes, zero past [`Frame::len`].
    #[inline]
    pub fn bytes(&self) -> [u8; 8] {
        self.data
    }
}

impl embedded_can::Frame for Frame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        Frame::data_frame(id, data)
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
        Frame::remote_frame(id, u8::try_from(dlc).ok()?)
    }

    fn is_extended(&self) -> bool {
        Frame::is_extended(self)
    }

    fn is_remote_frame(&self) -> bool {
        self.is_remote()
    }

    fn id(&self) -> Id {
        Frame::id(self)
    }

    fn dlc(&self) -> usize {
        usize::from(self.len)
    }

    fn data(&self) -> &[u8] {
        Frame::data(self)
    }
}

/// candump's notation, `181#01020304`; `R` and the length for a remote frame.
impl core::fmt::Display for Frame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if self.is_extended() {
            write!(f, "{:08X}#", self.raw_id())?;
        } else {
            write!(f, "{:03X}#", self.raw_id())?;
        }
        if self.is_remote() {
            return if self.len == 0 {
                f.write_str("R")
            } else {
                write!(f, "R{}", self.len)
            };
        }
        self.data()
            .iter()
            .try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

impl core::fmt::Debug for Frame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(self, f)
    }
}
