//! What a device is: its dictionary, the communication objects in it, and its dialect.

use crate::{Dialect, Dictionary, Field, Handle, PDOS, SDO_SERVERS, Table};

/// A device type: everything about it that never changes. One `static` serves any number of nodes.
#[derive(Clone, Copy, Debug)]
pub struct Device {
    /// The dictionary.
    pub table: Table,
    /// Where the node finds its own parameters.
    pub objects: CommunicationObjects,
    /// How it differs from the standard.
    pub dialect: Dialect,
}

impl Device {
    /// A device of `dictionary` and `dialect`.
    pub const fn new<const N: usize>(
        dictionary: &'static Dictionary<N>,
        dialect: Dialect,
    ) -> Device {
        Device {
            table: dictionary.table(),
            objects: CommunicationObjects::of(dictionary),
            dialect,
        }
    }
}

/// The objects of CiA 301 that the node itself reads and writes; `None` where a device has none.
/// A service whose objects a device lacks does not exist there.
#[derive(Clone, Copy, Debug)]
pub struct CommunicationObjects {
    pub(crate) error_register: Option<Handle<u8>>,
    pub(crate) history_count: Option<Handle<u8>>,
    pub(crate) history: [Option<Handle<u32>>; 8],
    pub(crate) sync_cob_id: Option<Handle<u32>>,
    pub(crate) sync_period_us: Option<Handle<u32>>,
    pub(crate) sync_window_us: Option<Handle<u32>>,
    pub(crate) sync_counter: Option<Handle<u8>>,
    pub(crate) guard_time_ms: Option<Handle<u16>>,
    pub(crate) life_time_factor: Option<Handle<u8>>,
    pub(crate) time_cob_id: Option<Handle<u32>>,
    pub(crate) emcy_cob_id: Option<Handle<u32>>,
    /// 100 µs.
    pub(crate) emcy_inhibit: Option<Handle<u16>>,
    pub(crate) heartbeat_consumers: Option<Run>,
    pub(crate) heartbeat_ms: Option<Handle<u16>>,
    pub(crate) emcy_consumers: Option<Run>,
    pub(crate) error_behaviour: Option<Handle<u8>>,
    pub(crate) verification: Option<Run>,
    pub(crate) startup: Option<Handle<u32>>,
    /// The servers after the default one: 0x1201 and on.
    pub(crate) sdo: [Option<SdoObjects>; SDO_SERVERS - 1],
    pub(crate) rpdo: [Option<PdoObjects>; PDOS],
    pub(crate) tpdo: [Option<PdoObjects>; PDOS],
}

/// Sub-indices 1 and on of an object, one after the other in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    first: Field,
    pub(crate) count: u8,
}

impl Run {
    const fn of<const N: usize>(dictionary: &Dictionary<N>, index: u16) -> Option<Run> {
        let Some(first) = dictionary.field(index, 1) else {
            return None;
        };
        let mut count = 1;
        while let Some(next) = dictionary.field(index, count + 1) {
            assert!(
                next.offset() == first.nth(count as u16).offset(),
                "declare the entries of such a list as one run (.subs)"
            );
            count += 1;
        }
        Some(Run { first, count })
    }

    /// The place of sub-index `n` + 1.
    pub(crate) const fn nth(&self, n: u8) -> Field {
        self.first.nth(n as u16)
    }
}

/// The parameters of an SDO server: 0x1201 and on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SdoObjects {
    pub(crate) request: Handle<u32>,
    pub(crate) reply: Handle<u32>,
}

impl SdoObjects {
    const fn of<const N: usize>(dictionary: &Dictionary<N>, index: u16) -> Option<SdoObjects> {
        match (dictionary.optional(index, 1), dictionary.optional(index, 2)) {
            (Some(request), Some(reply)) => Some(SdoObjects { request, reply }),
            _ => None,
        }
    }
}

