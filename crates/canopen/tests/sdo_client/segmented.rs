//! Segmented transfers (CiA 301 7.2.4.3.3 to 7.2.4.3.8).

use canopen::Abort;
use canopen::sdo_client::{Failure, Method, Settings, Stage};

use crate::dialogue::*;

const ASK: Line = Sends("40 452306 00000000");
const ASK_0: Line = Sends("60 00000000000000");
const ASK_1: Line = Sends("70 00000000000000");
const WRITE_9: Line = Sends("21 452306 09000000");
const WRITTEN: Line = Answer("60 452306 00000000");
const FIRST: Line = Sends("00 00010203040506");
const SECOND: Line = Sends("1B 07080000000000");
const TIMED_OUT: Line = Sends("80 452306 00000405");

fn reads(what: &str, settings: Settings, lines: &[Line], bytes: usize) {
    let outcome = done(bytes as u32);
    let read = upload(what, settings, Method::Segmented, lines, outcome);
    assert_eq!(read, pattern(bytes), "{what}");
}

fn fails(what: &str, settings: Settings, lines: &[Line], failure: Failure) {
    upload(what, settings, Method::Segmented, lines, Err(failure));
}

fn writes(what: &str, settings: Settings, lines: &[Line]) {
    download(
        what,
        settings,
        Method::Segmented,
        &pattern(9),
        lines,
        done(9),
    );
}

fn write_fails(what: &str, settings: Settings, lines: &[Line], failure: Failure) {
    download(
        what,
        settings,
        Method::Segmented,
        &pattern(9),
        lines,
        Err(failure),
    );
}

#[test]
fn segments_are_asked_for_by_alternating_toggle_bits() {
    for (begin, total) in [
        ("41 452306 10000000", Some(16)),
        ("40 452306 00000000", None),
        // As short as the standard does not allow, but nothing is missing.
        ("40 452306", None),
    ] {
        let lines = [
            ASK,
            Answer(begin),
            ASK_0,
            Progress(0, total),
            Answer("00 00010203040506"),
            ASK_1,
            Progress(7, total),
            Answer("10 0708090A0B0C0D"),
            ASK_0,
            // n = 5: two bytes count, whatever stands behind them.
            Answer("0B 0E0F FFFFFFFFFF"),
        ];
        reads(begin, Settings::DEFAULT, &lines, 16);
    }
}

/// n counts the unused bytes of a segment, of any segment.
#[test]
fn every_number_of_bytes_in_a_last_segment() {
    let texts = [
        "0F 00000000000000",
        "0D 00000000000000",
        "0B 00010000000000",
        "09 00010200000000",
        "07 00010203000000",
        "05 00010203040000",
        "03 00010203040500",
        "01 00010203040506",
    ];
    for (bytes, text) in texts.into_iter().enumerate() {
        let size = format!("41 452306 0{bytes}000000");
        let size: &'static str = size.leak();
        for begin in [size, "40 452306 00000000"] {
            let lines = [ASK, Answer(begin), ASK_0, Answer(text)];
            reads(text, Settings::DEFAULT, &lines, bytes);
        }
        let request: &'static str = format!("21 452306 0{bytes}000000").leak();
        let lines = [
            Sends(request),
            WRITTEN,
            Sends(text),
            Answer("20 00000000000000"),
        ];
        let data = pattern(bytes);
        let outcome = done(bytes as u32);
        download(
            text,
            Settings::DEFAULT,
            Method::Segmented,
            &data,
            &lines,
            outcome,
        );
    }
    // Segments that are not full in the middle, as long as what they carry.
    let lines = [
        ASK,
        Answer("41 452306 03000000"),
        ASK_0,
        Answer("0C 00"),
        ASK_1,
        Answer("1E"),
        ASK_0,
        Answer("0B 0102"),
    ];
    reads("short segments", Settings::DEFAULT, &lines, 3);
}

#[test]
fn a_segment_shorter_than_it_says_is_no_answer() {
    let lines = [
        ASK,
        Answer("41 452306 07000000"),
        ASK_0,
        Stale("01 000102030405"),
        Answer("01 00010203040506"),
    ];
    reads("truncated", Settings::DEFAULT, &lines, 7);
    let lines = [ASK, Stale("41 452306 070000"), Answer("4F 452306 00")];
    reads("no room for the size", Settings::DEFAULT, &lines, 1);
}

