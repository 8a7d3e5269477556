//! Replays the fuzzer's corpus, in which every piece of code that it ever reached is reached.

use crate::harness;

#[test]
fn corpus() {
    let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/sdo_client");
    let files = std::fs::read_dir(directory).expect("the corpus");
    let mut count = 0;
    for file in files {
        let path = file.expect("a corpus file").path();
        let input = std::fs::read(&path).expect("its bytes");
        println!("{}", path.display());
        harness::script::run(&input);
        count += 1;
    }
    assert!(count > 0, "{directory} is empty");
}
