//! `servobus sdo`: reads and writes objects.

mod read;
mod transfer;
mod write;

use std::process::ExitCode;
use std::time::Duration;

use can::Frame;
use canopen::{Address, DataType, Instant, NodeId};
use client::decode::{Decoder, DriveWords, Meaning, ObjectValue, standard_type};
use client::sdo::{Data, Method};
use client::{Client, Link, RequestForm, Settings, Value};
use personalities::Personality;

use crate::identify::{self, Identity};
use crate::wire::WireArguments;
use crate::{Failure, drive_kind, object_address, time_span};

/// Read and write objects of a node (SDO), of any length.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus sdo read --node 1 0x6041            statusword, in words
  servobus sdo write --node 1 0x6060 0 4       mode of operation: profile torque
  servobus sdo read --node 1 0x1021 --output drive.eds

Names, types and units are those of the drive. Without --drive and --type the node is asked which drive it
is (0x1000, 0x1008, 0x1018); of one that is not known here only the standard's objects have a name.
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
    /// Whose dictionary gives names, types and units; `servobus od NAME` lists it [default: that of the
    /// drive that the node says it is, or the standard's]
    #[arg(long, value_name = "NAME", value_parser = drive_kind::parse)]
    drive: Option<&'static Personality>,
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
    /// The drive that was named. A type that was given is enough, and nobody is asked then.
    fn said(&self) -> Option<Identity> {
        let unknown = self.data_type.map(|_| Identity::Unknown);
        self.drive.map(Identity::Drive).or(unknown)
    }

    /// Whose dictionary counts: the drive that was named, else the one that the node says it is.
    ///
    /// # Errors
    /// The link broke.
    async fn identity<L: Link>(&self, client: &mut Client<L>) -> Result<Identity, Failure> {
        match self.said() {
            Some(said) => Ok(said),
            None => {
                let known = identify::node(client, self.node).await;
                known.map_err(Failure::unsuccessful)
            }
        }
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

    /// The object as a drive's dictionary has it.
    fn known(&self, drive: Option<&Personality>, object: Address) -> Known {
        let declared = match drive {
            Some(drive) => {
                let table = &drive.device.table;
                match table.find(object.index, object.sub) {
                    Ok(entry) => Some(entry.field.data_type()),
                    Err(_)
                        if object.sub == 0 && table.highest_sub_index(object.index).is_some() =>
                    {
                        Some(DataType::U8)
                    }
                    Err(_) => None,
                }
            }
            None => standard_type(object),
        };
        Known {
            node: self.node,
            object,
            words: drive.map(drive_kind::words).unwrap_or_default(),
            data_type: self.data_type.or(declared),
        }
    }
}

/// What is known of an object.
struct Known {
    node: NodeId,
    object: Address,
    words: DriveWords,
    /// Its type: as said, or by the dictionary.
    data_type: Option<DataType>,
}

impl Known {
    /// What the bytes of the object say in words: long ones as text if that is their type, else in
    /// hexadecimal.
    fn words(&self, bytes: &[u8], is_sized: bool) -> ObjectValue {
        let short = match is_sized {
            true => Data::sized(bytes),
            false => Data::unsized_bytes(bytes),
        };
        if let Some(words) = short.and_then(|data| self.short_words(data)) {
            return words;
        }
        let any = Data::sized(&[0]).and_then(|data| self.short_words(data));
        let text = match self.data_type {
            Some(DataType::Text) => Value::decode(bytes, DataType::Text).map(|v| v.to_string()),
            _ => None,
        };
        ObjectValue {
            index: self.object.index,
            sub: self.object.sub,
            name: any.and_then(|words| words.name),
            text: text.unwrap_or_else(|| hexadecimal(bytes)),
            bytes: bytes.to_vec(),
        }
    }

    /// What up to four bytes say.
    fn short_words(&self, data: Data) -> Option<ObjectValue> {
        let mut decoder = Decoder::with_words(self.words);
        let len = data.bytes().len() as u8;
        let command = match data.is_sized() {
            true => 0x43 | 4_u8.saturating_sub(len) << 2,
            false => 0x42,
        };
        let [low, high] = self.object.index.to_le_bytes();
        let [d0, d1, d2, d3] = data.raw().to_le_bytes();
        let bytes = [command, low, high, self.object.sub, d0, d1, d2, d3];
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
