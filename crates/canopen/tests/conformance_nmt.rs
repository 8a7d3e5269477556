//! CiA 301's rules for NMT, boot-up, heartbeat, guarding and error behaviour.

#[path = "checks/guarding.rs"]
mod guarding;
mod harness;
#[path = "checks/heartbeat.rs"]
mod heartbeat;
#[path = "checks/nmt.rs"]
mod nmt;
mod rules;

use rules::{Rule, rule};

#[test]
fn rules() {
    rules::hold("NMT", "conformance_nmt.rs", RULES);
}

#[rustfmt::skip]
const RULES: &[Rule] = &[
    rule("NMT-01", "CiA 301 7.2.8.3.3", "Boot-up is one frame of one byte 0x00 on 0x700 plus the node ID", nmt::boot_up),
    rule("NMT-02", "CiA 301 7.3.2.2", "After boot-up the node is in pre-operational by itself", nmt::enters_pre_operational),
    rule("NMT-03", "CiA 301 7.3.2.1", "0x01, 0x02 and 0x80 lead from every state into operational, stopped and pre-operational", nmt::transitions),
    rule("NMT-04", "CiA 301 7.2.8.3.1", "A command is for all nodes (0) or for the node it names", nmt::addressed),
    rule("NMT-05", "CiA 301 7.2.8.3.1", "A command has exactly two bytes", nmt::two_bytes),
    rule("NMT-06", "CiA 301 7.2.8.3.1", "Unknown command specifiers change nothing", nmt::unknown_commands),
    rule("NMT-07", "CiA 301 7.2.8.3.1", "Only a data frame of identifier 0 of 11 bits is a command", nmt::data_frames_of_identifier_0),
    rule("NMT-08", "CiA 301 7.3.2.1", "0x81 and 0x82 ask for a reset in every state", nmt::resets),
    rule("NMT-09", "CiA 301 7.3.2.2", "Reset communication: boot-up, communication parameters at their defaults, the others as they were", nmt::reset_communication),
    rule("NMT-10", "CiA 301 7.3.2.2", "Before boot-up nothing is sent, answered or obeyed", nmt::initialising),
    rule("NMT-11", "CiA 301 7.3.2.3", "SDO in pre-operational and operational only", nmt::sdo),
    rule("NMT-12", "CiA 301 7.3.2.3", "SYNC is consumed in pre-operational and operational only", nmt::sync),
    rule("NMT-13", "CiA 301 7.3.2.3", "TIME is consumed and produced in pre-operational and operational only", nmt::time),
    rule("NMT-14", "CiA 301 7.3.2.3", "EMCY is produced and consumed in pre-operational and operational only", nmt::emcy),
    rule("NMT-15", "CiA 301 7.3.2.3", "SYNC is produced in pre-operational and operational only", nmt::produced_sync),
    rule("NMT-16", "CiA 301 7.3.2.3", "Guarding and heartbeats, produced and consumed, live in every state", nmt::error_control),
    rule("NMT-17", "CiA 301 7.3.2.3", "In stopped no frame but NMT and guarding is answered", nmt::stopped_is_silent),
    rule("NMT-18", "CiA 301 7.5.2.20", "Heartbeats come at their period, exact to the millisecond, and carry the state", heartbeat::period),
    rule("NMT-19", "CiA 301 7.5.2.20", "A heartbeat time of 0 is off", heartbeat::off),
    rule("NMT-20", "CiA 301 7.2.8.2.2", "With a heartbeat time at start the boot-up is the first heartbeat", heartbeat::boot_up_is_the_first),
    rule("NMT-21", "CiA 301 7.2.8.2.2", "A new heartbeat time holds from its write on", heartbeat::new_period),
    rule("NMT-22", "CiA 301 7.2.8.2.2", "State changes do not disturb the heartbeat's rhythm", heartbeat::state_changes_keep_the_rhythm),
    rule("NMT-23", "CiA 301 7.5.2.19", "A node is listened for from its first heartbeat on", heartbeat::first_heartbeat),
    rule("NMT-24", "CiA 301 7.2.8.2.2", "A node is lost when its time has passed, exact to the millisecond: the error of 0x8130, told once", heartbeat::loss),
    rule("NMT-25", "CiA 301 7.2.8.2.2", "Each heartbeat starts the time anew", heartbeat::each_heartbeat_starts_anew),
    rule("NMT-26", "CiA 301 7.2.8.2.2", "A lost node that is heard again ends the error and is listened for again", heartbeat::recovery),
    rule("NMT-27", "CiA 301 7.2.8.2.2", "Changes of the state and every boot-up of a node are told", heartbeat::states),
    rule("NMT-28", "CiA 301 7.2.8.3.2", "A heartbeat is a data frame of one byte on 0x700 plus the node ID", heartbeat::not_a_heartbeat),
    rule("NMT-29", "CiA 301 7.5.2.19", "Several nodes are listened for, each with its time; the error lasts as long as one is lost", heartbeat::several),
    rule("NMT-30", "CiA 301 7.5.2.19", "A node is listened for once only: 0x06040043", heartbeat::twice),
    rule("NMT-31", "CiA 301 7.5.2.19", "Node 0, nodes over 127 and time 0 are entries that are not used", heartbeat::unused_entries),
    rule("NMT-32", "CiA 301 7.5.2.19", "Bits 24 to 31 of an entry are reserved: 0x06090030", heartbeat::reserved_bits),
    rule("NMT-33", "CiA 301 7.5.2.19", "Entries change one by one; who is not listened for any more is not missed", heartbeat::entries_change),
    rule("NMT-34", "CiA 301 7.2.8.3.2", "A guard request is answered with the state and a toggle bit that begins with 0", guarding::toggle),
    rule("NMT-35", "CiA 301 7.2.8.3.2", "The toggle bit goes on through all states; a communication reset begins with 0", guarding::toggle_and_states),
    rule("NMT-36", "CiA 301 7.2.8.3.2", "A guard request is a remote frame on the node's own 0x700 plus node ID, whatever length it asks for", guarding::request),
    rule("NMT-37", "CiA 301 7.5.2.12", "The life time is guard time times factor and begins with the first request; when it passes there is the error of 0x8130 until the next", guarding::life_time),
    rule("NMT-38", "CiA 301 7.5.2.12", "A guard time or factor of 0 ends life guarding, not node guarding", guarding::no_life_time),
    rule("NMT-39", "CiA 301 7.2.8.2.2", "Life guarding and its error end with guard time, factor and heartbeats", guarding::life_time_ends),
    rule("NMT-40", "CiA 301 7.2.8.2.2", "A node with heartbeats is not guarded; bit 7 of a heartbeat is 0", guarding::heartbeat_excludes_guarding),
    rule("NMT-41", "CiA 301 7.3.2.3", "The life is guarded in every state", guarding::life_guarding_in_every_state),
    rule("NMT-42", "CiA 301 7.5.2.32", "Guarding lost: 0x1029,1 leaves operational (0), keeps the state (1) or stops (2)", guarding::behaviour_after_guarding),
    rule("NMT-43", "CiA 301 7.5.2.32", "Heartbeat lost: likewise", guarding::behaviour_after_heartbeat),
    rule("NMT-44", "CiA 301 7.5.2.32", "Bus-off: likewise", guarding::behaviour_after_bus_off),
    rule("NMT-45", "CiA 301 7.5.2.32", "The end of an error does not lead back into operational", guarding::recovery_changes_no_state),
    rule("NMT-46", "CiA 301 7.5.2.32", "PDOs end with the operational that an error ends", guarding::pdos_end),
    rule("NMT-47", "CiA 301 7.5.2.32", "0x1029 holds 0, 1 or 2: 0x06090030", guarding::behaviour_values),
];
