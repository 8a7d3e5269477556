//! `docs/drives.md` shows what `servobus drives --markdown` prints. A run with `WRITE_DRIVES=1` writes
//! it there.

mod support;

use std::path::Path;

use support::printed;

#[test]
fn the_page_shows_what_the_command_prints() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/drives.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (begin, end) = ("<!-- drives -->\n", "<!-- end -->");
    let (head, rest) = page.split_once(begin).expect("a begin");
    let (_, tail) = rest.split_once(end).expect("an end");
    let tables = printed(&["drives", "--markdown"], 0);
    let new = format!("{head}{begin}\n{tables}\n{end}{tail}");
    if new == page {
        return;
    }
    assert!(
        std::env::var_os("WRITE_DRIVES").is_some(),
        "docs/drives.md shows another comparison; \
         write it anew with WRITE_DRIVES=1 cargo test -p servobus --test drives"
    );
    std::fs::write(path, new).unwrap();
}

/// The outside tests take the names of all drives from here.
#[test]
fn every_drive_is_in_the_json() {
    let json: serde_json::Value = serde_json::from_str(&printed(&["drives", "--json"], 0)).unwrap();
    let names: Vec<&str> = personalities::ALL.iter().map(|drive| drive.name).collect();
    assert_eq!(json["drives"], serde_json::json!(names));
    for part in json["parts"].as_array().unwrap() {
        for row in part["rows"].as_array().unwrap() {
            assert_eq!(
                row["drives"].as_array().unwrap().len(),
                names.len(),
                "{row}"
            );
        }
    }
}

#[test]
fn some_drives_in_the_order_asked_for() {
    let text = printed(&["drives", "p3-extended", "p3"], 0);
    let header = text.lines().find(|line| line.starts_with("services "));
    let header: Vec<&str> = header.unwrap().split_whitespace().collect();
    assert_eq!(header, ["services", "p3-extended", "p3"]);
    let json: serde_json::Value =
        serde_json::from_str(&printed(&["drives", "p3", "--json"], 0)).unwrap();
    assert_eq!(json["drives"], serde_json::json!(["p3"]));
    let modes = &json["parts"][1];
    assert_eq!(modes["title"], "modes of operation");
    assert_eq!(modes["rows"][0]["drives"], serde_json::json!(["yes"]));
}

#[test]
fn a_drive_that_does_not_exist_is_named_with_those_that_do() {
    let output = support::run(&["drives", "p4"]);
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(
        text.contains("p4") && text.contains("p3-extended"),
        "{text}"
    );
}
