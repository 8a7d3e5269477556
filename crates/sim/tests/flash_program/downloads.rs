//! Downloads in every piecing, bad ones, and those that end early.

use canopen::Abort;
use drive::program::{Action, Failure, ProgramStore};
use sim::PowerCut;

use crate::bench::{
    PRODUCT, SMALL_BANK, clear, download, image, image_for, prepared, started, update,
};

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
