//! Block upload (CiA 301 7.2.4.3.12 to 7.2.4.3.16).

use canopen::Abort;
use canopen::sdo_client::{Failure, Method, Settings, Stage};

use crate::dialogue::*;
use crate::harness::model::crc16;

/// The request for blocks of three segments, and what else these dialogues repeat. The object has
/// 30 bytes: five segments, the last of which has two.
const ASK: Line = Sends("A4 452306 03150000");
const BEGIN: Line = Answer("C6 452306 1E000000");
const START: Line = Sends("A3 00000000000000");
const S1: Line = Answer("01 00010203040506");
const S2: Line = Answer("02 0708090A0B0C0D");
const S3: Line = Answer("03 0E0F1011121314");
const ACK_3: Line = Sends("A2 03030000000000");
const S4: Line = Answer("01 15161718191A1B");
const S5: Line = Answer("82 1C1DFFFFFFFFFF");
const ACK_2: Line = Sends("A2 02030000000000");
const ENDED: Line = Sends("A1 00000000000000");
const TIMED_OUT: Line = Sends("80 452306 00000405");
const WRONG_NUMBER: Line = Sends("80 452306 03000405");
const FIRST: [Line; 7] = [ASK, BEGIN, START, S1, S2, S3, ACK_3];
const SECOND: [Line; 3] = [S4, S5, ACK_2];
const LAPSE: [Line; 2] = [Wait(499), Wait(1)];

/// The end after `bytes` of the pattern, of whose last segment `unused` do not count.
fn end(bytes: usize, unused: u8) -> Line {
    let [low, high] = crc16(&pattern(bytes)).to_le_bytes();
    let command = 0xC1 | unused << 2;
    Answer(format!("{command:02X} {low:02X}{high:02X} 0000000000").leak())
}

fn reads(what: &str, settings: Settings, lines: &[Line], bytes: usize) {
    let read = upload(what, settings, Method::Block, lines, done(bytes as u32));
    assert_eq!(read, pattern(bytes), "{what}");
}

fn fails(what: &str, settings: Settings, lines: &[Line], failure: Failure) {
    upload(what, settings, Method::Block, lines, Err(failure));
}

#[test]
fn blocks_are_confirmed_and_the_end_is() {
    let progress = [Progress(14, Some(30))];
    let lines = [&FIRST[..], &progress, &SECOND, &[end(30, 5), ENDED]].concat();
    reads("blocks", attempts_of_three(1), &lines, 30);
}

fn attempts_of_three(attempts: u32) -> Settings {
    Settings {
        attempts,
        ..blocks(3)
    }
}

/// Offered by the client or not, by the server or not; with the size or not.
#[test]
fn checksum_and_size_are_used_if_both_sides_have_them() {
    let wrong = Answer("D5 FFFF 0000000000");
    for (offered, ask) in [(true, ASK), (false, Sends("A0 452306 03150000"))] {
        for (answer, agreed, total) in [
            ("C6 452306 1E000000", true, Some(30)),
            ("C4 452306 00000000", true, None),
            ("C2 452306 1E000000", false, Some(30)),
            ("C0 452306 00000000", false, None),
        ] {
            let settings = Settings {
                crc: offered,
                ..blocks(3)
            };
            let begin = [ask, Answer(answer), START, Progress(0, total)];
            let lines = [&begin, &FIRST[3..], &SECOND].concat();
            let right = [&lines[..], &[end(30, 5), ENDED]].concat();
            reads(answer, settings, &right, 30);
            if offered && agreed {
                let told = Sends("80 452306 04000405");
                let failure = Failure::Crc {
                    computed: crc16(&pattern(30)),
                    received: 0xFFFF,
                };
                fails(
                    answer,
                    settings,
                    &[&lines[..], &[wrong, told]].concat(),
                    failure,
                );
            } else {
                reads(
                    answer,
                    settings,
                    &[&lines[..], &[wrong, ENDED]].concat(),
                    30,
                );
            }
        }
    }
}

/// The end says how many bytes of the last segment do not count.
#[test]
fn every_number_of_bytes_in_the_last_segment() {
    for bytes in 0..=7usize {
        let size = format!("C6 452306 {bytes:02X}000000").leak();
        let mut data = pattern(bytes);
        data.resize(7, 0xEE);
        let segment: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
        let segment = format!("81 {segment}").leak();
        let lines = [
            ASK,
            Answer(size),
            START,
            Answer(segment),
            Sends("A2 01030000000000"),
            end(bytes, 7 - bytes as u8),
            ENDED,
        ];
        reads(size, blocks(3), &lines, bytes);
    }
}

