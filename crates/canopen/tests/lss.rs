//! The LSS slave against CiA 305, rule by rule.

mod harness;

use can::{ExtendedId, Frame, StandardId};
use canopen::lss::{
    Answer, BitTiming, BitTimings, Event, Identity, Part, Refusal, Reply, Request, Service, Slave,
    State, StoreError,
};
use canopen::{Instant, NodeId};
use harness::lss::Pair;

/// The slave of the rules. In LSS's byte order its numbers are
/// `04 03 02 01`, `08 07 06 05`, `0C 0B 0A 09`, `10 0F 0E 0D`.
const IDENTITY: Identity = Identity {
    vendor: 0x0102_0304,
    product: 0x0506_0708,
    revision: 0x090A_0B0C,
    serial: 0x0D0E_0F10,
};

/// No node ID.
const NONE: u8 = 0xFF;

const SWITCH_STATE: &str = "
switch global has no answer | 05 | 04 01, 04 00
switch global to configuration | 05 | 04 01, 5E = 5E 05
switch global back to waiting | 05 | 04 01, 04 00, 5E
switch global twice is the same as once | 05 | 04 01, 04 01, 5E = 5E 05
switch global with mode 2 is nothing | 05 | 04 02, 5E
switch global with mode 2 leaves configuration as it is | 05 | 04 01, 04 02, 5E = 5E 05
switch global with mode 255 is nothing | 05 | 04 FF, 5E
reserved bytes of switch global do not count | 05 | 04 01 FF FF FF FF FF FF, 5E = 5E 05
switch selective answers the fourth number | 05 | 40 04 03 02 01, 41 08 07 06 05, 42 0C 0B 0A 09,
    43 10 0F 0E 0D = 44
switch selective works without a node ID | FF | 40 04 03 02 01, 41 08 07 06 05, 42 0C 0B 0A 09,
    43 10 0F 0E 0D = 44
switch selective leads to configuration | 05 | 40 04 03 02 01, 41 08 07 06 05, 42 0C 0B 0A 09,
    43 10 0F 0E 0D = 44, 5E = 5E 05
another vendor ID is not meant | 05 | 40 05 03 02 01, 41 08 07 06 05, 42 0C 0B 0A 09,
    43 10 0F 0E 0D, 5E
another product code is not meant | 05 | 40 04 03 02 01, 41 08 07 06 04, 42 0C 0B 0A 09,
    43 10 0F 0E 0D, 5E
another revision number is not meant | 05 | 40 04 03 02 01, 41 08 07 06 05, 42 0D 0B 0A 09,
    43 10 0F 0E 0D, 5E
another serial number is not meant | 05 | 40 04 03 02 01, 41 08 07 06 05, 42 0C 0B 0A 09,
    43 10 0F 0E 0C, 5E
the serial number alone selects nobody | 05 | 43 10 0F 0E 0D, 5E
numbers in another order select nobody | 05 | 41 08 07 06 05, 40 04 03 02 01, 42 0C 0B 0A 09,
    43 10 0F 0E 0D
a number that is missing selects nobody | 05 | 40 04 03 02 01, 41 08 07 06 05, 43 10 0F 0E 0D, 5E
a number that CAN delivers twice counts once | 05 | 40 04 03 02 01, 41 08 07 06 05,
    41 08 07 06 05, 42 0C 0B 0A 09, 43 10 0F 0E 0D = 44
a number out of turn ends the row | 05 | 40 04 03 02 01, 41 08 07 06 05, 42 0C 0B 0A 09,
    41 08 07 06 05, 42 0C 0B 0A 09, 43 10 0F 0E 0D
the first number begins anew | 05 | 40 04 03 02 01, 41 08 07 06 05, 40 04 03 02 01,
    42 0C 0B 0A 09, 43 10 0F 0E 0D
switch global to waiting forgets the numbers | 05 | 40 04 03 02 01, 41 08 07 06 05,
    42 0C 0B 0A 09, 04 00, 43 10 0F 0E 0D
switch selective is not for configuration | 05 | 04 01, 40 04 03 02 01, 41 08 07 06 05,
    42 0C 0B 0A 09, 43 10 0F 0E 0D
";

