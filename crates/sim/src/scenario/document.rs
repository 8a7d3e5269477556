//! The tables as text: for documents, for listings, and as a file to begin with.

use std::fmt::Write as _;

use personalities::Personality;
use personalities::p3::P3;

use super::act_rows::ACTS;
use super::acts::ActKind;
use super::conditions::CONDITIONS;
use super::drives::DRIVE_KEYS;
use super::event::EVENT_KEYS;
use super::parameter_rows::PARAMETERS;
use super::parameters::Parameter;
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

/// Every key and every parameter as tables in Markdown, with the defaults of one drive; or with those of
/// the P3, and behind them of the drives that have others.
pub fn parameters_document(drive: Option<&'static Personality>) -> String {
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
        let [unit, default, range] = parameter.shown(drive.unwrap_or(&P3));
        let default = match drive {
            Some(_) => default,
            None => default + &others(parameter),
        };
        let _ = writeln!(
            text,
            "| `{}` | {unit} | {default} | {range} | {} |",
            parameter.key(),
            parameter.what
        );
    }
    text
}

/// What other drives have where it is not what the P3 has. Of a family with several numbers of axes the
/// first speaks for all.
fn others(parameter: &Parameter) -> String {
    let [_, usual, _] = parameter.shown(&P3);
    let mut text = String::new();
    for drive in personalities::ALL
        .iter()
        .filter(|drive| drive.axes.len() == 1)
    {
        let [_, default, _] = parameter.shown(drive);
        if default != usual {
            let _ = write!(text, "; {} {default}", drive.name);
        }
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
    let is_short = text.chars().nth(1).is_some_and(char::is_uppercase);
    match characters.next() {
        // An abbreviation.
        Some(_) if is_short => text.to_owned(),
        Some(first) => first.to_lowercase().chain(characters).collect(),
        None => String::new(),
    }
}

/// A file with every parameter of a drive at its default, each explained. What its world does not have
/// stands in a comment.
pub fn parameters_template(drive: &'static Personality) -> String {
    let mut text =
        "# Every parameter of a drive's world with its default. Lines that are left out \
                    keep it.\n"
            .to_owned();
    let _ = writeln!(text, "personality = \"{}\"", drive.name);
    let mut section = "";
    for parameter in PARAMETERS {
        if parameter.section() != section {
            section = parameter.section();
            let _ = write!(text, "\n[drive.1.{section}]\n");
        }
        let [_, default, range] = parameter.shown(drive);
        if parameter.default(drive).is_none() {
            let _ = writeln!(text, "# {} {range}. Not there.", parameter.what);
            let _ = writeln!(text, "# {} =", parameter.key());
            continue;
        }
        let default = match parameter.quantity {
            Quantity::Number | Quantity::Whole | Quantity::Flag => default,
            _ => format!("\"{default}\""),
        };
        let _ = writeln!(text, "# {} {range}.", parameter.what);
        let _ = writeln!(text, "{} = {default}", parameter.key());
    }
    text
}
