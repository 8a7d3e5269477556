//! The tables as text: for documents, for listings, and as a file to begin with.

use std::fmt::Write as _;

use super::act_rows::ACTS;
use super::acts::ActKind;
use super::conditions::CONDITIONS;
use super::drives::DRIVE_KEYS;
use super::event::EVENT_KEYS;
use super::parameter_rows::PARAMETERS;
use super::{GLOBAL_KEYS, quantity::Quantity};

fn rows(text: &mut String, header: [&str; 3], rows: &[(&str, &str, &str)]) {
    let _ = writeln!(
        text,
        "| {} | {} | {} |\n|---|---|---|",
        header[0], header[1], header[2]
    );
    for (key, form, what) in rows {
        let _ = writeln!(text, "| `{key}` | `{form}` | {what} |");
    }
}

/// Every key and every parameter as tables in Markdown.
pub fn parameters_document() -> String {
    let mut text = "### At the top of the file\n\n".to_owned();
    rows(&mut text, ["key", "as in", "meaning"], GLOBAL_KEYS);
    text.push_str("\n### In `[drive.N]` and `[drive.all]`\n\n");
    rows(&mut text, ["key", "as in", "meaning"], DRIVE_KEYS);
    let mut section = "";
    for parameter in PARAMETERS {
        if parameter.section() != section {
            section = parameter.section();
            let _ = write!(
                text,
                "\n### `[drive.N.{section}]`\n\n| key | unit | default | range | meaning |\n|---|---|---|---|---|\n"
            );
        }
        let [unit, default, range] = parameter.shown();
        let _ = writeln!(
            text,
            "| `{}` | {unit} | {default} | {range} | {} |",
            parameter.key(),
            parameter.what
        );
    }
    text
}

/// Events, conditions and acts as tables in Markdown.
pub fn acts_document() -> String {
    let mut text = "### Keys of an event\n\n".to_owned();
    rows(&mut text, ["key", "as in", "meaning"], EVENT_KEYS);
    text.push_str("\n### Conditions\n\n");
    rows(&mut text, ["key", "as in", "comes true when"], CONDITIONS);
    text.push_str("\n### Acts\n\n| act | keys | what it does |\n|---|---|---|\n");
    for kind in ACTS {
        let _ = writeln!(text, "| `{}` | {} | {} |", kind.name, keys(kind), kind.what);
    }
    text
}

fn keys(kind: &ActKind) -> String {
    let keys = kind.shown().into_iter().filter(|[key, ..]| key != "drive");
    let keys: Vec<String> = keys
        .map(|[key, form, what]| match key.as_str() {
            "for" => format!("`for`: {}", lower(&what)),
            _ => format!(
                "`{key}`: {} ({form})",
                lower(what.trim_end_matches(" Needed."))
            ),
        })
        .collect();
    match keys.len() {
        0 => "–".to_owned(),
        _ => keys.join(" "),
    }
}

fn lower(text: &str) -> String {
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_lowercase().chain(characters).collect(),
        None => String::new(),
    }
}

/// A file with every parameter at its default, each explained.
pub fn parameters_template() -> String {
    let mut text =
        "# Every parameter of a drive's world with its default. Lines that are left out \
                    keep it.\n"
            .to_owned();
    let mut section = "";
    for parameter in PARAMETERS {
        if parameter.section() != section {
            section = parameter.section();
            let _ = write!(text, "\n[drive.1.{section}]\n");
        }
        let [_, default, range] = parameter.shown();
        let default = match parameter.quantity {
            Quantity::Number | Quantity::Whole | Quantity::Flag => default,
            _ => format!("\"{default}\""),
        };
        let _ = writeln!(text, "# {} {range}.", parameter.what);
        let _ = writeln!(text, "{} = {default}", parameter.key());
    }
    text
}
