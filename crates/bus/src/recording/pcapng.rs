//! pcapng (draft-ietf-opsawg-pcapng) with one interface of link type 227, CAN_SOCKETCAN: the
//! identifier with its flags in big-endian order, the length, three zero bytes, and always eight
//! data bytes, as Linux's own captures have them.
//!
//! ```text
//! section header, interface description      once
//! enhanced packet, …                         one for each frame, with its comments
//! interface statistics                       at the end: frames, comments that are left
//! ```

use super::{Content, Direction};
use std::io::{self, Write};

// Types of blocks.
const SECTION_HEADER: u32 = 0x0A0D_0D0A;
const INTERFACE_DESCRIPTION: u32 = 1;
const INTERFACE_STATISTICS: u32 = 5;
const ENHANCED_PACKET: u32 = 6;

/// Tells the byte order: as written here, little-endian.
const BYTE_ORDER_MAGIC: u32 = 0x1A2B_3C4D;
/// LINKTYPE_CAN_SOCKETCAN.
const CAN_SOCKETCAN: u16 = 227;
/// The only interface.
const INTERFACE: u32 = 0;

// Codes of options, each in its kind of block.
const COMMENT: u16 = 1;
const END: u16 = 0;
const SECTION_APPLICATION: u16 = 4;
const INTERFACE_NAME: u16 = 2;
const INTERFACE_RESOLUTION: u16 = 9;
const PACKET_FLAGS: u16 = 2;
const STATISTICS_RECEIVED: u16 = 4;

/// Time stamps count 10⁻⁹ s.
const NANOSECONDS: u8 = 9;
const INBOUND: u32 = 0b01;
const OUTBOUND: u32 = 0b10;

/// SocketCAN's mark for error messages, bit 29 of the identifier.
const ERROR_MESSAGE: u32 = 1 << 29;

/// A recording being written.
#[derive(Debug)]
pub(super) struct Writer<W> {
    output: W,
    block: Block,
    notes: Vec<String>,
    frames: u64,
}

impl<W: Write> Writer<W> {
    pub(super) fn begin(output: W, channel: &str) -> io::Result<Writer<W>> {
        let mut writer = Writer {
            output,
            block: Block::default(),
            notes: Vec::new(),
            frames: 0,
        };
        let block = &mut writer.block;
        block.u32(BYTE_ORDER_MAGIC);
        // Version 1.0, length of the section unknown.
        block.u16(1).u16(0).u64(u64::MAX);
        let application = concat!("servobus ", env!("CARGO_PKG_VERSION"));
        block.option(SECTION_APPLICATION, application.as_bytes());
        block.end(SECTION_HEADER, &mut writer.output)?;

        let block = &mut writer.block;
        // Nothing is cut to a length.
        block.u16(CAN_SOCKETCAN).u16(0).u32(0);
        block.option(INTERFACE_NAME, channel.as_bytes());
        block.option(INTERFACE_RESOLUTION, &[NANOSECONDS]);
        block.end(INTERFACE_DESCRIPTION, &mut writer.output)?;
        Ok(writer)
    }

    pub(super) fn write(
        &mut self,
        stamp_ns: u64,
        content: &Content,
        direction: Option<Direction>,
    ) -> io::Result<()> {
        let packet = packet(content);
        let block = &mut self.block;
        block.u32(INTERFACE).stamp(stamp_ns);
        // As much as there was was captured.
        block.u32(packet.len() as u32).u32(packet.len() as u32);
        block.bytes(&packet);
        for note in self.notes.drain(..) {
            block.option(COMMENT, note.as_bytes());
        }
        if let Some(direction) = direction {
            let flags = match direction {
                Direction::Received => INBOUND,
                Direction::Sent => OUTBOUND,
            };
            block.option(PACKET_FLAGS, &flags.to_le_bytes());
        }
        self.frames += 1;
        block.end(ENHANCED_PACKET, &mut self.output)
    }

    pub(super) fn note(&mut self, text: &str) {
        self.notes.push(text.to_owned());
    }

    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }

    pub(super) fn finish(mut self, stamp_ns: u64) -> io::Result<()> {
        let block = &mut self.block;
        block.u32(INTERFACE).stamp(stamp_ns);
        for note in self.notes.drain(..) {
            block.option(COMMENT, note.as_bytes());
        }
        block.option(STATISTICS_RECEIVED, &self.frames.to_le_bytes());
        block.end(INTERFACE_STATISTICS, &mut self.output)?;
        self.output.flush()
    }
}

/// A frame as SocketCAN's `struct can_frame`, its identifier in big-endian order.
fn packet(content: &Content) -> [u8; 16] {
    let (key, length, data) = match content {
        // Bits 31 (extended) and 30 (remote) are the same in both.
        Content::Frame(frame) => (frame.key(), frame.len(), frame.bytes()),
        Content::Error(error) => (error.class | ERROR_MESSAGE, 8, error.data),
    };
    let [a, b, c, d] = key.to_be_bytes();
    let [e, f, g, h, i, j, k, l] = data;
    [a, b, c, d, length, 0, 0, 0, e, f, g, h, i, j, k, l]
}

/// The body of a block being put together.
#[derive(Debug, Default)]
struct Block {
    body: Vec<u8>,
    has_options: bool,
}

impl Block {
    fn u16(&mut self, value: u16) -> &mut Block {
        self.body.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn u32(&mut self, value: u32) -> &mut Block {
        self.body.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn u64(&mut self, value: u64) -> &mut Block {
        self.body.extend_from_slice(&value.to_le_bytes());
        self
    }

    /// A time stamp: the high half comes first, whatever the byte order.
    fn stamp(&mut self, stamp_ns: u64) -> &mut Block {
        self.u32((stamp_ns >> 32) as u32).u32(stamp_ns as u32)
    }

    /// Bytes, filled up to a multiple of four.
    fn bytes(&mut self, bytes: &[u8]) {
        self.body.extend_from_slice(bytes);
        self.body.resize(self.body.len().next_multiple_of(4), 0);
    }

    fn option(&mut self, code: u16, value: &[u8]) {
        // A length of 16 bits: longer texts are cut.
        let value = value.get(..usize::from(u16::MAX)).unwrap_or(value);
        self.u16(code).u16(value.len() as u16);
        self.bytes(value);
        self.has_options = true;
    }

    /// Writes the block and is empty again.
    fn end(&mut self, kind: u32, output: &mut impl Write) -> io::Result<()> {
        if std::mem::take(&mut self.has_options) {
            self.u16(END).u16(0);
        }
        // Type and length before, length behind.
        let length = (self.body.len() as u32 + 12).to_le_bytes();
        let written = output
            .write_all(&kind.to_le_bytes())
            .and_then(|()| output.write_all(&length))
            .and_then(|()| output.write_all(&self.body))
            .and_then(|()| output.write_all(&length));
        self.body.clear();
        written
    }
}
