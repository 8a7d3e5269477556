//! Two banks in a flash: damage in them, and layouts that cannot be.

use drive::flash::{LayoutError, Region};
use drive::program::{Bank, Banks};
use embedded_storage::nor_flash::ReadNorFlash as _;
use sim::MemoryFlash;

use crate::bench::{SMALL_BANK, image, prepared, started};

type Small = MemoryFlash<4, 256>;

/// One bit anywhere: the newest program, or the one before it.
#[test]
fn one_damaged_bit_costs_at_most_the_newest_program() {
    let (flash, banks, newest) = prepared::<4, 256>(SMALL_BANK, 2, 100);
    let before = Some(image(0, 100));
    let mut fell_back = 0;
    for bit in 0..flash.capacity() * 8 {
        let mut damaged = flash.copy();
        damaged.bytes_mut()[bit / 8] ^= 1 << (bit % 8);
        let found = started(&mut damaged, &banks);
        if found != newest {
            assert_eq!(found, before, "bit {bit}");
            fell_back += 1;
        }
    }
    // The record's 16 bytes, the header's 64 and the body's 100.
    assert_eq!(fell_back, 8 * 180);
}

/// A record speaks for the image that it was written for, and for no other whole one.
#[test]
fn a_record_does_not_speak_for_another_image() {
    let (mut flash, banks, _) = prepared::<4, 256>(SMALL_BANK, 2, 100);
    let bytes = flash.bytes_mut();
    let bank = SMALL_BANK as usize;
    bytes.copy_within(bank + 64..2 * bank, 64);
    assert!(banks.program(&mut flash, Bank::Second).unwrap().is_some());
    assert_eq!(banks.program(&mut flash, Bank::First), Ok(None));
}

#[test]
fn layouts_that_cannot_be() {
    let flash = Small::new(4096);
    let new = |first: (u32, u32), second: (u32, u32)| {
        let region = |(at, bytes)| Region::new(at, bytes);
        Banks::new(region(first), region(second), &flash)
    };
    assert_eq!(
        new((0, 1024), (1024, 2048)).map(|banks| banks.capacity()),
        Ok(576)
    );
    assert!(matches!(
        new((0, 512), (1024, 1024)),
        Err(LayoutError::Unaligned(_))
    ));
    assert!(matches!(
        new((0, 1024), (512, 1024)),
        Err(LayoutError::Overlap(..))
    ));
    assert!(matches!(
        new((0, 1024), (3584, 1024)),
        Err(LayoutError::OutOfBounds { .. })
    ));
}
