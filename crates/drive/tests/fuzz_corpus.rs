//! Replays the corpora of the fuzz targets `drive` and `controller`, and random scripts beside them.

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
fn corpus() {
    replay("drive", harness::script::run);
}

#[test]
fn corpus_of_the_controller() {
    replay("controller", harness::controller::run);
}

fn random_inputs(count: usize, mut run: impl FnMut(&mut [u8])) {
    let mut random = 0x9E37_79B9_7F4A_7C15_u64;
    for _ in 0..count {
        let mut input = [0; 400];
        for chunk in input.chunks_mut(8) {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            chunk.copy_from_slice(&random.to_le_bytes());
        }
        run(&mut input);
    }
}

#[test]
fn random_scripts() {
    random_inputs(2_000, |input| {
        // Stored parameters of random bytes are damaged parameters; a few are enough.
        input[1] &= 7;
        harness::script::run(input);
    });
}

#[test]
fn random_scripts_of_the_controller() {
    random_inputs(300, |input| harness::controller::run(input));
}
