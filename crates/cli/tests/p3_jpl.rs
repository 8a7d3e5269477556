//! The transcripts of the P3 of 2016: every example message of its manual.

mod support;

use support::Sim;

#[test]
fn every_transcript_passes() {
    for text in support::play_all("p3-jpl", 7) {
        // J3, J6, J7 and J8 are what the manual prints and no drive does.
        assert_eq!(text.matches(": misprint, J").count(), 4, "{text}");
    }
}

/// A newcomer's first scan finds nobody; the simulation says why.
#[test]
fn the_simulation_tells_who_is_mute() {
    for (words, told) in [
        (
            &["--drive", "p3-jpl", "--nodes", "4"][..],
            "drive 4: mute until the first NMT message, as the document says: servobus nmt",
        ),
        (
            &["--node", "1=p3", "--node", "2-3=p3-jpl"],
            "drives 2-3: mute until the first NMT message",
        ),
    ] {
        let sim = Sim::start(words);
        let ended = sim.end();
        assert!(ended.stderr.contains(told), "{}", ended.stderr);
    }
    let ended = Sim::start(&["--nodes", "1"]).end();
    assert_eq!(ended.stderr, "");
}