/// One PDO's parameters: 0x1400 and 0x1600, or 0x1800 and 0x1A00, plus its number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PdoObjects {
    pub(crate) cob_id: Handle<u32>,
    pub(crate) transmission_type: Handle<u8>,
    pub(crate) map_count: Handle<u8>,
    /// The first mapping entry; the others follow it in the image.
    pub(crate) map_first: Field,
    /// How many mapping entries there are.
    pub(crate) map_entries: u8,
    /// 100 µs (TPDO).
    pub(crate) inhibit: Option<Handle<u16>>,
    pub(crate) event_timer_ms: Option<Handle<u16>>,
    /// The SYNC counter with which a TPDO begins.
    pub(crate) sync_start: Option<Handle<u8>>,
}

impl CommunicationObjects {
    #[allow(clippy::indexing_slicing, reason = "runs at compile time")]
    const fn of<const N: usize>(dictionary: &Dictionary<N>) -> CommunicationObjects {
        let mut history = [None; 8];
        let mut sdo = [None; SDO_SERVERS - 1];
        let mut rpdo = [None; PDOS];
        let mut tpdo = [None; PDOS];
        let mut i = 0;
        while i < 8 {
            history[i] = dictionary.optional(0x1003, i as u8 + 1);
            i += 1;
        }
        i = 0;
        while i < SDO_SERVERS - 1 {
            sdo[i] = SdoObjects::of(dictionary, 0x1201 + i as u16);
            i += 1;
        }
        i = 0;
        while i < PDOS {
            rpdo[i] = PdoObjects::of(dictionary, 0x1400 + i as u16);
            tpdo[i] = PdoObjects::of(dictionary, 0x1800 + i as u16);
            i += 1;
        }
        let heartbeat_consumers = Run::of(dictionary, 0x1016);
        if let Some(run) = &heartbeat_consumers {
            assert!(
                run.count as usize <= crate::MONITORED,
                "more heartbeat consumers than a node has"
            );
        }
        CommunicationObjects {
            error_register: dictionary.optional(0x1001, 0),
            history_count: dictionary.optional(0x1003, 0),
            history,
            sync_cob_id: dictionary.optional(0x1005, 0),
            sync_period_us: dictionary.optional(0x1006, 0),
            sync_window_us: dictionary.optional(0x1007, 0),
            sync_counter: dictionary.optional(0x1019, 0),
            guard_time_ms: dictionary.optional(0x100C, 0),
            life_time_factor: dictionary.optional(0x100D, 0),
            time_cob_id: dictionary.optional(0x1012, 0),
            emcy_cob_id: dictionary.optional(0x1014, 0),
            emcy_inhibit: dictionary.optional(0x1015, 0),
            heartbeat_consumers,
            heartbeat_ms: dictionary.optional(0x1017, 0),
            emcy_consumers: Run::of(dictionary, 0x1028),
            error_behaviour: dictionary.optional(0x1029, 1),
            verification: Run::of(dictionary, 0x1020),
            startup: dictionary.optional(0x1F80, 0),
            sdo,
            rpdo,
            tpdo,
        }
    }
}

impl PdoObjects {
    const fn of<const N: usize>(dictionary: &Dictionary<N>, index: u16) -> Option<PdoObjects> {
        let (Some(cob_id), Some(transmission_type), Some(map_count), Some(map_first)) = (
            dictionary.optional(index, 1),
            dictionary.optional(index, 2),
            dictionary.optional(index + 0x200, 0),
            dictionary.field(index + 0x200, 1),
        ) else {
            return None;
        };
        let mut map_entries = 1;
        while let Some(entry) = dictionary.field(index + 0x200, map_entries + 1) {
            assert!(
                entry.offset() == map_first.nth(map_entries as u16).offset(),
                "declare the entries of a PDO mapping as one run (.subs)"
            );
            map_entries += 1;
        }
        Some(PdoObjects {
            cob_id,
            transmission_type,
            map_count,
            map_first,
            map_entries,
            inhibit: dictionary.optional(index, 3),
            event_timer_ms: dictionary.optional(index, 5),
            sync_start: dictionary.optional(index, 6),
        })
    }
}
