//! `servobus eds read`: the objects of a file.

use std::process::ExitCode;

use canopen::NodeId;
use eds::{Constant, DataType, Eds, Entry, Value};
use serde::Serialize;

use crate::{Failure, output};

/// List the objects of an EDS or DCF.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus eds read p3.eds
  servobus eds read p3.eds --node 3        $NODEID+0x180 is shown as 0x183
  servobus eds read p3.eds --json

What is wrong with the file is not said here; see servobus eds check. Exit code 1 if nothing of it
can be used.")]
pub(super) struct Arguments {
    /// The file.
    file: String,
    /// For which node [default: the one that a DCF names, else none]
    #[arg(long, value_name = "ID", value_parser = super::super::sdo::parse_node)]
    node: Option<NodeId>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// A file, for programs.
#[derive(Debug, Serialize)]
struct File {
    node: Option<u8>,
    /// The data types that PDOs may map as dummies.
    dummies: Vec<u16>,
    objects: Vec<Object>,
}

/// An index with its sub-indices.
#[derive(Debug, Serialize)]
struct Object {
    index: u16,
    name: String,
    object_type: u8,
    list: &'static str,
    subs: Vec<Sub>,
}

/// A sub-index.
#[derive(Debug, Serialize)]
struct Sub {
    sub: u8,
    name: String,
    data_type: Option<u16>,
    access: Option<&'static str>,
    pdo_mapping: bool,
    low_limit: Option<Json>,
    high_limit: Option<Json>,
    default: Option<Json>,
    value: Option<Json>,
}

/// A value: its text, and what that means (`null` if it depends on a node ID that is not known).
#[derive(Debug, Serialize)]
struct Json {
    text: String,
    meaning: serde_json::Value,
}

impl Json {
    fn of(value: &Value, node: Option<NodeId>) -> Json {
        let constant = match node {
            Some(node) => value.for_node(node),
            None => value.constant().cloned(),
        };
        Json {
            text: value.text().to_owned(),
            meaning: match constant {
                // Beyond 64 bits there is no number.
                Some(Constant::Integer(number)) => {
                    match (i64::try_from(number), u64::try_from(number)) {
                        (Ok(number), _) => number.into(),
                        (_, Ok(number)) => number.into(),
                        _ => serde_json::Value::Null,
                    }
                }
                Some(Constant::Real(real)) => real.into(),
                Some(Constant::Text(text)) => text.into(),
                Some(Constant::Bytes(bytes)) => bytes.into(),
                Some(Constant::PlusNodeId(_)) | None => serde_json::Value::Null,
            },
        }
    }
}

/// Runs it.
///
/// # Errors
/// Exit code 2 if the file cannot be read, 1 if it holds no object.
pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let eds = eds::read(&super::get(&arguments.file)?).eds;
    if eds.objects.is_empty() {
        let what = format!(
            "{}: no object can be used; see servobus eds check",
            arguments.file
        );
        return Err(Failure::unsuccessful(what));
    }
    let named = || {
        eds.commissioning()
            .and_then(|there| NodeId::new(there.node_id))
    };
    let node = arguments.node.or_else(named);
    match arguments.json {
        true => output::print_json(&file(&eds, node))?,
        false => output::print(table(&eds, node))?,
    }
    Ok(ExitCode::SUCCESS)
}

fn file(eds: &Eds, node: Option<NodeId>) -> File {
    let sub = |sub: u8, entry: &Entry| {
        let json = |value: &Option<Value>| value.as_ref().map(|value| Json::of(value, node));
        Sub {
            sub,
            name: entry.name.clone(),
            data_type: entry.data_type.map(|data_type| data_type.0),
            access: entry.access.map(|access| access.name()),
            pdo_mapping: entry.pdo_mapping.unwrap_or(false),
            low_limit: json(&entry.low_limit),
            high_limit: json(&entry.high_limit),
            default: json(&entry.default),
            value: json(&entry.value),
        }
    };
    let objects = eds.objects.values().map(|object| Object {
        index: object.index,
        name: object.entry.name.clone(),
        object_type: object.entry.object_type.code(),
        list: object.list.section(),
        subs: object
            .sub_indices()
            .filter_map(|number| Some(sub(number, &*object.sub(number)?)))
            .collect(),
    });
    File {
        node: node.map(NodeId::get),
        dummies: eds.dummies(),
        objects: objects.collect(),
    }
}

fn table(eds: &Eds, node: Option<NodeId>) -> String {
    let mut table = output::table(&[
        "index", "sub", "type", "access", "PDO", "default", "value", "range", "name",
    ]);
    let mut count = 0;
    for (index, sub, entry) in eds.entries() {
        count += 1;
        table.add_row(columns(index, sub, &entry, node));
    }
    format!("{count} objects\n{}", table.trim_fmt())
}

fn columns(index: u16, sub: u8, entry: &Entry, node: Option<NodeId>) -> [String; 9] {
    let text = |value: &Option<Value>| match value {
        Some(value) => match (value.constant(), node) {
            (Some(Constant::PlusNodeId(_)), Some(node)) => value
                .number(node)
                .map_or_else(String::new, |number| format!("0x{number:X}")),
            _ => value.text().to_owned(),
        },
        None => String::new(),
    };
    let range = match (&entry.low_limit, &entry.high_limit) {
        (None, None) => String::new(),
        (low, high) => format!("{}..{}", text(low), text(high)),
    };
    let code = |data_type: DataType| match data_type.name() {
        Some(name) => name.to_owned(),
        None => format!("0x{:04X}", data_type.0),
    };
    [
        format!("0x{index:04X}"),
        sub.to_string(),
        entry.data_type.map_or_else(String::new, code),
        entry.access.map_or("", |access| access.name()).to_owned(),
        if entry.pdo_mapping == Some(true) {
            "yes"
        } else {
            ""
        }
        .to_owned(),
        text(&entry.default),
        text(&entry.value),
        range,
        entry.name.clone(),
    ]
}
