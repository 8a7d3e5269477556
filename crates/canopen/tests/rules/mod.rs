//! CiA 301's rules as tables: each row says a rule, where it stands, and checks it. The same rows
//! are the tables of `docs/conformance.md`; a run with `WRITE_CONFORMANCE=1` writes them there.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test file is a crate of its own and uses a part"
)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// One testable rule.
pub struct Rule {
    /// Its name: the service and a number, `SDO-07`.
    pub id: &'static str,
    /// Where it stands, as in "CiA 301 7.2.4.3.3".
    pub clause: &'static str,
    /// What it says, in one sentence.
    pub says: &'static str,
    /// Panics if the node does not keep to it.
    pub check: fn(),
}

/// A row of a table.
pub const fn rule(id: &'static str, clause: &'static str, says: &'static str, check: fn()) -> Rule {
    Rule {
        id,
        clause,
        says,
        check,
    }
}

/// Checks every rule of `service`, whose rows stand in the test file `file`, and that the
/// documentation has the same rows.
///
/// # Panics
/// If a rule does not hold, or the documentation says something else.
pub fn hold(service: &str, file: &str, rules: &[Rule]) {
    let broken: Vec<&str> = rules
        .iter()
        .filter(|rule| catch_unwind(AssertUnwindSafe(rule.check)).is_err())
        .map(|rule| rule.id)
        .collect();
    assert!(broken.is_empty(), "not kept: {broken:?}");
    for (n, rule) in rules.iter().enumerate() {
        let number = format!("{service}-{:02}", n + 1);
        assert_eq!(rule.id, number, "rules are numbered from 1, without gaps");
    }
    document(service, &table(file, rules));
}

fn table(file: &str, rules: &[Rule]) -> String {
    let mut table =
        String::from("| rule | clause | the standard says | test |\n|---|---|---|---|\n");
    for rule in rules {
        let Rule {
            id, clause, says, ..
        } = rule;
        assert!(!says.contains(['|', '\n']), "{id}: one line, no bars");
        table += &format!("| {id} | {clause} | {says} | `{file}`, `{id}` |\n");
    }
    table
}

/// Compares the service's table in the documentation, or writes it.
fn document(service: &str, table: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/conformance.md");
    let text = std::fs::read_to_string(&path).expect("docs/conformance.md can be read");
    let (begin, end) = (
        format!("<!-- rules {service} -->\n"),
        format!("<!-- end {service} -->\n"),
    );
    let from = text.find(&begin).expect("the service has a table") + begin.len();
    let to = text.find(&end).expect("the table has an end");
    if text[from..to] == *table {
        return;
    }
    assert!(
        std::env::var_os("WRITE_CONFORMANCE").is_some(),
        "docs/conformance.md says something else of {service}; \
         write it anew with WRITE_CONFORMANCE=1 cargo test -p servobus-canopen"
    );
    let new = format!("{}{table}{}", &text[..from], &text[to..]);
    std::fs::write(&path, new).expect("docs/conformance.md can be written");
}
