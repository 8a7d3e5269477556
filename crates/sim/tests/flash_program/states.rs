//! What may be done when, and which program runs.

use canopen::Abort;
use drive::program::{Action, Bank, ProgramStore};

use crate::bench::{PRODUCT, SMALL_BANK, clear, download, image, prepared, started};

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
