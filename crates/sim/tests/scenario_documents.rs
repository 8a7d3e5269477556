//! What `docs/scenarios.md` says of parameters and acts is what the tables say.

use std::fs;
use std::path::Path;

use sim::scenario::{Scenario, acts_document, parameters_document};

/// Set, the document is written anew.
const WRITE: &str = "SERVOBUS_WRITE_DOCS";

#[test]
fn the_document_is_that_of_the_tables() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/scenarios.md");
    let mut document = fs::read_to_string(&path).unwrap();
    let mut differs = false;
    for (name, tables) in [
        ("acts", acts_document()),
        ("parameters", parameters_document(None)),
    ] {
        let (begin, end) = (
            format!("<!-- begin {name} -->\n"),
            format!("<!-- end {name} -->"),
        );
        let (before, rest) = document.split_once(&begin).expect(name);
        let (old, after) = rest.split_once(&end).expect(name);
        differs |= old.trim() != tables.trim();
        document = format!("{before}{begin}\n{}\n\n{end}{after}", tables.trim());
    }
    if differs && std::env::var_os(WRITE).is_some() {
        fs::write(&path, document).unwrap();
        return;
    }
    assert!(
        !differs,
        "docs/scenarios.md is not up to date: run this test with {WRITE}=1"
    );
}

/// The scenario that the document shows is one.
#[test]
fn the_documents_scenario_is_right() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/scenarios.md");
    let document = fs::read_to_string(path).unwrap();
    let scenario = document.split("```toml\n").nth(1).unwrap();
    let scenario = scenario.split("```").next().unwrap();
    let read = Scenario::read("scenarios.md", scenario).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(read.event_count(), 2);
    assert_eq!(read.places().len(), 2);
}