#[test]
fn the_indicated_size_is_held() {
    let begin = |size| [ASK, Answer(size), START];
    let lines = [
        &begin("C6 452306 1F000000")[..],
        &FIRST[3..],
        &SECOND,
        &[end(30, 5), Sends("80 452306 13000706")],
    ];
    let failure = Failure::Size {
        indicated: 31,
        received: 30,
    };
    fails("less", blocks(3), &lines.concat(), failure);
    let lines = [
        &begin("C6 452306 0D000000")[..],
        &[S1, S2, S3, Sends("80 452306 12000706")],
    ];
    // The third segment shows that all bytes of the second count.
    let failure = Failure::Size {
        indicated: 13,
        received: 14,
    };
    fails("more", blocks(3), &lines.concat(), failure);
}

/// The protocol switch threshold (CiA 301 7.2.4.3.12).
#[test]
fn the_server_may_use_another_protocol_below_the_threshold() {
    let lines = [ASK, Answer("4B 452306 00010000")];
    reads("expedited", blocks(3), &lines, 2);
    let lines = [
        ASK,
        Answer("41 452306 09000000"),
        Sends("60 00000000000000"),
        Answer("00 00010203040506"),
        Sends("70 00000000000000"),
        Answer("1B 07080000000000"),
    ];
    reads("segmented", blocks(3), &lines, 9);
    let forbidden = Settings {
        switch_threshold: 0,
        ..blocks(3)
    };
    for (answer, command) in [("4B 452306 00010000", 0x4B), ("41 452306 09000000", 0x41)] {
        let lines = [
            Sends("A4 452306 03000000"),
            Answer(answer),
            Sends("80 452306 01000405"),
        ];
        fails(answer, forbidden, &lines, Failure::Command { command });
    }
}

#[test]
fn block_sizes_that_there_are_not_are_brought_into_range() {
    for (asked, request) in [
        (0, "A4 452306 01150000"),
        (1, "A4 452306 01150000"),
        (127, "A4 452306 7F150000"),
        (128, "A4 452306 7F150000"),
        (255, "A4 452306 7F150000"),
    ] {
        let lines = [Sends(request), Answer("4F 452306 00000000")];
        reads(request, blocks(asked), &lines, 1);
    }
}

/// The client confirms what came in order, and the server goes on from there.
#[test]
fn a_lost_segment_is_sent_again() {
    let cases: [(&str, &[Line]); 7] = [
        (
            "first",
            &[S2, S3, Sends("A2 00030000000000"), S1, S2, S3, ACK_3],
        ),
        (
            "second",
            &[
                S1,
                S3,
                Sends("A2 01030000000000"),
                Answer("01 0708090A0B0C0D"),
                Answer("02 0E0F1011121314"),
                Answer("03 15161718191A1B"),
                ACK_3,
                Answer("81 1C1DFFFFFFFFFF"),
                Sends("A2 01030000000000"),
            ],
        ),
        (
            "last, so that the block has no end",
            &[
                S1,
                S2,
                Wait(99),
                Wait(1),
                ACK_2,
                Answer("01 0E0F1011121314"),
                Answer("02 15161718191A1B"),
                Answer("83 1C1DFFFFFFFFFF"),
                ACK_3,
            ],
        ),
        (
            "first and last",
            &[S2, Wait(100), Sends("A2 00030000000000"), S1, S2, S3, ACK_3],
        ),
        (
            "the same one twice",
            &[
                S2,
                S3,
                Sends("A2 00030000000000"),
                S2,
                Wait(100),
                Sends("A2 00030000000000"),
                S1,
                S2,
                S3,
                ACK_3,
            ],
        ),
        (
            "first of the last block",
            &[
                S1,
                S2,
                S3,
                ACK_3,
                S5,
                Sends("A2 00030000000000"),
                S4,
                S5,
                ACK_2,
            ],
        ),
        (
            "last of all",
            &[
                S1,
                S2,
                S3,
                ACK_3,
                S4,
                Wait(100),
                Sends("A2 01030000000000"),
                Answer("81 1C1DFFFFFFFFFF"),
                Sends("A2 01030000000000"),
            ],
        ),
    ];
    for (what, lines) in cases {
        let begin = [ASK, BEGIN, START];
        let rest = match lines.last() {
            Some(Sends("A2 03030000000000")) if !lines.contains(&Answer("83 1C1DFFFFFFFFFF")) => {
                &SECOND[..]
            }
            _ => &[],
        };
        let ends = [end(30, 5), ENDED];
        // One attempt is enough: this is no repetition.
        let lines = [&begin[..], lines, rest, &ends].concat();
        reads(what, attempts_of_three(1), &lines, 30);
    }
}

