//! Frames and the words they become.

mod support;

use canopen::{Instant, NodeId};
use client::decode::{Decoder, Meaning};
use personalities::p3::P3;
use proptest::prelude::*;
use support::{frame, words_of};

fn words(decoder: &mut Decoder, text: &str) -> String {
    decoder
        .decode(Instant::ZERO, &frame(text))
        .meaning
        .to_string()
}

/// Frames in the order of one dialogue, and what each means to a decoder with the P3's dictionary.
const DIALOGUE: &[(&str, &str)] = &[
    ("000#8100", "NMT: reset node, all nodes"),
    ("701#00", "node 1 boot-up"),
    ("701#05", "node 1 heartbeat: operational"),
    ("701#7F", "node 1 heartbeat: pre-operational"),
    ("000#0101", "NMT: start, node 1"),
    (
        "601#224060008600",
        "write node 1 0x6040,0 Control word = 0x0086: shutdown, fault reset",
    ),
    (
        "581#6040600000000000",
        "node 1 has written 0x6040,0 Control word",
    ),
    ("601#40416000", "read node 1 0x6041,0 Status word"),
    (
        "581#4241600031000000",
        "node 1 answers 0x6041,0 Status word = 0x0031: ready to switch on, voltage",
    ),
    (
        "601#2260600004",
        "write node 1 0x6060,0 Set mode of operation = 0x04: profile torque",
    ),
    (
        "581#8060600022000008",
        "node 1 refuses 0x6060,0 Set mode of operation: 0x08000022 data cannot be transferred or \
         stored because of the present device state",
    ),
    // The refused mode was not learned, so bit 12 has no name yet ...
    (
        "581#4241600037100000",
        "node 1 answers 0x6041,0 Status word = 0x1037: operation enabled, voltage, bit 12",
    ),
    (
        "601#2260600001",
        "write node 1 0x6060,0 Set mode of operation = 0x01: profile position",
    ),
    (
        "581#6060600000000000",
        "node 1 has written 0x6060,0 Set mode of operation",
    ),
    // ... now it has one.
    (
        "581#4241600037140000",
        "node 1 answers 0x6041,0 Status word = 0x1437: operation enabled, voltage, target reached, \
         set-point acknowledge",
    ),
    (
        "601#224060001F00",
        "write node 1 0x6040,0 Control word = 0x001F: enable operation, new set-point",
    ),
    (
        "581#4208300196720000",
        "node 1 answers 0x3008,1 Filtered current sense, phase A = 29334 (0x7296) count/16",
    ),
    (
        "601#2210100401093000",
        "write node 1 0x1010,4 Save single entry = 0x00300901: 0x3009,1 Current sensor bias, phase A",
    ),
    (
        "601#2210100173617665",
        "write node 1 0x1010,1 Save all = 0x65766173: \"save\"",
    ),
    (
        "581#4B7160009CFF0000",
        "node 1 answers 0x6071,0 Target torque = -100 permille",
    ),
    (
        "081#1032050000000000",
        "node 1 emergency 0x3210: bus over-voltage; error register 0x05: generic, voltage",
    ),
    (
        "081#0000000000001032",
        "node 1 emergency 0x0000: error reset, 0x3210 bus over-voltage is gone; error register \
         0x00: none; maker's bytes 00 00 00 10 32",
    ),
    (
        "082#0150000102030405",
        "node 2 emergency 0x5001: device hardware; error register 0x00: none; maker's bytes 01 02 \
         03 04 05",
    ),
    (
        "581#4202100080080000",
        "node 1 answers 0x1002,0 Manufacturer status register = 0x00000880: bus under-voltage, SYNC \
         loss",
    ),
    ("080#", "SYNC"),
    ("080#07", "SYNC 7"),
    (
        "100#0102030400000000",
        "malformed: TIME of 8 bytes, it has 6",
    ),
    (
        "100#E80300000100",
        "TIME 1000 ms after midnight, 1 days since 1984-01-01",
    ),
    ("000#81", "malformed: NMT command of 1 bytes, it has 2"),
    ("701#42", "malformed: node 1 in state 0x42"),
    (
        "601#4041",
        "malformed: SDO request to node 1 of 2 bytes, under 4",
    ),
    (
        "601#2108100010000000",
        "node 1 SDO: segmented write of 0x1008,0, 16 bytes",
    ),
    ("7E5#0400000000000000", "LSS master: switch all to waiting"),
    (
        "7E5#0401000000000000",
        "LSS master: switch all to configuration",
    ),
    ("7E5#0402000000000000", "LSS master: command 0x04"),
    ("7E5#04", "LSS master: command 0x04"),
    ("7E5#1107000000000000", "LSS master: configure node ID 7"),
    ("7E5#11FF000000000000", "LSS master: configure no node ID"),
    ("7E5#1300030000000000", "LSS master: configure 250 kbit/s"),
    (
        "7E5#1380030000000000",
        "LSS master: configure bit timing 3 of table 128",
    ),
    (
        "7E5#15E8030000000000",
        "LSS master: activate bit timing after 1000 ms",
    ),
    ("7E5#1700000000000000", "LSS master: store configuration"),
    (
        "7E5#43BC0B0000000000",
        "LSS master: select serial number 0x00000BBC",
    ),
    (
        "7E5#4BBC0B0000000000",
        "LSS master: identify serial number to 0x00000BBC",
    ),
    (
        "7E5#4C00000000000000",
        "LSS master: identify devices without a node ID",
    ),
    ("7E5#5100000000800000", "LSS master: fastscan begins"),
    (
        "7E5#51080400001F0000",
        "LSS master: fastscan vendor ID 0x00000408 from bit 31",
    ),
    (
        "7E5#51BC0B0000000300",
        "LSS master: fastscan serial number 0x00000BBC from bit 0, next vendor ID",
    ),
    ("7E5#5A00000000000000", "LSS master: inquire vendor ID"),
    ("7E5#5E00000000000000", "LSS master: inquire node ID"),
    ("7E4#4400000000000000", "LSS slave: selected"),
    ("7E4#1100000000000000", "LSS slave: node ID configured"),
    (
        "7E4#1101000000000000",
        "LSS slave: refused, node ID out of range (error 1)",
    ),
    (
        "7E4#1702000000000000",
        "LSS slave: refused, the store cannot be written (error 2)",
    ),
    ("7E4#4F00000000000000", "LSS slave: identified"),
    ("7E4#5000000000000000", "LSS slave: has no node ID"),
    (
        "7E4#5DBC0B0000000000",
        "LSS slave: serial number 0x00000BBC",
    ),
    ("7E4#5EFF000000000000", "LSS slave: no node ID"),
    ("7E4#5E05000000000000", "LSS slave: node ID 5"),
    ("6E0#00", "not a CANopen service known here"),
];

