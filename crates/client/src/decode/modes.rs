//! The axes of a node: which object belongs to which, and the mode that each is in.

use canopen::Address;
use cia402::Mode;

/// The most axes that a device can have (CiA 402-2: 0x6000 to 0x9FFF, 0x800 objects each).
const AXES: usize = 8;

/// The axis whose object this is, from 0, and the object of the first axis that it is like.
pub(super) fn axis(address: Address) -> (usize, Address) {
    match address.index {
        0x6000..=0x9FFF => {
            let offset = address.index - 0x6000;
            let first = Address::new(0x6000 + offset % 0x800, address.sub);
            (usize::from(offset / 0x800), first)
        }
        _ => (0, address),
    }
}

/// The modes of operation of a node's axes, as far as they are known.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Modes([Option<Mode>; AXES]);

impl Modes {
    /// Notes the mode, if the object is one of the two that hold it.
    pub(super) fn learn(&mut self, address: Address, bytes: &[u8]) {
        let (axis, object) = axis(address);
        if let (0x6060 | 0x6061, 0, [mode, ..]) = (object.index, object.sub, bytes)
            && let Some(known) = self.0.get_mut(axis)
        {
            *known = Some(Mode(*mode as i8));
        }
    }

    /// That of the axis from 0.
    pub(super) fn of(&self, axis: usize) -> Option<Mode> {
        self.0.get(axis).copied().flatten()
    }
}
