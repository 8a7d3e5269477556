//! Every error of every drive has a name, its own ones by their document.

use std::collections::BTreeSet;

use personalities::Cause;

#[test]
fn every_cause_has_a_name_and_every_name_a_cause() {
    for drive in personalities::ALL {
        let mut names = BTreeSet::new();
        let mut own = BTreeSet::new();
        for fault in drive.faults {
            let name = drive.cause_name(fault.cause);
            let name = name.unwrap_or_else(|| panic!("{}: {:?}", drive.name, fault.cause));
            assert!(
                !name.is_empty() && names.insert(name),
                "{}: {name}",
                drive.name
            );
            if let Cause::Own(number) = fault.cause {
                own.insert(usize::from(number));
            }
        }
        assert!(
            own.into_iter().eq(0..drive.own_causes.len()),
            "{}",
            drive.name
        );
    }
}

/// Of the MD80 they are the names of its status bits, in the same order.
#[test]
fn the_md80_s_are_those_of_its_status_bits() {
    use personalities::md80::{Effect, MD80, STATUS_BITS};
    let announced = STATUS_BITS.iter().filter_map(|bit| match bit.effect {
        Effect::Fault(code) | Effect::Critical(code) | Effect::Announced(code) => {
            Some((bit.name, code))
        }
        Effect::Shown => None,
    });
    let rows = MD80.faults.iter();
    let rows = rows.filter(|row| matches!(row.cause, Cause::Own(_)));
    let built = rows.map(|row| (MD80.cause_name(row.cause).unwrap(), row.code));
    assert!(announced.eq(built));
}
