//! Block download (CiA 301 7.2.4.3.9 to 7.2.4.3.11 and 7.2.4.3.16).

use canopen::Abort;
use canopen::sdo_client::{Failure, Method, Settings, Stage};

use crate::dialogue::*;
use crate::harness::model::crc16;

/// The object has 30 bytes: five segments, the last of which has two.
const BYTES: usize = 30;
const ASK: Line = Sends("C6 452306 1E000000");
/// Blocks of three segments.
const BEGIN: Line = Answer("A4 452306 03000000");
const S1: Line = Sends("01 00010203040506");
const S2: Line = Sends("02 0708090A0B0C0D");
const S3: Line = Sends("03 0E0F1011121314");
const S4: Line = Sends("01 15161718191A1B");
const S5: Line = Sends("82 1C1D0000000000");
const ENDED: Line = Answer("A1 00000000000000");
const TIMED_OUT: Line = Sends("80 452306 00000405");
const FIRST: [Line; 5] = [ASK, BEGIN, S1, S2, S3];
const SECOND: [Line; 2] = [S4, S5];
const LAPSE: [Line; 2] = [Wait(499), Wait(1)];

fn ack(text: &'static str) -> [Line; 1] {
    [Answer(text)]
}

/// So many segments are there, and the next block may have so many.
const ACK_3: &str = "A2 03030000000000";
const ACK_2: &str = "A2 02030000000000";

fn end(bytes: usize, unused: u8) -> Line {
    let [low, high] = crc16(&pattern(bytes)).to_le_bytes();
    let command = 0xC1 | unused << 2;
    Sends(format!("{command:02X} {low:02X}{high:02X} 0000000000").leak())
}

fn writes(what: &str, settings: Settings, lines: &[Line]) {
    let outcome = done(BYTES as u32);
    download(
        what,
        settings,
        Method::Block,
        &pattern(BYTES),
        lines,
        outcome,
    );
}

fn fails(what: &str, settings: Settings, lines: &[Line], failure: Failure) {
    let data = pattern(BYTES);
    download(what, settings, Method::Block, &data, lines, Err(failure));
}

#[test]
fn blocks_are_sent_confirmed_and_ended() {
    let lines = [
        &FIRST[..],
        &[Progress(0, Some(30))],
        &ack(ACK_3),
        &SECOND,
        &[Progress(21, Some(30))],
        &ack(ACK_2),
        &[end(30, 5), Progress(30, Some(30)), ENDED],
    ];
    writes("blocks", attempts(1), &lines.concat());
}

#[test]
fn without_checksum_its_place_is_zero() {
    let rest = [&ack(ACK_3)[..], &SECOND, &ack(ACK_2)].concat();
    let none = Sends("D5 0000 0000000000");
    for (offered, ask, begin, last) in [
        (true, ASK, "A4 452306 03000000", end(30, 5)),
        (true, ASK, "A0 452306 03000000", none),
        (
            false,
            Sends("C2 452306 1E000000"),
            "A4 452306 03000000",
            none,
        ),
        (
            false,
            Sends("C2 452306 1E000000"),
            "A0 452306 03000000",
            none,
        ),
    ] {
        let settings = Settings {
            crc: offered,
            ..attempts(1)
        };
        let lines = [&[ask, Answer(begin)], &FIRST[2..], &rest, &[last, ENDED]].concat();
        writes(begin, settings, &lines);
    }
}

/// An object without bytes is one segment of which none counts.
#[test]
fn every_number_of_bytes_in_the_last_segment() {
    for bytes in 0..=8usize {
        let data = pattern(bytes);
        let ask = format!("C6 452306 {bytes:02X}000000").leak();
        let mut lines = vec![Sends(ask), BEGIN];
        let mut chunks: Vec<&[u8]> = data.chunks(7).collect();
        if chunks.is_empty() {
            chunks.push(&[]);
        }
        let count = chunks.len();
        for (number, chunk) in (1..).zip(&chunks) {
            let first = number | if number == count { 0x80 } else { 0 };
            let mut text = format!("{first:02X} ");
            for byte in chunk.iter().chain(&[0; 7]).take(7) {
                text += &format!("{byte:02X}");
            }
            lines.push(Sends(text.leak()));
        }
        let confirmed = format!("A2 {count:02X}030000000000").leak();
        let unused = 7 - chunks.last().map_or(0, |chunk| chunk.len());
        lines.extend([Answer(confirmed), end(bytes, unused as u8), ENDED]);
        let outcome = done(bytes as u32);
        download(ask, attempts(1), Method::Block, &data, &lines, outcome);
    }
}

