//! Access to the objects from within the device, by a way that is not CAN (a keypad, a serial line):
//! judged as an SDO client's is.

use crate::row::flag;
use crate::sdo::Readable;
use crate::{Abort, Address, Events, Image, Instant, Node, NodeMemory, Owner};

impl<M: NodeMemory> Node<M> {
    /// The value of an object that is an integer.
    ///
    /// # Errors
    /// What an SDO upload would be answered; [`Abort::LENGTH`] for an object that is no integer.
    pub fn read_local<O: Owner>(&mut self, address: Address, owner: &mut O) -> Result<i64, Abort> {
        let entry = match self.readable(address)? {
            Readable::Entry(entry) => entry,
            Readable::Highest(highest) => return Ok(i64::from(highest)),
        };
        entry.field.data_type().bounds().ok_or(Abort::LENGTH)?;
        let mut image = Image::new(self.memory.as_mut());
        if entry.has(flag::LIVE) {
            owner.publish(&mut image);
        }
        Ok(image.number(entry.field))
    }

    /// Writes an object that is an integer. What the owner does later, nobody is told of.
    ///
    /// # Errors
    /// What an SDO download would be answered; [`Abort::LENGTH`] for an object that is no integer of at
    /// most 32 bits.
    pub fn write_local<O: Owner>(
        &mut self,
        address: Address,
        value: i64,
        now: Instant,
        owner: &mut O,
    ) -> Result<Events, Abort> {
        let entry = self.writable(address)?;
        let (least, greatest) = entry.field.data_type().bounds().ok_or(Abort::LENGTH)?;
        if entry.has(flag::LONG) {
            return Err(Abort::LENGTH);
        }
        if value > greatest {
            return Err(self.range_abort(Abort::VALUE_TOO_HIGH));
        } else if value < least {
            return Err(self.range_abort(Abort::VALUE_TOO_LOW));
        }
        let mut events = Events::NOTHING;
        self.write(address, &entry, value as u32, now, owner, &mut events)?;
        Ok(events)
    }

    /// Whether an SDO client's write waits for its owner; until then there is no other.
    pub fn is_busy(&self) -> bool {
        self.waiting.is_some()
    }
}
