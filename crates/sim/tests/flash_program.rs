//! Program download into two banks: whatever goes wrong, the next start runs the old program or the
//! new one, whole.

use canopen::Abort;
use drive::flash::{LayoutError, Region};
use drive::program::{Action, Bank, Banks, Failure, ImageHeader, Program, ProgramStore, Version};
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash as _};
use proptest::prelude::*;
use sim::{MemoryFlash, PowerCut};

type Small = MemoryFlash<4, 256>;
const SMALL_BANK: u32 = 1024;
const PRODUCT: u32 = 0x5033;

fn banks<F: NorFlash>(flash: &F, bytes: u32) -> Banks {
    let first = Region::new(0, bytes);
    Banks::new(first, Region::new(bytes, bytes), flash).unwrap()
}

fn image_for(product: u32, number: u32, length: usize) -> Vec<u8> {
    let byte = |at: usize| (at as u32).wrapping_mul(37).wrapping_add(number * 101) as u8;
    let body: Vec<u8> = (0..length).map(byte).collect();
    let version = Version::new(&format!("1.{number}")).unwrap();
    let mut image = ImageHeader::of(product, version, &body).bytes().to_vec();
    image.extend(body);
    image
}

fn image(number: u32, length: usize) -> Vec<u8> {
    image_for(PRODUCT, number, length)
}

/// The image that the next start runs, read from where a boot loader reads it.
fn started<const PAGE: usize, const SECTOR: usize>(
    flash: &mut MemoryFlash<PAGE, SECTOR>,
    banks: &Banks,
) -> Option<Vec<u8>> {
    let program: Program = banks.newest(flash).unwrap()?;
    let at = program.at as usize;
    assert_eq!(at % 512, 0);
    let mut image = program.image.bytes().to_vec();
    image.extend(&flash.bytes()[at..at + program.image.body_bytes as usize]);
    assert_eq!(drive::program::check_image(&image), Ok(program.image));
    Some(image)
}

/// Clears the memory for a new program.
fn clear<F: NorFlash>(flash: &mut F, store: &mut ProgramStore) -> Result<(), Abort> {
    store.control(0)?;
    assert_eq!(store.control(3)?, Action::Clear);
    assert_eq!(store.status(), 1);
    while store.erase_sector(flash)? {
        assert_eq!(store.status(), 1);
    }
    assert_eq!((store.status(), store.control_value()), (0, 3));
    Ok(())
}

/// Downloads `image` in pieces of `piece` bytes.
fn download<F: NorFlash>(
    flash: &mut F,
    store: &mut ProgramStore,
    image: &[u8],
    piece: usize,
) -> Result<(), Abort> {
    store.begin(Some(image.len() as u32))?;
    let mut at = 0;
    for bytes in image.chunks(piece) {
        store.write(flash, at, bytes)?;
        assert_eq!((store.status(), store.control_value()), (1, 3));
        at += bytes.len() as u32;
    }
    store.finish(flash)
}

/// All that a master does to bring `image` in; the drive has just started.
fn update<F: NorFlash>(
    flash: &mut F,
    banks: &Banks,
    image: &[u8],
    piece: usize,
) -> Result<(), Abort> {
    let mut store = ProgramStore::open(flash, *banks, PRODUCT).map_err(|_| Abort::HARDWARE)?;
    clear(flash, &mut store)?;
    download(flash, &mut store, image, piece)?;
    assert_eq!((store.status(), store.control_value()), (0, 0));
    let stated = u32::from_le_bytes(*image[4..].first_chunk().unwrap());
    assert_eq!(store.identification(), stated);
    assert_eq!(store.control(1), Ok(Action::Start));
    Ok(())
}

/// A flash on which `number` programs were installed one after another, and the last of them.
fn prepared<const PAGE: usize, const SECTOR: usize>(
    bank_bytes: u32,
    number: u32,
    length: usize,
) -> (MemoryFlash<PAGE, SECTOR>, Banks, Option<Vec<u8>>) {
    let mut flash = MemoryFlash::new(2 * bank_bytes as usize);
    let banks = banks(&flash, bank_bytes);
    let mut last = None;
    for number in 0..number {
        let image = image(number, length);
        update(&mut flash, &banks, &image, 7).unwrap();
        last = Some(image);
    }
    assert_eq!(started(&mut flash, &banks), last);
    (flash, banks, last)
}

