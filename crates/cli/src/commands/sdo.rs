//! `servobus sdo`: reads and writes objects.

use std::process::ExitCode;
use std::time::Duration;

use can::Frame;
use canopen::{Address, DataType, Instant, NodeId};
use client::decode::{Decoder, Meaning, ObjectValue};
use client::sdo::{Cause, Data, SdoError};
use client::{Client, RequestForm, Settings, Value};
use personalities::Personality;
use serde::Serialize;

use crate::object_address::{self, ObjectName};
use crate::wire::{WireArguments, WireLink};
use crate::{Failure, drive_kind, output, time_span};

/// Read and write objects of a node (SDO, expedited: up to 4 bytes).
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus sdo read --node 1 0x6041            statusword, in words
  servobus sdo write --node 1 0x6060 0 4       mode of operation: profile torque

Exit code 1 if the node refuses or does not answer.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    access: Access,
}

#[derive(Debug, clap::Subcommand)]
enum Access {
    Read(Read),
    Write(Write),
}

/// Read an object.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus sdo read --node 1 0x6041
  servobus sdo read --node 1 0x3008,1
  servobus sdo read --node 1 0x3008 1 --json
  servobus sdo read --node 5 0x2000,3 --type i32     an object that --drive does not have")]
struct Read {
    /// Index, and sub-index behind a comma: 0x6041, 0x3008,1.
    #[arg(value_parser = object_address::parse)]
    object: ObjectName,
    /// Sub-index, if not behind a comma [default: 0]
    #[arg(value_parser = object_address::parse_sub)]
    sub: Option<u8>,
    #[command(flatten)]
    common: Common,
}

/// Write an object.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus sdo write --node 1 0x6040 0x0F             enable operation
  servobus sdo write --node 1 0x6060 0 4
  servobus sdo write --node 1 0x607A -2000
  servobus sdo write --node 1 0x1010,1 save           store all parameters
  servobus sdo write --node 5 0x2000,3 1.5 --type f32

Numbers are decimal or, after 0x, hexadecimal (for signed objects the bit pattern). 0x1010 and
0x1011 also take the words save and load.")]
struct Write {
    /// Index, and sub-index behind a comma: 0x6060, 0x3009,1.
    #[arg(value_parser = object_address::parse)]
    object: ObjectName,
    /// The value, or the sub-index (if not behind a comma) and the value.
    #[arg(
        value_name = "[SUB] VALUE",
        required = true,
        num_args = 1..=2,
        allow_negative_numbers = true
    )]
    words: Vec<String>,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, clap::Args)]
struct Common {
    /// The node ID, 1 to 127.
    #[arg(long, value_parser = parse_node)]
    node: NodeId,
    /// Its type, if the dictionary does not know the object or is wrong: bool, i8, i16, i32, u8,
    /// u16, u32, f32, text.
    #[arg(long = "type", value_name = "TYPE", value_parser = object_address::parse_type)]
    data_type: Option<DataType>,
    /// Whose dictionary gives names and types; `servobus od NAME` lists it.
    #[arg(long, value_name = "NAME", default_value = "p3", value_parser = drive_kind::parse)]
    drive: &'static Personality,
    /// How long to wait for the answer [default: 500ms; 5s for 0x1010 and 0x1011]
    #[arg(long, value_name = "TIME", value_parser = time_span::parse)]
    timeout: Option<Duration>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    wire: WireArguments,
}

pub(super) fn parse_node(text: &str) -> Result<NodeId, String> {
    let id = text.parse().ok().and_then(NodeId::new);
    id.ok_or_else(|| "node IDs are 1 to 127".to_owned())
}

/// Store and restore: they write flash, and take their time.
const SLOW: [u16; 2] = [0x1010, 0x1011];

impl Common {
    /// The object's type: as said, or by the dictionary.
    fn type_of(&self, object: Address) -> Option<DataType> {
        let table = &self.drive.device.table;
        let declared = || match table.find(object.index, object.sub) {
            Ok(entry) => Some(entry.field.data_type()),
            Err(_) if object.sub == 0 && table.highest_sub_index(object.index).is_some() => {
                Some(DataType::U8)
            }
            Err(_) => None,
        };
        self.data_type.or_else(declared)
    }

    fn settings(&self, object: Address) -> Settings {
        let usual = match SLOW.contains(&object.index) {
            true => Duration::from_secs(5),
            false => Duration::from_millis(500),
        };
        Settings {
            answer_ms: time_span::milliseconds(self.timeout.unwrap_or(usual)),
            attempts: 1,
            form: RequestForm::Standard,
        }
    }