const CONFIGURE: &str = "
node ID 1 is taken | 05 | 04 01, 11 01 = 11
node ID 127 is taken | 05 | 04 01, 11 7F = 11
node ID 0xFF is taken | 05 | 04 01, 11 FF = 11
node ID 0 is out of range | 05 | 04 01, 11 00 = 11 01
node ID 128 is out of range | 05 | 04 01, 11 80 = 11 01
node ID 254 is out of range | 05 | 04 01, 11 FE = 11 01
a node ID that is refused leaves the pending one | FF | 04 01, 11 07 = 11, 11 00 = 11 01,
    04 00 = boot 7
the last node ID is the pending one | FF | 04 01, 11 07 = 11, 11 09 = 11, 04 00 = boot 9
the active node ID stays until communication is reset | 05 | 04 01, 11 07 = 11, 5E = 5E 05, 04 00,
    04 01, 5E = 5E 05, reset, 04 01, 5E = 5E 07
a configured device does not boot by itself | 05 | 04 01, 11 07 = 11, 04 00
a configured device can become unconfigured | 05 | 04 01, 11 FF = 11, 04 00, 4C, reset, 4C = 50
an unconfigured device boots when it is sent to waiting | FF | 04 01, 11 07 = 11, 5E = 5E FF,
    04 00 = boot 7, 04 01, 5E = 5E 07
it boots once | FF | 04 01, 11 07 = 11, 04 00 = boot 7, 04 00, 04 01, 04 00
without a pending node ID it does not boot | FF | 04 01, 04 00, 4C = 50
a pending node ID can be taken back | FF | 04 01, 11 07 = 11, 11 FF = 11, 04 00, 4C = 50
configure node-ID is not for waiting | 05 | 11 07, 04 01, 17 = store 5 0
reset of communication leads to waiting | 05 | 04 01, reset, 5E
table 0 has 1000 kbit/s at 0 | 05 | 04 01, 13 00 00 = 13, 17 = store 5 0
table 0 has 800 kbit/s at 1 | 05 | 04 01, 13 00 01 = 13, 17 = store 5 1
table 0 has 500 kbit/s at 2 | 05 | 04 01, 13 00 02 = 13, 17 = store 5 2
table 0 has 250 kbit/s at 3 | 05 | 04 01, 13 00 03 = 13, 17 = store 5 3
table 0 has 125 kbit/s at 4 | 05 | 04 01, 13 00 04 = 13, 17 = store 5 4
table 0 has nothing at 5 | 05 | 04 01, 13 00 05 = 13 01, 17 = store 5 0
table 0 has 50 kbit/s at 6 | 05 | 04 01, 13 00 06 = 13, 17 = store 5 6
table 0 has 20 kbit/s at 7 | 05 | 04 01, 13 00 07 = 13, 17 = store 5 7
table 0 has 10 kbit/s at 8 | 05 | 04 01, 13 00 08 = 13, 17 = store 5 8
a rate that the device cannot do is refused | 05 | 04 01, 13 00 02 = 13, 13 00 09 = 13 01,
    17 = store 5 2
table 0 ends at 9 | 05 | 04 01, 13 00 0A = 13 01, 13 00 FF = 13 01
another table is refused | 05 | 04 01, 13 01 02 = 13 01, 13 80 02 = 13 01, 13 FF 02 = 13 01
configure bit timing is not for waiting | 05 | 13 00 02, 04 01, 17 = store 5 0
store is not for waiting | 05 | 17
the pending node ID is stored | 05 | 04 01, 11 07 = 11, 17 = store 7 0
0xFF can be stored | 05 | 04 01, 11 FF = 11, 17 = store 255 0
a store is done once, however often it is asked for | 05 | 04 01, 17 = store 5 0, 17, 17
while it stores it answers other requests | 05 | 04 01, 17 = store 5 0, 5E = 5E 05, 11 07 = 11
activate bit timing is not for waiting | 05 | 15 0A
activate bit timing has no answer | 05 | 04 01, 15 0A = quiet 10
the delay has 16 bits | 05 | 04 01, 15 FF FF = quiet 65535
while bit timing changes nothing is answered | 05 | 04 01, 15 0A = quiet 10, 5E, 04 00, 46, 11 07,
    17
";

