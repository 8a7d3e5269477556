//! Transfers in one exchange (CiA 301 7.2.4.3.3 and 7.2.4.3.6), and what begins all others.

use canopen::Abort;
use canopen::sdo_client::{
    Done, Failure, Method, NoData, RequestForm, Settings, Stage, StartError,
};

use crate::dialogue::*;

const ASK: Line = Sends("40 452306 00000000");

fn form(form: RequestForm) -> Settings {
    Settings {
        form,
        ..Settings::DEFAULT
    }
}

/// The size code is (4 - n) << 2; without it all bytes that came count.
#[test]
fn an_answer_carries_one_to_four_bytes() {
    let cases: [(&str, &[u8], bool); 9] = [
        ("4F 452306 11000000", &[0x11], true),
        ("4B 452306 11220000", &[0x11, 0x22], true),
        ("47 452306 11223300", &[0x11, 0x22, 0x33], true),
        ("43 452306 11223344", &[0x11, 0x22, 0x33, 0x44], true),
        ("42 452306 11220000", &[0x11, 0x22, 0, 0], false),
        // Answers as long as their contents.
        ("4F 452306 11", &[0x11], true),
        ("42 452306 1122", &[0x11, 0x22], false),
        ("42 452306", &[], false),
        // Shorter than it says.
        ("43 452306 1122", &[0x11, 0x22], false),
    ];
    for method in [Method::Expedited, Method::Segmented] {
        for (answer, bytes, is_sized) in cases {
            let outcome = Ok(Done {
                bytes: bytes.len() as u32,
                is_sized,
            });
            let lines = [ASK, Answer(answer)];
            let read = upload(answer, Settings::DEFAULT, method, &lines, outcome);
            assert_eq!(read, bytes, "{answer}");
        }
    }
}

#[test]
fn a_request_is_written_in_every_form() {
    use RequestForm::{Short, Sized, Unsized};
    let data = [0x11, 0x22, 0x33, 0x44];
    for (bytes, how, request) in [
        (1, Sized, "2F 452306 11000000"),
        (2, Sized, "2B 452306 11220000"),
        (3, Sized, "27 452306 11223300"),
        (4, Sized, "23 452306 11223344"),
        (1, Unsized, "22 452306 11000000"),
        (4, Unsized, "22 452306 11223344"),
        (1, Short, "22 452306 11"),
        (2, Short, "22 452306 1122"),
        (3, Short, "22 452306 112233"),
        (4, Short, "22 452306 11223344"),
    ] {
        let lines = [
            Sends(request),
            Progress(0, Some(bytes)),
            // What an acknowledge carries besides is not looked at (J1).
            Answer("60 452306 FFFFFFFF"),
            Progress(bytes, Some(bytes)),
        ];
        let data = &data[..bytes as usize];
        download(
            request,
            form(how),
            Method::Expedited,
            data,
            &lines,
            done(bytes),
        );
    }
    for how in [Sized, Unsized] {
        let lines = [ASK, Answer("4F 452306 01000000")];
        upload("upload", form(how), Method::Expedited, &lines, done(1));
    }
    let lines = [Sends("40 452306"), Answer("4F 452306 01000000")];
    upload("short", form(Short), Method::Expedited, &lines, done(1));
}

/// What begins a transfer of each kind, whatever the method and direction.
#[derive(Clone, Copy, Debug)]
struct Kind {
    name: &'static str,
    is_upload: bool,
    method: Method,
    request: &'static str,
    /// An answer that is possible, for another object; and one that no request can have.
    other: &'static str,
}

const KINDS: [Kind; 6] = [
    Kind {
        name: "expedited upload",
        is_upload: true,
        method: Method::Expedited,
        request: "40 452306 00000000",
        other: "43 452307 01020304",
    },
    Kind {
        name: "segmented upload",
        is_upload: true,
        method: Method::Segmented,
        request: "40 452306 00000000",
        other: "41 452206 08000000",
    },
    Kind {
        name: "block upload",
        is_upload: true,
        method: Method::Block,
        request: "A4 452306 7F150000",
        other: "C6 462306 08000000",
    },
    Kind {
        name: "expedited download",
        is_upload: false,
        method: Method::Expedited,
        request: "23 452306 00010203",
        other: "60 452307 00000000",
    },
    Kind {
        name: "segmented download",
        is_upload: false,
        method: Method::Segmented,
        request: "21 452306 04000000",
        other: "60 452307 00000000",
    },
    Kind {
        name: "block download",
        is_upload: false,
        method: Method::Block,
        request: "C6 452306 04000000",
        other: "A4 452307 05000000",
    },
];

fn run(kind: Kind, settings: Settings, lines: &[Line], outcome: Result<Done, Failure>) {
    if kind.is_upload {
        let read = upload(kind.name, settings, kind.method, lines, outcome);
        assert_eq!(read, [0; 0], "{}", kind.name);
    } else {
        let bytes = pattern(4);
        download(kind.name, settings, kind.method, &bytes, lines, outcome);
    }
}

#[test]
fn a_refusal_ends_the_transfer_and_is_not_answered() {
    for kind in KINDS {
        let lines = [Sends(kind.request), Answer("80 452306 00000206")];
        let refused = Err(Failure::Aborted(Abort::NO_OBJECT));
        run(kind, attempts(3), &lines, refused);
    }
}