    /// What the data say in words, by the dictionary.
    fn words(&self, object: Address, data: Data) -> Option<ObjectValue> {
        let mut decoder = Decoder::with_table(self.drive.device.table);
        let len = data.bytes().len() as u8;
        let command = match data.is_sized() {
            true => 0x43 | 4_u8.saturating_sub(len) << 2,
            false => 0x42,
        };
        let [low, high] = object.index.to_le_bytes();
        let [d0, d1, d2, d3] = data.raw().to_le_bytes();
        let bytes = [command, low, high, object.sub, d0, d1, d2, d3];
        let answer = Frame::classic(0x580 + u16::from(self.node.get()), bytes, 8);
        match decoder.decode(Instant::ZERO, &answer).meaning {
            Meaning::Value { value, .. } => Some(value),
            _ => None,
        }
    }
}

/// Runs it.
///
/// # Errors
/// Exit code 2 for values that make no sense or a bus that cannot be reached, 1 if the node refuses
/// or does not answer.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    match &arguments.access {
        Access::Read(arguments) => read(arguments),
        Access::Write(arguments) => write(arguments),
    }
}

/// What was read, for programs.
#[derive(Debug, Serialize)]
struct ReadResult<'a> {
    node: u8,
    #[serde(flatten)]
    words: &'a ObjectValue,
    #[serde(rename = "type")]
    data_type: Option<&'static str>,
    value: Option<serde_json::Value>,
}

fn read(arguments: &Read) -> Result<ExitCode, Failure> {
    let common = &arguments.common;
    let object = arguments
        .object
        .address(arguments.sub)
        .map_err(Failure::input)?;
    let node = common.node;
    let data = common.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        client.settings = common.settings(object);
        let data = client.upload(node, object).await;
        data.map_err(Failure::unsuccessful)
    })?;
    let value = match common.data_type {
        // What the user says must fit; what the dictionary says may be another drive's.
        Some(data_type) => Some(data.value(data_type).ok_or_else(|| {
            Failure::unsuccessful(SdoError {
                node,
                object,
                access: client::sdo::Access::Read,
                cause: Cause::WrongType { data, data_type },
            })
        })?),
        None => common.type_of(object).and_then(|known| data.value(known)),
    };
    let mut words = common.words(object, data).unwrap_or(ObjectValue {
        index: object.index,
        sub: object.sub,
        name: None,
        bytes: data.bytes().to_vec(),
        text: String::new(),
    });
    if let (Some(_), Some(value)) = (common.data_type, &value) {
        words.text = value.to_string();
    }
    if common.json {
        output::print_json(&ReadResult {
            node: node.get(),
            words: &words,
            data_type: common.type_of(object).map(DataType::name),
            value: value.map(json),
        })?;
    } else {
        output::print(format!("node {node} {words}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn json(value: Value) -> serde_json::Value {
    match value {
        Value::Integer(number) => number.into(),
        Value::Real(number) => number.into(),
        Value::Text(text) => text.into(),
    }
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
fn encode(text: &str, data_type: DataType, object: Address) -> Result<Data, Failure> {
    if SLOW.contains(&object.index) && object.sub > 0 && ["save", "load"].contains(&text) {
        return Data::sized(text.as_bytes())
            .ok_or_else(|| Failure::input(format!("'{text}' has no bytes")));
    }
    Value::parse(text, data_type)
        .and_then(|value| value.encode(data_type))
        .map_err(|error| Failure::input(format!("{object}: {error}")))
}

fn write(arguments: &Write) -> Result<ExitCode, Failure> {
    let common = &arguments.common;
    let (object, text) = split(arguments)?;
    let data_type = common.type_of(object).ok_or_else(|| {
        Failure::input(format!(
            "{object}: the dictionary of {} has no such object; say its type, as in --type u16",
            common.drive.name
        ))
    })?;
    let data = encode(text, data_type, object)?;
    let node = common.node;
    common.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        client.settings = common.settings(object);
        let written = client.download(node, object, data).await;
        written.map_err(Failure::unsuccessful)
    })?;
    if common.json {
        output::print_json(&WriteResult {
            node: node.get(),
            index: object.index,
            sub: object.sub,
            data_type: data_type.name(),
            bytes: data.bytes().to_vec(),
        })?;
    } else if let Some(words) = common.words(object, data) {
        output::print(format!("node {node} has taken {words}"))?;
    } else {
        output::print(format!("node {node} has taken {object}"))?;
    }
    Ok(ExitCode::SUCCESS)
}