#[test]
fn a_doubled_segment_counts_once() {
    let lines = [
        // The first request's answer looks like segment 0x46, the last one.
        &[ASK, BEGIN, Interrupt, BEGIN, START, BEGIN][..],
        &[S1, S1, S2, S1, S3, Interrupt, S3, ACK_3, S3],
        &[S4, S4, S5, Interrupt, S5, ACK_2, S5],
        &[end(30, 5), ENDED],
    ];
    reads("doubled", attempts_of_three(1), &lines.concat(), 30);
    let none = Sends("A2 00030000000000");
    let gap = [ASK, BEGIN, START, S2, S2, S3, Interrupt, S3, none, S3];
    let lines = [&gap[..], &FIRST[3..], &SECOND, &[end(30, 5), ENDED]].concat();
    reads("doubled after a gap", attempts_of_three(1), &lines, 30);
}

#[test]
fn sequence_numbers_that_cannot_be_are_aborted() {
    let begin = [ASK, BEGIN, START, S1];
    for (frame, received) in [
        ("00 00000000000000", 0),
        ("04 00000000000000", 4),
        ("7F 00000000000000", 0x7F),
        ("84 00000000000000", 4),
    ] {
        let lines = [&begin[..], &[Answer(frame), WRONG_NUMBER]].concat();
        let failure = Failure::Sequence {
            expected: 2,
            received,
        };
        fails(frame, blocks(3), &lines, failure);
    }
}

/// A server that always begins behind what is missing would go on for ever.
#[test]
fn blocks_that_bring_nothing_end_the_transfer() {
    let mut lines = vec![ASK, BEGIN, START];
    let other = Answer("02 00000000000000");
    for _ in 0..7 {
        lines.extend([S2, other, S3, Sends("A2 00030000000000")]);
    }
    lines.extend([S2, S3, WRONG_NUMBER]);
    let failure = Failure::Sequence {
        expected: 1,
        received: 3,
    };
    fails("nothing", blocks(3), &lines, failure);
}

/// A pause is taken for the end of the block. If the block goes on nevertheless, nobody knows what
/// the confirmation confirmed.
#[test]
fn a_block_that_goes_on_after_its_end_is_aborted() {
    let lines = [
        ASK,
        BEGIN,
        START,
        S1,
        S2,
        Wait(100),
        ACK_2,
        S3,
        WRONG_NUMBER,
    ];
    let failure = Failure::Sequence {
        expected: 1,
        received: 3,
    };
    fails("goes on", blocks(3), &lines, failure);
}

#[test]
fn a_lost_start_is_repeated() {
    let begin = [ASK, BEGIN, START];
    let lost = [&begin[..], &LAPSE, &[START]].concat();
    let rest = [&FIRST[3..], &SECOND, &[end(30, 5), ENDED]].concat();
    reads("start", blocks(3), &[&lost[..], &rest].concat(), 30);
    // After the second time the transfer is begun anew, and the start has two tries again.
    let again = [&lost[..], &LAPSE, &[TIMED_OUT], &FIRST, &rest[4..]].concat();
    reads("start", blocks(3), &again, 30);
    let never = [&lost[..], &LAPSE, &[TIMED_OUT], &lost, &LAPSE, &[TIMED_OUT]].concat();
    let failure = Failure::TimedOut {
        stage: Stage::Block,
    };
    fails("start", blocks(3), &never, failure);
    let once = [&begin[..], &LAPSE, &[TIMED_OUT]].concat();
    fails("start", attempts_of_three(1), &once, failure);
}