const INQUIRE: &str = "
inquire vendor ID | 05 | 04 01, 5A = 5A 04 03 02 01
inquire product code | 05 | 04 01, 5B = 5B 08 07 06 05
inquire revision number | 05 | 04 01, 5C = 5C 0C 0B 0A 09
inquire serial number | 05 | 04 01, 5D = 5D 10 0F 0E 0D
inquire node ID | 7F | 04 01, 5E = 5E 7F
inquire node ID of an unconfigured device | FF | 04 01, 5E = 5E FF
inquiries are not for waiting | 05 | 5A, 5B, 5C, 5D, 5E
identify remote slave answers the sixth number | 05 | 46 04 03 02 01, 47 08 07 06 05,
    48 0C 0B 0A 09, 49 0C 0B 0A 09, 4A 10 0F 0E 0D, 4B 10 0F 0E 0D = 4F
identify remote slave in configuration | FF | 04 01, 46 04 03 02 01, 47 08 07 06 05, 48,
    49 FF FF FF FF, 4A, 4B FF FF FF FF = 4F
identify does not change the state | 05 | 46 04 03 02 01, 47 08 07 06 05, 48, 49 FF FF FF FF, 4A,
    4B FF FF FF FF = 4F, 5E
identify with another vendor ID | 05 | 46 04 03 02 02, 47 08 07 06 05, 48, 49 FF FF FF FF, 4A,
    4B FF FF FF FF
identify with another product code | 05 | 46 04 03 02 01, 47 08 07 06 06, 48, 49 FF FF FF FF, 4A,
    4B FF FF FF FF
identify with a least revision number above | 05 | 46 04 03 02 01, 47 08 07 06 05, 48 0D 0B 0A 09,
    49 FF FF FF FF, 4A, 4B FF FF FF FF
identify with a greatest revision number below | 05 | 46 04 03 02 01, 47 08 07 06 05, 48,
    49 0B 0B 0A 09, 4A, 4B FF FF FF FF
identify with a least serial number above | 05 | 46 04 03 02 01, 47 08 07 06 05, 48,
    49 FF FF FF FF, 4A 11 0F 0E 0D, 4B FF FF FF FF
identify with a greatest serial number below | 05 | 46 04 03 02 01, 47 08 07 06 05, 48,
    49 FF FF FF FF, 4A, 4B 0F 0F 0E 0D
identify with a number missing | 05 | 46 04 03 02 01, 47 08 07 06 05, 48, 4A, 4B FF FF FF FF
identify begins anew after its answer | 05 | 46 04 03 02 01, 47 08 07 06 05, 48, 49 FF FF FF FF,
    4A, 4B FF FF FF FF = 4F, 4B FF FF FF FF
an unconfigured device says so | FF | 4C = 50
it says so in configuration | FF | 04 01, 4C = 50
with a pending node ID it does not | FF | 04 01, 11 07 = 11, 4C
a configured device does not | 05 | 4C, 04 01, 4C
";

const FASTSCAN: &str = "
BitCheck 128 is answered by an unconfigured device | FF | 51 00 00 00 00 80 = 4F
its ID number does not count | FF | 51 FF FF FF FF 80 = 4F
a configured device takes no part | 05 | 51 00 00 00 00 80, 51 04 03 02 01
one that will be unconfigured takes no part yet | 05 | 04 01, 11 FF = 11, 04 00,
    51 00 00 00 00 80, reset, 51 00 00 00 00 80 = 4F
one that has got a node ID takes no part | FF | 04 01, 11 07 = 11, 04 00 = boot 7,
    51 00 00 00 00 80
fastscan is not for configuration | FF | 04 01, 51 00 00 00 00 80, 51 04 03 02 01
bit 31 alone: 0 is right | FF | 51 00 00 00 00 1F = 4F
bit 31 alone: 1 is wrong | FF | 51 00 00 00 80 1F
bits below BitCheck do not count | FF | 51 FF FF FF 01 18 = 4F
all bits above BitCheck count | FF | 51 00 00 00 02 18, 51 00 00 00 81 18
BitCheck 0: the whole number | FF | 51 04 03 02 01 00 = 4F, 51 05 03 02 01 00
a wrong bit does not put it out of the scan | FF | 51 00 00 00 80 1F, 51 00 00 00 00 1F = 4F
LSSSub has to be the number of the moment | FF | 51 08 07 06 05 00 01 01
LSSNext moves on | FF | 51 04 03 02 01 00 00 01 = 4F, 51 04 03 02 01 00 00 01,
    51 08 07 06 05 00 01 01 = 4F
LSSNext moves on with any bit | FF | 51 00 00 00 00 1F 00 01 = 4F, 51 08 07 06 05 00 01 01 = 4F
LSSNext does not count when bits differ | FF | 51 05 03 02 01 00 00 01,
    51 04 03 02 01 00 00 00 = 4F
