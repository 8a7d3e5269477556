//! MCAP (mcap.dev): a channel of frames, one of notes, and one for each source of signals, all with
//! messages in JSON and a schema that says what is in them.
//!
//! Chunks are put together in memory and written whole, so that a file that is cut off is good up
//! to its last chunk.

use super::{Content, Direction};
use ::mcap::records::MessageHeader;
use ::mcap::{McapError, WriteOptions};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, HashMap};
use std::io::{self, Seek, Write};

/// Encoding of schemas.
const JSON_SCHEMA: &str = "jsonschema";
/// Encoding of messages.
const JSON: &str = "json";

/// A recording being written.
pub(super) struct Writer<W: Write + Seek> {
    output: ::mcap::Writer<W>,
    frames: Channel,
    notes: Channel,
    signals: HashMap<String, Channel>,
    text: Vec<u8>,
}

/// A channel and the number of its next message.
#[derive(Clone, Copy, Debug)]
struct Channel {
    id: u16,
    sequence: u32,
}

impl<W: Write + Seek> std::fmt::Debug for Writer<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Writer")
            .field("frames", &self.frames)
            .finish_non_exhaustive()
    }
}

/// A frame, as in the schema.
#[derive(Serialize)]
struct FrameMessage<'a> {
    id: u32,
    extended: bool,
    remote: bool,
    error: bool,
    length: u8,
    data: &'a [u8],
    direction: Option<&'static str>,
}

impl<W: Write + Seek> Writer<W> {
    pub(super) fn begin(output: W, channel: &str) -> io::Result<Writer<W>> {
        let options = WriteOptions::new()
            .library(concat!("servobus ", env!("CARGO_PKG_VERSION")))
            .disable_seeking(true);
        let mut output = options.create(output).map_err(failed)?;
        let frames = add_channel(&mut output, channel, "servobus.Frame", &frame_schema())?;
        let notes = add_channel(&mut output, "notes", "servobus.Note", &note_schema())?;
        Ok(Writer {
            output,
            frames,
            notes,
            signals: HashMap::new(),
            text: Vec::new(),
        })
    }

    pub(super) fn write(
        &mut self,
        stamp_ns: u64,
        content: &Content,
        direction: Option<Direction>,
    ) -> io::Result<()> {
        let direction = direction.map(|direction| match direction {
            Direction::Received => "received",
            Direction::Sent => "sent",
        });
        let message = match content {
            Content::Frame(frame) => FrameMessage {
                id: frame.raw_id(),
                extended: frame.is_extended(),
                remote: frame.is_remote(),
                error: false,
                length: frame.len(),
                data: frame.data(),
                direction,
            },
            Content::Error(error) => FrameMessage {
                id: error.class,
                extended: false,
                remote: false,
                error: true,
                length: 8,
                data: &error.data,
                direction,
            },
        };
        let channel = &mut self.frames;
        send(
            &mut self.output,
            channel,
            &mut self.text,
            stamp_ns,
            &message,
        )
    }

    pub(super) fn note(&mut self, stamp_ns: u64, text: &str) -> io::Result<()> {
        let message = json!({ "text": text });
        let channel = &mut self.notes;
        send(
            &mut self.output,
            channel,
            &mut self.text,
            stamp_ns,
            &message,
        )
    }

    pub(super) fn signals(
        &mut self,
        stamp_ns: u64,
        source: &str,
        values: &[(&str, f64)],
    ) -> io::Result<()> {
        if !self.signals.contains_key(source) {
            let schema = signal_schema(values);
            let name = format!("servobus.Signals.{source}");
            let channel = add_channel(&mut self.output, source, &name, &schema)?;
            self.signals.insert(source.to_owned(), channel);
        }
        let Some(channel) = self.signals.get_mut(source) else {
            return Ok(());
        };
        let message: Map<String, Value> = values
            .iter()
            .map(|(name, value)| ((*name).to_owned(), json!(value)))
            .collect();
        send(
            &mut self.output,
            channel,
            &mut self.text,
            stamp_ns,
            &message,
        )
    }

    /// Ends the chunk.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.output.flush().map_err(failed)
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.output.finish().map_err(failed)?;
        self.output.into_inner().flush()
    }
}

fn add_channel<W: Write + Seek>(
    output: &mut ::mcap::Writer<W>,
    topic: &str,
    name: &str,
    schema: &Value,
) -> io::Result<Channel> {
    let schema = schema.to_string();
    let schema = output
        .add_schema(name, JSON_SCHEMA, schema.as_bytes())
        .map_err(failed)?;
    let id = output
        .add_channel(schema, topic, JSON, &BTreeMap::new())
        .map_err(failed)?;
    Ok(Channel { id, sequence: 0 })
}

fn send<W: Write + Seek>(
    output: &mut ::mcap::Writer<W>,
    channel: &mut Channel,
    text: &mut Vec<u8>,
    stamp_ns: u64,
    message: &impl Serialize,
) -> io::Result<()> {
    text.clear();
    serde_json::to_writer(&mut *text, message)?;
    let header = MessageHeader {
        channel_id: channel.id,
        sequence: channel.sequence,
        log_time: stamp_ns,
        publish_time: stamp_ns,
    };
    channel.sequence = channel.sequence.wrapping_add(1);
    output.write_to_known_channel(&header, text).map_err(failed)
}

fn failed(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}

fn frame_schema() -> Value {
    json!({
        "title": "servobus.Frame",
        "description": "A frame that went over the bus, or an error frame of a controller's driver.",
        "type": "object",
        "properties": {
            "id": {
                "type": "integer",
                "description": "Identifier, 11 or 29 bits; of an error frame, its class.",
            },
            "extended": { "type": "boolean", "description": "The identifier has 29 bits." },
            "remote": { "type": "boolean", "description": "A remote frame." },
            "error": { "type": "boolean", "description": "An error frame (linux/can/error.h)." },
            "length": {
                "type": "integer",
                "description": "Data length code; of a remote frame, the bytes asked for.",
            },
            "data": {
                "type": "array",
                "items": { "type": "integer" },
                "description": "The data bytes; none in a remote frame.",
            },
            "direction": {
                "type": ["string", "null"],
                "description": "Seen from the recording program: sent or received; null if unknown.",
            },
        },
    })
}

fn note_schema() -> Value {
    json!({
        "title": "servobus.Note",
        "description": "Words about what happened.",
        "type": "object",
        "properties": { "text": { "type": "string" } },
    })
}

fn signal_schema(values: &[(&str, f64)]) -> Value {
    let properties: Map<String, Value> = values
        .iter()
        .map(|(name, _)| ((*name).to_owned(), json!({ "type": "number" })))
        .collect();
    json!({
        "title": "servobus.Signals",
        "description": "Quantities at one moment; each name ends with its unit.",
        "type": "object",
        "properties": properties,
    })
}
