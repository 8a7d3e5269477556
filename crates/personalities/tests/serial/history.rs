//! The query history: 16 queries that can be asked again by `#`.

use crate::harness::Bench;

#[test]
fn number_sign_asks_the_queries_again_in_turn() {
    let mut bench = Bench::quiet(1);
    bench.drive.set(0x6041, 0, 0x250);
    bench.drive.set(0x2100, 1, 12);
    assert_eq!(bench.say(b"#\r"), "");
    assert_eq!(bench.say(b"?SW_?A 1_"), "SW=592\rA=12\r");
    bench.drive.set(0x2100, 1, 13);
    assert_eq!(bench.say(b"#\r"), "SW=592\r");
    assert_eq!(bench.say(b"#_"), "A=13\r");
    assert_eq!(bench.say(b"#\r#\r"), "SW=592\rA=13\r");
    // Neither what is refused nor what is no query is kept.
    assert_eq!(
        bench.say(b"?XYZ\r?SW 2\r~MAC\r!CW 1 6\r"),
        "-\r-\rMAC=0\r+\r"
    );
    assert_eq!(bench.say(b"#\r#\r#\r"), "SW=592\rA=13\rSW=592\r");
    assert_eq!(bench.say(b"# C\r#\r"), "");
}

#[test]
fn only_the_answer_of_a_repeated_query_is_sent() {
    let mut bench = Bench::new(1);
    assert_eq!(bench.say(b"?SW\r"), "?SW\rSW=0\r");
    assert_eq!(bench.say(b"#\r"), "#\rSW=0\r");
    assert_eq!(bench.say(b"# 10\r"), "# 10\r");
    assert_eq!(bench.pass_ms(20), "SW=0\rSW=0\r");
}

#[test]
fn one_query_each_interval_until_it_is_stopped() {
    let mut bench = Bench::quiet(2);
    assert_eq!(bench.say(b"# C_?SW_?A 2_# 50_"), "SW=0:0\rA=0\r");
    assert_eq!(bench.pass_ms(49), "");
    assert_eq!(bench.pass_ms(1), "SW=0:0\r");
    assert_eq!(bench.pass_ms(100), "A=0\rSW=0:0\r");
    // Commands are obeyed meanwhile, and a new query joins the others.
    assert_eq!(bench.say(b"!CW 1 6\r?CW 1\r"), "+\rCW=6\r");
    assert_eq!(bench.pass_ms(200), "A=0\rCW=6\rSW=0:0\rA=0\r");
    // The first number sign only stops it.
    assert_eq!(bench.say(b"#\r"), "");
    assert_eq!(bench.pass_ms(1000), "");
    assert_eq!(bench.say(b"#\r"), "CW=6\r");
    // Clearing stops it, too.
    assert_eq!(bench.say(b"# 1\r"), "");
    assert_eq!(bench.pass_ms(2), "SW=0:0\rA=0\r");
    assert_eq!(bench.say(b"# C\r"), "");
    assert_eq!(bench.pass_ms(10), "");
}

#[test]
fn sixteen_are_kept() {
    let mut bench = Bench::quiet(3);
    for element in 1..=6 {
        bench.say(format!("?SPL {element}\r?SAC {element}\r?SDC {element}\r").as_bytes());
    }
    let mut again = String::new();
    for _ in 0..16 {
        again += &bench.say(b"#\r");
    }
    assert_eq!(again.matches('\r').count(), 16);
    // Of 18 the first two are gone.
    assert!(again.starts_with("SDC=0\rSPL=0\r"), "{again}");
    assert!(bench.say(b"#\r").starts_with("SDC"));
}

#[test]
fn intervals_that_are_none_are_refused() {
    for line in [
        "# 0",
        "# 32001",
        "# -5",
        "# 1 2",
        "# D",
        "##",
        "# 99999999999",
    ] {
        let mut bench = Bench::quiet(1);
        assert_eq!(bench.say(format!("{line}\r").as_bytes()), "-\r", "{line}");
    }
    let mut bench = Bench::quiet(1);
    assert_eq!(bench.say(b"?A\r# 32000\r"), "A=0\r");
    assert_eq!(bench.pass_ms(32_000), "A=0\r");
}

/// While more waits to be sent than there is room for, repetitions are left out.
#[test]
fn a_line_that_is_not_read_does_not_pile_up() {
    let mut bench = Bench::quiet(3);
    assert_eq!(bench.say(b"?SPL\r# 1\r").matches('\r').count(), 1);
    for _ in 0..1000 {
        bench.now = bench.now.plus_ms(1);
        bench.line.poll(bench.now, &mut bench.drive);
    }
    assert!(!bench.line.is_ready());
    let mut waiting = Vec::new();
    while let Some(byte) = bench.line.transmit() {
        waiting.push(byte);
    }
    assert!(waiting.len() <= 256);
    // Whole answers only.
    let text = String::from_utf8(waiting).expect("text");
    for answer in text.split_terminator('\r') {
        assert_eq!(answer, "SPL=0:0:0:0:0:0");
    }
    assert!(bench.line.is_ready());
}