/// The steps that an update takes.
fn steps<const PAGE: usize, const SECTOR: usize>(
    flash: &MemoryFlash<PAGE, SECTOR>,
    banks: &Banks,
    image: &[u8],
) -> u64 {
    let mut flash = flash.copy();
    update(&mut flash, banks, image, 889).unwrap();
    flash.steps().total()
}

/// Updates with the power failing, and powers on again.
fn update_cut<const PAGE: usize, const SECTOR: usize>(
    flash: &mut MemoryFlash<PAGE, SECTOR>,
    banks: &Banks,
    image: &[u8],
    piece: usize,
    cut: PowerCut,
) {
    flash.cut_after(cut);
    update(flash, banks, image, piece).unwrap_err();
    assert!(flash.has_lost_power());
    flash.power_on();
}

#[derive(Debug, Default)]
struct Count {
    cuts: u64,
    old: u64,
    new: u64,
}

impl Count {
    fn add(&mut self, found: &Option<Vec<u8>>, old: &Option<Vec<u8>>, new: &[u8], what: &str) {
        self.cuts += 1;
        if found.as_deref() == Some(new) {
            self.new += 1;
        } else if found == old {
            self.old += 1;
        } else {
            panic!("{what}: neither the old nor the new program");
        }
    }
}

/// The power fails in each step of an update; then in each step of the update that follows; then
/// one goes through.
#[test]
fn a_cut_in_every_step_and_another_in_every_step_of_the_recovery() {
    let (mut single, mut double) = (Count::default(), Count::default());
    for installed in 0..4 {
        let (flash, banks, old) = prepared::<4, 256>(SMALL_BANK, installed, 100);
        let (new, newer) = (image(10, 131), image(20, 90));
        for seed in 0..4 {
            for after in 0..steps(&flash, &banks, &new) {
                let mut cut = flash.copy();
                let piece = 1 + (after as usize * 13 + seed as usize) % 200;
                update_cut(&mut cut, &banks, &new, piece, PowerCut { after, seed });
                let what = format!("{installed} installed, cut after {after}, seed {seed}");
                let found = started(&mut cut, &banks);
                single.add(&found, &old, &new, &what);
                for again in 0..steps(&cut, &banks, &newer) {
                    let mut twice = cut.copy();
                    let seed = seed + again * 7;
                    update_cut(
                        &mut twice,
                        &banks,
                        &newer,
                        64,
                        PowerCut { after: again, seed },
                    );
                    let what = format!("{what}, again after {again}");
                    let left = started(&mut twice, &banks);
                    double.add(&left, &found, &newer, &what);
                    update(&mut twice, &banks, &new, 100).unwrap();
                    assert_eq!(started(&mut twice, &banks).as_ref(), Some(&new));
                }
            }
        }
    }
    println!("once: {single:?}; twice: {double:?}");
    // A new one only if the half-written last byte happened to get all its bits.
    assert!(single.cuts > 3000 && single.old > 0);
    assert!(double.cuts > 600_000 && double.old > 0 && double.new > 0);
}

/// Real sizes: every erase, the last thousand steps, and between them every 499th.
#[test]
fn cuts_on_banks_of_128_kib() {
    let (mut flash, banks, old) = prepared::<8, 4096>(128 * 1024, 2, 90_000);
    let new = image(10, 100_000);
    let total = steps(&flash, &banks, &new);
    let mut count = Count::default();
    let between = (40..total - 1000).step_by(499);
    for after in (0..40).chain(between).chain(total - 1000..total) {
        let mut cut = flash.copy();
        update_cut(&mut cut, &banks, &new, 889, PowerCut { after, seed: after });
        let found = started(&mut cut, &banks);
        count.add(&found, &old, &new, &format!("cut after {after} of {total}"));
    }
    println!("{total} steps: {count:?}");
    update(&mut flash, &banks, &new, 889).unwrap();
    assert_eq!(started(&mut flash, &banks), Some(new));
}