/// The server says with each confirmation how many segments it wants next.
#[test]
fn the_block_size_follows_the_server() {
    let lines = [
        ASK,
        Answer("A4 452306 01000000"),
        S1,
        Answer("A2 01020000000000"),
        Sends("01 0708090A0B0C0D"),
        Sends("02 0E0F1011121314"),
        Answer("A2 027F0000000000"),
        S4,
        S5,
        // The size of a block that never comes is not looked at.
        Answer("A2 02000000000000"),
        end(30, 5),
        ENDED,
    ];
    writes("sizes", attempts(1), &lines);
    for (segments, begin) in [(0, "A4 452306 00000000"), (128, "A4 452306 80000000")] {
        let lines = [ASK, Answer(begin), Sends("80 452306 02000405")];
        fails(begin, attempts(2), &lines, Failure::BlockSize { segments });
    }
    for (segments, ack) in [(0, "A2 03000000000000"), (255, "A2 03FF0000000000")] {
        let lines = [&FIRST[..], &[Answer(ack), Sends("80 452306 02000405")]].concat();
        fails(ack, attempts(2), &lines, Failure::BlockSize { segments });
    }
}

#[test]
fn what_was_not_confirmed_is_sent_again() {
    let ends = [end(30, 5), ENDED];
    let cases: [(&str, &[Line]); 5] = [
        (
            "nothing",
            &[
                Answer("A2 00030000000000"),
                S1,
                S2,
                S3,
                Answer(ACK_3),
                S4,
                S5,
                Answer(ACK_2),
            ],
        ),
        (
            "one, and the next block is longer",
            &[
                Answer("A2 01040000000000"),
                Sends("01 0708090A0B0C0D"),
                Sends("02 0E0F1011121314"),
                Sends("03 15161718191A1B"),
                Sends("84 1C1D0000000000"),
                Answer("A2 04040000000000"),
            ],
        ),
        (
            "all but the last, and the next block is shorter",
            &[
                Answer("A2 02010000000000"),
                Sends("01 0E0F1011121314"),
                Answer("A2 01030000000000"),
                S4,
                S5,
                Answer(ACK_2),
            ],
        ),
        (
            "half of the last block",
            &[
                Answer(ACK_3),
                S4,
                S5,
                Answer("A2 01030000000000"),
                Sends("81 1C1D0000000000"),
                Answer("A2 01030000000000"),
            ],
        ),
        (
            "nothing of the last block",
            &[
                Answer(ACK_3),
                S4,
                S5,
                Answer("A2 00010000000000"),
                S4,
                Answer("A2 01010000000000"),
                Sends("81 1C1D0000000000"),
                Answer("A2 01010000000000"),
            ],
        ),
    ];
    for (what, lines) in cases {
        writes(what, attempts(1), &[&FIRST[..], lines, &ends].concat());
    }
}

#[test]
fn more_than_was_sent_cannot_be_confirmed() {
    for (ack, received) in [("A2 04030000000000", 4), ("A2 FF030000000000", 255)] {
        let lines = [&FIRST[..], &[Answer(ack), Sends("80 452306 03000405")]].concat();
        let failure = Failure::Sequence {
            expected: 3,
            received,
        };
        fails(ack, attempts(2), &lines, failure);
    }
}

/// A server that never takes anything would go on for ever.
#[test]
fn blocks_of_which_nothing_arrives_end_the_transfer() {
    let mut lines = FIRST.to_vec();
    for _ in 0..7 {
        lines.extend([Answer("A2 00030000000000"), S1, S2, S3]);
    }
    lines.extend([Answer("A2 00030000000000"), Sends("80 452306 03000405")]);
    let failure = Failure::Sequence {
        expected: 3,
        received: 0,
    };
    fails("nothing", attempts(2), &lines, failure);
}

/// The last segment may have been lost, or the confirmation.
#[test]
fn after_silence_the_last_segment_is_sent_again() {
    let ends = [end(30, 5), ENDED];
    let rest = [&ack(ACK_3)[..], &SECOND, &ack(ACK_2), &ends].concat();
    let lost = [&FIRST[..], &LAPSE, &[S3]].concat();
    writes("segment", attempts(2), &[&lost[..], &rest].concat());
    // It tells the server that the block is over: more was lost than the last segment.
    let partly = [
        &lost[..],
        &[Answer("A2 01030000000000")],
        &[
            Sends("01 0708090A0B0C0D"),
            Sends("02 0E0F1011121314"),
            Sends("03 15161718191A1B"),
            Answer(ACK_3),
            Sends("81 1C1D0000000000"),
            Answer("A2 01030000000000"),
        ],
        &ends,
    ];
    writes("segments", attempts(2), &partly.concat());
    // Nothing of which block? The transfer begins anew.
    let nothing = [Answer("A2 00030000000000"), TIMED_OUT];
    let again = [&lost[..], &nothing, &FIRST, &rest].concat();
    writes("confirmation", attempts(2), &again);
    let failure = Failure::TimedOut {
        stage: Stage::Block,
    };
    let once = [&FIRST[..], &LAPSE, &[TIMED_OUT]].concat();
    fails("once", attempts(1), &once, failure);
    let twice = [&lost[..], &LAPSE, &[TIMED_OUT]].concat();
    fails(
        "twice",
        attempts(2),
        &[&twice[..], &twice].concat(),
        failure,
    );
    // The server does not like a number that its next, shorter block does not have.
    let refused = [&lost[..], &[Answer("80 452306 03000405")]].concat();
    writes(
        "refused",
        attempts(2),
        &[&refused[..], &FIRST, &rest].concat(),
    );
    // In the last block.
    let last = [
        &FIRST[..],
        &ack(ACK_3),
        &SECOND,
        &LAPSE,
        &[S5],
        &ack(ACK_2),
        &ends,
    ];
    writes("last block", attempts(2), &last.concat());
}