#[test]
fn the_indicated_size_is_held() {
    let more = [
        ASK,
        Answer("41 452306 08000000"),
        ASK_0,
        Answer("00 00010203040506"),
        ASK_1,
        Answer("1B 07080000000000"),
        Sends("80 452306 12000706"),
    ];
    let failure = Failure::Size {
        indicated: 8,
        received: 9,
    };
    fails("more", attempts(2), &more, failure);
    let less = [
        ASK,
        Answer("41 452306 08000000"),
        ASK_0,
        Answer("01 00010203040506"),
        Sends("80 452306 13000706"),
    ];
    let failure = Failure::Size {
        indicated: 8,
        received: 7,
    };
    fails("less", attempts(2), &less, failure);
}

#[test]
fn a_download_is_segments_with_alternating_toggle_bits() {
    let lines = [
        WRITE_9,
        WRITTEN,
        FIRST,
        Progress(0, Some(9)),
        Answer("20 00000000000000"),
        SECOND,
        Progress(7, Some(9)),
        Answer("30 00000000000000"),
        Progress(9, Some(9)),
    ];
    writes("download", Settings::DEFAULT, &lines);
}

#[test]
fn a_wrong_toggle_bit_is_aborted() {
    const TOGGLE: Line = Sends("80 452306 00000305");
    let begin = Answer("40 452306 00000000");
    let first = [ASK, begin, ASK_0, Answer("10 00010203040506"), TOGGLE];
    fails("upload", attempts(2), &first, Failure::Toggle { offset: 0 });
    let second = [
        ASK,
        begin,
        ASK_0,
        Answer("00 00010203040506"),
        ASK_1,
        Answer("00 0708090A0B0C0D"),
        TOGGLE,
    ];
    fails(
        "upload",
        attempts(2),
        &second,
        Failure::Toggle { offset: 7 },
    );
    let first = [WRITE_9, WRITTEN, FIRST, Answer("30 00000000000000"), TOGGLE];
    write_fails(
        "download",
        attempts(2),
        &first,
        Failure::Toggle { offset: 0 },
    );
}

/// CAN repeats a frame whose last bit was disturbed at its sender. A server whose bit does not
/// alternate looks the same, but nothing else comes.
#[test]
fn a_doubled_answer_is_passed_over_and_nothing_but_that_is_a_wrong_toggle_bit() {
    const TOGGLE: Line = Sends("80 452306 00000305");
    let begin = [
        ASK,
        Answer("41 452306 09000000"),
        Interrupt,
        Answer("41 452306 09000000"),
        ASK_0,
        Stale("43 452306 01020304"),
        Answer("00 00010203040506"),
    ];
    let twice = [
        ASK_1,
        Answer("00 00010203040506"),
        Answer("00 00010203040506"),
    ];
    let right = [Answer("1B 07080000000000")];
    let lines = [&begin[..], &twice, &right].concat();
    reads("upload", Settings::DEFAULT, &lines, 9);
    let lines = [&begin[..], &twice, &[Wait(500), TOGGLE]].concat();
    fails("upload", attempts(2), &lines, Failure::Toggle { offset: 7 });
    let lines = [
        WRITE_9,
        WRITTEN,
        FIRST,
        Stale("60 452306 01000000"),
        Answer("20 00000000000000"),
        SECOND,
        Answer("20 00000000000000"),
        Answer("30 00000000000000"),
    ];
    writes("download", Settings::DEFAULT, &lines);
    let lines = [&lines[..7], &[Wait(500), TOGGLE]].concat();
    write_fails(
        "download",
        attempts(2),
        &lines,
        Failure::Toggle { offset: 7 },
    );
}