#[test]
fn a_dialogue_is_put_into_words() {
    let mut decoder = Decoder::with_words(words_of(&P3));
    for (text, meaning) in DIALOGUE {
        assert_eq!(words(&mut decoder, text), *meaning, "{text}");
    }
}

#[test]
fn without_a_dictionary_the_standards_names_serve() {
    let mut decoder = Decoder::new();
    assert_eq!(
        words(&mut decoder, "581#4241600037020000"),
        "node 1 answers 0x6041,0 Statusword = 0x0237: operation enabled, voltage, remote"
    );
    assert_eq!(
        words(&mut decoder, "581#4208300196720000"),
        "node 1 answers 0x3008,1 = 96 72 00 00 (size not said)"
    );
    assert_eq!(
        words(&mut decoder, "601#22084000"),
        "write node 1 0x4008,0 = no data"
    );
}

#[test]
fn further_axes_have_the_standards_names_too() {
    let mut decoder = Decoder::new();
    assert_eq!(
        words(&mut decoder, "581#4F61700003000000"),
        "node 1 answers 0x7061,0 Modes of operation display = 0x03: profile velocity"
    );
    assert_eq!(
        words(&mut decoder, "581#4B41700037120000"),
        "node 1 answers 0x7041,0 Statusword = 0x1237: operation enabled, voltage, remote, speed is \
         zero"
    );
    assert_eq!(
        words(&mut decoder, "581#43FFA00001000000"),
        "node 1 answers 0xA0FF,0 = 01 00 00 00"
    );
}