/// Also an abort without address: before a transfer runs it may be about anything.
#[test]
fn what_names_another_object_is_stale() {
    for kind in KINDS {
        let lines = [
            Sends(kind.request),
            Stale(kind.other),
            Stale("80 452307 00000206"),
            Stale("80 000000 00000206"),
            // No address at all, or too short for one.
            Stale("00 11223344556677"),
            Stale("20"),
            Stale("80 4523"),
            Answer("80 452306 00000206"),
        ];
        let refused = Err(Failure::Aborted(Abort::NO_OBJECT));
        run(kind, Settings::DEFAULT, &lines, refused);
    }
}

#[test]
fn an_unknown_specifier_is_aborted() {
    for kind in KINDS {
        let lines = [
            Sends(kind.request),
            Answer("E0 452306 00000000"),
            Sends("80 452306 01000405"),
        ];
        let failure = Failure::Command { command: 0xE0 };
        run(kind, attempts(3), &lines, Err(failure));
    }
}

/// The answers of one kind of transfer to the request of another: late ones, for the same object.
#[test]
fn answers_of_another_kind_are_stale() {
    let answers = [
        ("43 452306 01020304", "upload"),
        ("41 452306 08000000", "upload"),
        ("60 452306 00000000", "download"),
        ("A4 452306 05000000", "block download"),
        ("C6 452306 08000000", "block upload"),
    ];
    for kind in KINDS {
        for (answer, of) in answers {
            let is_own = match kind.method {
                Method::Block => kind.name == of || (of == "upload" && kind.is_upload),
                _ => kind.name.ends_with(of) && !of.starts_with("block"),
            };
            if is_own {
                continue;
            }
            let lines = [
                Sends(kind.request),
                Stale(answer),
                Cancel(Abort::GENERAL),
                Sends("80 452306 00000008"),
            ];
            let cancelled = Err(Failure::Cancelled(Abort::GENERAL));
            run(kind, Settings::DEFAULT, &lines, cancelled);
        }
    }
}

#[test]
fn a_first_request_is_repeated_as_often_as_allowed() {
    for kind in KINDS {
        for count in 1..4 {
            let mut lines = Vec::new();
            for _ in 0..count {
                lines.extend([Sends(kind.request), Wait(499), Wait(1)]);
            }
            // A request that was everything leaves nothing behind that had to be cleared.
            if kind.method != Method::Expedited {
                lines.push(Sends("80 452306 00000405"));
            }
            run(kind, attempts(count), &lines, timed_out(Stage::Initiate));
            // No attempt is less than one.
            if count == 1 {
                run(kind, attempts(0), &lines, timed_out(Stage::Initiate));
            }
        }
        let lines = [
            Sends(kind.request),
            Wait(500),
            Sends(kind.request),
            Answer("80 452306 00000206"),
        ];
        let refused = Err(Failure::Aborted(Abort::NO_OBJECT));
        run(kind, attempts(2), &lines, refused);
    }
}

#[test]
fn the_caller_may_give_up_before_and_after_the_first_request() {
    let cancelled = Err(Failure::Cancelled(Abort::DEVICE_STATE));
    for kind in KINDS {
        // Nobody knows of the transfer yet.
        let mut client = client(Settings::DEFAULT);
        match kind.is_upload {
            true => client.upload(OBJECT, kind.method).unwrap(),
            false => client.download(OBJECT, 4, kind.method).unwrap(),
        }
        client.cancel(Abort::DEVICE_STATE);
        play(
            kind.name,
            &mut client,
            &[],
            cancelled,
            &mut NoData,
            &mut NoData,
        );
        let lines = [
            Sends(kind.request),
            Cancel(Abort::DEVICE_STATE),
            Sends("80 452306 22000008"),
            Stale("43 452306 01020304"),
            Stale("80 452306 22000008"),
        ];
        run(kind, attempts(3), &lines, cancelled);
    }
}

#[test]
fn an_expedited_upload_does_not_become_segmented() {
    for (answer, bytes) in [
        ("41 452306 15000000", Some(0x15)),
        ("40 452306 00000000", None),
    ] {
        let lines = [ASK, Answer(answer), Sends("80 452306 05000405")];
        let failure = Failure::NotExpedited { bytes };
        upload(answer, attempts(2), Method::Expedited, &lines, Err(failure));
    }
}

#[test]
fn an_expedited_download_has_one_to_four_bytes() {
    let mut client = client(Settings::DEFAULT);
    for bytes in [0, 5, u32::MAX] {
        let refused = client.download(OBJECT, bytes, Method::Expedited);
        assert_eq!(refused, Err(StartError::NotExpedited { bytes }));
    }
    client.download(OBJECT, 1, Method::Expedited).unwrap();
    let busy = Err(StartError::Busy);
    assert_eq!(client.download(OBJECT, 1, Method::Expedited), busy);
    assert_eq!(client.upload(OBJECT, Method::Expedited), busy);
}

#[test]
fn what_the_sink_or_the_source_refuses_is_aborted_or_never_begun() {
    let mut client = client(Settings::DEFAULT);
    let refused = Err(Failure::Refused(Abort::HARDWARE));
    let mut sink = |_: u32, _: &[u8]| Err(Abort::HARDWARE);
    client.upload(OBJECT, Method::Expedited).unwrap();
    let lines = [
        ASK,
        Answer("4F 452306 01000000"),
        Sends("80 452306 00000606"),
    ];
    play("sink", &mut client, &lines, refused, &mut sink, &mut NoData);
    // The same client, reused. The source has fewer bytes than were announced.
    client.download(OBJECT, 4, Method::Expedited).unwrap();
    let general = Err(Failure::Refused(Abort::GENERAL));
    let mut source: &[u8] = &[1, 2, 3];
    play(
        "source",
        &mut client,
        &[],
        general,
        &mut NoData,
        &mut source,
    );
}
