//! `servobus replay`: runs a recorded simulation again.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bus::recording::Format;
use sim::{
    Happening, ReadError, Replayed, begin_frames, replay, replay_each, write_error, write_frame,
    write_notice,
};

use crate::{Failure, output, record_file};

/// Run a recorded simulation again, and compare it with its recording.
///
/// Without --output, says whether the frames are the same, byte for byte, or which line differs
/// first (exit code 1).
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus replay run.log                      is the run repeated exactly?
  servobus replay run.log --output again.log   write the repeated log
  servobus replay run.log --output run.pcapng  or the same frames for Wireshark
  servobus replay run.log --output - | head    or print it

A recording is two files that `servobus sim --record run.log` writes: run.log with all frames, in
candump's format, and run.log.run with what they follow from. The replay is made from the second
and compared with the first.")]
pub(crate) struct Arguments {
    /// The log that `servobus sim --record` wrote; FILE.run must lie beside it.
    file: PathBuf,
    /// Write the repeated frames there instead of comparing, to a file that ends in .log, .pcapng or
    /// .mcap; `-` is standard output, as a log.
    #[arg(long, value_name = "OUT", value_parser = parse_output)]
    output: Option<PathBuf>,
}

fn parse_output(text: &str) -> Result<PathBuf, String> {
    match text {
        "-" => Ok(PathBuf::from(text)),
        _ => record_file::parse(text),
    }
}

/// Runs it.
///
/// # Errors
/// Exit code 2 for recordings that cannot be read, 1 for replays that differ.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let file = &arguments.file;
    match &arguments.output {
        None => verify(file),
        Some(output) if output.as_os_str() == "-" => {
            let mut stdout = io::stdout().lock();
            replayed(file, &mut BufWriter::new(&mut stdout))?;
            Ok(ExitCode::SUCCESS)
        }
        Some(output) => write(file, output),
    }
}

fn replayed(file: &Path, output: &mut impl Write) -> Result<Replayed, Failure> {
    replay(file, output).map_err(|error| match error {
        ReadError::Write(error) => Failure::output(error),
        error => Failure::input(error),
    })
}

fn write(file: &Path, path: &Path) -> Result<ExitCode, Failure> {
    let same = |path: &Path| fs::canonicalize(path).ok();
    if same(path).is_some_and(|path| Some(path) == same(file)) {
        return Err(Failure::input(format!(
            "{}: that is the recording itself; name another file with --output",
            path.display()
        )));
    }
    // In memory first: a recording that cannot be read must not cost an older output.
    let mut happenings = Vec::new();
    let done = replay_each(file, &mut |happening| {
        happenings.push(happening);
        Ok(())
    })
    .map_err(Failure::input)?;
    begin_frames(path)
        .and_then(|mut log| {
            for happening in &happenings {
                match happening {
                    Happening::Frame(traffic) => write_frame(&mut log, traffic)?,
                    Happening::Notice(notice) => write_notice(&mut log, notice)?,
                    Happening::Error(error) => write_error(&mut log, error)?,
                }
            }
            log.finish(done.end.0)
        })
        .map_err(|error| {
            Failure::input(format!(
                "{}: cannot write there: {error}; name another file with --output",
                path.display()
            ))
        })?;
    let cut = cut_off_note(&done);
    output::print(format!("{}: {} frames{cut}", path.display(), done.frames))?;
    Ok(ExitCode::SUCCESS)
}

fn cut_off_note(done: &Replayed) -> String {
    match done.cut_off {
        true => format!(
            " (the recording was cut off: it can be repeated until its last outside frame, {:.6} s)",
            done.end.seconds()
        ),
        false => String::new(),
    }
}

fn verify(file: &Path) -> Result<ExitCode, Failure> {
    if matches!(Format::of(file), Ok(Format::Pcapng | Format::Mcap)) {
        return Err(Failure::input(format!(
            "{}: a replay can be compared with a candump log only: record to a file that ends in \
             .log, or write the repeated log with --output again.log",
            file.display()
        )));
    }
    let recorded = fs::read(file).map_err(|error| {
        let path = file.display();
        Failure::input(format!(
            "{path}: cannot be read: {error}; give the log that `servobus sim --record` wrote"
        ))
    })?;
    let mut again = Vec::new();
    let done = replayed(file, &mut again)?;
    let name = file.display();
    if let Some(difference) = difference(&recorded, &again, done.cut_off) {
        return Err(Failure::unsuccessful(format!("{name}:{difference}")));
    }
    let (frames, cut) = (done.frames, cut_off_note(&done));
    output::print(format!("{name}: {frames} frames, identical{cut}"))?;
    Ok(ExitCode::SUCCESS)
}

/// The first line that differs, with its number and both texts. Of a recording that was cut off
/// only what both have is compared, without a last line that may be half written.
fn difference(recorded: &[u8], again: &[u8], cut_off: bool) -> Option<String> {
    let (mut recorded, mut again) = (recorded, again);
    if cut_off {
        let whole = |bytes: &[u8]| {
            bytes
                .iter()
                .rposition(|byte| *byte == b'\n')
                .map_or(0, |n| n + 1)
        };
        recorded = &recorded[..whole(recorded)];
        let common = recorded.len().min(again.len());
        (recorded, again) = (&recorded[..common], &again[..common]);
    }
    if recorded == again {
        return None;
    }
    let mut old = recorded.split_inclusive(|byte| *byte == b'\n');
    let mut new = again.split_inclusive(|byte| *byte == b'\n');
    let mut number = 0;
    loop {
        number += 1;
        let (old, new) = (old.next(), new.next());
        if old != new || old.is_none() {
            let (old, new) = (words(old), words(new));
            return Some(format!(
                "{number}: the replay differs\n  recorded  {old}\n  replayed  {new}"
            ));
        }
    }
}

fn words(line: Option<&[u8]>) -> String {
    line.map_or_else(
        || "(nothing more)".to_owned(),
        |line| String::from_utf8_lossy(line).trim_end().to_owned(),
    )
}

#[cfg(test)]
mod tests {
    use super::difference;

    #[test]
    fn the_first_different_line_is_named() {
        let text = difference(b"a\nb\nc\n", b"a\nx\ny\n", false).unwrap();
        assert_eq!(text, "2: the replay differs\n  recorded  b\n  replayed  x");
        let text = difference(b"a\n", b"a\nb\n", false).unwrap();
        assert_eq!(
            text,
            "2: the replay differs\n  recorded  (nothing more)\n  replayed  b"
        );
        assert_eq!(difference(b"a\nb\n", b"a\nb\n", false), None);
        assert!(difference(b"a", b"a\n", false).is_some());
    }

    #[test]
    fn a_recording_that_was_cut_off_is_compared_as_far_as_both_go() {
        assert_eq!(difference(b"a\nb\nhal", b"a\nb\nhalf\n", true), None);
        assert_eq!(difference(b"a\nb\n", b"a\n", true), None);
        assert!(difference(b"a\nb\n", b"a\nx\n", true).is_some());
    }
}
