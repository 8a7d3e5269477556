//! `docs/modes.md` and `docs/homing.md` show the transcripts of the extended P3 as they are, and each
//! of them passes. A run with `WRITE_MODES=1` writes them into the pages.

mod support;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn every_transcript_passes() {
    support::play_all("p3-extended", 13);
}

#[test]
fn the_pages_show_them_all() {
    let mut shown = BTreeSet::new();
    for page in ["modes", "homing"] {
        show(&root().join(format!("docs/{page}.md")), &mut shown);
    }
    let all: BTreeSet<String> = support::transcripts("p3-extended")
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
