//! How a device's CANopen differs from the standard, as data.

/// What the first byte of an expedited upload answer says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UploadReply {
    /// 0x43, 0x47, 0x4B or 0x4F: expedited, size indicated (CiA 301 7.2.4.3.6).
    Sized,
    /// 0x42: expedited, size not indicated, eight bytes zero padded (P3, P2).
    Unsized,
}

/// What bytes 4 to 7 of a download acknowledge hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcknowledgeData {
    /// Zeros (CiA 301; P3).
    Zeros,
    /// The data that was written (J1); of a command that is carried out later what its object
    /// reads as (J2).
    Echo,
}

/// Which SDO transfers a server offers beside the expedited ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SdoTransfers {
    /// None: the others get 0x05040001 (P3 l.166).
    Expedited,
    /// Segmented and block transfers (CiA 301 7.2.4.2).
    All {
        /// How long a server waits for its client's next step, ms.
        timeout_ms: u16,
        /// Segments in a block that a client sends, 1 to 127.
        block_size: u8,
    },
}

/// When a synchronous RPDO's data are applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RpdoSync {
    /// With the next SYNC, whatever the type 0 to 240 says (CiA 301 7.5.2.35).
    Next,
    /// With the nth SYNC after reception for type n (P3, P50); 0 counts as 1.
    Nth,
}

/// The abort code for a value outside an object's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RangeAbort {
    /// 0x06090031 or 0x06090032, by the side it is off (CiA 301).
    TooHighTooLow,
    /// 0x06090030 on both sides (P27).
    Invalid,
}

/// The settings by which CANopen devices differ. Core code asks these, never which drive it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// SDO requests may be as short as their contents (4 to 8 bytes); the standard wants 8 (P1).
    pub short_requests: bool,
    /// An expedited download may be longer than its object, if the bytes that are too many are 0
    /// (M19). The standard wants the object's length.
    pub zero_padded_writes: bool,
    /// How an expedited upload is answered.
    pub upload_reply: UploadReply,
    /// How a download is acknowledged.
    pub acknowledge_data: AcknowledgeData,
    /// Which SDO transfers are served beside the expedited ones.
    pub sdo: SdoTransfers,
    /// Which abort a value out of range gets.
    pub range_abort: RangeAbort,
    /// A COB-ID may be changed and a PDO mapped anew while it is valid: setting sub-index 0 to 0 is
    /// enough, and a COB-ID of 0 also means "off" (P49). The standard wants bit 31 set first.
    pub reconfigure_while_valid: bool,
    /// A PDO may map the low bits of a longer number, 8 or 16 of them; received ones are sign extended
    /// where the number has a sign (J4). In the standard the length is the object's.
    pub short_mapping: bool,
    /// When synchronous RPDOs are applied.
    pub rpdo_sync: RpdoSync,
    /// TPDO type 0 is sent on every SYNC, like type 1 (P13); in the standard it is acyclic.
    pub tpdo_type_0_is_cyclic: bool,
    /// TPDOs are sent by events, inhibit time and event timer are obeyed, and RPDOs have deadlines
    /// (CiA 301 7.2.2.2). If not, these parameters are stored without effect (P51).
    pub pdo_events: bool,
    /// A TPDO of type 254, whose event is the maker's own to choose, is sent by its event timer and
    /// not when a mapped value changes.
    pub type_254_by_timer: bool,
    /// Emergencies are sent; if not, 0x1014 is stored without effect (J16).
    pub emergencies: bool,
    /// Emergencies keep the inhibit time 0x1015; if not, it is stored without effect.
    pub emcy_inhibit: bool,
    /// Bit 30 of 0x1005 can make the node a SYNC producer.
    pub produces_sync: bool,
    /// Remote transmission requests are answered: TPDO types 252 and 253, node guarding. If not,
    /// those types get 0x06090030 (P3 l.174).
    pub remote_requests: bool,
    /// Bit 30 of a TPDO's COB-ID, no remote requests, cannot be cleared: 0x06090030.
    pub tpdo_forbids_remote: bool,
    /// Services may be moved onto identifiers of 29 bits (not in the P3, l.178).
    pub extended_identifiers: bool,
    /// The device is an LSS slave (CiA 305). The slave ([`crate::lss::Slave`]) stands beside the node,
    /// because it is there before the device has a node ID.
    pub lss: bool,
    /// TPDOs answer SYNC in pre-operational, too (P14).
    pub tpdo_in_pre_operational: bool,
    /// The start is told by a boot-up frame (CiA 301 7.2.8.3.3); if not, by a heartbeat with the state
    /// of the moment in which it is sent (J9).
    pub boot_up: bool,
    /// Goes to operational after boot-up, unless 0x1F80 exists and has bit 2 set (CiA 302-2; P3
    /// l.378). If false the device waits in pre-operational, whatever 0x1F80 holds (J9).
    pub boots_to_operational: bool,
    /// Writing 0 to 0x1003,0 clears the error history (CiA 301 7.5.2.4; not in the P3, P40).
    pub history_clearable: bool,
}

impl Dialect {
    /// Plain CiA 301.
    pub const STANDARD: Dialect = Dialect {
        short_requests: false,
        zero_padded_writes: false,
        upload_reply: UploadReply::Sized,
        acknowledge_data: AcknowledgeData::Zeros,
        sdo: SdoTransfers::All {
            timeout_ms: 1000,
            block_size: 127,
        },
        range_abort: RangeAbort::TooHighTooLow,
        reconfigure_while_valid: false,
        short_mapping: false,
        rpdo_sync: RpdoSync::Next,
        tpdo_type_0_is_cyclic: false,
        pdo_events: true,
        type_254_by_timer: false,
        emergencies: true,
        emcy_inhibit: true,
        produces_sync: true,
        remote_requests: true,
        tpdo_forbids_remote: false,
        extended_identifiers: true,
        lss: true,
        tpdo_in_pre_operational: false,
        boot_up: true,
        boots_to_operational: false,
        history_clearable: true,
    };
}
