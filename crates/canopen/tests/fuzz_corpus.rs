//! Replays the fuzzers' corpora, in which every piece of code that they ever reached is reached, and
//! every crash that they ever found stands beside its mend.

mod harness;

fn replay(target: &str, run: fn(&[u8])) {
    let directory = format!("{}/../../fuzz/corpus/{target}", env!("CARGO_MANIFEST_DIR"));
    let files = std::fs::read_dir(&directory).expect("the corpus");
    let mut count = 0;
    for file in files {
        let path = file.expect("a corpus file").path();
        let input = std::fs::read(&path).expect("its bytes");
        println!("{}", path.display());
        run(&input);
        count += 1;
    }
    assert!(count > 0, "{directory} is empty");
}

#[test]
fn frames() {
    replay("frames", harness::script::run);
}

#[test]
fn lss() {
    replay("lss", harness::lss::run);
}

#[test]
fn sdo_server() {
    replay("sdo_server", harness::sdo_server::run);
}