/// Any length of pieces gives the same flash.
#[test]
fn pieces_of_every_length() {
    let (flash, banks, _) = prepared::<4, 256>(SMALL_BANK, 1, 100);
    let new = image(10, 511);
    let mut whole = flash.copy();
    update(&mut whole, &banks, &new, 889).unwrap();
    for piece in 1..=new.len() {
        let mut other = flash.copy();
        update(&mut other, &banks, &new, piece).unwrap();
        assert!(other.bytes() == whole.bytes(), "pieces of {piece}");
    }
    // Without an announced size, and the largest image that fits.
    let largest = image(11, banks.capacity() as usize - 64);
    let mut store = ProgramStore::open(&mut whole, banks, PRODUCT).unwrap();
    clear(&mut whole, &mut store).unwrap();
    store.begin(None).unwrap();
    store.write(&mut whole, 0, &largest).unwrap();
    store.finish(&mut whole).unwrap();
    assert_eq!(started(&mut whole, &banks), Some(largest));
}

/// A bad download: what came, how it was cut off, and what the client and 0x1F57 are told.
struct Bad {
    what: &'static str,
    announced: Option<u32>,
    bytes: Vec<u8>,
    abort: Abort,
    status: u32,
    /// Whether the memory is still clear after it.
    clear: bool,
}

fn bad_downloads(capacity: u32) -> Vec<Bad> {
    let good = image(10, 300);
    let length = good.len() as u32;
    let mut flipped = good.clone();
    flipped[250] ^= 0x40;
    let longer = [&good[..], &[0xFF]].concat();
    let bad = |what, announced, bytes: &[u8], abort, status, clear| Bad {
        what,
        announced,
        bytes: bytes.to_vec(),
        abort,
        status,
        clear,
    };
    let exact = Some(length);
    vec![
        bad(
            "not an image",
            None,
            &good[1..],
            Abort::CANNOT_STORE,
            0x0002_0004,
            true,
        ),
        bad(
            "for another drive",
            exact,
            &image_for(0x5034, 10, 300),
            Abort::CANNOT_STORE,
            0x0003_0004,
            true,
        ),
        bad(
            "too short",
            None,
            &good[..good.len() - 1],
            Abort::TOO_SHORT,
            0x0004_0006,
            false,
        ),
        bad(
            "no header even",
            None,
            &good[..50],
            Abort::TOO_SHORT,
            0x0004_0006,
            true,
        ),
        bad("nothing", None, &[], Abort::TOO_SHORT, 0x0004_0006, true),
        bad(
            "announced too short",
            Some(length - 1),
            &good,
            Abort::TOO_SHORT,
            0x0004_0006,
            true,
        ),
        bad(
            "announced as a header",
            Some(64),
            &good,
            Abort::TOO_SHORT,
            0x0004_0006,
            true,
        ),
        bad(
            "too long",
            None,
            &longer,
            Abort::TOO_LONG,
            0x0005_0006,
            false,
        ),
        bad(
            "announced too long",
            Some(length + 1),
            &longer,
            Abort::TOO_LONG,
            0x0005_0006,
            true,
        ),
        bad(
            "checksum",
            exact,
            &flipped,
            Abort::CANNOT_STORE,
            0x0006_0006,
            false,
        ),
        bad(
            "announced out of the bank",
            Some(capacity + 1),
            &[],
            Abort::TOO_LONG,
            0x000B_000C,
            true,
        ),
        bad(
            "out of the bank",
            None,
            &image(1, capacity as usize),
            Abort::TOO_LONG,
            0x000B_000C,
            true,
        ),
    ]
}

