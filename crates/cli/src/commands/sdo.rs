//! `servobus sdo`: reads and writes objects.

mod read;
mod transfer;
mod write;

use std::process::ExitCode;
use std::time::Duration;

use can::Frame;
use canopen::{Address, DataType, Instant, NodeId};
use client::decode::{Decoder, Meaning, ObjectValue};
use client::sdo::{Data, Method};
use client::{RequestForm, Settings, Value};
use personalities::Personality;

use crate::wire::WireArguments;
use crate::{Failure, drive_kind, object_address, time_span};

/// Read and write objects of a node (SDO), of any length.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus sdo read --node 1 0x6041            statusword, in words
  servobus sdo write --node 1 0x6060 0 4       mode of operation: profile torque
  servobus sdo read --node 1 0x1021 --output drive.eds

Exit code 1 if the node refuses or does not answer.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    access: Access,
}

#[derive(Debug, clap::Subcommand)]
enum Access {
    Read(read::Read),
    Write(write::Write),
}

/// Runs it.
///
/// # Errors
/// Exit code 2 for values that make no sense, files or a bus that cannot be reached, 1 if the node
/// refuses or does not answer.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    match &arguments.access {
        Access::Read(arguments) => read::run(arguments),
        Access::Write(arguments) => write::run(arguments),
    }
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
    /// Which protocol: expedited, segmented or block; auto takes the one that fits the length.
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = parse_method)]
    method: Method,
    /// How long to wait for each answer [default: 500ms; 5s for 0x1010 and 0x1011]
    #[arg(long, value_name = "TIME", value_parser = time_span::parse)]
    timeout: Option<Duration>,
    /// How often to repeat what got no answer. A node may obey a repeated write twice.
    #[arg(long, value_name = "NUMBER", default_value_t = 0)]
    retries: u32,
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

const METHODS: [(&str, Method); 4] = [
    ("auto", Method::Auto),
    ("expedited", Method::Expedited),
    ("segmented", Method::Segmented),
    ("block", Method::Block),
];

fn parse_method(text: &str) -> Result<Method, String> {
    let found = METHODS.iter().find(|(name, _)| *name == text);
    found.map(|(_, method)| *method).ok_or_else(|| {
        let names: Vec<&str> = METHODS.iter().map(|(name, _)| *name).collect();
        format!("there is no such method; there are: {}", names.join(", "))
    })
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
            attempts: self.retries.saturating_add(1),
            form: RequestForm::Standard,
            method: self.method,
            ..Settings::default()
        }
    }

    /// What the bytes of an object say in words, by the dictionary: long ones as text if that is
    /// their type, else in hexadecimal.
    fn words(&self, object: Address, bytes: &[u8], is_sized: bool) -> ObjectValue {
        let short = match is_sized {
            true => Data::sized(bytes),
            false => Data::unsized_bytes(bytes),
        };
        if let Some(words) = short.and_then(|data| self.short_words(object, data)) {
            return words;
        }
        let any = Data::sized(&[0]).and_then(|data| self.short_words(object, data));
        let text = match self.type_of(object) {
            Some(DataType::Text) => Value::decode(bytes, DataType::Text).map(|v| v.to_string()),
            _ => None,
        };
        ObjectValue {
            index: object.index,
            sub: object.sub,
            name: any.and_then(|words| words.name),
            text: text.unwrap_or_else(|| hexadecimal(bytes)),
            bytes: bytes.to_vec(),
        }
    }

    /// What up to four bytes say.
    fn short_words(&self, object: Address, data: Data) -> Option<ObjectValue> {
        let drive = self.drive;
        let mut decoder =
            Decoder::with_table(drive.device.table).with_mode_names(drive.mode_names());
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

/// Bytes with a blank between each two.
fn hexadecimal(bytes: &[u8]) -> String {
    let digits: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    digits.join(" ")
}
