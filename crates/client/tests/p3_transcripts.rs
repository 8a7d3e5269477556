//! The P3's transcripts against nodes that have its dictionary, dialect and state machine, but no
//! motor: everything but the physics must hold.

mod support;

use std::path::PathBuf;

use canopen::NodeId;
use client::block_on;
use client::transcript::{Options, Transcript, play};
use personalities::p3::P3;
use support::{Nodes, words_of};

fn files() -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../transcripts/p3");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    files
}

#[test]
fn every_transcript_passes() {
    let mut failed = Vec::new();
    let mut sent = 0;
    let mut matched = 0;
    for file in files() {
        let transcript = Transcript::read(&file).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(
            transcript.header().drive.as_deref(),
            Some("p3"),
            "{}",
            file.display()
        );
        let nodes: Vec<NodeId> = transcript.header().nodes.clone();
        let options = Options {
            drive: words_of(&P3),
            ..Options::default()
        };
        let report = block_on(play(&transcript, &mut Nodes::new(&nodes), &options));
        println!("{report}");
        assert!(transcript.asserts_physics() != report.not_checked.is_empty());
        (sent, matched) = (sent + report.sent, matched + report.matched);
        if !report.passed() {
            failed.push(report.to_string());
        }
    }
    println!("{sent} frames sent, {matched} as expected");
    assert!(failed.is_empty(), "{}", failed.join("\n\n"));
    assert!(sent > 200 && matched > 200);
}

#[test]
fn the_misprint_of_the_count_is_shown_to_be_one() {
    let file = files()
        .into_iter()
        .find(|file| file.ends_with("pdo-example-1.txt"))
        .unwrap();
    let transcript = Transcript::read(&file).unwrap();
    let nodes = &transcript.header().nodes;
    let report = block_on(play(
        &transcript,
        &mut Nodes::new(nodes),
        &Options::default(),
    ));
    let [misprint] = report.misprints.as_slice() else {
        panic!("{report}")
    };
    assert!(misprint.reason.starts_with("P3 l.324"));
    assert_eq!(misprint.instead, "nothing within 100 ms");

    // Were the misprint right, its mark would be wrong, and said so.
    let text = std::fs::read_to_string(&file).unwrap();
    let (before, rest) = text
        .split_once("  0x601 5 22 00 1A 00 00  As printed")
        .unwrap();
    let corrected = format!("{before}  0x601 5 22 00 1A 00 01  As meant{rest}");
    let transcript = Transcript::parse("corrected", &corrected).unwrap();
    let report = block_on(play(
        &transcript,
        &mut Nodes::new(nodes),
        &Options::default(),
    ));
    let failure = report.failure.unwrap().to_string();
    assert!(
        failure.contains("the drive does as printed, so this is no misprint"),
        "{failure}"
    );
}