/// Each leaves the old program as it was, startable, and says why; the next one goes well.
#[test]
fn bad_downloads_leave_the_old_program() {
    let (flash, banks, old) = prepared::<4, 256>(SMALL_BANK, 1, 100);
    for bad in bad_downloads(banks.capacity()) {
        for piece in [1, 7, 64, 889] {
            let mut flash = flash.copy();
            let mut store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
            let identification = store.identification();
            clear(&mut flash, &mut store).unwrap();
            let mut at = 0;
            let mut result = store.begin(bad.announced);
            for bytes in bad.bytes.chunks(piece) {
                result = result.and_then(|()| store.write(&mut flash, at, bytes));
                at += bytes.len() as u32;
            }
            result = result.and_then(|()| store.finish(&mut flash));
            assert_eq!(result, Err(bad.abort), "{}", bad.what);
            assert_eq!(store.status(), bad.status, "{}", bad.what);
            assert_eq!(store.identification(), identification);
            assert_eq!(store.control_value(), if bad.clear { 3 } else { 0 });
            assert_eq!(store.write(&mut flash, at, b"x"), Err(Abort::DEVICE_STATE));
            assert_eq!(store.finish(&mut flash), Err(Abort::DEVICE_STATE));
            assert_eq!(store.status(), bad.status, "{}", bad.what);
            assert_eq!(started(&mut flash, &banks), old);
            let good = image(11, 200);
            if bad.clear {
                download(&mut flash.copy(), &mut store.clone(), &good, 10).unwrap();
            } else {
                let again = store.clone().begin(None);
                assert_eq!(again, Err(Abort::DEVICE_STATE));
            }
            assert_eq!(store.control(1), Ok(Action::Start));
            update(&mut flash, &banks, &good, piece).unwrap();
            assert_eq!(started(&mut flash, &banks), Some(good));
        }
    }
}

/// The client aborts after each byte.
#[test]
fn an_abort_at_every_byte() {
    let (flash, banks, old) = prepared::<4, 256>(SMALL_BANK, 2, 100);
    let new = image(10, 150);
    for received in 0..=new.len() as u32 {
        let mut flash = flash.copy();
        let mut store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
        clear(&mut flash, &mut store).unwrap();
        store.begin(Some(new.len() as u32)).unwrap();
        for (at, byte) in new.iter().take(received as usize).enumerate() {
            store.write(&mut flash, at as u32, &[*byte]).unwrap();
        }
        store.abort();
        assert_eq!(store.failure(), Some(Failure::Aborted { received }));
        assert_eq!(store.status(), 0x0007_0006);
        store.abort();
        assert_eq!(store.status(), 0x0007_0006);
        assert_eq!(started(&mut flash, &banks), old);
        assert_eq!(store.control(1), Ok(Action::Start));
    }
}

/// A flash that does not keep what is written.
#[test]
fn a_flash_that_fails() {
    let (mut flash, banks, old) = prepared::<4, 256>(SMALL_BANK, 1, 100);
    let mut store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
    clear(&mut flash, &mut store).unwrap();
    let new = image(10, 150);
    store.begin(None).unwrap();
    store.write(&mut flash, 0, &new[..130]).unwrap();
    // A cell that was written has come loose.
    flash.bytes_mut()[SMALL_BANK as usize + 520] ^= 1;
    store.write(&mut flash, 130, &new[130..]).unwrap();
    assert_eq!(store.finish(&mut flash), Err(Abort::HARDWARE));
    assert_eq!(store.status(), 0x000A_000A);
    // One that is not erased where the next chunk goes.
    clear(&mut flash, &mut store).unwrap();
    flash.bytes_mut()[SMALL_BANK as usize + 64] = 0;
    store.begin(None).unwrap();
    assert_eq!(store.write(&mut flash, 0, &new), Err(Abort::HARDWARE));
    assert_eq!(store.status(), 0x0009_000A);
    // Erasing fails.
    store.control(3).unwrap();
    flash.cut_after(PowerCut { after: 1, seed: 0 });
    assert_eq!(store.erase_sector(&mut flash), Ok(true));
    assert_eq!(store.erase_sector(&mut flash), Err(Abort::HARDWARE));
    flash.power_on();
    assert_eq!((store.status(), store.control_value()), (0x0009_000A, 0));
    assert_eq!(store.erase_sector(&mut flash), Ok(false));
    assert_eq!(started(&mut flash, &banks), old);
}

/// Pieces for another place than the next.
#[test]
fn pieces_out_of_order() {
    let (mut flash, banks, _) = prepared::<4, 256>(SMALL_BANK, 1, 100);
    let new = image(10, 150);
    for (at, written) in [(99, 100), (101, 100), (0, 100), (u32::MAX, 0)] {
        let mut store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
        clear(&mut flash, &mut store).unwrap();
        store.begin(None).unwrap();
        store.write(&mut flash, 0, &new[..written]).unwrap();
        let written = written as u32;
        assert_eq!(store.write(&mut flash, at, &new[..10]), Err(Abort::GENERAL));
        assert_eq!(store.status(), 0x000C_000C);
        assert_eq!(
            store.failure(),
            Some(Failure::OutOfOrder {
                expected: written,
                at
            })
        );
    }
}

