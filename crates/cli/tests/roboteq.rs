//! The Roboteq's transcripts, and its numbers of channels on the command line.

mod support;

use std::path::{Path, PathBuf};

use support::printed;

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../transcripts/roboteq");
    let entries = std::fs::read_dir(folder).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn every_transcript_passes() {
    let files = files();
    let count = files.len();
    assert!(count >= 4);
    for seed in ["0", "7"] {
        let mut words = vec!["play", "--virtual", "--seed", seed];
        words.extend(files.iter().map(|file| file.to_str().unwrap()));
        let text = printed(&words, 0);
        assert!(
            text.ends_with(&format!("{count} transcripts: {count} passed, 0 failed\n")),
            "{text}"
        );
    }
}

#[test]
fn channels_choose_the_controller() {
    for (channels, name) in [("1", "roboteq"), ("2", "roboteq-2"), ("3", "roboteq-3")] {
        let by_number = printed(&["eds", "roboteq", "--channels", channels], 0);
        assert_eq!(by_number, printed(&["eds", name], 0));
        let words = ["sim", "--drive", "roboteq", "--channels", channels];
        let rest = [
            "--nodes", "4", "--bus", "none", "--for", "100ms", "--speed", "max",
        ];
        let ready = printed(&[words.as_slice(), &rest].concat(), 0);
        let expected = format!("ready: 1 virtual {name} drive, node 4");
        assert!(ready.contains(&expected), "{ready}");
    }
}

#[test]
fn numbers_of_channels_that_a_drive_does_not_have_are_refused() {
    for (drive, channels) in [("roboteq", "4"), ("roboteq", "0"), ("p3", "2")] {
        printed(&["eds", drive, "--channels", channels], 2);
    }
}
