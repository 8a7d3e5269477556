//! CiA 301's rules for SYNC and TIME.

mod harness;
#[path = "checks/identifiers.rs"]
mod identifiers;
mod rules;
#[path = "checks/sync.rs"]
mod sync;
#[path = "checks/time.rs"]
mod time;

use rules::{Rule, rule};

#[test]
fn rules() {
    rules::hold("SYNC", "conformance_sync.rs", RULES);
}

#[rustfmt::skip]
const RULES: &[Rule] = &[
    rule("SYNC-01", "CiA 301 7.5.2.5", "COB-ID SYNC is 0x80 by default", sync::default_identifier),
    rule("SYNC-02", "CiA 301 7.2.5.3", "A SYNC is a data frame of its identifier, of 11 or 29 bits", sync::data_frame),
    rule("SYNC-03", "CiA 301 7.5.2.5", "A consumer's COB-ID may be moved, at once, but onto no restricted identifier: 0x06090030", sync::moved),
    rule("SYNC-04", "CiA 301 7.5.2.5", "COB-ID SYNC has 29 bits with bit 29, otherwise bits 11 to 28 are 0: 0x06090030", sync::wide_identifier),
    rule("SYNC-05", "CiA 301 7.5.2.5", "Bit 31 of COB-ID SYNC has no meaning", sync::bit_31),
    rule("SYNC-06", "CiA 301 7.5.2.5", "A device that cannot produce SYNC, or 29 bits, refuses bit 30 and bit 29: 0x06090030", sync::no_producer),
    rule("SYNC-07", "CiA 301 7.5.2.6", "A producer's SYNCs come at its period, exact to the microsecond, the first within one period", sync::period),
    rule("SYNC-08", "CiA 301 7.5.2.6", "SYNC is produced with bit 30 and a period other than 0", sync::producer_needs_both),
    rule("SYNC-09", "CiA 301 7.5.2.5", "Bits 0 to 29 of COB-ID SYNC do not change while bit 30 is set: 0x06090030", sync::fixed_while_producing),
    rule("SYNC-10", "CiA 301 7.2.5.3", "The counter is one byte and runs from 1 to the overflow value; without it a SYNC is empty", sync::counter),
    rule("SYNC-11", "CiA 301 7.2.5.1", "After stopped the counter begins with 1", sync::counter_after_stopped),
    rule("SYNC-12", "CiA 301 7.2.5.1", "The counter goes up by 1 with each SYNC through pre-operational, operational and changes of the period", sync::counter_goes_on),
    rule("SYNC-13", "CiA 301 7.2.5.1", "Who begins to produce begins with 1", sync::counter_of_a_new_producer),
    rule("SYNC-14", "CiA 301 7.5.2.22", "The overflow value is 0 or 2 to 240: 0x06090030", sync::overflow_values),
    rule("SYNC-15", "CiA 301 7.5.2.22", "The overflow value does not change while the period is not 0: 0x08000022", sync::overflow_needs_no_period),
    rule("SYNC-16", "CiA 301 7.5.2.22", "A SYNC of another length than 0x1019 says is not obeyed: the error of 0x8240 until a good one", sync::length),
    rule("SYNC-17", "CiA 301 7.2.5.1", "A producer obeys its own SYNC; its PDOs follow it", sync::obeys_its_own),
    rule("SYNC-18", "CiA 301 7.5.2.37", "The SYNC start value holds for a producer's own counter", sync::start_value_of_its_own),
    rule("SYNC-19", "CiA 301 7.2.5.1", "A producer that was held up sends one SYNC, not a burst", sync::no_burst),
    rule("SYNC-20", "CiA 301 7.5.2.7", "Synchronous TPDOs that were not sent within the window are not sent; event-driven ones are", sync::window_of_transmission),
    rule("SYNC-21", "CiA 301 7.5.2.7", "Synchronous RPDOs that come after the window are discarded until the next SYNC, whatever is written meanwhile", sync::window_of_reception),
    rule("SYNC-22", "CiA 301 7.5.2.7", "The error of a missed window ends with one that was kept, or with the window", sync::window_error_ends),
    rule("SYNC-23", "CiA 301 7.5.2.7", "A window of 0 is none", sync::no_window),
    rule("SYNC-24", "CiA 301 7.5.2.15", "COB-ID TIME is 0x100 by default, neither consumed nor produced", time::default),
    rule("SYNC-25", "CiA 301 7.2.6.3", "With bit 31 TIME is consumed: milliseconds of the day in 28 bits, days in 16", time::consumed),
    rule("SYNC-26", "CiA 301 7.1.6.4", "The four bits beside the milliseconds are reserved", time::reserved_bits),
    rule("SYNC-27", "CiA 301 7.2.6.3", "A TIME is a data frame of six bytes of its identifier", time::six_bytes),
    rule("SYNC-28", "CiA 301 7.2.6.3", "With bit 30 TIME is produced, six bytes, once each", time::produced),
    rule("SYNC-29", "CiA 301 7.5.2.15", "Without bit 30 no TIME is produced", time::not_produced),
    rule("SYNC-30", "CiA 301 7.5.2.15", "Bits 0 to 29 of COB-ID TIME do not change while bit 30 or 31 is set: 0x06090030", time::fixed_while_on),
    rule("SYNC-31", "CiA 301 7.5.2.15", "COB-ID TIME is no restricted identifier and has 11 bits or, with bit 29, 29: 0x06090030", time::identifiers),
];