#[test]
fn what_needs_another_state_is_refused() {
    let (mut flash, banks, old) = prepared::<4, 256>(SMALL_BANK, 1, 100);
    let mut store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
    let refused = Err(Abort::DEVICE_STATE);
    assert_eq!((store.control_value(), store.status()), (1, 0));
    // Running: nothing but a stop.
    assert_eq!(store.begin(None), refused);
    assert_eq!(store.status(), 0x0008_0008);
    assert_eq!(store.control(3), Err(Abort::DEVICE_STATE));
    assert_eq!(store.control(2), Err(Abort::DEVICE_STATE));
    assert_eq!(store.control(4), Err(Abort::INVALID_VALUE));
    assert_eq!(store.control(1), Ok(Action::Nothing));
    assert_eq!(store.control(0), Ok(Action::Stop));
    // Stopped: not clear yet.
    assert_eq!(store.begin(None), refused);
    assert_eq!(store.control(2), Ok(Action::Nothing));
    assert_eq!(store.control(3), Ok(Action::Clear));
    // Being cleared: nothing.
    assert_eq!(store.begin(None), refused);
    for value in 0..4 {
        assert_eq!(store.control(value), Err(Abort::DEVICE_STATE));
    }
    store.abort();
    assert_eq!(store.status(), 1);
    while store.erase_sector(&mut flash).unwrap() {}
    // Receiving: nothing but bytes.
    store.begin(None).unwrap();
    assert_eq!(store.begin(None), refused);
    for value in 0..4 {
        assert_eq!(store.control(value), Err(Abort::DEVICE_STATE));
    }
    assert_eq!(store.status(), 1);
    store.abort();
    assert_eq!(store.control(3), Ok(Action::Nothing));
    assert_eq!(store.control(0), Ok(Action::Nothing));
    assert_eq!(started(&mut flash, &banks), old);
}

/// A drive without any program cannot start, and takes one.
#[test]
fn the_first_program() {
    let (mut flash, banks, _) = prepared::<4, 256>(SMALL_BANK, 0, 0);
    let mut store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
    assert_eq!((store.control_value(), store.status()), (0, 0x0001_0002));
    assert_eq!(store.identification(), 0);
    assert_eq!(store.control(1), Err(Abort::DEVICE_STATE));
    assert_eq!(store.status(), 0x0001_0002);
    clear(&mut flash, &mut store).unwrap();
    assert_eq!(store.control(1), Err(Abort::DEVICE_STATE));
    let first = image(0, 100);
    download(&mut flash, &mut store, &first, 33).unwrap();
    assert_eq!(store.control(1), Ok(Action::Start));
    let next = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
    assert_eq!(
        next.running().map(|program| program.bank),
        Some(Bank::First)
    );
    assert_eq!((next.control_value(), next.status()), (1, 0));
}

/// A program that waits for its start is given up by a clear: the bank that runs is never touched.
#[test]
fn the_program_that_runs_is_never_cleared() {
    let (mut flash, banks, old) = prepared::<4, 256>(SMALL_BANK, 1, 100);
    let bank = flash.bytes_mut()[..SMALL_BANK as usize].to_vec();
    let mut store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
    for number in 10..13 {
        clear(&mut flash, &mut store).unwrap();
        assert_eq!(started(&mut flash, &banks), old);
        assert_eq!(store.valid(), store.running());
        let new = image(number, 120);
        download(&mut flash, &mut store, &new, 50).unwrap();
        assert_eq!(started(&mut flash, &banks), Some(new));
        assert_eq!(flash.bytes_mut()[..SMALL_BANK as usize], bank);
    }
}

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

