//! The transcripts of the P3 of 2016: every example message of its manual.

mod support;

use std::path::{Path, PathBuf};

use support::printed;

#[test]
fn every_transcript_passes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../transcripts/p3-jpl");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    let count = files.len();
    assert!(count >= 7);
    for seed in ["0", "7"] {
        let mut words = vec!["play", "--virtual", "--seed", seed];
        words.extend(files.iter().map(|file| file.to_str().unwrap()));
        let text = printed(&words, 0);
        assert!(
            text.ends_with(&format!("{count} transcripts: {count} passed, 0 failed\n")),
            "{text}"
        );
        assert!(!text.contains("NOT CHECKED"), "{text}");
        // J3, J6, J7 and J8 are what the manual prints and no drive does.
        assert_eq!(text.matches(": misprint, J").count(), 4, "{text}");
    }
}
