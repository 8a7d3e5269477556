//! CiA 301's rules for PDOs: what is sent and taken when, mapping, COB-IDs and types.

mod harness;
#[path = "checks/identifiers.rs"]
mod identifiers;
#[path = "checks/pdo_mapping.rs"]
mod mapping;
#[path = "checks/pdo_parameters.rs"]
mod parameters;
#[path = "checks/pdo_receive.rs"]
mod receive;
mod rules;
#[path = "checks/pdo_start.rs"]
mod start;
#[path = "checks/pdo_transmit.rs"]
mod transmit;

use rules::{Rule, rule};

#[test]
fn rules() {
    rules::hold("PDO", "conformance_pdo.rs", RULES);
}

#[rustfmt::skip]
const RULES: &[Rule] = &[
    rule("PDO-01", "CiA 301 7.3.2.3", "TPDOs are sent in operational only, by none of their causes in another state", transmit::operational_only),
    rule("PDO-02", "CiA 301 7.5.2.37", "Type 0: the SYNC after an event sends the TPDO, no event alone and no SYNC alone", transmit::acyclic),
    rule("PDO-03", "CiA 301 7.5.2.37", "Type 0: the values are those at the SYNC, not those at the event", transmit::acyclic_value_of_the_sync),
    rule("PDO-04", "CiA 301 7.5.2.37", "Types 1 to 240: sent with every nth SYNC", transmit::cyclic),
    rule("PDO-05", "CiA 301 7.2.2.2", "A synchronous TPDO holds the values that were sampled with its SYNC", transmit::cyclic_is_sampled_with_sync),
    rule("PDO-06", "CiA 301 7.5.2.37", "Types 1 to 240 are sent by neither events nor the event timer", transmit::cyclic_has_no_events),
    rule("PDO-07", "CiA 301 7.5.2.37", "Type 252: sampled with each SYNC, sent by remote request only", transmit::synchronous_request),
    rule("PDO-08", "CiA 301 7.5.2.37", "Type 253: sampled and sent by remote request only", transmit::event_request),
    rule("PDO-09", "CiA 301 7.2.2.3", "Types 254 and 255: each change of a mapped value is an event that sends the TPDO once", transmit::change_is_an_event),
    rule("PDO-10", "CiA 301 7.2.2.3", "A change of any of 64 bits, single or of one object, is an event", transmit::change_of_any_bit),
    rule("PDO-11", "CiA 301 7.2.2.3", "Types 254 and 255: an event of the application sends the TPDO", transmit::application_event),
    rule("PDO-12", "CiA 301 7.5.2.37", "Between two invocations of an event-driven TPDO lies the inhibit time, exact to 100 µs; the last value counts", transmit::inhibit_time),
    rule("PDO-13", "CiA 301 7.5.2.37", "The inhibit time holds for requests of event-driven TPDOs, too", transmit::inhibit_time_of_requests),
    rule("PDO-14", "CiA 301 7.5.2.37", "The inhibit time does not hold synchronous TPDOs back", transmit::inhibit_time_of_cyclic),
    rule("PDO-15", "CiA 301 7.5.2.37", "A change of the type does not end an inhibit time", transmit::inhibit_time_survives_a_type),
    rule("PDO-16", "CiA 301 7.5.2.37", "The inhibit time does not change while the TPDO exists: 0x06090030", transmit::inhibit_time_is_fixed),
    rule("PDO-17", "CiA 301 7.5.2.37", "The event timer sends types 254 and 255 at its period, exact to the millisecond", transmit::event_timer),
    rule("PDO-18", "CiA 301 7.2.2.3", "Each transmission starts the event timer anew", transmit::event_timer_starts_anew),
    rule("PDO-19", "CiA 301 7.5.2.37", "An event timer of 0 is off; it has no effect on the other types; it may change at any time", transmit::event_timer_off),
    rule("PDO-20", "CiA 301 7.3.2.3", "The event timer begins with operational", transmit::event_timer_begins_with_operational),
    rule("PDO-21", "CiA 301 7.5.2.37", "An event timer shorter than the inhibit time gives way to it", transmit::event_timer_and_inhibit_time),
    rule("PDO-22", "CiA 301 7.5.2.37", "Bit 30 of the COB-ID says whether remote requests are answered; it may change while the TPDO exists", transmit::request_allowed),
    rule("PDO-23", "CiA 301 7.2.2.3", "Synchronous TPDOs do not answer remote requests", transmit::request_of_synchronous),
    rule("PDO-24", "CiA 301 7.2.2.5", "A remote request is known by its identifier, of 11 or 29 bits, whatever length it asks for", transmit::request_by_identifier),
    rule("PDO-25", "CiA 301 7.5.2.37", "SYNC start value: the SYNC with that counter is the first that a TPDO counts", start::sync_start),
    rule("PDO-26", "CiA 301 7.5.2.37", "SYNC start value without a counter in 0x1019 has no effect", start::sync_start_without_counter),
    rule("PDO-27", "CiA 301 7.5.2.37", "SYNC start value is waited for in each operational", start::sync_start_in_each_operational),
    rule("PDO-28", "CiA 301 7.5.2.37", "SYNC start value does not change while the TPDO exists, and is 0 to 240: 0x06090030", start::sync_start_is_fixed),
    rule("PDO-29", "CiA 301 7.5.2.38", "A TPDO whose mapping is disabled is not sent, whatever its type", transmit::empty_mapping),
    rule("PDO-30", "CiA 301 7.2.2.5", "A TPDO has as many bytes as its mapping, the last one filled up with zeros", transmit::length_is_the_mapping),
    rule("PDO-31", "CiA 301 7.5.2.37", "TPDOs have identifiers of 29 bits", transmit::wide_identifiers),
    rule("PDO-32", "CiA 301 7.3.2.3", "What waits to be sent when operational ends is not sent", transmit::withdrawn),
    rule("PDO-33", "CiA 301 7.5.2.37", "SYNCs are counted from the first one in operational", transmit::counts_from_operational),
    rule("PDO-34", "CiA 301 7.2.2.2", "All TPDOs of a SYNC show the same moment", transmit::one_moment),
    rule("PDO-35", "CiA 301 7.5.2.35", "RPDO types 254 and 255 are applied at once", receive::event_driven),
    rule("PDO-36", "CiA 301 7.5.2.35", "RPDO types 0 to 240 are applied once, with the next SYNC", receive::synchronous),
    rule("PDO-37", "CiA 301 7.2.2.2", "Of several frames before a SYNC the last counts", receive::last_counts),
    rule("PDO-38", "CiA 301 7.3.2.3", "RPDOs are taken in operational only", receive::operational_only),
    rule("PDO-39", "CiA 301 7.3.2.3", "What waits for its SYNC when operational ends is forgotten", receive::forgotten),
    rule("PDO-40", "CiA 301 7.2.2.5", "A frame shorter than its mapping is not applied; the error of 0x8210 lasts until a good one", receive::too_short),
    rule("PDO-41", "CiA 301 7.2.2.5", "Of a frame longer than its mapping the first bytes are applied; the error of 0x8220 lasts until a good one", receive::too_long),
    rule("PDO-42", "CiA 301 7.2.2.5", "The length of a mapping of bits is its number of bytes, rounded up", receive::length_in_bits),
    rule("PDO-43", "CiA 301 7.5.2.36", "An RPDO whose mapping is disabled takes nothing and finds nothing wrong", receive::no_mapping),
    rule("PDO-44", "CiA 301 7.2.2.5", "One RPDO's good frame does not end another one's error", receive::each_pdo_its_error),
    rule("PDO-45", "CiA 301 7.5.2.35", "An RPDO that ends takes its errors along, and so does operational", receive::errors_go_with_the_pdo),
    rule("PDO-46", "CiA 301 7.5.2.35", "RPDO event timer: the deadline begins with a reception; when it passes there is the error of 0x8250 until the next frame", receive::deadline),
    rule("PDO-47", "CiA 301 7.5.2.35", "RPDO event timer: exact to the millisecond; 0 is none", receive::deadline_exactly),
    rule("PDO-48", "CiA 301 7.5.2.35", "The deadline ends with operational, with the RPDO and with a timer of 0", receive::deadline_ends),
    rule("PDO-49", "CiA 301 7.5.2.35", "A new event timer leaves data that wait for their SYNC", receive::deadline_leaves_data),
    rule("PDO-50", "CiA 301 7.5.2.35", "An RPDO is known by its identifier, of 11 or 29 bits, and is a data frame", receive::identifier),
    rule("PDO-51", "CiA 301 7.2.2.1", "Two RPDOs of one identifier are both served, each by its type", receive::shared_identifier),
    rule("PDO-52", "CiA 301 7.4.7.1", "Dummy entries fill an RPDO, a BOOLEAN by one bit", receive::dummies),
    rule("PDO-53", "CiA 301 7.2.2.5", "An object that refuses its value leaves the others of its RPDO alone", receive::refused_alone),
    rule("PDO-54", "CiA 301 7.2.2.2", "With a SYNC RPDOs are applied before TPDOs are sampled", receive::applied_before_sampled),
    rule("PDO-55", "CiA 301 7.5.2.35", "An RPDO that is off takes nothing", receive::off),
    rule("PDO-56", "CiA 301 7.5.2.36", "1 to 64 single bits in one PDO, both ways", mapping::single_bits),
    rule("PDO-57", "CiA 301 7.5.2.36", "Objects of 64 bits, both ways", mapping::wide_objects),
    rule("PDO-58", "CiA 301 7.5.2.36", "Up to eight objects of whole bytes, both ways", mapping::more_than_four),
    rule("PDO-59", "CiA 301 7.5.2.36", "Objects that cross the borders of bytes, both ways", mapping::across_bytes),
    rule("PDO-60", "CiA 301 7.2.2.5", "Any mixture of widths is packed without gaps, lowest bit first, both ways", mapping::any_mixture),
    rule("PDO-61", "CiA 301 7.5.2.36", "A mapping does not change while the PDO exists: 0x06010000", mapping::valid_bit_first),
    rule("PDO-62", "CiA 301 7.5.2.36", "Entries do not change while sub-index 0 is not 0: 0x06010000", mapping::count_zero_first),
    rule("PDO-63", "CiA 301 7.5.2.36", "A mapped object exists: 0x06020000, 0x06090011", mapping::existing),
    rule("PDO-64", "CiA 301 7.5.2.36", "A mapped object may be mapped in that direction: 0x06040041", mapping::mappable),
    rule("PDO-65", "CiA 301 7.5.2.36", "The length in an entry is the object's: 0x06040041", mapping::exact_length),
    rule("PDO-66", "CiA 301 7.5.2.36", "The lengths make at most 64 bits: 0x06040042", mapping::at_most_64_bits),
    rule("PDO-67", "CiA 301 7.5.2.36", "There are at most 64 entries: 0x06040042", mapping::at_most_64_entries),
    rule("PDO-68", "CiA 301 7.5.2.36", "Entries past sub-index 0 do not count; an unused one within it does not exist", mapping::unused_entries),
    rule("PDO-69", "CiA 301 7.5.2.36", "A refused count leaves the mapping as it was", mapping::refused_count),
    rule("PDO-70", "CiA 301 7.5.2.36", "A count of 0 disables a mapping and keeps its entries", mapping::disabled),
    rule("PDO-71", "CiA 301 7.5.2.38", "A PDO is mapped anew in operational without disturbing the others", mapping::whole_procedure),
    rule("PDO-72", "CiA 301 7.3.3", "COB-IDs are by default 0x180 and on for TPDOs, 0x200 and on for RPDOs, plus the node ID", parameters::defaults),
    rule("PDO-73", "CiA 301 7.5.2.37", "Types 241 to 251 are reserved, 252 and 253 for TPDOs: 0x06090030", parameters::reserved_types),
    rule("PDO-74", "CiA 301 7.3.5", "No PDO is on a restricted identifier: 0x06090030", parameters::restricted_identifiers),
    rule("PDO-75", "CiA 301 7.5.2.35", "COB-IDs have 29 bits with bit 29, otherwise bits 11 to 28 are 0: 0x06090030", parameters::wide_identifiers),
    rule("PDO-76", "CiA 301 7.5.2.35", "A device without 29 bits refuses bit 29: 0x06090030", parameters::without_wide_identifiers),
    rule("PDO-77", "CiA 301 7.5.2.35", "Bits 0 to 29 of a COB-ID do not change while the PDO exists: 0x06090030", parameters::fixed_while_valid),
    rule("PDO-78", "CiA 301 7.5.2.35", "Bit 30 of an RPDO's COB-ID has no meaning", parameters::bit_30_of_a_receive_pdo),
    rule("PDO-79", "CiA 301 7.5.2.35", "Sub-index 4 does not exist: 0x06090011", parameters::no_sub_index_4),
    rule("PDO-80", "CiA 301 7.5.2.35", "Sub-index 0 is the highest sub-index, and constant", parameters::highest_sub_index),
    rule("PDO-81", "CiA 301 7.5.2.35", "Bit 31 of a COB-ID switches a PDO off and on at once", parameters::off_takes_effect),
    rule("PDO-82", "CiA 301 7.5.2.37", "A TPDO that was withdrawn before it was sent inhibits nothing", transmit::inhibit_time_of_what_is_sent),
];
