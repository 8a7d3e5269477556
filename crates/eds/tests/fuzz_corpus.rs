//! Replays the corpus of the fuzz target `eds_reader`.

mod harness;

#[test]
fn corpus() {
    let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/eds_reader");
    let files = std::fs::read_dir(directory).expect("the corpus");
    let mut count = 0;
    for file in files {
        let path = file.expect("a corpus file").path();
        let input = std::fs::read(&path).expect("its bytes");
        println!("{}", path.display());
        harness::run(&input);
        count += 1;
    }
    assert!(count > 0, "{directory} is empty");
}
