//! The slcan codec against the lines of its documents, round trips and noise.

use can::slcan::{Answer, Answers, BitRate, Command, Commands, Error};
use can::{ExtendedId, Frame, StandardId};
use proptest::prelude::*;

fn commands(bytes: &[u8]) -> Vec<Result<Command, Error>> {
    let mut decoder = Commands::new();
    bytes
        .iter()
        .filter_map(|byte| decoder.push(*byte))
        .collect()
}

fn answers(bytes: &[u8]) -> Vec<Result<Answer, Error>> {
    let mut decoder = Answers::new();
    bytes
        .iter()
        .filter_map(|byte| decoder.push(*byte))
        .collect()
}

fn data(id: u16, bytes: &[u8]) -> Frame {
    Frame::data_frame(StandardId::new(id).unwrap(), bytes).unwrap()
}

/// Every line of the table in the module's documentation, and what hosts send to begin with.
#[test]
fn lines_and_their_meaning() {
    let wide = ExtendedId::new(0x1ABC_DEF0).unwrap();
    let table: &[(&str, Command)] = &[
        ("\r", Command::Empty),
        ("O\r", Command::Open),
        ("L\r", Command::Listen),
        ("C\r", Command::Close),
        (
            "S0\r",
            Command::BitRate(BitRate::from_bits_per_s(10_000).unwrap()),
        ),
        (
            "S6\r",
            Command::BitRate(BitRate::from_bits_per_s(500_000).unwrap()),
        ),
        (
            "S8\r",
            Command::BitRate(BitRate::from_bits_per_s(1_000_000).unwrap()),
        ),
        ("s031C\r", Command::BitTiming([0x03, 0x1C])),
        ("V\r", Command::Version),
        ("N\r", Command::SerialNumber),
        ("F\r", Command::Flags),
        ("Z0\r", Command::Timestamps(false)),
        ("Z1\r", Command::Timestamps(true)),
        ("M00000000\r", Command::AcceptanceCode(0)),
        ("mFFFFFFFF\r", Command::AcceptanceMask(u32::MAX)),
        (
            "t2013A1B2C3\r",
            Command::Send(data(0x201, &[0xA1, 0xB2, 0xC3])),
        ),
        ("t0800\r", Command::Send(data(0x80, &[]))),
        ("T1ABCDEF0811223344AABBCCDD\r", {
            let bytes = [0x11, 0x22, 0x33, 0x44, 0xAA, 0xBB, 0xCC, 0xDD];
            Command::Send(Frame::data_frame(wide, &bytes).unwrap())
        }),
        ("r7014\r", {
            Command::Send(Frame::remote_frame(StandardId::new(0x701).unwrap(), 4).unwrap())
        }),
        (
            "R1ABCDEF00\r",
            Command::Send(Frame::remote_frame(wide, 0).unwrap()),
        ),
    ];
    for (text, command) in table {
        assert_eq!(commands(text.as_bytes()), [Ok(*command)], "{text:?}");
        assert_eq!(command.encode().as_bytes(), text.as_bytes(), "{text:?}");
    }
    let frame = data(0x181, &[1, 0xFF]);
    let table: &[(&str, Answer)] = &[
        ("\r", Answer::Done),
        ("\x07", Answer::Refused),
        ("z\r", Answer::Queued { extended: false }),
        ("Z\r", Answer::Queued { extended: true }),
        (
            "V1013\r",
            Answer::Version {
                hardware: 0x10,
                software: 0x13,
            },
        ),
        ("NA123\r", Answer::SerialNumber(*b"A123")),
        ("F08\r", Answer::Flags(8)),
        (
            "t181201FF\r",
            Answer::Received {
                frame,
                timestamp_ms: None,
            },
        ),
        // 59 999 ms is EA5Fh, the last one of a minute.
        (
            "t181201FFEA5F\r",
            Answer::Received {
                frame,
                timestamp_ms: Some(59_999),
            },
        ),
    ];
    for (text, answer) in table {
        assert_eq!(answers(text.as_bytes()), [Ok(*answer)], "{text:?}");
        assert_eq!(answer.encode().as_bytes(), text.as_bytes(), "{text:?}");
    }
}

#[test]
fn wrong_lines_say_what_and_where() {
    let table: &[(&str, Error)] = &[
        ("X\r", Error::Unknown(b'X')),
        ("\u{7f}\r", Error::Unknown(0x7F)),
        (
            "OO\r",
            Error::Length {
                expected: 1,
                got: 2,
            },
        ),
        (
            "S\r",
            Error::Length {
                expected: 2,
                got: 1,
            },
        ),
        ("S9\r", Error::BitRate(9)),
        ("SA\r", Error::Digit { at: 1, byte: b'A' }),
        ("Z2\r", Error::Digit { at: 1, byte: b'2' }),
        (
            "t\r",
            Error::Length {
                expected: 2,
                got: 1,
            },
        ),
        ("t8000\r", Error::Identifier(0x800)),
        ("T200000000\r", Error::Identifier(0x2000_0000)),
        ("t1239\r", Error::DataLength(9)),
        ("r1239\r", Error::DataLength(9)),
        ("t12G0\r", Error::Digit { at: 3, byte: b'G' }),
        ("t123A\r", Error::Digit { at: 4, byte: b'A' }),
        (
            "t123211\r",
            Error::Length {
                expected: 9,
                got: 7,
            },
        ),
        (
            "t12311122\r",
            Error::Length {
                expected: 7,
                got: 9,
            },
        ),
        ("t12321 22\r", Error::Digit { at: 6, byte: b' ' }),
        (
            "r123111\r",
            Error::Length {
                expected: 5,
                got: 7,
            },
        ),
        (
            "m123\r",
            Error::Length {
                expected: 9,
                got: 4,
            },
        ),
        ("T123456788112233445566778811112\r", Error::TooLong),
    ];
    for (text, error) in table {
        assert_eq!(commands(text.as_bytes()), [Err(*error)], "{text:?}");
    }
    assert_eq!(
        answers(b"t12\x07z\r").as_slice(),
        [
            Err(Error::Interrupted),
            Ok(Answer::Queued { extended: false })
        ]
    );
}

