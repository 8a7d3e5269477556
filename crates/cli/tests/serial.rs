//! `servobus sim --serial`: what it offers, and what it refuses.

mod support;

use support::{printed, run};

/// What is said of these words, which are refused.
fn refused(words: &[&str]) -> String {
    let output = run(&[&["sim", "--bus", "none", "--for", "50ms"], words].concat());
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{text}");
    text
}

#[test]
fn the_lines_are_printed_with_their_drives_and_the_port_that_they_have() {
    let words = ["--drive", "roboteq", "--nodes", "1-3"];
    let serial = [
        "--serial",
        "tcp://127.0.0.1:0",
        "--serial",
        "1=tcp://localhost:0",
    ];
    let words = [
        &["sim", "--bus", "none", "--for", "50ms"],
        words.as_slice(),
        &serial,
    ]
    .concat();
    let text = printed(&words, 0);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "ready: 3 virtual roboteq drives, nodes 1-3");
    // The first one was taken, so it is the second one's.
    let places = [
        ("serial tcp://127.0.0.1:", " node 2"),
        ("serial tcp://localhost:", " node 1"),
    ];
    for (line, (before, after)) in lines[1..].iter().zip(places) {
        let port = line
            .strip_prefix(before)
            .and_then(|rest| rest.strip_suffix(after));
        let port: u16 = port.unwrap_or_else(|| panic!("{line}")).parse().unwrap();
        assert_ne!(port, 0);
    }
}

#[cfg(unix)]
#[test]
fn a_terminal_is_printed_by_its_name() {
    let words = [
        "sim", "--bus", "none", "--for", "50ms", "--drive", "roboteq",
    ];
    let text = printed(
        &[words.as_slice(), &["--nodes", "7", "--serial", "pty"]].concat(),
        0,
    );
    let line = text.lines().nth(1).unwrap();
    assert!(
        line.starts_with("serial /dev/") && line.ends_with(" node 7"),
        "{line}"
    );
}

#[test]
fn what_cannot_be_is_refused_with_what_to_do() {
    let pty = "--serial";
    let rows: &[(&[&str], &str)] = &[
        (
            &[pty, "pty"],
            "no drive is left that has a serial command line; use --drive roboteq",
        ),
        (
            &[pty, "2=pty"],
            "p3 has no serial command line; use --drive roboteq",
        ),
        (&[pty, "9=pty"], "there is no drive with node ID 9"),
        (
            &["--drive", "roboteq", "--nodes", "1", pty, "pty", pty, "pty"],
            "no drive is left",
        ),
        (
            &["--drive", "roboteq", pty, "2=pty", pty, "2=pty"],
            "names drive 2 twice",
        ),
        (
            &["--drive", "roboteq", pty, "tcp://0.0.0.0:0"],
            "allow it by --expose",
        ),
        (
            &["--drive", "roboteq", pty, "pty", "--speed", "max"],
            "--speed max with --serial",
        ),
        (
            &["--drive", "roboteq", pty, "/dev/ttyS0"],
            "write tcp://127.0.0.1:29540 or pty",
        ),
        (&["--drive", "roboteq", pty, "x=pty"], "'x' is no node ID"),
    ];
    for (words, message) in rows {
        let text = refused(words);
        // The message is wrapped as wide as a terminal may be.
        let text = text.split_whitespace().collect::<Vec<&str>>().join(" ");
        assert!(text.contains(message), "{words:?}: {text}");
    }
}
