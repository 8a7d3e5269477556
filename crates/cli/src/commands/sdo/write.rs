//! `servobus sdo write`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use canopen::{Address, DataType, NodeId};
use client::Value;
use serde::Serialize;

use super::{Common, SLOW, transfer};
use crate::identify::Identity;
use crate::object_address::{self, ObjectName};
use crate::{Failure, output};

/// Write an object.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus sdo write --node 1 0x6040 0x0F             enable operation
  servobus sdo write --node 1 0x6060 0 4
  servobus sdo write --node 1 0x607A -2000
  servobus sdo write --node 1 0x1010,1 save           store all parameters
  servobus sdo write --node 5 0x2000,3 1.5 --type f32
  servobus sdo write --node 5 0x1F50,1 --input firmware.bin --method block

Numbers are decimal or, after 0x, hexadecimal (for signed objects the bit pattern). 0x1010 and
0x1011 also take the words save and load. Ctrl-C ends the transfer, and the node is told.")]
pub(super) struct Write {
    /// Index, and sub-index behind a comma: 0x6060, 0x3009,1.
    #[arg(value_parser = object_address::parse)]
    object: ObjectName,
    /// The value, or the sub-index (if not behind a comma) and the value. With --input only the
    /// sub-index.
    #[arg(
        value_name = "[SUB] VALUE",
        required_unless_present = "input",
        num_args = 0..=2,
        allow_negative_numbers = true
    )]
    words: Vec<String>,
    /// Write the bytes of FILE, as they are.
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// What was written, for programs.
#[derive(Debug, Serialize)]
struct WriteResult {
    node: u8,
    index: u16,
    sub: u8,
    #[serde(rename = "type")]
    data_type: &'static str,
    bytes: Vec<u8>,
}

/// What was written from a file, for programs.
#[derive(Debug, Serialize)]
struct FileResult<'a> {
    node: u8,
    index: u16,
    sub: u8,
    size: usize,
    file: &'a Path,
}

pub(super) fn run(arguments: &Write) -> Result<ExitCode, Failure> {
    match &arguments.input {
        Some(path) => from_file(arguments, path),
        None => from_words(arguments),
    }
}

/// The object and the text of its value.
fn split(arguments: &Write) -> Result<(Address, &str), Failure> {
    let (sub, value) = match arguments.words.as_slice() {
        [value] => (None, value),
        [sub, _] if arguments.object.has_sub() => {
            return Err(Failure::input(format!(
                "'{sub}' is too much: the sub-index stands behind the comma already"
            )));
        }
        [sub, value, ..] => (
            Some(object_address::parse_sub(sub).map_err(Failure::input)?),
            value,
        ),
        [] => return Err(Failure::input("the value is missing")),
    };
    let object = arguments.object.address(sub).map_err(Failure::input)?;
    Ok((object, value))
}

/// The bytes of a value as a user typed it.
fn encode(text: &str, data_type: DataType, object: Address) -> Result<Vec<u8>, Failure> {
    let is_signature =
        SLOW.contains(&object.index) && object.sub > 0 && ["save", "load"].contains(&text);
    if is_signature || data_type == DataType::Text {
        return Ok(text.as_bytes().to_vec());
    }
    Value::parse(text, data_type)
        .and_then(|value| value.encode(data_type))
        .map(|data| data.bytes().to_vec())
        .map_err(|error| Failure::input(format!("{object}: {error}")))
}

fn from_words(arguments: &Write) -> Result<ExitCode, Failure> {
    let common = &arguments.common;
    let (object, text) = split(arguments)?;
    let node = common.node;
    let written = transfer::download(common, object, true, |identity| {
        let known = common.known(identity.drive(), object);
        let data_type = known.data_type;
        let data_type = data_type.ok_or_else(|| unknown(node, object, identity))?;
        let bytes = encode(text, data_type, object)?;
        Ok((bytes.clone(), (known, data_type, bytes)))
    })?;
    let (known, data_type, bytes) = written;
    if common.json {
        output::print_json(&WriteResult {
            node: node.get(),
            index: object.index,
            sub: object.sub,
            data_type: data_type.name(),
            bytes,
        })?;
    } else {
        let words = known.words(&bytes, true);
        output::print(format!("node {node} has taken {words}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// An object whose type nobody knows.
fn unknown(node: NodeId, object: Address, identity: Identity) -> Failure {
    match identity {
        Identity::Drive(drive) => Failure::input(format!(
            "{object}: the dictionary of {} has no such object; say which drive it is \
             (--drive) or the type, as in --type u16",
            drive.name
        )),
        Identity::Unknown => Failure::input(format!(
            "node {node} is no drive that is known here, and {object} no object of the standard; say \
             which drive it is (--drive) or the type, as in --type u16"
        )),
        Identity::Silent => Failure::unsuccessful(format!(
            "node {node} does not say which drive it is: no answer to 0x1000"
        )),
    }
}

fn from_file(arguments: &Write, path: &Path) -> Result<ExitCode, Failure> {
    let common = &arguments.common;
    let sub = match arguments.words.as_slice() {
        [] => None,
        [sub] => Some(object_address::parse_sub(sub).map_err(Failure::input)?),
        [_, value, ..] => {
            return Err(Failure::input(format!(
                "'{value}' is too much: the value comes from --input"
            )));
        }
    };
    let object = arguments.object.address(sub).map_err(Failure::input)?;
    let failed = |error| Failure::input(format!("{}: {error}", path.display()));
    let bytes = fs::read(path).map_err(failed)?;
    let size = bytes.len();
    transfer::download(common, object, false, |_| Ok((bytes, ())))?;
    let node = common.node;
    if common.json {
        output::print_json(&FileResult {
            node: node.get(),
            index: object.index,
            sub: object.sub,
            size,
            file: path,
        })?;
    } else {
        let path = path.display();
        output::print(format!(
            "node {node} has taken {object}: {size} bytes of {path}"
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
