//! PDO parameters, learned from the SDO transfers that pass.

use std::collections::BTreeMap;

use canopen::{Address, CobId, NodeId};

use super::meaning::Direction;

/// What is known of one PDO of one node.
#[derive(Clone, Debug, Default)]
pub(super) struct Pdo {
    cob_id: Option<u32>,
    count: Option<u8>,
    entries: BTreeMap<u8, u32>,
}

/// A mapped object: which, and how many bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Mapped {
    pub(super) object: Address,
    pub(super) bits: u8,
}

impl Pdo {
    /// The objects in their order; `None` if the count or an entry was never seen.
    pub(super) fn mapping(&self) -> Option<Vec<Mapped>> {
        let count = self.count?;
        (1..=count)
            .map(|n| {
                let [bits, sub, low, high] = self.entries.get(&n)?.to_le_bytes();
                let object = Address::new(u16::from_le_bytes([low, high]), sub);
                Some(Mapped { object, bits })
            })
            .collect()
    }
}

/// The PDOs of one node, by direction and number from 0.
#[derive(Clone, Debug, Default)]
pub(super) struct Pdos {
    known: BTreeMap<(Direction, u16), Pdo>,
}

impl Pdos {
    /// Notes the value of an object, if it is a PDO parameter.
    pub(super) fn learn(&mut self, address: Address, raw: u32) {
        let (direction, is_mapping, base) = match address.index {
            0x1400..=0x15FF => (Direction::Receive, false, 0x1400),
            0x1600..=0x17FF => (Direction::Receive, true, 0x1600),
            0x1800..=0x19FF => (Direction::Transmit, false, 0x1800),
            0x1A00..=0x1BFF => (Direction::Transmit, true, 0x1A00),
            _ => return,
        };
        let pdo = self
            .known
            .entry((direction, address.index - base))
            .or_default();
        match (is_mapping, address.sub) {
            (false, 1) => pdo.cob_id = Some(raw),
            (true, 0) => pdo.count = Some(raw as u8),
            (true, sub) => {
                pdo.entries.insert(sub, raw);
            }
            _ => {}
        }
    }

    /// The PDO of this node, if one, that has the 11-bit identifier `id`: by its COB-ID if that is
    /// known, else by the predefined connection set (CiA 301 7.3.3).
    pub(super) fn find(&self, node: NodeId, id: u16) -> Option<(Direction, u16, Option<&Pdo>)> {
        let known = self.known.iter().find(|(_, pdo)| {
            pdo.cob_id.is_some_and(|cob_id| {
                cob_id != 0 && !CobId(cob_id).is_off() && CobId(cob_id).id() == id
            })
        });
        if let Some((&(direction, number), pdo)) = known {
            return Some((direction, number, Some(pdo)));
        }
        if id & 0x7F != u16::from(node.get()) {
            return None;
        }
        let (direction, number) = predefined(id)?;
        let pdo = self.known.get(&(direction, number));
        let moved = pdo.is_some_and(|pdo| pdo.cob_id.is_some());
        (!moved).then_some((direction, number, pdo))
    }
}

/// Direction and number of the PDO with identifier `id` in the predefined connection set.
pub(super) fn predefined(id: u16) -> Option<(Direction, u16)> {
    let function = id >> 7;
    // TPDO1 is 0x180, function code 3; RPDO1 0x200, 4; and so on to RPDO4 0x500, 10.
    match function {
        3 | 5 | 7 | 9 => Some((Direction::Transmit, (function - 3) / 2)),
        4 | 6 | 8 | 10 => Some((Direction::Receive, (function - 4) / 2)),
        _ => None,
    }
}
