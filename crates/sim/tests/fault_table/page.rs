//! The tables of docs/faults.md are these rows; `WRITE_FAULTS=1 cargo test -p servobus-sim --test
//! fault_table page` writes them there.

use std::fmt::Write as _;
use std::path::Path;

use super::*;

/// What switches a row, in words.
fn switch(personality: &Personality, switch: Switch) -> String {
    let name = |field| {
        let (index, sub) = address(personality, field);
        format!("0x{index:04X},{sub}")
    };
    match switch {
        Switch::Always => "always on".into(),
        Switch::Off => "off (P46)".into(),
        Switch::Object(object) => format!("`{}`", name(object.field)),
        Switch::Either(one, other) => {
            format!("`{}`, `{}`", name(one.field), name(other.field))
        }
    }
}

fn table(personality: &Personality) -> String {
    let mut text = String::from(
        "| code | kind | 0x1001 bit | 0x1002 bit | looked for | switch | brought about by | seen after |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for row in personality.faults {
        let kind = match row.kind {
            Kind::Fault => "fault",
            Kind::Critical => "critical fault",
            Kind::Warning => "warning",
        };
        let states = match row.states {
            personalities::States::All => "always",
            personalities::States::OperationEnabled => "in operation enabled",
        };
        let proof = rows().find(|proof| proof.cause == row.cause);
        let (how, when) = match (row.switch, proof) {
            (Switch::Off, _) => ("never", String::from("–")),
            (_, Some(proof)) => {
                let (from, to) = proof.within_ms;
                (proof.how, format!("{from} to {to} ms"))
            }
            (_, None) => ("?", String::from("?")),
        };
        let switch = switch(personality, row.switch);
        let status_bit = match row.status_bit {
            bit @ 0..=31 => bit.to_string(),
            _ => String::from("–"),
        };
        writeln!(
            text,
            "| 0x{:04X} | {kind} | {} | {status_bit} | {states} | {switch} | {how} | {when} |",
            row.code, row.register_bit
        )
        .unwrap();
    }
    text
}

#[test]
fn the_page_of_faults_is_true() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/faults.md");
    let mut text = std::fs::read_to_string(&path).expect("docs/faults.md");
    for personality in [&P3, &P3_EXTENDED] {
        let begin = format!("<!-- faults {} -->\n", personality.name);
        let end = format!("<!-- end {} -->\n", personality.name);
        let from = text.find(&begin).expect("a table") + begin.len();
        let to = text.find(&end).expect("the table's end");
        text.replace_range(from..to, &table(personality));
    }
    let is = std::fs::read_to_string(&path).unwrap();
    if is != text {
        assert!(
            std::env::var_os("WRITE_FAULTS").is_some(),
            "docs/faults.md is not what the rows say; write it anew with \
             WRITE_FAULTS=1 cargo test -p servobus-sim --test fault_table page"
        );
        std::fs::write(&path, text).unwrap();
    }
}
