//! `servobus program`: the images in which programs are downloaded.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use drive::program::{ImageHeader, Version, check_image};
use serde::Serialize;

use crate::{Failure, output};

/// Make and check the images in which a drive takes a program (0x1F50).
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus program make --version 1.2 --product 0x5033 firmware.bin firmware.sbi
  servobus program check firmware.sbi")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    Make(Make),
    Check(Check),
}

/// Make an image of a program: its bytes with a checksummed header in front.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus program make --version 1.2 --product 0x5033 firmware.bin firmware.sbi

The product code is the drive's 0x1018,2; a drive refuses a program for another one.")]
struct Make {
    /// The program's version: text of at most 32 bytes.
    #[arg(long, value_name = "TEXT", value_parser = Version::new)]
    version: Version,
    /// Product code of the drive that it is for, as in 0x5033.
    #[arg(long, value_name = "CODE", value_parser = parse_product)]
    product: u32,
    /// The program's bytes.
    input: PathBuf,
    /// The image to be written; a file that is there is replaced.
    output: PathBuf,
}

/// Check an image and print what it is. Exit code 1 if a drive would refuse it.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus program check firmware.sbi
  servobus program check --json firmware.sbi")]
struct Check {
    /// The image.
    file: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

fn parse_product(text: &str) -> Result<u32, String> {
    let digits = text.strip_prefix("0x").or(text.strip_prefix("0X"));
    let code = match digits {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    code.map_err(|_| "that is no product code; write a number up to 0xFFFFFFFF".into())
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(path)
        .map_err(|error| Failure::input(format!("{}: cannot be read: {error}", path.display())))
}

/// Runs it.
///
/// # Errors
/// Files that cannot be read or written, an image that is none.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    match &arguments.action {
        Action::Make(arguments) => make(arguments),
        Action::Check(arguments) => check(arguments),
    }
}

fn make(arguments: &Make) -> Result<ExitCode, Failure> {
    let mut body = read(&arguments.input)?;
    let input = arguments.input.display();
    if body.is_empty() {
        return Err(Failure::input(format!(
            "{input}: the file is empty, a program has at least one byte"
        )));
    }
    if check_image(&body).is_ok() {
        return Err(Failure::input(format!(
            "{input}: that is an image already; give the program that it was made of"
        )));
    }
    if body.len() > u32::MAX as usize - drive::program::IMAGE_HEADER {
        return Err(Failure::input(format!(
            "{input}: {} bytes, an image holds less than 4 GiB",
            body.len()
        )));
    }
    let header = ImageHeader::of(arguments.product, arguments.version, &body);
    body.splice(0..0, header.bytes());
    let path = arguments.output.display();
    fs::write(&arguments.output, body)
        .map_err(|error| Failure::input(format!("{path}: cannot be written: {error}")))?;
    output::print(words(&path.to_string(), &header))?;
    Ok(ExitCode::SUCCESS)
}

fn check(arguments: &Check) -> Result<ExitCode, Failure> {
    let path = arguments.file.display().to_string();
    let header = check_image(&read(&arguments.file)?)
        .map_err(|failure| Failure::unsuccessful(format!("{path}: {failure}")))?;
    if arguments.json {
        output::print_json(&Image {
            version: header.version.text(),
            product: header.product,
            identification: header.checksum,
            program_bytes: header.body_bytes,
            image_bytes: header.image_bytes(),
        })?;
    } else {
        output::print(words(&path, &header))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// An image as it is listed.
#[derive(Clone, Copy, Debug, Serialize)]
struct Image<'a> {
    version: &'a str,
    product: u32,
    /// What 0x1F56 reads as when a drive has it.
    identification: u32,
    program_bytes: u32,
    image_bytes: u32,
}

fn words(path: &str, header: &ImageHeader) -> String {
    format!(
        "{path}: program {} for product 0x{:X}, {} bytes, software identification 0x{:08X}",
        header.version.text(),
        header.product,
        header.body_bytes,
        header.checksum,
    )
}
