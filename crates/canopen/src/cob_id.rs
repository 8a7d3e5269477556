//! Node IDs and COB-IDs.

/// A CANopen node ID, 1 to 127.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(u8);

impl NodeId {
    /// `None` unless `id` is 1 to 127.
    pub const fn new(id: u8) -> Option<NodeId> {
        if id >= 1 && id <= 127 {
            Some(NodeId(id))
        } else {
            None
        }
    }

    /// The number.
    #[inline]
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl core::fmt::Display for NodeId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Display::fmt(&self.0, f)
    }
}

/// A COB-ID parameter as it stands in the dictionary (CiA 301 7.5.2.5 and the PDO objects):
/// bit 31 off for a PDO or EMCY, bit 30 function dependent, bit 29 frame format, then identifier.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct CobId(pub u32);

impl CobId {
    /// A key that no data frame has: "listens to nothing".
    pub(crate) const NO_KEY: u32 = u32::MAX;

    /// Bit 31: the PDO or service does not exist.
    pub const fn is_off(self) -> bool {
        self.0 & (1 << 31) != 0
    }

    /// Bit 29: 29-bit identifier.
    pub const fn is_extended(self) -> bool {
        self.0 & (1 << 29) != 0
    }

    /// The identifier: 29 bits if [`CobId::is_extended`], else 11.
    pub const fn raw_id(self) -> u32 {
        if self.is_extended() {
            self.0 & 0x1FFF_FFFF
        } else {
            self.0 & 0x7FF
        }
    }

    /// The low 11 bits of the identifier.
    pub const fn id(self) -> u16 {
        (self.0 & 0x7FF) as u16
    }

    /// Bits 11 to 28 of an identifier of 11 bits, which must be 0.
    pub(crate) const fn has_stray_bits(self) -> bool {
        !self.is_extended() && self.0 & 0x1FFF_F800 != 0
    }

    /// Whether the identifier is one that CiA 301 (7.3.5, restricted CAN-IDs) keeps for its own
    /// services, so that no PDO, SYNC, TIME, EMCY or further SDO may be moved onto it.
    pub const fn is_restricted(self) -> bool {
        !self.is_extended()
            && matches!(
                self.id(),
                0x000..=0x07F
                    | 0x101..=0x180
                    | 0x581..=0x5FF
                    | 0x601..=0x67F
                    | 0x6E0..=0x6FF
                    | 0x701..=0x7FF
            )
    }

    /// [`can::Frame::key`] of data frames with this identifier.
    pub(crate) const fn key(self) -> u32 {
        if self.is_extended() {
            self.raw_id() | 1 << 31
        } else {
            self.raw_id()
        }
    }

    /// Whether a service with this COB-ID exists: valid and not on a restricted identifier,
    /// whatever was put into the image; with 29 bits only where the device has those.
    pub(crate) const fn is_usable(self, extended: bool) -> bool {
        !self.is_off() && (extended || !self.is_extended()) && !self.is_restricted()
    }
}

impl core::fmt::Debug for CobId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "CobId(0x{:08X})", self.0)
    }
}
