//! What went over a bus, written to files that other programs read.
//!
//! | ending | format | read by |
//! |---|---|---|
//! | `.log` | [`candump`] | can-utils, python-can, tshark, `servobus replay` |
//! | `.pcapng` | pcapng, link type 227 | Wireshark, tshark |
//! | `.mcap` | MCAP, JSON messages | Foxglove, PlotJuggler, `mcap` for Python |
//!
//! A recording that was cut off can be read up to where it was last flushed.

pub mod candump;
mod content;
mod format;
mod mcap;
mod pcapng;

pub use content::{Content, Direction};
pub use format::{Format, UnknownEnding};

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// A recording being written.
#[derive(Debug)]
pub struct Recorder {
    channel: String,
    writer: Writer,
}

#[derive(Debug)]
enum Writer {
    Candump(BufWriter<File>),
    Pcapng(pcapng::Writer<BufWriter<File>>),
    Mcap(Box<mcap::Writer<BufWriter<File>>>),
}

impl Recorder {
    /// Begins the file `path`, in the format that its ending tells; an existing one is replaced.
    /// `channel` is the name of the bus.
    ///
    /// # Errors
    /// Those of the file system, and [`UnknownEnding`] as an error of kind `InvalidInput`; then
    /// nothing was touched.
    pub fn create(path: &Path, channel: &str) -> io::Result<Recorder> {
        let format = Format::of(path)
            .map_err(|unknown| io::Error::new(io::ErrorKind::InvalidInput, unknown))?;
        let file = BufWriter::new(File::create(path)?);
        let writer = match format {
            Format::Candump => Writer::Candump(file),
            Format::Pcapng => Writer::Pcapng(pcapng::Writer::begin(file, channel)?),
            Format::Mcap => Writer::Mcap(Box::new(mcap::Writer::begin(file, channel)?)),
        };
        Ok(Recorder {
            channel: channel.to_owned(),
            writer,
        })
    }

    /// A frame went over the bus, or a controller's driver reported an error. `stamp_ns` counts
    /// nanoseconds since the start of the bus (virtual) or since 1970; the format's own resolution
    /// may be coarser. candump's log leaves the direction out.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write(
        &mut self,
        stamp_ns: u64,
        content: &Content,
        direction: Option<Direction>,
    ) -> io::Result<()> {
        match &mut self.writer {
            Writer::Candump(output) => {
                candump::write_content(output, stamp_ns, &self.channel, content)
            }
            Writer::Pcapng(writer) => writer.write(stamp_ns, content, direction),
            Writer::Mcap(writer) => writer.write(stamp_ns, content, direction),
        }
    }

    /// Words about what happened. candump's log has no place for them; in pcapng they become
    /// comments of the next frame.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn note(&mut self, stamp_ns: u64, text: &str) -> io::Result<()> {
        match &mut self.writer {
            Writer::Candump(_) => Ok(()),
            Writer::Pcapng(writer) => {
                writer.note(text);
                Ok(())
            }
            Writer::Mcap(writer) => writer.note(stamp_ns, text),
        }
    }

    /// Whether signals are kept: so in MCAP only.
    pub fn takes_signals(&self) -> bool {
        matches!(self.writer, Writer::Mcap(_))
    }

    /// Quantities of `source`, as in `drive/1`, each with its name, which ends with its unit. A
    /// source always has the same names. Passed over unless [`Recorder::takes_signals`].
    ///
    /// # Errors
    /// Those of the file system.
    pub fn signals(
        &mut self,
        stamp_ns: u64,
        source: &str,
        values: &[(&str, f64)],
    ) -> io::Result<()> {
        match &mut self.writer {
            Writer::Mcap(writer) => writer.signals(stamp_ns, source, values),
            Writer::Candump(_) | Writer::Pcapng(_) => Ok(()),
        }
    }

    /// Writes what is waiting to the file: so much is there if the recording is cut off.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn flush(&mut self) -> io::Result<()> {
        match &mut self.writer {
            Writer::Candump(output) => output.flush(),
            Writer::Pcapng(writer) => writer.flush(),
            Writer::Mcap(writer) => writer.flush(),
        }
    }

    /// Ends the recording at this time.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn finish(self, stamp_ns: u64) -> io::Result<()> {
        match self.writer {
            Writer::Candump(mut output) => output.flush(),
            Writer::Pcapng(writer) => writer.finish(stamp_ns),
            Writer::Mcap(writer) => writer.finish(),
        }
    }
}
