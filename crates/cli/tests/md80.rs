//! The MD80 on the command line: its transcripts, and a drive out of the box.

mod support;

use std::path::{Path, PathBuf};

use support::printed;

#[test]
fn every_transcript_passes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../transcripts/md80");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    let count = files.len();
    assert!(count >= 5);
    for seed in ["0", "7"] {
        let mut words = vec!["play", "--virtual", "--seed", seed];
        words.extend(files.iter().map(|file| file.to_str().unwrap()));
        let text = printed(&words, 0);
        assert!(
            text.ends_with(&format!("{count} transcripts: {count} passed, 0 failed\n")),
            "{text}"
        );
        assert!(!text.contains("NOT CHECKED"), "{text}");
    }
}
