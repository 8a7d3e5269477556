//! The runner against a bus that follows a script: what passes, what fails, and what is said.

mod support;

use client::block_on;
use client::transcript::{FailureKind, Options, Report, Transcript, WithoutPhysics, play};
use support::{Scripted, words_of};

fn run(text: &str, mut link: Scripted) -> (Report, Scripted) {
    let transcript = Transcript::parse("t.txt", text).unwrap_or_else(|error| panic!("{error}"));
    let options = Options {
        drive: words_of(&personalities::p3::P3),
        ..Options::default()
    };
    let report = block_on(play(&transcript, &mut link, &options));
    (report, link)
}

fn failure(text: &str, link: Scripted) -> String {
    let (report, _) = run(text, link);
    report
        .failure
        .unwrap_or_else(|| panic!("passed: {text}"))
        .to_string()
}

const ACK: &str = "581#6040600000000000";

#[test]
fn a_difference_shows_both_frames_and_what_they_mean() {
    let link = Scripted::new().on("601#2260600004", &[(430, "581#8060600022000008")]);
    let text = "0x601 5 22 60 60 00 04  Mode\n0x581 8 60 60 60 00 00 00 00 00\n";
    assert_eq!(
        failure(text, link),
        "t.txt:2: another frame came than expected\n\
        \x20 expected  0x581 8 60 60 60 00 00 00 00 00\n\
        \x20           node 1 has written 0x6060,0 Set mode of operation\n\
        \x20 received  0x581 8 80 60 60 00 22 00 00 08   after 430 us\n\
        \x20           node 1 refuses 0x6060,0 Set mode of operation: 0x08000022 data cannot be \
         transferred or stored because of the present device state\n\
        \x20 differs   byte 0: 60 expected, 80 received\n\
        \x20 differs   byte 4: 00 expected, 22 received\n\
        \x20 differs   byte 7: 00 expected, 08 received"
    );
}

#[test]
fn a_missing_frame_is_waited_for_as_long_as_the_line_allows() {
    let text = "0x000 2 81 01\n(within 250 ms)\n0x701 1 00  Boot-up\n";
    let late = || Scripted::new().on("000#8101", &[(250_001, "701#00")]);
    let (report, link) = run(text, late());
    let said = report.failure.unwrap().to_string();
    assert_eq!(
        said,
        "t.txt:3: no frame came within 250 ms\n  expected  0x701 1 00\n            node 1 boot-up"
    );
    // 100 ms to settle, 250 ms waited.
    assert_eq!(link.now_ns, 350_000_000);
    assert_eq!(report.duration_ns, 350_000_000);
    let just = Scripted::new().on("000#8101", &[(250_000, "701#00")]);
    assert!(run(text, just).0.passed());
    // Without "within" the limit holds, 100 ms at first.
    let text = "0x000 2 81 01\n0x701 1 00\n";
    assert!(
        !run(text, Scripted::new().on("000#8101", &[(100_001, "701#00")]))
            .0
            .passed()
    );
    let text = "limit 300 ms\n0x000 2 81 01\n0x701 1 00\n";
    assert!(run(text, late()).0.passed());
}

#[test]
fn a_frame_may_come_too_early() {
    let text = "0x000 2 01 01\n(between 90 ms and 110 ms)\n0x701 1 05\n";
    let after = |us| Scripted::new().on("000#0101", &[(us, "701#05")]);
    assert!(run(text, after(90_000)).0.passed());
    assert!(run(text, after(110_000)).0.passed());
    let said = failure(text, after(89_999));
    assert!(
        said.starts_with("t.txt:3: the frame came before 90 ms had passed"),
        "{said}"
    );
    assert!(failure(text, after(110_001)).contains("no frame came within 110 ms"));
}

#[test]
fn a_frame_that_is_not_listed_fails_wherever_it_comes() {
    let emergency = "081#1032050000000000";
    let listed = "0x601 6 22 40 60 00 86 00\n0x581 8 60 40 60 00 00 00 00 00\n";
    // Before the answer, before the next line, during a silence, after the end.
    let cases = [
        ("", [(1, emergency), (2, ACK)], 2),
        ("0x080 0\n", [(2, ACK), (2, emergency)], 3),
        ("(silence 20 ms)\n", [(1, ACK), (10_000, emergency)], 3),
        ("", [(1, ACK), (10_000, emergency)], 3),
    ];
    for (more, answers, line) in cases {
        let link = Scripted::new().on("601#224060008600", &answers);
        let said = failure(&format!("{listed}{more}"), link);
        assert!(said.starts_with(&format!("t.txt:{line}: ")), "{said}");
        assert!(
            said.contains("node 1 emergency 0x3210: bus over-voltage"),
            "{said}"
        );
        // An ignore rule lets it pass.
        for rule in [
            "ignore 0x081",
            "ignore 0x080/0x780",
            "ignore 0x081 8 10 32 ..",
        ] {
            let link = Scripted::new().on("601#224060008600", &answers);
            let (report, _) = run(&format!("{rule}\n{listed}{more}"), link);
            assert!(report.passed(), "{report}");
            assert_eq!(report.ignored, 1);
        }
        let link = Scripted::new().on("601#224060008600", &answers);
        assert!(
            !run(&format!("ignore heartbeats\n{listed}{more}"), link)
                .0
                .passed()
        );
    }
}

