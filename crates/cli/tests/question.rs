//! The question of `servobus calibrate` at a terminal, and every way of not answering it.

#![cfg(unix)]

mod support;

use std::fs::File;
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};

use nix::pty::openpty;
use support::{Sim, printed, servobus};

const OLD: &str = "= 2000";
const FOUND: &str = "= 1833";

fn sdo(bus: &str, words: &[&str]) -> String {
    let all = [&words[..1], &["--node", "1", "--bus", bus], &words[1..]].concat();
    printed(&[&["sdo"], &all[..]].concat(), 0)
}

/// A drive whose current sensor is not calibrated.
fn uncalibrated() -> Sim {
    let sim = Sim::start(&["--nodes", "1"]);
    sdo(sim.bus(), &["write", "0x3009", "1", "2000"]);
    sim
}

fn bias(bus: &str) -> String {
    sdo(bus, &["read", "0x3009", "1"])
}

/// The command at a terminal of which we have the other end.
struct Asked {
    child: Child,
    terminal: File,
    seen: String,
}

impl Asked {
    /// Runs up to the question.
    fn start(bus: &str) -> Asked {
        // Clones are closed in children: whoever inherited the other end would keep the terminal open.
        let (terminal, slave) = {
            let pair = openpty(None, None).unwrap();
            let terminal = pair.master.try_clone().unwrap();
            (File::from(terminal), pair.slave.try_clone().unwrap())
        };
        let slave = || Stdio::from(slave.try_clone().unwrap());
        let child = servobus(&["calibrate", "current-sensor", "--node", "1", "--bus", bus])
            .stdin(slave())
            .stderr(slave())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut asked = Asked {
            child,
            terminal,
            seen: String::new(),
        };
        while !asked.seen.contains("[y/N] ") {
            let mut bytes = [0; 256];
            let count = asked.terminal.read(&mut bytes).unwrap();
            asked
                .seen
                .push_str(&String::from_utf8_lossy(&bytes[..count]));
        }
        asked
    }

    fn answer(&mut self, line: &str) {
        self.terminal.write_all(line.as_bytes()).unwrap();
    }

    fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let sent = Command::new("kill").args([name, &id]).status().unwrap();
        assert!(sent.success());
    }

    /// The exit code, and what was said on standard output and at the terminal.
    fn end(mut self) -> (Option<i32>, String, String) {
        let mut output = String::new();
        let mut pipe = self.child.stdout.take().unwrap();
        pipe.read_to_string(&mut output).unwrap();
        let code = self.child.wait().unwrap().code();
        // Linux ends a terminal that nobody has open any more with an error.
        let mut bytes = Vec::new();
        let _ = self.terminal.read_to_end(&mut bytes);
        self.seen.push_str(&String::from_utf8_lossy(&bytes));
        (code, output, self.seen)
    }
}

#[test]
fn only_a_yes_saves() {
    let sim = uncalibrated();
    for answer in ["\n", "no\n", "\u{4}"] {
        let mut asked = Asked::start(sim.bus());
        asked.answer(answer);
        let (code, output, seen) = asked.end();
        assert_eq!(code, Some(0), "{answer:?}: {seen}");
        assert!(
            output.ends_with("node 1: not saved, the old values are back\n"),
            "{output}"
        );
        assert!(bias(sim.bus()).contains(OLD), "{answer:?}");
    }
    let mut asked = Asked::start(sim.bus());
    asked.answer("yes\n");
    let (code, output, seen) = asked.end();
    assert_eq!(code, Some(0), "{seen}");
    assert!(output.ends_with("node 1: saved\n"), "{output}");
    assert!(bias(sim.bus()).contains(FOUND));
    sim.end();
}

#[test]
fn ctrl_c_at_the_question_gives_the_old_values_back() {
    let sim = uncalibrated();
    for signal in ["-INT", "-TERM", "-HUP"] {
        let asked = Asked::start(sim.bus());
        assert!(bias(sim.bus()).contains(FOUND), "{signal}");
        asked.signal(signal);
        let (code, _, seen) = asked.end();
        assert_eq!(code, Some(1), "{seen}");
        assert!(
            seen.contains("error: node 1: stopped; not saved, the old values are back"),
            "{signal}: {seen}"
        );
        assert!(bias(sim.bus()).contains(OLD), "{signal}");
    }
    sim.end();
}

#[test]
fn a_terminal_that_goes_away_gives_the_old_values_back() {
    let sim = uncalibrated();
    let asked = Asked::start(sim.bus());
    let Asked {
        mut child,
        terminal,
        ..
    } = asked;
    drop(terminal);
    let code = child.wait().unwrap().code();
    assert_ne!(code, None);
    assert!(bias(sim.bus()).contains(OLD), "{code:?}");
    sim.end();
}

#[test]
fn results_that_nobody_reads_are_not_saved() {
    let sim = uncalibrated();
    let words = [
        "calibrate",
        "current-sensor",
        "--node",
        "1",
        "--yes",
        "--bus",
    ];
    let mut child = servobus(&[&words[..], &[sim.bus()]].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(
        error.contains(
            "error: node 1: nobody reads the results; not saved, the old values are back"
        ),
        "{error}"
    );
    assert!(bias(sim.bus()).contains(OLD), "{error}");
    sim.end();
}