/// What a master, or the power, may do.
#[derive(Clone, Debug)]
enum Act {
    Control(u8),
    Erase,
    /// Stop, clear, and as many sectors as it takes.
    Clear,
    Begin(Option<u32>),
    Write(usize, bool),
    Finish,
    Abort,
    Restart,
    Cut(u64, u64),
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        4 => (0..5u8).prop_map(Act::Control),
        2 => Just(Act::Control(3)),
        3 => Just(Act::Erase),
        4 => Just(Act::Clear),
        3 => prop_oneof![Just(None), Just(Some(214)), (0..2000u32).prop_map(Some)].prop_map(Act::Begin),
        6 => (1..300usize, prop::bool::weighted(0.03)).prop_map(|(n, damage)| Act::Write(n, damage)),
        3 => Just(Act::Finish),
        1 => Just(Act::Abort),
        1 => Just(Act::Restart),
        1 => (0..300u64, any::<u64>()).prop_map(|(after, seed)| Act::Cut(after, seed)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Beside a model: the bank that runs never changes, and the next start runs the last program
    /// that was finished, unless that was cleared: then the one that runs.
    #[test]
    fn any_order(acts in proptest::collection::vec(act(), 1..120)) {
        let (mut flash, banks, old) = prepared::<4, 256>(SMALL_BANK, 1, 100);
        let mut store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
        let (mut running, mut next) = (old.clone(), old);
        let (mut number, mut at, mut whole) = (10, 0usize, true);
        let mut coming = image(number, 150);
        for act in acts {
            let bank = store.running().map_or(0, |program| program.at as usize - 512);
            let bank = bank..bank + SMALL_BANK as usize;
            let before = flash.bytes_mut()[bank.clone()].to_vec();
            let was = started(&mut flash, &banks);
            match act {
                Act::Control(value) => {
                    if store.control(value) == Ok(Action::Clear) {
                        next.clone_from(&running);
                    }
                }
                Act::Erase => {
                    let _ = store.erase_sector(&mut flash);
                }
                Act::Clear => {
                    let _ = store.control(0);
                    if store.control(3) == Ok(Action::Clear) {
                        next.clone_from(&running);
                    }
                    while store.erase_sector(&mut flash) == Ok(true) {}
                }
                Act::Begin(bytes) => {
                    if store.begin(bytes).is_ok() {
                        number += 1;
                        (coming, at, whole) = (image(number, 150), 0, true);
                    }
                }
                Act::Write(length, damage) => {
                    let mut bytes: Vec<u8> = coming.iter().skip(at).take(length).copied().collect();
                    if damage && let Some(byte) = bytes.last_mut() {
                        *byte ^= 0x20;
                        whole = false;
                    }
                    if store.write(&mut flash, at as u32, &bytes).is_ok() {
                        at += bytes.len();
                    }
                }
                Act::Finish => {
                    let finished = store.finish(&mut flash);
                    if finished.is_ok() {
                        prop_assert!(whole && at == coming.len());
                        prop_assert_eq!(store.status(), 0);
                        next = Some(coming.clone());
                    }
                }
                Act::Abort => store.abort(),
                Act::Restart => {
                    store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
                    running = started(&mut flash, &banks);
                    next.clone_from(&running);
                }
                Act::Cut(after, seed) => {
                    // The power fails during the rest of whatever goes on.
                    flash.cut_after(PowerCut { after, seed });
                    while store.erase_sector(&mut flash) == Ok(true) {}
                    let rest = coming.get(at..).unwrap_or(&[]);
                    let written = store.write(&mut flash, at as u32, rest);
                    let finished = written.and_then(|()| store.finish(&mut flash));
                    flash.power_on();
                    let found = started(&mut flash, &banks);
                    let new = whole && found.as_ref() == Some(&coming);
                    prop_assert!(found == was || found == next || new, "{:?}", finished);
                    store = ProgramStore::open(&mut flash, banks, PRODUCT).unwrap();
                    running.clone_from(&found);
                    next = found;
                }
            }
            prop_assert_eq!(&flash.bytes_mut()[bank], &before);
            prop_assert!(store.running().is_some());
            let valid = store.valid().map(|program| program.image.bytes().to_vec());
            prop_assert_eq!(valid, next.as_ref().map(|image| image[..64].to_vec()));
            // Until the first sector is erased, a program that was given up is still there.
            let found = started(&mut flash, &banks);
            prop_assert!(found == next || store.status() == 1 && found == was);
        }
    }
}
