//! Replays the corpus of the fuzz target `drive`, and random scripts beside it.

mod harness;

#[test]
fn corpus() {
    let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/drive");
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

#[test]
fn random_scripts() {
    let mut random = 0x9E37_79B9_7F4A_7C15_u64;
    for _ in 0..2_000 {
        let mut input = [0; 400];
        for chunk in input.chunks_mut(8) {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            chunk.copy_from_slice(&random.to_le_bytes());
        }
        // Stored parameters of random bytes are damaged parameters; a few are enough.
        input[1] &= 7;
        harness::script::run(&input);
    }
}