#[test]
fn what_is_no_answer_to_a_segment_is_aborted() {
    const COMMAND: Line = Sends("80 452306 01000405");
    for (wrong, command) in [
        ("20 00000000000000", 0x20),
        ("A1 00000000000000", 0xA1),
        ("C1 00000000000000", 0xC1),
        ("E0 00000000000000", 0xE0),
    ] {
        let lines = [
            ASK,
            Answer("40 452306 00000000"),
            ASK_0,
            Answer(wrong),
            COMMAND,
        ];
        fails(wrong, attempts(2), &lines, Failure::Command { command });
    }
    for (wrong, command) in [
        ("00 00000000000000", 0x00),
        ("A2 01010000000000", 0xA2),
        ("E0 00000000000000", 0xE0),
    ] {
        let lines = [WRITE_9, WRITTEN, FIRST, Answer(wrong), COMMAND];
        write_fails(wrong, attempts(2), &lines, Failure::Command { command });
    }
}

/// With the object's address, or without any: not with another's.
#[test]
fn the_server_may_abort_between_segments() {
    let failure = Failure::Aborted(Abort::DEVICE_STATE);
    for abort in ["80 452306 22000008", "80 000000 22000008"] {
        let begin = [ASK, Answer("40 452306 00000000"), ASK_0];
        let abort = [Answer(abort)];
        let more = [Answer("00 00010203040506"), ASK_1];
        fails(
            "upload",
            attempts(2),
            &[&begin[..], &abort].concat(),
            failure,
        );
        let lines = [&begin[..], &more, &abort].concat();
        fails("upload", attempts(2), &lines, failure);
        let begin = [WRITE_9, WRITTEN, FIRST];
        let more = [Answer("20 00000000000000"), SECOND];
        write_fails(
            "download",
            attempts(2),
            &[&begin[..], &abort].concat(),
            failure,
        );
        let lines = [&begin[..], &more, &abort].concat();
        write_fails("download", attempts(2), &lines, failure);
    }
}

#[test]
fn the_caller_may_give_up_between_segments() {
    let told = Sends("80 452306 00000008");
    let begin = [ASK, Answer("40 452306 00000000"), ASK_0];
    let more = [Answer("00 00010203040506"), ASK_1];
    let end = [Cancel(Abort::GENERAL), told, Stale("10 00010203040506")];
    let failure = Failure::Cancelled(Abort::GENERAL);
    fails("upload", attempts(2), &[&begin[..], &end].concat(), failure);
    fails(
        "upload",
        attempts(2),
        &[&begin[..], &more, &end].concat(),
        failure,
    );
    let begin = [WRITE_9, WRITTEN, FIRST];
    let more = [Answer("20 00000000000000"), SECOND];
    write_fails(
        "download",
        attempts(2),
        &[&begin[..], &end].concat(),
        failure,
    );
    write_fails(
        "download",
        attempts(2),
        &[&begin[..], &more, &end].concat(),
        failure,
    );
}

/// The request is not repeated: the server may have gone on already.
#[test]
fn a_lost_segment_begins_the_transfer_anew_or_ends_it() {
    let timed_out = Failure::TimedOut {
        stage: Stage::Segment,
    };
    let begin = [
        ASK,
        Answer("41 452306 09000000"),
        ASK_0,
        Answer("00 00010203040506"),
        ASK_1,
    ];
    let lost = [Wait(499), Wait(1), TIMED_OUT];
    let end = [Answer("1B 07080000000000")];
    fails(
        "upload",
        attempts(1),
        &[&begin[..], &lost].concat(),
        timed_out,
    );
    let lines = [&begin[..], &lost, &begin, &lost].concat();
    fails("upload", attempts(2), &lines, timed_out);
    let lines = [&begin[..], &lost, &begin, &end].concat();
    reads("upload", attempts(2), &lines, 9);
    // What was lost comes late: it is not taken for the answer to the new first request.
    let late = [ASK, Stale("1B 07080000000000")];
    let lines = [&begin[..], &lost, &late, &begin[1..], &end].concat();
    reads("upload", attempts(2), &lines, 9);

    let begin = [WRITE_9, WRITTEN, FIRST, Answer("20 00000000000000"), SECOND];
    let end = [Answer("30 00000000000000")];
    write_fails(
        "download",
        attempts(1),
        &[&begin[..], &lost].concat(),
        timed_out,
    );
    let lines = [&begin[..], &lost, &begin, &end].concat();
    writes("download", attempts(2), &lines);
}