#[test]
fn ignoring_heartbeats_does_not_ignore_a_boot_up() {
    let text = "ignore heartbeats\n0x000 2 01 00\n(wait 50 ms)\n";
    let link = Scripted::new().on("000#0100", &[(10, "701#05"), (20, "705#7F")]);
    let (report, _) = run(text, link);
    assert!(report.passed(), "{report}");
    assert_eq!(report.ignored, 2);
    let link = Scripted::new().on("000#0100", &[(10, "701#00")]);
    assert!(failure(text, link).contains("node 1 boot-up"));
}

#[test]
fn frames_of_a_group_come_in_any_order() {
    let text = "0x000 2 81 00\nin any order\n  0x701 1 00\n  0x702 1 00\nend\n";
    for order in [["701#00", "702#00"], ["702#00", "701#00"]] {
        let link = Scripted::new().on("000#8100", &[(10, order[0]), (20, order[1])]);
        let (report, _) = run(text, link);
        assert!(report.passed(), "{report}");
        assert_eq!(report.matched, 2);
    }
    // Each is needed once.
    let link = Scripted::new().on("000#8100", &[(10, "701#00"), (20, "701#00")]);
    let said = failure(text, link);
    assert!(
        said.contains("expected  0x702 1 00") && !said.contains("expected  0x701"),
        "{said}"
    );
}

#[test]
fn bytes_are_captured_computed_with_and_sent() {
    let text = "0x601 4 40 08 30 01\n\
                0x581 8 42 08 30 01 $raw:2 00 00\n\
                let $bias = $raw / 16\n\
                0x601 6 22 09 30 01 $bias:2\n\
                0x581 8 60 09 30 01 00 00 00 00\n\
                0x601 4 40 09 30 01\n\
                0x581 8 42 09 30 01 $bias:2 00 00\n";
    let link = |last: &str| {
        Scripted::new()
            .on("601#40083001", &[(10, "581#4208300196720000")])
            .on("601#220930012907", &[(10, "581#6009300100000000")])
            .on("601#40093001", &[(10, last)])
    };
    let (report, link_after) = run(text, link("581#4209300129070000"));
    assert!(report.passed(), "{report}");
    assert_eq!(link_after.sent[1], "601#220930012907");
    // A variable that has its value is compared.
    let said = failure(text, link("581#4209300128070000"));
    assert!(
        said.contains("expected  0x581 8 42 09 30 01 29 07 00 00"),
        "{said}"
    );
    assert!(said.contains("byte 4: 29 expected, 28 received"), "{said}");
}

#[test]
fn a_value_that_does_not_fit_is_not_sent() {
    let text = "let $big = 65536\n0x601 6 22 71 60 00 $big:2\n";
    let (report, link) = run(text, Scripted::new());
    assert!(link.sent.is_empty());
    let said = report.failure.unwrap().to_string();
    assert!(
        said.contains("$big is 65536, which does not fit 2 bytes"),
        "{said}"
    );
    // -1 fits, as FF FF.
    let (report, link) = run("let $less = 0 - 1\n0x201 2 $less:2\n", Scripted::new());
    assert!(report.passed());
    assert_eq!(link.sent, ["201#FFFF"]);
}

#[test]
fn wildcards_leave_bits_bytes_and_lengths_open() {
    let text = |expected: &str| format!("0x080 0\n{expected}\n");
    let answer = || Scripted::new().on("080#", &[(10, "181#37020A0B")]);
    for fits in [
        "0x181 4 ?? 02 0A 0B",
        "0x181 4 3? ?2 ..",
        "0x181 4 27/6F 00/01 ?? 0B",
        "0x181 ? ..",
        "0x181 4 37 02 0A 0B",
        "< 0x181 4 ..",
    ] {
        let (report, _) = run(&text(fits), answer());
        assert!(report.passed(), "{fits}: {report}");
    }
    for differs in [
        "0x181 4 ?? 03 0A 0B",
        "0x181 4 4? ..",
        "0x181 4 23/6F ..",
        "0x181 3 ..",
        "0x182 4 ..",
        "0x181 ? 37 02 0A",
    ] {
        assert!(!run(&text(differs), answer()).0.passed(), "{differs}");
    }
    let said = failure(&text("0x181 4 23/6F .."), answer());
    assert!(
        said.contains("byte 0: 23 expected in the bits 6F, 37 received"),
        "{said}"
    );
}

