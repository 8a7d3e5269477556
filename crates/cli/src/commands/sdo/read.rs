//! `servobus sdo read`.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use canopen::{Abort, Address, DataType};
use client::Value;
use client::decode::ObjectValue;
use client::sdo::{Cause, Data, SdoError};
use serde::Serialize;

use super::{Common, transfer};
use crate::object_address::{self, ObjectName};
use crate::{Failure, output};

/// Read an object.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus sdo read --node 1 0x6041
  servobus sdo read --node 1 0x3008,1
  servobus sdo read --node 1 0x3008 1 --json
  servobus sdo read --node 5 0x2000,3 --type i32     an object that its dictionary does not have
  servobus sdo read --node 5 0x1021 --output drive.eds --method block

Above 4 bytes, objects of type text are printed as text and all others in hexadecimal. --output
replaces FILE when everything has come. Ctrl-C ends the transfer, and the node is told.")]
pub(super) struct Read {
    /// Index, and sub-index behind a comma: 0x6041, 0x3008,1.
    #[arg(value_parser = object_address::parse)]
    object: ObjectName,
    /// Sub-index, if not behind a comma [default: 0]
    #[arg(value_parser = object_address::parse_sub)]
    sub: Option<u8>,
    /// Write the bytes to FILE, as they came.
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// What was read, for programs.
#[derive(Debug, Serialize)]
struct ReadResult<'a> {
    node: u8,
    #[serde(flatten)]
    words: &'a ObjectValue,
    #[serde(rename = "type")]
    data_type: Option<&'static str>,
    /// Whose dictionary has told name and type; `None`: the standard's.
    drive: Option<&'static str>,
    value: Option<serde_json::Value>,
}

/// What was written to a file, for programs.
#[derive(Debug, Serialize)]
struct FileResult<'a> {
    node: u8,
    index: u16,
    sub: u8,
    size: u32,
    file: &'a Path,
}

pub(super) fn run(arguments: &Read) -> Result<ExitCode, Failure> {
    let object = arguments
        .object
        .address(arguments.sub)
        .map_err(Failure::input)?;
    match &arguments.output {
        Some(file) => to_file(&arguments.common, object, file),
        None => to_screen(&arguments.common, object),
    }
}

fn to_screen(common: &Common, object: Address) -> Result<ExitCode, Failure> {
    let node = common.node;
    let mut bytes = Vec::new();
    let mut sink = |offset: u32, new: &[u8]| {
        bytes.truncate(offset as usize);
        bytes.extend_from_slice(new);
        Ok(())
    };
    let (done, identity) = transfer::upload_and_identify(common, object, &mut sink)?;
    let known = common.known(identity.drive(), object);
    let value = match common.data_type {
        // What the user says must fit; what the dictionary says may be another drive's.
        Some(data_type) => Some(
            value(&bytes, done.is_sized, data_type)
                .ok_or_else(|| wrong_type(common, object, &bytes, done.is_sized, data_type))?,
        ),
        None => {
            let known = known.data_type;
            known.and_then(|known| value(&bytes, done.is_sized, known))
        }
    };
    let mut words = known.words(&bytes, done.is_sized);
    if let (Some(_), Some(value)) = (common.data_type, &value) {
        words.text = value.to_string();
    }
    if common.json {
        output::print_json(&ReadResult {
            node: node.get(),
            words: &words,
            data_type: known.data_type.map(DataType::name),
            drive: identity.drive().map(|drive| drive.name),
            value: value.map(json),
        })?;
    } else {
        output::print(format!("node {node} {words}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The bytes as a value of a type; `None` if they are too few, or too many although the node said
/// how many count.
fn value(bytes: &[u8], is_sized: bool, data_type: DataType) -> Option<Value> {
    match data_type {
        DataType::Text => Value::decode(bytes, data_type),
        _ => data(bytes, is_sized)?.value(data_type),
    }
}

fn data(bytes: &[u8], is_sized: bool) -> Option<Data> {
    match is_sized {
        true => Data::sized(bytes),
        false => Data::unsized_bytes(bytes),
    }
}

fn wrong_type(
    common: &Common,
    object: Address,
    bytes: &[u8],
    is_sized: bool,
    data_type: DataType,
) -> Failure {
    let node = common.node;
    match data(bytes, is_sized) {
        Some(data) => Failure::unsuccessful(SdoError {
            node,
            object,
            access: client::sdo::Access::Read,
            cause: Cause::WrongType { data, data_type },
        }),
        None => Failure::unsuccessful(format!(
            "node {node}: reading {object}: {} bytes came, which is no {}",
            bytes.len(),
            data_type.name()
        )),
    }
}

fn json(value: Value) -> serde_json::Value {
    match value {
        Value::Integer(number) => number.into(),
        Value::Real(number) => number.into(),
        Value::Text(text) => text.into(),
    }
}

fn to_file(common: &Common, object: Address, path: &Path) -> Result<ExitCode, Failure> {
    let mut file = Output::create(path)?;
    let read = transfer::upload(common, object, &mut |offset: u32, bytes: &[u8]| {
        file.take(offset, bytes)
    });
    let done = file.finish(read)?;
    let node = common.node;
    if common.json {
        output::print_json(&FileResult {
            node: node.get(),
            index: object.index,
            sub: object.sub,
            size: done,
            file: path,
        })?;
    } else {
        let path = path.display();
        output::print(format!("node {node} {object}: {done} bytes, now in {path}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A file that takes its name when it is complete.
struct Output<'a> {
    path: &'a Path,
    part: PathBuf,
    file: BufWriter<File>,
    wrong: Option<std::io::Error>,
}

impl Output<'_> {
    fn create(path: &Path) -> Result<Output<'_>, Failure> {
        let failed = |error| Failure::input(format!("{}: {error}", path.display()));
        let Some(name) = path.file_name().filter(|_| !path.is_dir()) else {
            return Err(Failure::input(format!(
                "{} is no name of a file; write one after --output",
                path.display()
            )));
        };
        let mut part = name.to_owned();
        part.push(".part");
        let part = path.with_file_name(part);
        let file = File::create(&part).map_err(failed)?;
        Ok(Output {
            path,
            part,
            file: BufWriter::new(file),
            wrong: None,
        })
    }

    fn take(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Abort> {
        let begun_anew = match offset {
            0 => self.begin(),
            _ => Ok(()),
        };
        let written = begun_anew.and_then(|()| self.file.write_all(bytes));
        written.map_err(|error| {
            self.wrong = Some(error);
            Abort::OUT_OF_MEMORY
        })
    }

    fn begin(&mut self) -> std::io::Result<()> {
        use std::io::Seek;
        self.file.rewind()?;
        self.file.get_ref().set_len(0)
    }

    /// Gives the file its name, or removes it.
    fn finish(mut self, read: Result<client::sdo::Done, Failure>) -> Result<u32, Failure> {
        let done = read.and_then(|done| {
            let flushed = self.file.flush();
            let named = flushed.and_then(|()| fs::rename(&self.part, self.path));
            match named {
                Ok(()) => Ok(done.bytes),
                Err(error) => {
                    self.wrong = Some(error);
                    Err(Failure::ReaderGone)
                }
            }
        });
        done.map_err(|failure| {
            // It is of no use to anybody; if it cannot be removed, the message is about more.
            let _ = fs::remove_file(&self.part);
            match self.wrong {
                Some(error) => Failure::input(format!("{}: {error}", self.path.display())),
                None => failure,
            }
        })
    }
}
