//! What is wrong with a scenario is told by line and column, before anything starts.

use std::path::Path;

use canopen::{Instant, NodeId};
use personalities::p3::P3;
use sim::scenario::{Problems, Scenario};
use sim::{BusSettings, DriveSettings, FlashFile};

/// A text, and what is said of it: line, column, what is wrong.
type Case = (&'static str, &'static [&'static str]);

/// Mistakes that are seen whatever drives there are.
#[rustfmt::skip]
const MISTAKES: &[Case] = &[
    ("seed = ", &["1:8 string values must be quoted, expected literal string"]),
    ("seed = 1\nseed = 2", &["2:1 duplicate key"]),
    ("[drive.1", &["1:9 unclosed table, expected `]`"]),
    ("name = \"abc", &["1:12 invalid basic string, expected `\"`"]),
    ("seed = 1 2", &["1:8 string values must be quoted, expected literal string"]),
    ("sed = 7", &["1:1 a scenario has no 'sed'"]),
    ("flavour = 1", &["1:1 a scenario has no 'flavour'"]),
    ("seed = \"7\"", &["1:8 a whole number is expected, not a text"]),
    ("seed = -1", &["1:8 this number is out of range"]),
    ("seed = 1.5", &["1:8 a whole number is expected, not a decimal number"]),
    ("seed = 99999999999999999999", &["1:8 this number is out of range"]),
    ("bit_rate = 500", &["1:12 'bit_rate' cannot be a whole number"]),
    ("bit_rate = \"300k\"", &["1:12 '300k' is no bit rate"]),
    ("personality = \"p4\"", &["1:15 no drive is called 'p4'"]),
    ("personality = \"puck4\"", &["1:15 no drive is called 'puck4'"]),
    ("length = 10", &["1:10 the unit is missing"]),
    ("length = \"0 s\"", &["1:10 0 s is out of range"]),
    ("length = \"10 parsecs\"", &["1:10 'parsecs' is no unit of a time"]),
    ("nodes = 3", &["1:9 'nodes' is a list of drives"]),
    ("nodes = []", &["1:9 'nodes' is a list of drives"]),
    ("nodes = [1, 128]", &["1:13 '128' is no drive: a node ID is a number from 1 to 127; drives without one are called u1 to u127"]),
    ("nodes = [1, \"u1\", 1]", &["1:19 drive 1 is there twice"]),
    ("nodes = [\"x\"]", &["1:10 'x' is no drive: a node ID is a number from 1 to 127; drives without one are called u1 to u127"]),
    ("event = 1", &["1:1 events are a list"]),
    ("[event]\nat = \"1 s\"", &["1:2 events are a list"]),
    ("drive = 1", &["1:9 'drive' cannot be a whole number"]),
    ("[drive.200]", &["1:8 '200' is no drive: a node ID is a number from 1 to 127; drives without one are called u1 to u127"]),
    ("[drive.x]", &["1:8 'x' is no drive: a node ID is a number from 1 to 127; drives without one are called u1 to u127"]),
    ("[drive.1]\npersonality = 3", &["2:15 'personality' cannot be a whole number"]),
    ("[drive.1]\nmotor = 3", &["2:9 this cannot be a whole number"]),
    ("[drive.1]\nmotr = {}", &["2:1 a drive has no 'motr'"]),
    ("[drive.1.motor]\nphase_resistanc = \"1 ohm\"", &["2:1 'motor' has no parameter 'phase_resistanc'"]),
    ("[drive.1.motor]\nphase_resistance = 6.55", &["2:20 the unit is missing"]),
    ("[drive.1.motor]\nphase_resistance = \"6.55\"", &["2:20 '6.55' has no unit"]),
    ("[drive.1.motor]\nphase_resistance = \"6.55 V\"", &["2:20 'V' is no unit of a resistance"]),
    ("[drive.1.motor]\nphase_resistance = \"much\"", &["2:20 'much' is not a resistance"]),
    ("[drive.1.motor]\nphase_resistance = \"-1 ohm\"", &["2:20 -1 ohm is out of range"]),
    ("[drive.1.motor]\nphase_resistance = \"inf ohm\"", &["2:20 'inf ohm' is not a resistance"]),
    ("[drive.1.motor]\nphase_resistance = true", &["2:20 a resistance is expected, not true or false"]),
    ("[drive.1.motor]\npole_pairs = \"2\"", &["2:14 a whole number is expected, not a text"]),
    ("[drive.1.motor]\npole_pairs = 0", &["2:14 0 is out of range"]),
    ("[drive.1.motor]\npole_pairs = 1.5", &["2:14 a whole number is expected, not a decimal number"]),
    ("[drive.1.encoder]\nreversed = 1", &["2:12 true or false is expected, not a whole number"]),
    ("[drive.1.spread]\nmotor.phase_resistance = 10", &["2:26 the unit is missing"]),
    ("[drive.1.spread]\nmotor.phase_resistance = \"150 %\"", &["2:26 150 % is out of range"]),
    ("[drive.1.spread]\nencoder.reversed = \"10 %\"", &["2:20 'encoder.reversed' cannot be spread"]),
    ("[drive.1.spread]\nfoo = 1", &["2:1 'spread' has no 'foo'"]),
    ("[drive.1.stored]\n6065 = 1", &["2:1 '6065' is no object"]),
    ("[drive.1.stored]\n\"0x6065\" = \"x\"", &["2:12 a whole number is expected, not a text"]),
    ("[drive.1]\nstored = 5", &["2:10 'stored' cannot be a whole number"]),
    ("[[event]]\n", &["1:1 this event does nothing", "1:1 when this happens is missing"]),
    ("[[event]]\ndo = \"block-shaft\"\ndrive = 1\n", &["1:1 when this happens is missing"]),
    ("[[event]]\nat = \"1 s\"\ndrive = 1\n", &["1:1 this event does nothing"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"explode\"\ndrive = 1", &["3:6 there is no act 'explode'"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"block-shaf\"\ndrive = 1", &["3:6 there is no act 'block-shaf'"]),
    ("[[event]]\nat = 1\ndo = \"block-shaft\"\ndrive = 1\n", &["2:6 the unit is missing"]),
    ("[[event]]\nat = \"-1 s\"\ndo = \"block-shaft\"\ndrive = 1\n", &["2:6 -1 s is out of range"]),
    ("[[event]]\nat = \"1 V\"\ndo = \"block-shaft\"\ndrive = 1\n", &["2:6 'V' is no unit of a time"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"block-shaft\"", &["1:1 block-shaft needs 'drive'"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = \"every\"", &["4:9 'every' is no drive: a node ID is a number from 1 to 127; drives without one are called u1 to u127"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 0", &["4:9 '0' is no drive: a node ID is a number from 1 to 127; drives without one are called u1 to u127"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"motor-supply\"\ndrive = 1", &["1:1 motor-supply needs 'to'"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"motor-supply\"\ndrive = 1\nto = \"2 kA\"", &["5:6 'kA' is no unit of a voltage"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"motor-supply\"\ndrive = 1\nto = \"2000 V\"", &["5:6 2 kV is out of range"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 1\nto = \"1 V\"", &["5:1 'to' has no meaning here"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"free-shaft\"\ndrive = 1\nfor = \"1 s\"", &["5:1 'for' has no meaning here"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"stop-sync\"\ndrive = 1", &["4:1 'drive' has no meaning here"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"stall-processor\"\ndrive = 1", &["1:1 stall-processor needs 'for'"]),
    ("[[event]]\nat = \"1 s\"\nwhen = { state = \"fault\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["3:1 an event has one beginning, and 'at' is there already"]),
    ("[[event]]\nat = \"1 s\"\ndelay = \"1 s\"\ndo = \"block-shaft\"\ndrive = 1\n", &["3:9 a delay has no meaning with a time"]),
    ("[[event]]\nat = \"1 s\"\ntimes = 3\ndo = \"block-shaft\"\ndrive = 1\n", &["3:9 a time passes once"]),
    ("[[event]]\nat = \"1 s\"\nevery = \"1 s\"\ntimes = 0\ndo = \"block-shaft\"\ndrive = 1\n", &["4:9 this number is out of range"]),
    ("[[event]]\nat = \"1 s\"\nevery = \"0 s\"\ndo = \"block-shaft\"\ndrive = 1\n", &["3:9 0 s is out of range"]),
    ("[[event]]\nat = \"1 s\"\nevery = \"1 s\"\nfor = \"2 s\"\ndo = \"block-shaft\"\ndrive = 1\n", &["4:7 it would last longer than the time between two"]),
    ("[[event]]\nafter = \"sag\"\ndo = \"block-shaft\"\ndrive = 1\n", &["2:9 there is no event 'sag'"]),
    ("[[event]]\nname = \"sag\"\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 1\n[[event]]\nafter = \"sagg\"\ndo = \"block-shaft\"\ndrive = 1\n", &["7:9 there is no event 'sagg'"]),
    ("[[event]]\nname = \"a\"\nafter = \"b\"\ndo = \"block-shaft\"\ndrive = 1\n[[event]]\nname = \"b\"\nafter = \"a\"\ndo = \"block-shaft\"\ndrive = 1\n", &["3:9 event \"a\" waits for itself, so it never happens", "8:9 event \"b\" waits for itself, so it never happens"]),
    ("[[event]]\nname = \"a\"\nafter = \"a\"\ndo = \"block-shaft\"\ndrive = 1\n", &["3:9 event \"a\" waits for itself, so it never happens"]),
    ("[[event]]\nname = \"a\"\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 1\n[[event]]\nname = \"a\"\nat = \"2 s\"\ndo = \"block-shaft\"\ndrive = 1\n", &["7:8 line 1 has an event \"a\" already"]),
    ("[[event]]\nname = 5\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 1\n", &["2:8 'name' cannot be a whole number"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 1\n[[event]]\nat = \"1000 ms\"\ndo = \"free-shaft\"\ndrive = \"all\"\n", &["6:6 event 1 (line 1) sets the shaft at the same time to something else"]),
    ("[[event]]\nat = \"1 s\"\ncolour = \"red\"\ndo = \"block-shaft\"\ndrive = 1\n", &["3:1 an event has no 'colour'"]),
    ("[[event]]\nwhen = \"fault\"\ndo = \"block-shaft\"\ndrive = 1\n", &["2:8 a condition cannot be a text"]),
    ("[[event]]\nwhen = {}\ndo = \"block-shaft\"\ndrive = 1\n", &["2:8 this condition says nothing"]),
    ("[[event]]\nwhen = { state = \"broken\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:18 'broken' is nothing that 'state' can be"]),
    ("[[event]]\nwhen = { stat = \"fault\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:10 a condition has no 'stat'"]),
    ("[[event]]\nwhen = { state = \"fault\", nmt = \"stopped\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:27 a condition is one thing, and 'state' is there already"]),
    ("[[event]]\nwhen = { nmt = \"operatinal\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:16 'operatinal' is nothing that 'nmt' can be"]),
    ("[[event]]\nwhen = { position = \"2 m\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:21 'm' is no unit of a position"]),
    ("[[event]]\nwhen = { position = \"2 turns\", direction = \"left\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:44 'left' is nothing that 'direction' can be"]),
    ("[[event]]\nwhen = { state = \"fault\", direction = \"up\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:27 a condition has no 'direction'"]),
    ("[[event]]\nwhen = { speed_above = \"-1 rpm\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:24 -1 rpm is out of range"]),
    ("[[event]]\nwhen = { emergency = 0x12345 }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:22 this number is out of range"]),
    ("[[event]]\nwhen = { emergency = \"0x3120\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:22 a whole number is expected, not a text"]),
    ("[[event]]\nwhen = { state = \"fault\", nth = 0 }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:33 this number is out of range"]),
    ("[[event]]\nwhen = { state = \"fault\" }\ndo = \"stop-sync\"\n", &["2:8 which drive this condition looks at is missing"]),
    ("[[event]]\nwhen = { frame = 0x181 }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:18 a frame cannot be a whole number"]),
    ("[[event]]\nwhen = { frame = { id = 0x40000000 } }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:25 this number is out of range"]),
    ("[[event]]\nwhen = { frame = { mask = 0x7FF } }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:27 a mask needs an identifier"]),
    ("[[event]]\nwhen = { frame = { id = 0x800, extended = false } }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:43 this identifier has 29 bits, and extended says that it has 11"]),
    ("[[event]]\nwhen = { frame = { data = \"1\" } }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:27 '1' is no data"]),
    ("[[event]]\nwhen = { frame = { data = \"?1\" } }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:27 '?1' is no data"]),
    ("[[event]]\nwhen = { frame = { from = \"inside\" } }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:27 'inside' is no drive: a node ID is a number from 1 to 127; drives without one are called u1 to u127"]),
    ("[[event]]\nwhen = { frame = { idd = 1 } }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:20 a frame has no 'idd'"]),
    ("[[event]]\nwhen = { frame = { id = 1 }, drive = 1 }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:38 a frame has no drive"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flip-bit\"\nbit = 20", &["1:1 flip-bit needs 'frames'"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flip-bit\"\nframes = { id = 1 }\nbit = 160", &["5:7 a bit is a number from 0 to 159, crc-delimiter, ack-slot, ack-delimiter, eof1 to eof7, or intermission1 to intermission3"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flip-bit\"\nframes = { id = 1 }\nbit = \"eof8\"", &["5:7 a bit is a number from 0 to 159, crc-delimiter, ack-slot, ack-delimiter, eof1 to eof7, or intermission1 to intermission3"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flip-bit\"\nframes = { id = 1 }\nbit = true", &["5:7 a bit is a number from 0 to 159, crc-delimiter, ack-slot, ack-delimiter, eof1 to eof7, or intermission1 to intermission3"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flip-bit\"\nframes = { id = 1 }\nbit = 1\nseen_by = \"everybody\"", &["6:11 'everybody' is no drive: a node ID is a number from 1 to 127; drives without one are called u1 to u127"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flip-bit\"\nframes = { id = 1, data = \"00\" }\nbit = 1", &["4:20 'data' has no meaning here"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flip-bit\"\nframes = { id = 1 }\nbit = 1\ncount = 0", &["6:9 this number is out of range"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"lose-frames\"\nframes = {}", &["1:1 lose-frames needs 'drive'"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"hold-frames\"\ndrive = \"outside\"", &["1:1 hold-frames needs 'for'"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = \"outside\"", &["4:9 'outside' is no drive: a node ID is a number from 1 to 127; drives without one are called u1 to u127"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flood\"\nid = 0x20000000\nfor = \"1 s\"", &["4:6 this number is out of range"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flood\"\nid = 1\ndata = \"??\"\nfor = \"1 s\"", &["5:8 '??' is no data"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flood\"\nid = 1\ndata = \"000102030405060708\"\nfor = \"1 s\"", &["5:8 '000102030405060708' is no data"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"break-bus\"\nlevel = \"floating\"\nfor = \"1 s\"", &["4:9 'floating' is nothing that 'level' can be"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"short-circuit\"\ndrive = 1\nbetween = \"A-D\"", &["5:11 'A-D' is nothing that 'between' can be"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"open-phase\"\ndrive = 1\nphase = \"a\"", &["5:9 'a' is nothing that 'phase' can be"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"slip-magnet\"\ndrive = 1\nby = \"1 turn\"", &["5:6 1 turns is out of range"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"gate-supply\"\ndrive = 2\nto = \"8 Hz\"", &["5:6 'Hz' is no unit of a voltage"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"move-magnet\"\ndrive = 1\nto = \"3 V\"", &["5:6 'V' is no unit of a length"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"bad-encoder-answers\"\ndrive = 1\nshare = \"120 %\"", &["5:9 120 % is out of range"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"press-switch\"\ndrive = 1\nswitch = \"limit\"", &["5:10 'limit' is nothing that 'switch' can be"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"analog-input\"\ndrive = 1\ninput = \"1\"\nto = \"5 V\"", &["6:6 5 V is out of range"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"set-input\"\ndrive = 1\ninput = 5\nlevel = \"high\"", &["5:9 '5' is nothing that 'input' can be"]),
    ("[drive.1.supply]\nbrake = \"nothing\"", &["2:9 'nothing' is not a resistance"]),
    ("[[event]]\nname = \"a\\nb\"\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 1\n", &["2:8 a name has no line breaks or other control characters"]),
    ("[[event]]\nname = \"\\u0085\"\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 1\n", &["2:8 a name has no line breaks or other control characters"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"disconnect\"\ndrive = \"outside\"\n[[event]]\nat = \"1 s\"\ndo = \"connect\"\ndrive = \"outside\"\n", &["6:6 event 1 (line 1) sets the connection at the same time to something else"]),
    ("[drive.1.axis.2.supply]\nmotor_voltage = \"20 V\"", &["2:17 supply.motor_voltage is that of all axes"]),
    ("[drive.1.motor]\nphase_resistance = \"none\"", &["2:20 'none' is not a resistance"]),
];

/// Mistakes on a bus with drives 1 and 2, both P3s, in a run of 10 s.
#[rustfmt::skip]
const NOT_THERE: &[Case] = &[
    ("[drive.4.motor]\npole_pairs = 2", &["1:8 there is no drive 4 on this bus"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"block-shaft\"\ndrive = 4", &["4:9 there is no drive 4 on this bus"]),
    ("[[event]]\nwhen = { drive = 5, state = \"fault\" }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:18 there is no drive 5 on this bus"]),
    ("[[event]]\nwhen = { frame = { from = 6 } }\ndo = \"block-shaft\"\ndrive = 1\n", &["2:27 there is no drive 6 on this bus"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"cut-motor-supply\"\ndrive = 1\naxis = 1\n", &["5:8 all axes of a drive have one supply"]),
    ("[[event]]\nat = \"30 s\"\ndo = \"block-shaft\"\ndrive = 1\n", &["2:6 this never happens: the run ends at 10 s"]),
    ("[drive.1.stored]\n\"0x1234\" = 1", &["2:12 p3 has no object 0x1234"]),
    ("[drive.1.stored]\n\"0x6041\" = 1", &["2:12 0x6041 cannot be stored"]),
    ("[drive.1.stored]\n\"0x6060\" = 300", &["2:12 0x6060 cannot be stored"]),
    ("[drive.1.motor]\nrotor_inertia = \"0 kg m2\"", &["2:17 no drive can be like this: rotor and load together need an inertia, and a load behind a coupling one of its own"]),
    ("[drive.1.load]\ncoupling_stiffness = \"1 Nm/rad\"", &["2:22 no drive can be like this: rotor and load together need an inertia, and a load behind a coupling one of its own"]),
    ("[drive.1.load]\ninertia = \"10 g cm2\"\nbacklash = \"1 deg\"", &["3:12 no drive can be like this: a coupling needs a stiffness"]),
    ("[drive.1.supply]\ncapacitance = \"1 mF\"", &["2:15 no drive can be like this: a capacitance needs a resistance of the supply above 0, and a brake that switches off below where it switches on"]),
    ("[drive.1.load]\nlowest_stop = \"2 turns\"\nhighest_stop = \"1 turn\"", &["3:16 no drive can be like this: the lowest stop must be below the highest, and the start between them"]),
    ("[drive.1.inverter]\ndead_time = \"5 us\"", &["2:13 no drive can be like this: the dead time must be below a tenth of the PWM period"]),
    ("[drive.1.switches]\nhome_from = \"2 turns\"\nhome_to = \"1 turn\"", &["3:11 no drive can be like this: the home switch must begin before it ends"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"press-switch\"\ndrive = 2\nswitch = \"home\"", &["4:9 drive 2 does not have this switch"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"reverse-output-encoder\"\ndrive = 2", &["4:9 drive 2 has no encoder on its output"]),
    ("[drive.all.switches]\nnegative_limit = \"-1 turn\"\n[[event]]\nat = \"1 s\"\ndo = \"set-input\"\ndrive = 2\ninput = \"negative-limit\"\nlevel = \"high\"", &["6:9 a switch is connected to this input of drive 2"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"lose-frames\"\ndrive = 3\nframes = {}", &["4:9 there is no drive 3 on this bus"]),
    ("[[event]]\nat = \"1 s\"\ndo = \"flip-bit\"\nframes = { from = 9 }\nbit = 1\nseen_by = 8", &["4:19 there is no drive 9 on this bus", "6:11 there is no drive 8 on this bus"]),
];

fn two_drives() -> BusSettings {
    let node = |id| DriveSettings::new(NodeId::new(id).unwrap(), &P3);
    BusSettings::new(1, vec![node(1), node(2)])
}

fn told(problems: &Problems) -> Vec<String> {
    let problems = problems.list.iter();
    problems
        .map(|problem| {
            assert!(!problem.remedy.is_empty());
            format!("{}:{} {}", problem.line, problem.column, problem.what)
        })
        .collect()
}

#[test]
fn mistakes_are_told_by_line_and_column() {
    assert!(MISTAKES.len() + NOT_THERE.len() >= 60);
    for (text, expected) in MISTAKES {
        let problems = Scenario::read("f.toml", text).expect_err(text);
        assert_eq!(told(&problems), *expected, "{text}");
    }
}

#[test]
fn what_these_drives_cannot_do_is_told_before_the_start() {
    for (text, expected) in NOT_THERE {
        let scenario = Scenario::read("f.toml", text).expect(text);
        let end = Instant::ZERO.plus_ms(10_000);
        let problems = scenario.set_up(&mut two_drives(), end).expect_err(text);
        assert_eq!(told(&problems), *expected, "{text}");
    }
}

#[test]
fn a_message_shows_the_line_and_what_to_do() {
    let text =
        "[[event]]\nat = \"1 s\"\ndo = \"motor-supply\"\ndrive = 1\n\tto = \"\u{fc} 20 W\" # oh\n";
    let problems = Scenario::read("sag.toml", text).unwrap_err();
    assert_eq!(
        problems.to_string(),
        "sag.toml:5:7: '\u{fc} 20 W' is not a voltage\n  \
         5 | \tto = \"\u{fc} 20 W\" # oh\n    \
         | \t     ^^^^^^^^ write it in V, mV or kV, as in \"48 V\""
    );
    let text = "\r\nsed = 1\r\n";
    let problems = Scenario::read("a.toml", text).unwrap_err();
    assert_eq!(
        problems.to_string(),
        "a.toml:2:1: a scenario has no 'sed'\n  2 | sed = 1\n    | ^^^ did you mean 'seed'?"
    );
}

/// All drives are not the outside programs.
#[test]
fn drives_and_outside_programs_do_not_contradict_each_other() {
    let text = "[[event]]\nat = \"1 s\"\ndo = \"disconnect\"\ndrive = \"all\"\n\
                [[event]]\nat = \"1 s\"\ndo = \"connect\"\ndrive = \"outside\"\n";
    let scenario = Scenario::read("f.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let end = Instant::ZERO.plus_ms(10_000);
    scenario.set_up(&mut two_drives(), end).unwrap();
}

/// A drive whose flash is a file would not keep what it stores, were the file to say what is stored.
#[test]
fn what_is_stored_is_said_by_one_only() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scenario-mistakes");
    let _ = std::fs::remove_dir_all(&folder);
    let end = Instant::ZERO.plus_ms(10_000);
    let mut settings = two_drives();
    let place = settings.drives[1].place;
    settings.drives[1].store = FlashFile::file(&folder, "p3", place).unwrap();
    let text = "[drive.2.stored]\n\"0x6065\" = 1234\n";
    let scenario = Scenario::read("f.toml", text).unwrap();
    let problems = scenario.set_up(&mut settings, end).unwrap_err();
    let file = folder.join("p3-node2.flash");
    let expected = format!(
        "1:10 drive 2 keeps what it stores in {}, and this would not",
        file.display()
    );
    assert_eq!(told(&problems), [expected]);
    // The other one has no file; and nothing is said of what is stored.
    for text in [
        "[drive.1.stored]\n\"0x6065\" = 1234\n",
        "[drive.all.stored]\n",
    ] {
        let scenario = Scenario::read("f.toml", text).unwrap();
        scenario.set_up(&mut settings, end).unwrap();
    }
    assert_eq!(settings.drives[1].store.path(), Some(file.as_path()));
}