/// It would be number 1 of the next block if the confirmation was lost.
#[test]
fn the_only_segment_of_a_block_is_not_sent_again() {
    let begin = [ASK, Answer("A4 452306 01000000"), S1];
    let lines = [
        &begin[..],
        &LAPSE,
        &[TIMED_OUT],
        &begin,
        &LAPSE,
        &[TIMED_OUT],
    ]
    .concat();
    let failure = Failure::TimedOut {
        stage: Stage::Block,
    };
    fails("one segment", attempts(2), &lines, failure);
}

#[test]
fn a_lost_end_is_repeated() {
    let all = [&FIRST[..], &ack(ACK_3), &SECOND, &ack(ACK_2), &[end(30, 5)]].concat();
    let lines = [&all[..], &LAPSE, &[end(30, 5), ENDED]].concat();
    writes("end", attempts(2), &lines);
    let failure = Failure::TimedOut { stage: Stage::End };
    fails(
        "end",
        attempts(1),
        &[&all[..], &LAPSE, &[TIMED_OUT]].concat(),
        failure,
    );
    // If only the confirmation was lost, the server knows of no transfer any more. Nobody can say
    // then whether the object was written, so it is written again.
    let refused = [
        &all[..],
        &LAPSE,
        &[end(30, 5), Answer("80 452306 01000405")],
    ]
    .concat();
    let again = [&refused[..], &all, &[ENDED]].concat();
    writes("again", attempts(2), &again);
    let failure = Failure::Aborted(Abort::COMMAND);
    fails(
        "again",
        attempts(2),
        &[&refused[..], &refused].concat(),
        failure,
    );
    // The server found a wrong checksum.
    let refused = [&all[..], &[Answer("80 452306 04000405")]].concat();
    fails(
        "checksum",
        attempts(2),
        &refused,
        Failure::Aborted(Abort::CRC),
    );
}

#[test]
fn doubled_answers_count_once() {
    let (three, two) = (Answer(ACK_3), Answer(ACK_2));
    let lines = [
        &[ASK, BEGIN, Interrupt, BEGIN][..],
        &FIRST[2..],
        &[Stale("60 452306 00000000")],
        &[three, Interrupt, three, S4, Interrupt, three, S5],
        &[two, Interrupt, two, end(30, 5), two, ENDED],
    ];
    writes("doubled", attempts(1), &lines.concat());
}

#[test]
fn what_is_no_confirmation_is_aborted() {
    const COMMAND: Line = Sends("80 452306 01000405");
    let all = [&FIRST[..], &ack(ACK_3), &SECOND, &ack(ACK_2), &[end(30, 5)]].concat();
    for (frame, command) in [
        ("20 00000000000000", 0x20),
        ("A3 00000000000000", 0xA3),
        ("C1 00000000000000", 0xC1),
        ("E0 00000000000000", 0xE0),
    ] {
        let wrong = [Answer(frame), COMMAND];
        let failure = Failure::Command { command };
        fails(frame, attempts(2), &[&FIRST[..], &wrong].concat(), failure);
        fails(frame, attempts(2), &[&all[..], &wrong].concat(), failure);
    }
    let early = [Answer("A1 00000000000000"), COMMAND];
    let failure = Failure::Command { command: 0xA1 };
    fails(
        "early end",
        attempts(2),
        &[&FIRST[..], &early].concat(),
        failure,
    );
    let late = [Answer("A2 01010000000000"), COMMAND];
    let failure = Failure::Command { command: 0xA2 };
    fails(
        "late block",
        attempts(2),
        &[&all[..], &late].concat(),
        failure,
    );
}

/// Also in the middle of a block, when the client has more to send.
#[test]
fn the_server_and_the_caller_may_abort_at_every_step() {
    let all = [&FIRST[..], &ack(ACK_3), &SECOND, &ack(ACK_2), &[end(30, 5)]].concat();
    for (abort, told, failure) in [
        (
            Answer("80 452306 22000008"),
            None,
            Failure::Aborted(Abort::DEVICE_STATE),
        ),
        (
            Cancel(Abort::GENERAL),
            Some(Sends("80 452306 00000008")),
            Failure::Cancelled(Abort::GENERAL),
        ),
    ] {
        for cut in 1..=all.len() {
            let mut lines = all[..cut].to_vec();
            lines.push(Interrupt);
            lines.push(abort);
            lines.extend(told);
            fails("abort", attempts(2), &lines, failure);
        }
    }
}
