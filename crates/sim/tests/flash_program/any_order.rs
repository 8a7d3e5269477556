//! Acts in any order, beside a model.

use drive::program::{Action, ProgramStore};
use proptest::prelude::*;
use sim::PowerCut;

use crate::bench::{PRODUCT, SMALL_BANK, image, prepared, started};

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