BitCheck 128 leads back to the vendor ID | FF | 51 04 03 02 01 00 00 01 = 4F,
    51 00 00 00 00 80 = 4F, 51 04 03 02 01 00 00 00 = 4F
after all four it is in configuration | FF | 51 00 00 00 00 80 = 4F, 51 04 03 02 01 00 00 01 = 4F,
    51 08 07 06 05 00 01 02 = 4F, 51 0C 0B 0A 09 00 02 03 = 4F, 51 10 0F 0E 0D 00 03 00 = 4F,
    5E = 5E FF
and is not before | FF | 51 00 00 00 00 80 = 4F, 51 04 03 02 01 00 00 01 = 4F,
    51 08 07 06 05 00 01 02 = 4F, 51 0C 0B 0A 09 00 02 03 = 4F, 51 10 0F 0E 0D 00 03 03 = 4F, 5E
a wrong serial number leaves it in waiting | FF | 51 04 03 02 01 00 00 03 = 4F,
    51 11 0F 0E 0D 00 03 00, 5E, 51 10 0F 0E 0D 00 03 00 = 4F, 5E = 5E FF
an agreement in part of the bits does not end the scan | FF | 51 04 03 02 01 00 00 03 = 4F,
    51 11 0F 0E 0D 01 03 00 = 4F, 5E, 51 10 0F 0E 0D 00 03 00
numbers that are known to be equal are passed over | FF | 51 04 03 02 01 00 00 03 = 4F,
    51 10 0F 0E 0D 00 03 00 = 4F, 5E = 5E FF
waiting begins at the vendor ID | FF | 51 04 03 02 01 00 00 03 = 4F, 04 00, 51 04 03 02 01 = 4F
after configuration it begins at the vendor ID | FF | 51 04 03 02 01 00 00 03 = 4F, 04 01, 04 00,
    51 04 03 02 01 = 4F
BitCheck 32 is nothing | FF | 51 04 03 02 01 20
BitCheck 127 is nothing | FF | 51 04 03 02 01 7F
BitCheck 129 is nothing | FF | 51 04 03 02 01 81
BitCheck 255 is nothing | FF | 51 04 03 02 01 FF
LSSSub 4 is nothing | FF | 51 04 03 02 01 00 04 00
LSSNext 4 is nothing | FF | 51 04 03 02 01 00 00 04
a reset with LSSSub 4 is nothing | FF | 51 00 00 00 00 80 04 00
";

fn bytes(text: &str) -> [u8; 8] {
    let mut bytes = [0; 8];
    for (byte, word) in bytes.iter_mut().zip(text.split(' ')) {
        *byte = u8::from_str_radix(word, 16).expect("a byte");
    }
    bytes
}

/// Rules, one after the other: name, stored node ID, and requests, each with what comes of it.
/// Bytes that are not written are zeros. `boot`, `store` and `quiet` are the owner's to do; `reset`
/// is NMT's reset of communication.
///
/// Beside the slave runs the model of the property tests, so that the model obeys the rules, too.
fn check(rules: &str) {
    let rates = &BitTiming::ALL[..8];
    for rule in rules.replace("\n    ", " ").trim().lines() {
        let [name, active, steps] = rule.split(" | ").collect::<Vec<_>>()[..] else {
            panic!("no rule: {rule}");
        };
        let active = u8::from_str_radix(active, 16).expect("a node ID");
        let address = Part::ALL.map(|part| IDENTITY.get(part));
        let mut pair = Pair::new(address, active, rates);
        for (n, step) in steps.split(", ").enumerate() {
            let (request, expected) = step.split_once(" = ").unwrap_or((step, ""));
            if request == "reset" {
                pair.reset_communication();
                continue;
            }
            let reply = pair.receive(bytes(request), Instant(1_000));
            let got = match reply {
                None => String::new(),
                Some(Reply::Answer(answer)) => {
                    let bytes = answer.to_bytes();
                    assert_eq!(Answer::from_frame(&answer.frame()), Some(answer));
                    let used = bytes.iter().rposition(|byte| *byte != 0).unwrap_or(0);
                    let words = bytes[..=used].iter().map(|byte| format!("{byte:02X}"));
                    words.collect::<Vec<_>>().join(" ")
                }
                Some(Reply::Event(Event::NodeIdConfigured(id))) => format!("boot {id}"),
                Some(Reply::Event(Event::Silence { delay_ms })) => format!("quiet {delay_ms}"),
                Some(Reply::Event(Event::StoreConfiguration {
                    node_id,
                    bit_timing,
                })) => {
                    let id = node_id.map_or(NONE, NodeId::get);
                    format!("store {id} {}", bit_timing.index())
                }
                Some(Reply::Event(event)) => panic!("{name}: {event:?}"),
            };
            assert_eq!(got, expected, "{name}: step {n}, {request}");
        }
    }
}

