//! The communication objects 0x1000 to 0x1FFF, which the node knows itself: what may be written to
//! them, and what follows.

mod judge;
mod read;

use crate::device::PdoObjects;
use crate::pdo::Direction;
use crate::{Field, Node, NodeMemory, PDOS};

/// Which parameter of which PDO an address is.
pub(crate) struct PdoParameter {
    way: Direction,
    n: usize,
    is_mapping: bool,
}

impl PdoParameter {
    fn of(index: u16) -> Option<PdoParameter> {
        let (way, is_mapping, base) = match index {
            0x1400..=0x15FF => (Direction::Receive, false, 0x1400),
            0x1600..=0x17FF => (Direction::Receive, true, 0x1600),
            0x1800..=0x19FF => (Direction::Transmit, false, 0x1800),
            0x1A00..=0x1BFF => (Direction::Transmit, true, 0x1A00),
            _ => return None,
        };
        let n = usize::from(index - base);
        (n < PDOS).then_some(PdoParameter { way, n, is_mapping })
    }
}

impl<M: NodeMemory> Node<M> {
    /// The first `count` mapping entries.
    fn map_entries(&self, objects: &PdoObjects, count: u8) -> impl Iterator<Item = u32> {
        let bytes = self.memory.as_ref();
        let first = objects.map_first;
        (0..u16::from(count)).map(move |step| crate::image::raw(bytes, first.nth(step)))
    }

    fn pdo_objects(&self, parameter: &PdoParameter) -> Option<&'static PdoObjects> {
        let objects = &self.device.objects;
        let all = match parameter.way {
            Direction::Receive => &objects.rpdo,
            Direction::Transmit => &objects.tpdo,
        };
        all.get(parameter.n)?.as_ref()
    }

    pub(crate) fn raw(&self, field: Field) -> u32 {
        crate::image::raw(self.memory.as_ref(), field)
    }
}