#[test]
fn pdo_mappings_are_learned_from_acknowledged_writes_only() {
    let mut decoder = Decoder::with_words(words_of(&P3));
    assert_eq!(
        words(&mut decoder, "181#01020304"),
        "node 1 TPDO1, mapping unknown"
    );
    let mut write = |data: &str, answer: &str| {
        words(&mut decoder, &format!("601#{data}"));
        words(&mut decoder, &format!("581#{answer}"));
    };
    write("22001A0000", "60001A0000000000");
    write("22001A0120006460", "60001A0100000000");
    // Refused: 0x1000 cannot be mapped.
    write("22001A0220000010", "80001A0241000406");
    write("22001A0208006160", "60001A0200000000");
    write("22001A0002", "60001A0000000000");
    let position = 0x0403_0201;
    assert_eq!(
        words(&mut decoder, "181#0102030401"),
        format!(
            "node 1 TPDO1: 0x6064,0 Actual position = {position} cts; 0x6061,0 Mode of operation \
             display = 0x01: profile position"
        )
    );
    // The mode that the PDO carried now names the bits.
    assert!(words(&mut decoder, "581#4241600037100000").ends_with("set-point acknowledge"));
    // Longer and shorter than the mapping.
    assert!(words(&mut decoder, "181#01020304010203").ends_with("; 2 bytes not mapped"));
    assert_eq!(
        words(&mut decoder, "181#0102"),
        "node 1 TPDO1: 2 bytes not mapped"
    );
    // A reset forgets.
    words(&mut decoder, "000#8101");
    assert_eq!(
        words(&mut decoder, "181#01020304"),
        "node 1 TPDO1, mapping unknown"
    );
}

/// The P3 of 2016 maps the low bits of longer numbers; they have a sign (J4).
#[test]
fn parts_of_objects_in_pdos_are_numbers() {
    let mut decoder = Decoder::with_words(words_of(personalities::by_name("p3-jpl").unwrap()));
    for (data, answer) in [
        ("22001A0110006460", "60001A0110006460"),
        ("22001A0208006C60", "60001A0208006C60"),
        ("22001A0002", "60001A0002000000"),
    ] {
        words(&mut decoder, &format!("601#{data}"));
        words(&mut decoder, &format!("581#{answer}"));
    }
    assert_eq!(
        words(&mut decoder, "181#FEFF05"),
        "node 1 TPDO1: 0x6064,0 Position actual value = -2 cts (low 16 bits); 0x606C,0 Velocity \
         actual value = 5 rad/s/65536 (low 8 bits)"
    );
}

#[test]
fn a_moved_cob_id_is_followed_for_every_node_that_listens() {
    let mut decoder = Decoder::with_words(words_of(&P3));
    for node in [1, 2] {
        for (data, answer) in [
            ("2200140110020000", "6000140100000000"),
            ("2200160110007160", "6000160100000000"),
            ("2200160001", "6000160000000000"),
        ] {
            words(&mut decoder, &format!("60{node}#{data}"));
            words(&mut decoder, &format!("58{node}#{answer}"));
        }
    }
    assert_eq!(
        words(&mut decoder, "210#0A00"),
        "node 1 RPDO1: 0x6071,0 Target torque = 10 permille | node 2 RPDO1: 0x6071,0 Target torque \
         = 10 permille | node 16 RPDO1, mapping unknown"
    );
    // Nobody known is at the old place any more.
    assert_eq!(
        words(&mut decoder, "201#0A00"),
        "not a CANopen service known here"
    );
}

#[test]
fn the_structure_is_for_programs() {
    let mut decoder = Decoder::with_words(words_of(&P3));
    let decoded = decoder.decode(Instant(1_500_000), &frame("581#4241600031000000"));
    let json = serde_json::to_value(&decoded).unwrap();
    assert_eq!(
        json,
        serde_json::json!({
            "time_ns": 1_500_000,
            "frame": "581#4241600031000000",
            "kind": "value",
            "node": 1,
            "value": {
                "index": 0x6041,
                "sub": 0,
                "name": "Status word",
                "bytes": [0x31, 0, 0, 0],
                "text": "0x0031: ready to switch on, voltage",
            },
        })
    );
    let line = decoded.to_string();
    assert!(
        line.starts_with("    0.001500  0x581 8 42 41 60 00 31 00 00 00  node 1 answers"),
        "{line}"
    );
    let emergency = decoder.decode(Instant(0), &frame("081#1032050000000000"));
    let json = serde_json::to_value(&emergency).unwrap();
    assert_eq!(
        (&json["kind"], &json["code"]),
        (&"emergency".into(), &0x3210.into())
    );
}

#[test]
fn remote_frames_and_29_bits_are_told_apart() {
    let mut decoder = Decoder::new();
    let guard = can::Frame::remote_frame(can::StandardId::new(0x701).unwrap(), 1).unwrap();
    let asked = decoder.decode(Instant::ZERO, &guard).meaning.to_string();
    assert_eq!(asked, "remote frame: node guarding asks node 1");
    let extended = can::Frame::data_frame(can::ExtendedId::new(0x581).unwrap(), &[0x60]).unwrap();
    assert_eq!(
        decoder.decode(Instant::ZERO, &extended).meaning,
        Meaning::Unknown
    );
}

