//! The MD80's transcripts: the message examples of its page.

mod support;

#[test]
fn every_transcript_passes() {
    support::play_all("md80", 5);
}