#[test]
fn the_mark_decides_about_the_direction() {
    // We play the drive: its identifier is sent, the master's expected.
    let link = Scripted::new().on("181#05", &[(10, "201#06")]);
    let (report, link) = run("> 0x181 1 05\n< 0x201 1 06\n", link);
    assert!(report.passed(), "{report}");
    assert_eq!(link.sent, ["181#05"]);
}

#[test]
fn physics_is_asserted_where_there_is_some() {
    let bench = || Scripted {
        quantities: vec![("position", 150.0, "counts"), ("current", 0.07, "A")],
        ..Scripted::new()
    };
    let text = "assert node 1 position > 100 counts\nassert node 1 current = 0.07 +- 0.001 A\n";
    let (report, _) = run(text, bench());
    assert!(report.passed() && report.not_checked.is_empty());
    assert_eq!(report.assertions, 2);
    assert_eq!(
        failure("assert node 1 position < 100 counts", bench()),
        "t.txt:1: the drive is not as asserted\n  expected  node 1 position < 100 counts\n  \
         measured  node 1 position 150 counts"
    );
    assert!(failure("assert node 1 mass > 1 kg", bench()).contains("there are position, current"));
    assert!(failure("assert node 2 position > 1 counts", bench()).contains("there is no node 2"));
    assert!(failure("assert node 1 position > 1 rad", bench()).contains("in counts, not in rad"));

    let transcript = Transcript::parse("t.txt", text).unwrap();
    let mut real = WithoutPhysics(bench());
    let report = block_on(play(&transcript, &mut real, &Options::default()));
    assert!(report.passed());
    assert_eq!(report.not_checked.len(), 2);
    let said = report.to_string();
    assert!(said.contains("t.txt:1: NOT CHECKED"), "{said}");
}

#[test]
fn a_misprint_must_fail_at_its_last_line_and_there_only() {
    let block = "misprint M p.1: prints 07\n\
                 0x601 4 40 71 60 00\n\
                 0x581 8 42 71 60 00 07 00 00 00\n\
                 end\n\
                 0x080 0\n";
    let answers = |answer| Scripted::new().on("601#40716000", &[(10, answer)]);
    let (report, link) = run(block, answers("581#4271600064000000"));
    assert!(report.passed(), "{report}");
    assert_eq!(link.sent, ["601#40716000", "080#"]);
    assert_eq!(report.misprints[0].line, 1);
    assert!(
        report.misprints[0]
            .instead
            .contains("Target torque = 100 permille")
    );

    let (report, _) = run(block, answers("581#4271600007000000"));
    let Some(failure) = report.failure else {
        panic!("a right line passed as a misprint")
    };
    assert!(matches!(failure.kind, FailureKind::NoMisprint { .. }));
    // A failure before the last line is a failure.
    let longer = block.replace("end", "0x581 8 .. \nend");
    let (report, _) = run(&longer, answers("581#4271600064000000"));
    assert!(matches!(
        report.failure.unwrap().kind,
        FailureKind::Differs { .. }
    ));
}

#[test]
fn finally_is_carried_out_even_after_a_failure() {
    let text = "0x601 6 22 40 60 00 0F 00\n\
                0x581 8 60 40 60 00 00 00 00 00\n\
                0x201 2 64 00\n\
                finally\n\
                0x201 2 00 00\n\
                0x601 6 22 40 60 00 00 00\n\
                0x581 8 60 40 60 00 00 00 00 00\n";
    let (report, link) = run(text, Scripted::new());
    assert_eq!(report.failure.unwrap().line, 2);
    assert_eq!(
        link.sent,
        ["601#224060000F00", "201#0000", "601#224060000000"]
    );
    // Without one it is played like any other lines.
    let good = Scripted::new()
        .on("601#224060000F00", &[(10, ACK)])
        .on("601#224060000000", &[(10, ACK)]);
    let (report, _) = run(text, good);
    assert!(report.passed(), "{report}");
    assert_eq!(report.matched, 2);
}

#[test]
fn what_was_on_the_bus_before_is_dropped_unless_asked_for() {
    let text = "0x080 0\n";
    assert!(
        run(text, Scripted::new().at_us(50_000, "701#00"))
            .0
            .passed()
    );
    let early = Scripted::new().at_us(50_000, "701#00");
    assert!(run("settle 0 ms\n0x701 1 00\n", early).0.passed());
}

#[test]
fn a_lost_bus_ends_the_play() {
    let link = Scripted {
        broken: true,
        ..Scripted::new()
    };
    let said = failure("0x080 0\nfinally\n0x080 0\n", link);
    assert!(
        said.contains("t.txt:1: the bus is lost: script: the other end closed"),
        "{said}"
    );
}

#[test]
fn a_report_is_data_too() {
    let link = Scripted::new().on("601#2260600004", &[(430, "581#8060600022000008")]);
    let (report, _) = run("0x601 5 22 60 60 00 04\n0x581 8 60 ..\n", link);
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["failure"]["kind"], "differs");
    assert_eq!(json["failure"]["line"], 2);
    assert_eq!(json["failure"]["received"]["after_ns"], 430_000);
}
