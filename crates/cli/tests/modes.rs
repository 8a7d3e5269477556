//! `docs/modes.md` and `docs/homing.md` show the transcripts of the extended P3 as they are, and each
//! of them passes. A run with `WRITE_MODES=1` writes them into the pages.

mod support;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use support::printed;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn files() -> Vec<PathBuf> {
    let folder = root().join("transcripts/p3-extended");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    files
}

#[test]
fn every_transcript_passes() {
    let files = files();
    let count = files.len();
    assert!(count >= 13);
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

#[test]
fn the_pages_show_them_all() {
    let mut shown = BTreeSet::new();
    for page in ["modes", "homing"] {
        show(&root().join(format!("docs/{page}.md")), &mut shown);
    }
    let all: BTreeSet<String> = files()
        .iter()
        .map(|file| file.file_stem().unwrap().to_str().unwrap().to_string())
        .collect();
    shown.retain(|name| !name.starts_with("../"));
    assert_eq!(shown, all);
}

/// Compares the transcripts in a page with the files, whose names are those of `transcripts/p3-extended`
/// or go on from there. Notes which it shows.
fn show(path: &Path, shown: &mut BTreeSet<String>) {
    let page = std::fs::read_to_string(path).unwrap();
    let (mark, end) = ("<!-- transcript ", "<!-- end -->");
    let mut new = String::new();
    let mut parts = page.split(mark);
    new += parts.next().unwrap();
    for part in parts {
        let (name, rest) = part.split_once(" -->\n").expect("a name");
        let (_, rest) = rest.split_once(end).expect("an end");
        let file = root().join(format!("transcripts/p3-extended/{name}.txt"));
        let text = std::fs::read_to_string(&file).expect(name);
        new += &format!("{mark}{name} -->\n```text\n{text}```\n{end}{rest}");
        shown.insert(name.to_string());
    }
    if new == page {
        return;
    }
    assert!(
        std::env::var_os("WRITE_MODES").is_some(),
        "{} shows other transcripts; \
         write them anew with WRITE_MODES=1 cargo test -p servobus --test modes",
        path.display()
    );
    std::fs::write(path, new).unwrap();
}
