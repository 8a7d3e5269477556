//! The Roboteq's transcripts, and its numbers of channels on the command line.

mod support;

use support::printed;

#[test]
fn every_transcript_passes() {
    support::play_all("roboteq", 5);
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
