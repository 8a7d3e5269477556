//! Every mistake in a transcript gets one message with its place and a remedy.

use canopen::NodeId;
use client::transcript::{Transcript, TranscriptError};
use proptest::prelude::*;

/// Text, line, column, what the message says, what the remedy says.
const MISTAKES: &[(&str, usize, usize, &str, &str)] = &[
    (
        "0x601 8 22 40 60 00 86 00",
        1,
        7,
        "the length is 8, but 6 bytes follow",
        "correct one",
    ),
    (
        "0x601 4 40 41 60 00 00",
        1,
        7,
        "the length is 4, but 5 bytes follow",
        "correct one",
    ),
    (
        "# fine\n\n0x601 4 40 4G 60 00",
        3,
        12,
        "\"4G\" is not a byte",
        "two hexadecimal digits",
    ),
    (
        "0x601 4 40 41 60 00 Read it",
        1,
        21,
        "\"Read\" is not a byte",
        "two blanks",
    ),
    ("0x601 9 00", 1, 7, "\"9\" is not a length", "0 to 8"),
    ("0x601", 1, 6, "the length is missing", "0 to 8"),
    ("0x901 0", 1, 1, "\"0x901\" is not an identifier", "0x7FF"),
    (
        "0x2FFFFFFF 0",
        1,
        1,
        "\"0x2FFFFFFF\" is not an identifier",
        "29-bit",
    ),
    ("601 0", 1, 1, "\"601\" begins no line", "write a frame"),
    (
        "0x601 4 40 ?? 60 00",
        1,
        12,
        "?? in a frame that is sent",
        "mark one with <",
    ),
    (
        "0x601 4 40 ..",
        1,
        12,
        ".. in a frame that is sent",
        "mark one with <",
    ),
    ("0x581 8 .. 40", 1, 12, "data after ..", "the last"),
    (
        "0x581 1 27/20",
        1,
        9,
        "27/20 asks for bits outside its mask",
        "20/20",
    ),
    (
        " < 0x581/0x7F0 1 00",
        1,
        4,
        "a mask on the identifier",
        "ignore",
    ),
    (
        "0x601 4 40 $raw:2 00",
        1,
        12,
        "$raw has no value here",
        "let $raw",
    ),
    (
        "0x581 4 40 $raw:5",
        1,
        12,
        "\"$raw:5\" has no size",
        "$raw:2",
    ),
    ("0x581 1 $1", 1, 9, "\"$1\" is not a variable", "a letter"),
    (
        "let $a = 1\nlet $a = 2",
        2,
        5,
        "$a has a value already",
        "another name",
    ),
    ("let $a = $b", 1, 10, "$b has no value here", "capture it"),
    ("let $a = (1 + 2", 1, 10, "not closed", "add the )"),
    ("let $a = 1 2", 1, 12, "\"2\" is too much here", "remove it"),
    ("let a = 1", 1, 5, "no variable", "let $name"),
    ("(Wait 1 fortnight)", 1, 9, "no unit of time", "ms"),
    ("(Wait)", 1, 6, "no duration", "20 ms"),
    ("wait 61 min", 1, 6, "more than an hour", "at most an hour"),
    ("(wait 20 ms", 1, 1, "not closed", "add the )"),
    (
        "between 20 ms and 10 ms\n0x701 1 05",
        1,
        15,
        "the end lies before the begin",
        "swap",
    ),
    (
        "(within 1 s)\n0x080 0",
        1,
        1,
        "no expected frame follows",
        "right before",
    ),
    (
        "within 1 s\nwithin 2 s\n0x701 1 00",
        1,
        1,
        "no expected frame follows",
        "right before",
    ),
    (
        "0x701 1 00\n  within 1 s",
        2,
        3,
        "no expected frame follows",
        "right before",
    ),
    (
        "in any order\n0x701 1 00",
        1,
        1,
        "this block has no end",
        "\"end\"",
    ),
    (
        "in any order\n0x080 0\nend",
        2,
        1,
        "not an expected frame",
        "mark one with <",
    ),
    (
        "in any order\nend",
        1,
        1,
        "an empty group",
        "list the frames",
    ),
    (
        "in some order\nend",
        1,
        1,
        "an unknown line",
        "in any order",
    ),
    ("end", 1, 1, "\"end\" without a block", "remove it"),
    (
        "misprint\n0x701 1 00\nend",
        1,
        1,
        "a misprint without a reason",
        "P3 l.324",
    ),
    (
        "misprint x\n0x080 0\nend",
        1,
        1,
        "nothing shows to be one",
        "expected frame",
    ),
    (
        "misprint x\nmisprint y\n0x701 1 00\nend\nend",
        2,
        1,
        "within a misprint",
        "end the first",
    ),
    (
        "0x080 0\n drive p3",
        2,
        2,
        "\"drive\" after the first step",
        "at the head",
    ),
    ("nodes 1 200", 1, 9, "\"200\" is not a node ID", "1 to 127"),
    ("nodes", 1, 6, "\"\" is not a node ID", "1 to 127"),
    ("drive", 1, 6, "no drive", "drive p3"),
    ("nodes 1 2 1", 1, 11, "node 1 is there already", "once"),
    (
        "nodes 1\nnode 1 = p3",
        2,
        6,
        "node 1 is there already",
        "once",
    ),
    ("node 2", 1, 7, "it does not say which drive", "node 2 = p3"),
    (
        "node 2 md80",
        1,
        8,
        "it does not say which drive",
        "node 2 = p3",
    ),
    (
        "node 2 =",
        1,
        8,
        "it does not say which drive",
        "node 2 = p3",
    ),
    ("node = p3", 1, 6, "\"=\"", "127"),
    ("node 2 = md80 p3", 1, 15, "too much", "remove"),
    (
        "assert node 1 position 100 counts",
        1,
        24,
        "\"100\" is not a comparison",
        ">=",
    ),
    (
        "assert node 1 position > fast",
        1,
        26,
        "\"fast\" is not a number",
        "100",
    ),
    (
        "assert node 1 position = 100 counts",
        1,
        30,
        "no tolerance",
        "+-",
    ),
    (
        "assert drive 1 position > 1",
        1,
        8,
        "no node",
        "assert node 1",
    ),
    (
        "finally\nfinally",
        2,
        1,
        "\"finally\" within a block",
        "one \"finally\"",
    ),
    (
        "ignore 0x701 1 $x",
        1,
        16,
        "a variable in an ignore rule",
        "??",
    ),
    // Columns are characters: µ is one.
    (
        "# µ\n\t\tgo µ",
        2,
        3,
        "\"go\" begins no line",
        "write a frame",
    ),
];