#[test]
fn noise_ends_at_the_next_carriage_return() {
    let mut bytes = vec![0xA5; 100_000];
    bytes.extend(b"\rO\r");
    assert_eq!(commands(&bytes), [Err(Error::TooLong), Ok(Command::Open)]);
    assert_eq!(
        answers(&bytes),
        [Err(Error::TooLong), Err(Error::Unknown(b'O'))]
    );
}

/// Some terminals end lines by CR LF.
#[test]
fn line_feeds_are_passed_over() {
    assert_eq!(
        commands(b"C\r\nO\r\n\r"),
        [Ok(Command::Close), Ok(Command::Open), Ok(Command::Empty)]
    );
}

#[test]
fn small_letters_are_digits_too() {
    let frame = data(0x1AB, &[0xCD]);
    assert_eq!(commands(b"t1ab1cd\r"), [Ok(Command::Send(frame))]);
}

fn any_frame() -> impl Strategy<Value = Frame> {
    let data = prop::collection::vec(any::<u8>(), 0..=8);
    (any::<u32>(), any::<bool>(), any::<bool>(), data).prop_map(|(id, wide, remote, data)| {
        let id: can::Id = if wide {
            ExtendedId::new(id & 0x1FFF_FFFF).unwrap().into()
        } else {
            StandardId::new((id & 0x7FF) as u16).unwrap().into()
        };
        if remote {
            Frame::remote_frame(id, data.len() as u8).unwrap()
        } else {
            Frame::data_frame(id, &data).unwrap()
        }
    })
}

fn any_command() -> impl Strategy<Value = Command> {
    prop_oneof![
        any_frame().prop_map(Command::Send),
        (0..=8_u8).prop_map(|code| Command::BitRate(BitRate::from_code(code).unwrap())),
        any::<[u8; 2]>().prop_map(Command::BitTiming),
        any::<bool>().prop_map(Command::Timestamps),
        any::<u32>().prop_map(Command::AcceptanceCode),
        any::<u32>().prop_map(Command::AcceptanceMask),
        Just(Command::Empty),
        Just(Command::Close),
    ]
}

fn any_answer() -> impl Strategy<Value = Answer> {
    prop_oneof![
        (any_frame(), prop::option::of(0..60_000_u16)).prop_map(|(frame, timestamp_ms)| {
            Answer::Received {
                frame,
                timestamp_ms,
            }
        }),
        any::<bool>().prop_map(|extended| Answer::Queued { extended }),
        (any::<u8>(), any::<u8>())
            .prop_map(|(hardware, software)| Answer::Version { hardware, software }),
        any::<u8>().prop_map(Answer::Flags),
        Just(Answer::Done),
        Just(Answer::Refused),
    ]
}

/// Bytes that often look like slcan.
fn noise() -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![
        prop::sample::select(b"tTrROLCSsVNFZMm0123456789abcdefABCDEF\r\r\n\x07".to_vec()),
        any::<u8>(),
    ];
    prop::collection::vec(byte, 0..400)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4_000))]

    #[test]
    fn commands_round_trip(sent in prop::collection::vec(any_command(), 0..20)) {
        let text: Vec<u8> = sent.iter().flat_map(|c| c.encode().as_bytes().to_vec()).collect();
        let came: Result<Vec<_>, _> = commands(&text).into_iter().collect();
        prop_assert_eq!(came, Ok(sent));
    }

    #[test]
    fn answers_round_trip(sent in prop::collection::vec(any_answer(), 0..20)) {
        let text: Vec<u8> = sent.iter().flat_map(|a| a.encode().as_bytes().to_vec()).collect();
        let came: Result<Vec<_>, _> = answers(&text).into_iter().collect();
        prop_assert_eq!(came, Ok(sent));
    }

    /// Noise never panics, and gives one result for each line end; what was understood encodes to
    /// the same line, small letters aside. After it a good line is understood.
    #[test]
    fn noise_is_survived(noise in noise()) {
        let ends = noise.iter().filter(|byte| **byte == b'\r').count();
        prop_assert_eq!(commands(&noise).len(), ends);
        let bells = noise.iter().filter(|byte| **byte == 7).count();
        prop_assert_eq!(answers(&noise).len(), ends + bells);
        for command in commands(&noise).into_iter().flatten() {
            prop_assert_eq!(commands(command.encode().as_bytes()), vec![Ok(command)]);
        }
        let mut after = noise;
        after.extend(b"\rV\r");
        prop_assert_eq!(commands(&after).pop(), Some(Ok(Command::Version)));
    }
}