#[test]
fn switch_state() {
    check(SWITCH_STATE);
}

#[test]
fn configure() {
    check(CONFIGURE);
}

#[test]
fn inquire_and_identify() {
    check(INQUIRE);
}

#[test]
fn fastscan() {
    check(FASTSCAN);
}

/// Command specifiers that no service has are silence in both states (CiA 305, all protocols).
#[test]
fn other_command_specifiers() {
    let known = [
        4, 17, 19, 21, 23, 64, 65, 66, 67, 70, 71, 72, 73, 74, 75, 76, 81, 90, 91, 92, 93, 94,
    ];
    for command in 0..=255u8 {
        let request = Request::from_bytes([command, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(request.is_some(), known.contains(&command), "{command}");
        if let Some(request) = request {
            assert_eq!(request.to_bytes()[0], command);
            assert_eq!(Request::from_frame(&request.frame()), Some(request));
        }
        let answer = Answer::from_bytes([command, 0, 0, 0, 0, 0, 0, 0]);
        let answers = [17, 19, 23, 68, 79, 80, 90, 91, 92, 93, 94];
        assert_eq!(answer.is_some(), answers.contains(&command), "{command}");
        if let Some(answer) = answer {
            assert_eq!(answer.to_bytes()[0], command);
        }
    }
}

/// An LSS message is a data frame of eight bytes with an 11-bit identifier.
#[test]
fn what_is_no_lss_frame() {
    let data = [0x5E, 0, 0, 0, 0, 0, 0, 0];
    let request = StandardId::new(0x7E5).expect("11 bits");
    let answer = StandardId::new(0x7E4).expect("11 bits");
    for length in 0..=8u8 {
        let data = &data[..usize::from(length)];
        let frame = Frame::data_frame(request, data).expect("a frame");
        assert_eq!(
            Request::from_frame(&frame).is_some(),
            length == 8,
            "{length} bytes"
        );
        assert_eq!(Answer::from_frame(&frame), None);
        let frame = Frame::data_frame(answer, data).expect("a frame");
        assert_eq!(
            Answer::from_frame(&frame).is_some(),
            length == 8,
            "{length} bytes"
        );
        assert_eq!(Request::from_frame(&frame), None);
        for id in [request, answer] {
            let remote = Frame::remote_frame(id, length).expect("a frame");
            let id = ExtendedId::new(id.as_raw().into()).expect("29 bits");
            let extended = Frame::data_frame(id, data).expect("a frame");
            for frame in [remote, extended] {
                assert_eq!(Request::from_frame(&frame), None);
                assert_eq!(Answer::from_frame(&frame), None);
            }
        }
    }
}

fn slave(id: u8) -> Slave {
    Slave::new(
        IDENTITY,
        NodeId::new(id),
        BitTiming::Kbit1000,
        BitTimings::RATES,
    )
}

/// The answer to "store configuration" comes when the owner knows how it went.
#[test]
fn store_is_answered_when_it_is_done() {
    for (stored, answer) in [
        (Ok(()), "17"),
        (Err(StoreError::NotSupported), "17 01"),
        (Err(StoreError::Access), "17 02"),
        (Err(StoreError::Specific(9)), "17 FF 09"),
    ] {
        let mut slave = slave(5);
        let now = Instant::ZERO;
        assert_eq!(slave.complete(stored), None, "nobody asked");
        slave.receive(Request::SwitchGlobal(State::Configuration), now);
        slave.receive(Request::Store, now);
        let got = slave.complete(stored).expect("an answer");
        assert_eq!(got.to_bytes(), bytes(answer));
        assert_eq!(slave.complete(stored), None, "one answer to one request");
        let again = slave.receive(Request::Store, now);
        assert!(matches!(
            again,
            Some(Reply::Event(Event::StoreConfiguration { .. }))
        ));
        // The next device in configuration may be another one.
        slave.receive(Request::SwitchGlobal(State::Waiting), now);
        assert_eq!(slave.complete(stored), None, "it has left configuration");
    }
}

/// Two delays: the change between them, silence through both.
#[test]
fn bit_timing_changes_after_a_delay_and_silence_lasts_another() {
    for delay_ms in [0, 1, 10, u16::MAX] {
        let mut slave = slave(5);
        let start = Instant(7_000_000);
        let delay = u64::from(delay_ms);
        slave.receive(Request::SwitchGlobal(State::Configuration), start);
        let index = BitTiming::Kbit250.index();
        slave.receive(Request::ConfigureBitTiming { table: 0, index }, start);
        assert_eq!(slave.bit_timing(), BitTiming::Kbit1000, "not active yet");
        let reply = slave.receive(Request::ActivateBitTiming { delay_ms }, start);
        assert_eq!(reply, Some(Reply::Event(Event::Silence { delay_ms })));
        assert!(slave.is_silent());
        assert_eq!(slave.next_deadline(), start.plus_ms(delay));
        if delay > 0 {
            assert_eq!(slave.poll(start.plus_ms(delay - 1)), None);
        }
        let changed = start.plus_ms(delay);
        let event = slave.poll(changed);
        assert_eq!(event, Some(Event::SwitchBitTiming(BitTiming::Kbit250)));
        assert_eq!(slave.bit_timing(), BitTiming::Kbit250);
        assert!(slave.is_silent());
        if delay > 0 {
            assert_eq!(slave.poll(changed.plus_ms(delay - 1)), None);
        }
        assert_eq!(slave.poll(changed.plus_ms(delay)), Some(Event::SpeakAgain));
        assert!(!slave.is_silent());
        assert_eq!(slave.next_deadline(), Instant::NEVER);
        assert_eq!(slave.poll(Instant::NEVER), None);
        // It is where it was, in configuration.
        assert_eq!(slave.state(), State::Configuration);
    }
}

/// A store that ends while bit timing changes is not answered, for nothing is sent then.
#[test]
fn a_silent_slave_says_nothing_of_its_store() {
    let mut slave = slave(5);
    let now = Instant::ZERO;
    slave.receive(Request::SwitchGlobal(State::Configuration), now);
    slave.receive(Request::Store, now);
    slave.receive(Request::ActivateBitTiming { delay_ms: 5 }, now);
    assert_eq!(slave.complete(Ok(())), None);
}

/// A device that cannot change its bit timing refuses to be given one and changes nothing.
#[test]
fn a_device_with_one_bit_timing() {
    let id = NodeId::new(5);
    let mut slave = Slave::new(IDENTITY, id, BitTiming::Kbit500, BitTimings::NONE);
    let now = Instant::ZERO;
    slave.receive(Request::SwitchGlobal(State::Configuration), now);
    for index in 0..=255 {
        let reply = slave.receive(Request::ConfigureBitTiming { table: 0, index }, now);
        let refusal = Refusal {
            service: Service::ConfigureBitTiming,
            error: 1,
            specific: 0,
        };
        assert_eq!(reply, Some(Reply::Answer(Answer::Refused(refusal))));
    }
    assert_eq!(
        slave.receive(Request::ActivateBitTiming { delay_ms: 0 }, now),
        None
    );
    assert!(!slave.is_silent());
}

/// Table 0 both ways.
#[test]
fn bit_timing_numbers() {
    let rates = [1000, 800, 500, 250, 125, 0, 50, 20, 10];
    for index in 0..=255 {
        let timing = BitTiming::from_index(index);
        let rate = rates.get(usize::from(index)).filter(|rate| **rate > 0);
        assert_eq!(timing.and_then(BitTiming::kbit_s), rate.copied(), "{index}");
        assert_eq!(timing.is_some(), rate.is_some() || index == 9);
        if let Some(timing) = timing {
            assert_eq!(timing.index(), index);
            assert_eq!(
                timing.kbit_s().and_then(BitTiming::from_kbit_s),
                rate.and(Some(timing))
            );
            assert_eq!(BitTimings::RATES.has(timing), index != 9);
            assert!(BitTimings::NONE.with(timing).has(timing));
        }
    }
    assert_eq!(
        BitTiming::from_kbit_s(100),
        None,
        "table 0 has no 100 kbit/s"
    );
}
