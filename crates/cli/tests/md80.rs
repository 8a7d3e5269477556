//! The MD80's transcripts: the message examples of its page.

mod support;

#[test]
fn every_transcript_passes() {
    support::play_all("md80", 5);
}

/// What its lights do is told, as everything that people should know of.
#[test]
fn a_red_light_is_told_of() {
    let folder = support::Folder::new();
    let scenario = folder.file("gates.toml");
    let text = "[[event]]\nat = \"100 ms\"\ndo = \"gate-supply\"\ndrive = 1\nto = \"6 V\"\nfor = \"50 ms\"\n";
    std::fs::write(&scenario, text).unwrap();
    let words = [
        "sim",
        "--drive",
        "md80",
        "--nodes",
        "1",
        "--bus",
        "none",
        "--for",
        "300ms",
        "--scenario",
        &scenario,
    ];
    let output = support::run(&words);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{told}");
    let light = "node 1: green LED: blinks once a second, red LED: on";
    assert_eq!(told.matches(light).count(), 1, "{told}");
}