/// One bus, each drive in the words of its own document.
#[test]
fn each_drive_of_a_mixed_bus_has_its_own_words() {
    let mut decoder = Decoder::with_words(words_of(&P3));
    for (node, name) in [(3, "p3-jpl"), (4, "md80"), (5, "roboteq-3")] {
        let drive = personalities::by_name(name).unwrap();
        let node = NodeId::new(node).unwrap();
        decoder.set_drive(node, words_of(drive));
    }
    for (sent, expected) in [
        (
            "581#4241600000000000",
            "node 1 answers 0x6041,0 Status word = 0x0000: not ready to switch on",
        ),
        // No state machine: the number says nothing.
        (
            "583#4241600000000000",
            "node 3 answers 0x6041,0 Status word (not implemented) = 0",
        ),
        (
            "603#224060000F00",
            "write node 3 0x6040,0 Control word (not implemented) = 15 (0xF)",
        ),
        (
            "583#4261600007000000",
            "node 3 answers 0x6061,0 Read mode of operation = 0x07: Barrett trapezoid",
        ),
        (
            "584#4F616000FF000000",
            "node 4 answers 0x6061,0 Modes Of Operation Display = 0xFF: service",
        ),
        (
            "585#4F61600000000000",
            "node 5 answers 0x6061,0 Modes of operation display (AOM) = 0x00: open loop",
        ),
        // Each axis has 0x800 objects.
        (
            "585#4F617000FE000000",
            "node 5 answers 0x7061,0 Modes of operation display (AOM) = 0xFE: position tracking",
        ),
        (
            "585#4B41680037020000",
            "node 5 answers 0x6841,0 Status word (SW) = 0x0237: operation enabled, voltage, remote",
        ),
        // Each axis has a mode of its own, here two relative ones, whose bits are those of mode 1.
        (
            "585#4F616800FF000000",
            "node 5 answers 0x6861,0 Modes of operation display (AOM) = 0xFF: position relative",
        ),
        (
            "585#4B41680037160000",
            "node 5 answers 0x6841,0 Status word (SW) = 0x1637: operation enabled, voltage, remote, \
             target reached, set-point acknowledge",
        ),
        (
            "605#2B4068001F000000",
            "write node 5 0x6840,0 Control word (CW) = 0x001F: enable operation, new set-point",
        ),
        (
            "585#4B41600037120000",
            "node 5 answers 0x6041,0 Status word (SW) = 0x1237: operation enabled, voltage, remote, \
             bit 12",
        ),
        // Bits and error codes have the names of each document.
        (
            "584#4304200301000000",
            "node 4 answers 0x2004,3 Calibration Status = 0x00000001: calibration: offset",
        ),
        (
            "585#4B12210012000000",
            "node 5 answers 0x2112,0 Fault flags (FF) = 0x0012: over-voltage, emergency stop",
        ),
        (
            "085#0090810000000000",
            "node 5 emergency 0x9000: emergency stop; error register 0x81: generic, manufacturer",
        ),
        (
            "081#0090810000000000",
            "node 1 emergency 0x9000: external error: safe torque off; error register 0x81: generic, \
             motion",
        ),
        (
            "084#0573010000000000",
            "node 4 emergency 0x7305: main encoder; error register 0x01: generic",
        ),
        // The names outlive a reset.
        ("000#8100", "NMT: reset node, all nodes"),
        (
            "584#4F616000FF000000",
            "node 4 answers 0x6061,0 Modes Of Operation Display = 0xFF: service",
        ),
    ] {
        assert_eq!(words(&mut decoder, sent), expected, "{sent}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 500, ..ProptestConfig::default() })]

    /// Also with what random SDO traffic taught it.
    #[test]
    fn no_traffic_makes_the_decoder_panic(
        frames in prop::collection::vec((0u16..0x800, any::<[u8; 8]>(), 0u8..=8, any::<bool>()), 1..200)
    ) {
        let mut decoder = Decoder::with_words(words_of(&P3));
        decoder.set_drive(NodeId::new(2).unwrap(), words_of(&P3));
        for (id, mut data, length, about_pdos) in frames {
            let id = if about_pdos {
                // Writes and answers about PDO parameters of node 1.
                data[0] = if data[0] & 1 == 0 { 0x22 } else { 0x42 | data[0] & 0x0D };
                data[2] = [0x14, 0x16, 0x18, 0x1A][usize::from(data[2] & 3)];
                data[1] &= 1;
                data[3] &= 7;
                if data[0] == 0x22 { 0x601 } else { 0x581 }
            } else {
                id
            };
            let frame = can::Frame::classic(id, data, length);
            let _ = decoder.decode(Instant::ZERO, &frame).to_string();
        }
    }
}
