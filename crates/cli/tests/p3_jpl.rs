//! The transcripts of the P3 of 2016: every example message of its manual.

mod support;

#[test]
fn every_transcript_passes() {
    for text in support::play_all("p3-jpl", 7) {
        // J3, J6, J7 and J8 are what the manual prints and no drive does.
        assert_eq!(text.matches(": misprint, J").count(), 4, "{text}");
    }
}
