//! Mappings that are not lists of copies: bits, wide numbers, parts of numbers, and more than four
//! objects.

use super::{Direction, mapped_entry};
use crate::row::flag;
use crate::{Address, Entry, Events, Image, Instant, MAPPED_PER_PDO, Node, NodeMemory, Owner};

/// One mapped object, found.
#[derive(Clone, Copy)]
struct Step {
    asks: bool,
    row: u16,
    address: Address,
    shift: u8,
    bits: u8,
}

impl Step {
    const NONE: Step = Step {
        asks: false,
        row: 0,
        address: Address::new(0, 0),
        shift: 0,
        bits: 0,
    };

    /// The object's bits in a PDO.
    fn extract(&self, data: u64) -> u64 {
        let mask = u64::MAX >> (64 - u32::from(self.bits)).min(63);
        (data >> (self.shift & 63)) & mask
    }
}

/// The low `bits` of a number, 32 at most, in all its bytes.
fn extend(raw: u32, bits: u8, entry: &Entry) -> u32 {
    let data_type = entry.field.data_type();
    let has_sign = data_type.bounds().is_some_and(|(low, _)| low < 0);
    match 32u32.checked_sub(u32::from(bits)) {
        Some(unused @ 1..=31) if has_sign => {
            let all = 32u32.saturating_sub(u32::from(data_type.bits())).min(31);
            ((raw << unused) as i32 >> unused) as u32 & u32::MAX >> all
        }
        _ => raw,
    }
}

impl<M: NodeMemory> Node<M> {
    /// Writes the data of a received PDO into the image, its objects found in the mapping entries.
    #[cold]
    pub(crate) fn apply_walked<O: Owner>(
        &mut self,
        n: usize,
        data: u64,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let mut steps = [Step::NONE; MAPPED_PER_PDO];
        let count = self.steps(Direction::Receive, n, &mut steps);
        let steps = steps.get_mut(..count).unwrap_or(&mut []);
        steps.sort_unstable_by_key(|step| (step.asks, step.row, step.shift));
        for step in steps {
            let Ok(entry) = self.device.table.find(step.address.index, step.address.sub) else {
                continue;
            };
            let value = step.extract(data);
            // A refusal has no one to be told to.
            if entry.has(flag::LONG) {
                let bytes = value.to_le_bytes();
                let _ = self.write_long(step.address, &entry, &bytes, now, owner, events);
            } else {
                let raw = extend(value as u32, step.bits, &entry);
                let _ = self.write(step.address, &entry, raw, now, owner, events);
            }
        }
    }

    /// The mapped values of transmit PDO `n` as its data.
    #[cold]
    pub(crate) fn sample_walked(&mut self, n: usize) -> u64 {
        let mut steps = [Step::NONE; MAPPED_PER_PDO];
        let count = self.steps(Direction::Transmit, n, &mut steps);
        let mut data = 0;
        for step in steps.get(..count).unwrap_or(&[]) {
            let Ok(entry) = self.device.table.find(step.address.index, step.address.sub) else {
                continue;
            };
            let image = Image::new(self.memory.as_mut());
            let value = Step { shift: 0, ..*step }.extract(image.wide(entry.field));
            data |= value << (step.shift & 63);
        }
        data
    }

    /// Finds the objects of a mapping that was compiled before. Returns their number.
    fn steps(&self, way: Direction, n: usize, steps: &mut [Step; MAPPED_PER_PDO]) -> usize {
        let objects = &self.device.objects;
        let (all, mapping) = match way {
            Direction::Receive => (&objects.rpdo, self.rpdo.get(n).map(|pdo| pdo.mapping)),
            Direction::Transmit => (&objects.tpdo, self.tpdo.get(n).map(|pdo| pdo.mapping)),
        };
        let (Some(Some(objects)), Some(mapping)) = (all.get(n), mapping) else {
            return 0;
        };
        let mut count = 0;
        let mut shift = 0u8;
        for (place, step) in steps.iter_mut().zip(0..u16::from(mapping.count())) {
            let entry = crate::image::raw(self.memory.as_ref(), objects.map_first.nth(step));
            let Ok((found, bits)) = mapped_entry(self.device, entry, way) else {
                break;
            };
            *place = Step {
                asks: found.has(flag::ASKS),
                row: found.row,
                address: Address::new((entry >> 16) as u16, (entry >> 8) as u8),
                shift,
                bits,
            };
            shift = shift.saturating_add(bits);
            count += 1;
        }
        count
    }
}