#[test]
fn each_mistake_is_named_with_its_place_and_a_remedy() {
    for &(text, line, column, message, remedy) in MISTAKES {
        let error = Transcript::parse("t.txt", text).expect_err(text);
        assert!(error.message.contains(message), "{text:?}: {error}");
        assert_eq!(
            (error.line, error.column),
            (line, column),
            "{text:?}: {error}"
        );
        assert!(error.remedy.contains(remedy), "{text:?}: {error}");
        let shown = error.to_string();
        assert!(
            shown.starts_with(&format!("t.txt:{line}:{column}: ")),
            "{shown}"
        );
        assert_eq!(shown.lines().count(), 1, "{shown}");
    }
}

#[test]
fn the_manuals_own_lines_are_taken_as_they_are_printed() {
    // Tabs between the columns, tabs before the wait, tags around the answer: p3.txt l.244-252.
    let text = "0x601\t6\t22 40 60 00 86 00\tClear Faults\n\
                \t\t\t(Wait 1 second)\n\
                0x581\t8\t42 08 30 01 96 72 00 00\t<i>Response: 0x7296</i>\n\
                0x080\t0\t\tSYNC\r\n\
                0x601 8 22 10 10 04 00 B0 21 00  Save the new ID to non-volatile memory\n";
    Transcript::parse("p3.txt", text).unwrap();
}

#[test]
fn a_file_that_cannot_be_read_or_is_no_text_is_said_to_be_so() {
    let missing = std::path::Path::new("no/such/transcript.txt");
    let error = Transcript::read(missing).unwrap_err();
    assert!(matches!(error, TranscriptError::Unreadable { .. }));
    let shown = error.to_string();
    assert!(
        shown.starts_with("no/such/transcript.txt: cannot be read"),
        "{shown}"
    );

    let file = std::env::temp_dir().join(format!("servobus-{}.bin", std::process::id()));
    std::fs::write(&file, b"drive p3\n# \xC2\xB5 \xFF\n").unwrap();
    let error = Transcript::read(&file).unwrap_err();
    std::fs::remove_file(&file).unwrap();
    let TranscriptError::Syntax(error) = error else {
        panic!("{error}")
    };
    // After "# µ " comes the fifth character.
    assert_eq!((error.line, error.column), (2, 5));
}

/// Pieces of the notation, so that random lines get far into the parser.
const PIECES: &[&str] = &[
    "0x601",
    "0x581",
    "0x",
    " ",
    "  ",
    "\t",
    "8",
    "4",
    "0",
    "40",
    "??",
    "..",
    "$a",
    "$a:2",
    "27/6F",
    "let ",
    "= ",
    "( ",
    ")",
    "+",
    "<<",
    "wait",
    "within",
    "between",
    " and ",
    "20 ms",
    "1 s",
    "ignore ",
    "heartbeats",
    "misprint ",
    "end",
    "finally",
    "in any order",
    "assert node 1 ",
    "nodes ",
    "node ",
    "drive",
    "limit",
    "silence",
    "settle",
    ">",
    "<",
    "#",
    "µ",
    "\u{FEFF}",
    "-1",
    "1e400",
    "/0x7F0",
    "position",
    "\n",
    "\n",
    "\n",
    "\r\n",
];

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn no_text_makes_the_parser_panic(text in any::<String>()) {
        let _ = Transcript::parse("t", &text);
    }

    #[test]
    fn no_mixture_of_the_notation_makes_the_parser_panic(
        pieces in prop::collection::vec(prop::sample::select(PIECES), 0..40)
    ) {
        let text = pieces.concat();
        if let Err(error) = Transcript::parse("t", &text) {
            let line = text.lines().nth(error.line - 1).unwrap_or("");
            // The place exists, or is the end of its line.
            prop_assert!(error.column <= line.chars().count() + 2, "{error}");
            prop_assert!(!error.remedy.is_empty());
        }
    }
}

#[test]
fn a_head_names_one_kind_of_drives_or_several() {
    let drives = |text: &str| {
        let transcript = Transcript::parse("t", text).unwrap();
        let header = transcript.header();
        let of = |node: &NodeId| format!("{node} {}", header.drive_of(*node).unwrap_or("-"));
        header.nodes.iter().map(of).collect::<Vec<_>>().join(", ")
    };
    assert_eq!(drives("drive p3\nnodes 1 2"), "1 p3, 2 p3");
    assert_eq!(drives("node 1 = p3\nNODE 4 = md80  # x"), "1 p3, 4 md80");
    assert_eq!(
        drives("node 2 = md80\nnodes 1 3\ndrive p3"),
        "2 md80, 1 p3, 3 p3"
    );
    assert_eq!(drives("nodes 1"), "1 -");
}