/// Either the confirmation was lost or all of the next block. The server would skip the second
/// block if it was that, which shows if the size is known.
#[test]
fn a_confirmation_is_repeated_only_if_the_size_is_known() {
    let rest = [&SECOND[..], &[end(30, 5), ENDED]].concat();
    let known = [&FIRST[..], &LAPSE, &[ACK_3], &rest].concat();
    reads("known", blocks(3), &known, 30);
    let skipped = [
        &FIRST[..],
        &LAPSE,
        &[ACK_3],
        &[Answer("81 1C1DFFFFFFFFFF"), Sends("A2 01030000000000")],
        &[Answer("D5 0000 0000000000")],
    ]
    .concat();
    let no_crc = |line: &Line| match *line {
        ASK => Sends("A0 452306 03150000"),
        other => other,
    };
    let skipped: Vec<Line> = skipped.iter().map(no_crc).collect();
    let settings = Settings {
        crc: false,
        ..blocks(3)
    };
    let failure = Failure::Size {
        indicated: 30,
        received: 23,
    };
    let told = [Sends("80 452306 13000706")];
    fails(
        "skipped",
        settings,
        &[&skipped[..], &told].concat(),
        failure,
    );

    let begin = [ASK, Answer("C4 452306 00000000")];
    let first = [&begin[..], &FIRST[2..]].concat();
    let unknown = [&first[..], &LAPSE, &[TIMED_OUT], &first, &rest].concat();
    reads("unknown", blocks(3), &unknown, 30);
    let failure = Failure::TimedOut {
        stage: Stage::Block,
    };
    let once = [&first[..], &LAPSE, &[TIMED_OUT]].concat();
    fails("unknown", attempts_of_three(1), &once, failure);
}

#[test]
fn a_lost_end_is_asked_for_by_the_last_confirmation() {
    let all = [&FIRST[..], &SECOND].concat();
    let lines = [&all[..], &LAPSE, &[ACK_2, end(30, 5), ENDED]].concat();
    reads("end", blocks(3), &lines, 30);
    let failure = Failure::TimedOut { stage: Stage::End };
    let lines = [&all[..], &LAPSE, &[TIMED_OUT]].concat();
    fails("end", attempts_of_three(1), &lines, failure);
    let lost = [&all[..], &LAPSE, &[ACK_2], &LAPSE, &[TIMED_OUT]].concat();
    fails("end", blocks(3), &[&lost[..], &lost].concat(), failure);
    // If the end was what was lost, the server does not expect the confirmation again.
    let refused = [&all[..], &LAPSE, &[ACK_2, Answer("80 452306 01000405")]].concat();
    let again = [&refused[..], &all, &[end(30, 5), ENDED]].concat();
    reads("again", blocks(3), &again, 30);
    let failure = Failure::Aborted(Abort::COMMAND);
    fails(
        "again",
        blocks(3),
        &[&refused[..], &refused].concat(),
        failure,
    );
    // Other aborts have other causes.
    let refused = [&all[..], &LAPSE, &[ACK_2, Answer("80 452306 00000606")]].concat();
    fails(
        "end",
        blocks(3),
        &refused,
        Failure::Aborted(Abort::HARDWARE),
    );
}

#[test]
fn what_is_no_end_is_aborted() {
    for (frame, command) in [
        ("C0 00000000000000", 0xC0),
        ("A1 00000000000000", 0xA1),
        ("60 00000000000000", 0x60),
        ("01 00000000000000", 0x01),
        ("81 00000000000000", 0x81),
    ] {
        let wrong = [Answer(frame), Sends("80 452306 01000405")];
        let lines = [&FIRST[..], &SECOND, &wrong].concat();
        fails(frame, blocks(3), &lines, Failure::Command { command });
    }
}

/// In a block only 0x80 is an abort: other first bytes from 0x81 on are last segments.
#[test]
fn the_server_and_the_caller_may_abort_at_every_step() {
    let all = [&FIRST[..], &SECOND].concat();
    for cut in 1..=all.len() {
        let begin = [&all[..cut], &[Interrupt]].concat();
        let refused = [&begin[..], &[Answer("80 452306 22000008")]].concat();
        let failure = Failure::Aborted(Abort::DEVICE_STATE);
        fails("server", blocks(3), &refused, failure);
        let told = Sends("80 452306 00000008");
        let cancelled = [&begin[..], &[Cancel(Abort::GENERAL), told]].concat();
        fails(
            "caller",
            blocks(3),
            &cancelled,
            Failure::Cancelled(Abort::GENERAL),
        );
    }
}
