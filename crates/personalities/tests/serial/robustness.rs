//! Binary garbage, long lines, half lines, and anything else.

use crate::harness::{Bench, run};

#[test]
fn what_is_no_text_spoils_its_line_only() {
    let mut bench = Bench::quiet(1);
    for byte in 127..=255 {
        let line = [b'!', b'C', b'W', b' ', b'1', byte, b'5', b'\r'];
        assert_eq!(bench.say(&line), "-\r", "{byte:#04X}");
        assert_eq!(bench.drive.get(0x6040, 0), 0);
        assert_eq!(bench.say(b"?CW\r"), "CW=0\r", "{byte:#04X}");
    }
}

/// "All other characters lower than 0x20 have no effect", says the maker's user manual, but for ENQ, which
/// it has answered ACK.
#[test]
fn control_characters_are_passed_over_and_enq_is_answered() {
    let mut bench = Bench::new(1);
    for byte in 0..=31_u8 {
        let mut line = b"?CW\r".to_vec();
        line.insert(2, byte);
        let answer = bench.say(&line);
        match byte {
            b'\r' => assert_eq!(answer, "?C\rC=0\rW\r-\r"),
            0x05 => assert_eq!(answer, "?C\x06W\rCW=0\r"),
            _ => assert_eq!(answer, "?CW\rCW=0\r", "{byte:#04X}"),
        }
    }
    // Also in the middle of what is no line, and whether it echoes or not.
    assert_eq!(bench.say(b"^ECHOF 1\r"), "^ECHOF 1\r+\r");
    assert_eq!(bench.say(b"\xFF\x05\x05\r"), "\x06\x06-\r");
}

/// What is not acknowledged as part of a line is not sent back.
#[test]
fn garbage_is_not_echoed() {
    let mut bench = Bench::new(1);
    assert_eq!(bench.say(b"\xFF\x00\x80?A\r"), "\r-\r");
    assert_eq!(bench.say(b"?A\x07\r"), "?A\rA=0\r");
}

#[test]
fn a_line_of_64_characters_is_taken_and_one_of_65_is_not() {
    let mut bench = Bench::quiet(1);
    let line = format!("{:<64}\r", "!CW 1 15");
    assert_eq!(bench.say(line.as_bytes()), "+\r");
    let line = format!("{:<65}\r", "!CW 1 6");
    assert_eq!(bench.say(line.as_bytes()), "-\r");
    let line = format!("!CW 1 {:0>70}\r", 6);
    assert_eq!(bench.say(line.as_bytes()), "-\r");
    assert_eq!(bench.say(&[b'A'; 100_000]), "");
    assert_eq!(bench.say(b"\r?CW\r"), "-\rCW=15\r");
}

/// Who goes away in the middle of a line leaves nothing of it behind.
#[test]
fn half_a_line_goes_with_who_sent_it() {
    let mut bench = Bench::quiet(1);
    assert_eq!(bench.say(b"!CW 1 1"), "");
    bench.line.hang_up();
    assert_eq!(bench.say(b"5\r"), "-\r");
    assert_eq!(bench.drive.get(0x6040, 0), 0);
    // Settings stay, repetitions do not.
    assert_eq!(bench.say(b"?CW\r# 10\r"), "CW=0\r");
    bench.line.hang_up();
    assert_eq!(bench.pass_ms(100), "");
    assert_eq!(bench.say(b"#\r"), "CW=0\r");
    // Nor does the answer of a store.
    assert_eq!(bench.say(b"%EESAV\r"), "");
    bench.line.hang_up();
    assert!(bench.line.is_ready());
    bench.line.stored(true);
    assert!(bench.line.is_silent());
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> u8 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u8
    }
}

/// Words of which lines are made, so that random scripts get further than to `-`.
const WORDS: &[&[u8]] = &[
    b"!",
    b"?",
    b"^",
    b"~",
    b"%",
    b"#",
    b"# C",
    b"CW",
    b"SW",
    b"S",
    b"SPL",
    b"F",
    b"MAC",
    b"FSA",
    b"ECHOF",
    b"EESAV",
    b" ",
    b" 1",
    b" 2",
    b" 3",
    b" -5",
    b" 15",
    b" 99999999999",
    b"\r",
    b"_",
    b"\n",
    b"\x7F\x00",
    b"\x8A",
    b"\xA1",
    b"\xB0",
    b"\xB9",
    b"\xC0",
    b"?SW\r",
    b"?A 1\r",
    b"# 1\r",
    b"!CW 1 15\r",
    b"%EESAV\r",
];

#[test]
fn nothing_harms_it() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    for round in 0..20_000 {
        let mut input = vec![random.next()];
        for _ in 0..60 {
            if round % 4 == 0 {
                input.push(random.next());
            } else {
                let word = WORDS[usize::from(random.next()) % WORDS.len()];
                input.extend_from_slice(word);
            }
        }
        run(&input);
    }
}

#[test]
fn corpus() {
    let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/serial");
    let mut count = 0;
    for file in std::fs::read_dir(directory).expect("the corpus") {
        let path = file.expect("a corpus file").path();
        println!("{}", path.display());
        run(&std::fs::read(&path).expect("its bytes"));
        count += 1;
    }
    assert!(count > 0, "{directory} is empty");
}
