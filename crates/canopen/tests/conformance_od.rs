//! The object dictionary against CiA 301 7.4 and 7.5.2, rule by rule.

mod harness;
mod rules;

#[path = "conformance_od/access.rs"]
mod access;
#[path = "conformance_sdo/blocks.rs"]
#[allow(dead_code, reason = "the SDO's tests use all of it")]
mod blocks;
#[path = "conformance_sdo/master.rs"]
#[allow(dead_code, reason = "the SDO's tests use all of it")]
mod master;
#[path = "conformance_od/objects.rs"]
mod objects;
#[path = "conformance_od/values.rs"]
mod values;

use rules::{Rule, rule};

#[test]
fn rules() {
    rules::hold("OD", "conformance_od.rs", RULES);
}

#[rustfmt::skip]
const RULES: &[Rule] = &[
    rule("OD-01", "CiA 301 7.4.1",
        "An index that the dictionary does not have gets 0x06020000, by every transfer.",
        access::no_such_object),
    rule("OD-02", "CiA 301 7.4.3",
        "A sub-index that an object does not have gets 0x06090011, by every transfer.",
        access::no_such_sub_index),
    rule("OD-03", "CiA 301 7.4.3",
        "Sub-indices may have gaps; those in them get 0x06090011.",
        access::gaps),
    rule("OD-04", "CiA 301 7.4.3",
        "Write-only objects cannot be read (0x06010001), read-only and constant ones not written (0x06010002).",
        access::every_object_by_its_access),
    rule("OD-05", "CiA 301 7.4.3",
        "A constant never changes.",
        access::constants_stay),
    rule("OD-06", "CiA 301 7.2.4.3.17",
        "The abort tells the first of: object, sub-index, access, length, range.",
        access::order_of_the_checks),
    rule("OD-07", "CiA 301 7.4.3",
        "Sub-index 0 of an object that has others is the highest of them, as a constant UNSIGNED8.",
        access::sub_index_0),
    rule("OD-08", "CiA 301 7.5.2.36",
        "Sub-index 0 of a mapping and of the error history counts what is in use.",
        access::sub_index_0_that_counts),
    rule("OD-09", "CiA 301 7.4.7",
        "An object is as long as its type, a string or DOMAIN as long as its value.",
        access::lengths),
    rule("OD-10", "CiA 301 7.4.3",
        "Only what was written has changed.",
        access::who_is_told),
    rule("OD-11", "CiA 301 7.4.7.1",
        "Each data type has its index in the dictionary.",
        values::codes_of_types),
    rule("OD-12", "CiA 301 7.4.7.1",
        "Values of every type are kept bit for bit.",
        values::every_type),
    rule("OD-13", "CiA 301 7.1.4",
        "Numbers are sent low byte first.",
        values::low_byte_first),
    rule("OD-14", "CiA 301 7.1.4.2",
        "A BOOLEAN is 0 or 1.",
        values::booleans),
    rule("OD-15", "CiA 301 7.2.4.3.17",
        "Values beyond a range get 0x06090031 above and 0x06090032 below; the bounds belong to it.",
        values::both_bounds_of_every_type),
    rule("OD-16", "CiA 301 7.2.4.3.17",
        "So do the extremes of every type; what is no number gets 0x06090030.",
        values::extremes_of_every_type),
    rule("OD-17", "CiA 301 7.2.4.3.17",
        "Bounds are exact, up to those of 64 bits.",
        values::exact_bounds),
    rule("OD-18", "CiA 301 7.4.3",
        "A write changes its own object and no other.",
        values::nothing_else_changes),
    rule("OD-19", "CiA 301 7.1.6.3",
        "A VISIBLE_STRING has any length up to its greatest.",
        values::texts),
    rule("OD-20", "CiA 301 7.1.6.2",
        "An OCTET_STRING is kept with all its octets.",
        values::octets),
    rule("OD-21", "CiA 301 7.3.3",
        "After the start every object has its default; COB-IDs include the node ID.",
        values::defaults),
    rule("OD-22", "CiA 301 7.5.2.21",
        "0x1000 says the device type, 0x1018 the identity in four sub-indices.",
        objects::device_type_and_identity),
    rule("OD-23", "CiA 301 7.5.2.8",
        "0x1008 to 0x100A are constant texts.",
        objects::names_and_versions),
    rule("OD-24", "CiA 301 7.5.2.4",
        "Without errors 0x1003,0 is 0 and the others get 0x08000024.",
        objects::no_errors_in_the_history),
    rule("OD-25", "CiA 301 7.5.2.4",
        "The newest error is at 0x1003,1 and pushes the others on; 0x1003,0 counts them.",
        objects::the_newest_error_first),
    rule("OD-26", "CiA 301 7.5.2.4",
        "Writing 0 to 0x1003,0 clears the history; other values get 0x06090030.",
        objects::clearing_the_history),
    rule("OD-27", "CiA 301 7.5.2.13",
        "0x1010 stores upon \"save\" only; other values get 0x08000020. Reading says that it can.",
        objects::the_signature_to_store),
    rule("OD-28", "CiA 301 7.5.2.13",
        "What was stored is there after the next start, of every type.",
        objects::stored_values_come_back),
    rule("OD-29", "CiA 301 7.5.2.13",
        "0x1010 stores all, the communication or the application parameters; the rest stays as stored.",
        objects::groups),
    rule("OD-30", "CiA 301 7.5.2.14",
        "0x1011 restores upon \"load\" only; other values get 0x08000020.",
        objects::the_signature_to_restore),
    rule("OD-31", "CiA 301 7.5.2.14",
        "Restored defaults are valid after the next start.",
        objects::restored_defaults),
    rule("OD-32", "CiA 301 7.3.3",
        "COB-IDs that were not changed follow another node ID.",
        objects::another_node_id),
    rule("OD-33", "CiA 301 7.5.2.13",
        "A damaged store is not used; nor is a value that the dictionary does not allow.",
        objects::values_that_are_not_used),
    rule("OD-34", "CiA 301 7.3.2.2.1",
        "Reset communication puts the communication parameters back to what is stored, and no others.",
        objects::reset_communication),
    rule("OD-35", "CiA 301 7.5.2.23",
        "0x1020 keeps date and time of the configuration, and is stored with it; with another it is 0.",
        objects::verify_configuration),
    rule("OD-36", "CiA 301 7.5.2.24",
        "0x1021 hands out the EDS, in the format that 0x1022 says.",
        objects::store_eds),
];
