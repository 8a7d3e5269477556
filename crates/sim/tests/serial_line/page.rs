//! The dialogue of the page in the documentation.

use personalities::roboteq::ROBOTEQ_2;
use sim::DriveSettings;

use crate::bench::{hear, send};
use crate::master::{Master, id};

/// The dialogue of the page: what is sent stands first, what comes back from the fifteenth character on,
/// a remark from the twenty-ninth.
#[test]
fn the_page_shows_what_happens() {
    let page = include_str!("../../../../docs/roboteq-serial.md");
    let dialogue = page.split("```text\n").nth(1).expect("a dialogue");
    let dialogue = dialogue.split("```").next().expect("its end");
    let mut master = Master::with(vec![DriveSettings::new(id(1), &ROBOTEQ_2)]);
    let mut heard = String::new();
    let mut lines = 0;
    for line in dialogue.lines() {
        let column = |from: usize, to: usize| {
            let text = line.get(from..to.min(line.len())).unwrap_or("");
            text.trim()
        };
        let (sent, expected) = (column(0, 14), column(14, 28));
        if !sent.is_empty() {
            assert_eq!(heard, "", "before {sent}");
            send(&mut master.bus, format!("{sent}\r").as_bytes());
        }
        if sent == "?F" {
            // It says so: once it is there. Until then there is only one answer to hear.
            hear(&mut master, 10);
            master.run_ms(2000);
            send(&mut master.bus, b"?F\r");
        }
        if sent == "#" {
            hear(&mut master, 50);
        }
        if expected.is_empty() {
            master.run_ms(5);
            assert!(master.bus.take_serial().is_empty(), "{line}");
            continue;
        }
        for _ in 0..2000 {
            if heard.contains('\r') {
                break;
            }
            master.run_us(1000);
            let sent = master.bus.take_serial();
            heard.extend(sent.iter().map(|byte| char::from(byte.byte)));
        }
        let (answer, rest) = heard.split_once('\r').expect("an answer");
        // The measured speed is not the same each time.
        let rounded = answer.replace("=299", "=300").replace(":299", ":300");
        let rounded = rounded.replace("301", "300");
        assert_eq!(rounded, expected, "{line}");
        heard = rest.to_owned();
        lines += 1;
    }
    assert!(lines > 15, "{lines}");
}
