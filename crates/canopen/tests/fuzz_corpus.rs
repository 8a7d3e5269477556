//! Replays the fuzzers' corpora, in which every piece of code that they ever reached is reached, and
//! every crash that they ever found stands beside its mend.

mod harness;

use std::path::Path;

/// Runs every file of a target's corpus.
fn replay(target: &str, run: fn(&[u8])) {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let files = std::fs::read_dir(corpus.join(target)).expect("the corpus");
    let mut count = 0;
    for file in files {
        let path = file.expect("a corpus file").path();
        let input = std::fs::read(&path).expect("its bytes");
        println!("{}", path.display());
        run(&input);
        count += 1;
    }
    assert!(count > 0, "the corpus of {target} is empty");
}

#[test]
fn frames() {
    replay("frames", harness::script::run);
}

#[test]
fn pdo_config() {
    replay("pdo_config", harness::config::run);
}

#[test]
fn lss() {
    replay("lss", harness::lss::run);
}

#[test]
fn sdo_server() {
    replay("sdo_server", harness::sdo_server::run);
}
