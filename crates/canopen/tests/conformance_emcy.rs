//! CiA 301's rules for emergencies and the error history.

#[path = "checks/emcy.rs"]
mod emcy;
mod harness;
#[path = "checks/identifiers.rs"]
mod identifiers;
mod rules;

use rules::{Rule, rule};

#[test]
fn rules() {
    rules::hold("EMCY", "conformance_emcy.rs", RULES);
}

#[rustfmt::skip]
const RULES: &[Rule] = &[
    rule("EMCY-01", "CiA 301 7.2.7.3", "An emergency is eight bytes: code, error register, five of the manufacturer's; sent once", emcy::contents),
    rule("EMCY-02", "CiA 301 7.2.7.1", "The end of the errors is announced with code 0x0000, which is no entry of the history", emcy::error_reset),
    rule("EMCY-03", "CiA 301 7.5.2.2", "0x1001 is the register that was announced, and read only", emcy::register),
    rule("EMCY-04", "CiA 301 7.5.2.4", "The history has the newest error first; entries without an error have no data: 0x08000024", emcy::history),
    rule("EMCY-05", "CiA 301 7.5.2.4", "Writing 0 to 0x1003,0 clears the history, another value is refused: 0x06090030", emcy::history_cleared),
    rule("EMCY-06", "CiA 301 7.5.2.4", "The entries of the history are read only: 0x06010002", emcy::history_is_read_only),
    rule("EMCY-07", "CiA 301 7.3.2.2", "History and register outlast a communication reset", emcy::history_survives_communication),
    rule("EMCY-08", "CiA 301 7.5.2.17", "COB-ID EMCY is 0x80 plus the node ID by default", emcy::default_identifier),
    rule("EMCY-09", "CiA 301 7.5.2.17", "COB-ID EMCY is no restricted identifier and has 11 bits or, with bit 29, 29: 0x06090030", emcy::identifiers),
    rule("EMCY-10", "CiA 301 7.5.2.17", "Bits 0 to 29 of COB-ID EMCY do not change while it exists, bit 30 is reserved: 0x06090030", emcy::fixed_while_valid),
    rule("EMCY-11", "CiA 301 7.5.2.17", "With bit 31 nothing is sent; register and history go on", emcy::off),
    rule("EMCY-12", "CiA 301 7.5.2.18", "Between two emergencies that leave lies the inhibit time, exact to 100 µs; none is lost, none overtakes", emcy::inhibit_time),
    rule("EMCY-13", "CiA 301 7.5.2.18", "An inhibit time of 0 is none", emcy::no_inhibit_time),
    rule("EMCY-14", "CiA 301 7.5.2.18", "On a busy bus emergencies wait, and all are sent, the inhibit time between them as they leave", emcy::inhibit_time_of_a_busy_bus),
    rule("EMCY-15", "CiA 301 7.3.2.2", "Emergencies of stopped are sent after it, at the inhibit time", emcy::stopped),
    rule("EMCY-16", "CiA 301 7.3.2.2", "Nothing is sent before boot-up, nor made up for; the history knows", emcy::before_boot_up),
    rule("EMCY-17", "CiA 301 7.5.2.31", "An emergency of a COB-ID in 0x1028 is of the node whose number is the sub-index", emcy::consumed),
    rule("EMCY-18", "CiA 301 7.5.2.31", "Other frames, lengths and entries that are off are not consumed", emcy::not_consumed),
    rule("EMCY-19", "CiA 301 7.5.2.31", "COB-IDs in 0x1028: not restricted, fixed while they exist, bit 30 reserved, 29 bits with bit 29: 0x06090030", emcy::consumers_identifiers),
];
