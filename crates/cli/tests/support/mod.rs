//! The command as a user runs it: as a process.

#![allow(dead_code, reason = "each test file uses its part")]

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// `servobus` with these words.
pub(crate) fn servobus(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_servobus"));
    command.args(words).stdin(Stdio::null());
    command
}

/// Runs it to its end.
pub(crate) fn run(words: &[&str]) -> Output {
    servobus(words).output().unwrap()
}

/// What it printed, after it ended with this exit code.
pub(crate) fn printed(words: &[&str], code: i32) -> String {
    let output = run(words);
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{words:?}\n{out}\n{err}");
    if code == 0 {
        out
    } else {
        format!("{out}{err}")
    }
}

/// The transcripts in a folder of `transcripts/`, by name.
pub(crate) fn transcripts(folder: &str) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../transcripts");
    let entries = std::fs::read_dir(root.join(folder)).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// All of them pass, with two seeds, and nothing in them is left unchecked. There are at least `least`.
/// What was printed with each seed.
pub(crate) fn play_all(folder: &str, least: usize) -> [String; 2] {
    let files = transcripts(folder);
    let count = files.len();
    assert!(count >= least, "{count}");
    ["0", "7"].map(|seed| {
        let mut words = vec!["play", "--virtual", "--seed", seed];
        words.extend(files.iter().map(|file| file.to_str().unwrap()));
        let text = printed(&words, 0);
        assert!(
            text.ends_with(&format!("{count} transcripts: {count} passed, 0 failed\n")),
            "{text}"
        );
        assert!(!text.contains("NOT CHECKED"), "{text}");
        text
    })
}

/// A folder of its own, removed at the end unless the test failed.
#[derive(Debug)]
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn new() -> Folder {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("servobus-cli-{}-{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// A file in it, as text for an argument.
    pub(crate) fn file(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }
}

/// A running `servobus sim`.
#[derive(Debug)]
pub(crate) struct Sim {
    child: Child,
    output: BufReader<ChildStdout>,
    /// The line `ready: ...`.
    pub(crate) ready: String,
    /// The lines of the doors.
    pub(crate) doors: Vec<String>,
}

/// What a simulation had said when it had ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Sim {
    /// Starts it with these words, and a socketcand door at a free port.
    pub(crate) fn start(words: &[&str]) -> Sim {
        Sim::with_doors(&["socketcand://127.0.0.1:0"], words)
    }

    /// Starts it with these doors and words, and waits until it is ready.
    pub(crate) fn with_doors(doors: &[&str], words: &[&str]) -> Sim {
        let mut command = servobus(&["sim"]);
        for door in doors {
            command.args(["--bus", door]);
        }
        let mut child = command
            .args(words)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut output = BufReader::new(child.stdout.take().unwrap());
        let mut line = || {
            let mut line = String::new();
            output.read_line(&mut line).unwrap();
            line.trim_end().to_owned()
        };
        let ready = line();
        let doors = doors.iter().filter(|door| **door != "none");
        let doors = doors.map(|_| line()).collect();
        Sim {
            child,
            output,
            ready,
            doors,
        }
    }

    /// The first door's address.
    pub(crate) fn bus(&self) -> &str {
        let door = self.doors.first().expect("a door");
        door.split(' ').next().unwrap()
    }

    /// Sends a signal by name.
    pub(crate) fn signal(&self, name: &str) {
        let signal = format!("-{name}");
        let id = self.child.id().to_string();
        let status = Command::new("kill").args([&signal, &id]).status().unwrap();
        assert!(status.success());
    }

    /// Waits for its end.
    pub(crate) fn wait(mut self) -> Ended {
        let limit = Instant::now() + Duration::from_secs(30);
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(Instant::now() < limit, "the simulation does not end");
            std::thread::sleep(Duration::from_millis(5));
        };
        let mut stdout = String::new();
        self.output.read_to_string(&mut stdout).unwrap();
        let mut stderr = String::new();
        let mut errors = self.child.stderr.take().unwrap();
        errors.read_to_string(&mut stderr).unwrap();
        Ended {
            status,
            stdout,
            stderr,
        }
    }

    /// Ends it by SIGTERM, which must be clean.
    pub(crate) fn end(self) -> Ended {
        self.signal("TERM");
        let ended = self.wait();
        assert_eq!(ended.status.code(), Some(0), "{ended:?}");
        ended
    }
}

impl Drop for Sim {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
