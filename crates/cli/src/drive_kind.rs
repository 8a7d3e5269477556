//! Which documented drive, by the name on the command line.

use client::decode::DriveWords;
use personalities::Personality;

use crate::Failure;

/// Finds a personality by its name.
///
/// # Errors
/// The names there are.
pub(crate) fn parse(name: &str) -> Result<&'static Personality, String> {
    personalities::by_name(name)
        .ok_or_else(|| format!("there is no such drive; there are: {}", names()))
}

/// What its document calls things.
pub(crate) fn words(drive: &Personality) -> DriveWords {
    DriveWords {
        table: Some(drive.device.table),
        modes: drive.words.modes,
        mode_bits: drive.words.mode_bits,
        bits: drive.words.bits,
        errors: drive.words.errors,
    }
}

/// The name of a mode of operation in its document.
pub(crate) fn mode_name(drive: &Personality, mode: i8) -> String {
    words(drive).mode(mode)
}

/// A drive that there is with several numbers of motor channels, with so many.
///
/// # Errors
/// It does not have so many. The numbers that there are.
pub(crate) fn with_channels(
    drive: &'static Personality,
    channels: Option<u8>,
) -> Result<&'static Personality, Failure> {
    let Some(channels) = channels.map(usize::from) else {
        return Ok(drive);
    };
    // The one with more than one channel has their number behind its name.
    let of = |number: usize| {
        let name = format!("{}-{number}", drive.name);
        let is_it = |other: &&&Personality| match other.axes.len() == number {
            true => other.name == drive.name || other.name == name,
            false => false,
        };
        personalities::ALL.iter().find(is_it).copied()
    };
    of(channels).ok_or_else(|| {
        let numbers = (1..=9).filter(|number| of(*number).is_some());
        let numbers: Vec<String> = numbers.map(|number| number.to_string()).collect();
        Failure::input(format!(
            "{} does not come with {channels} channels; it comes with {}",
            drive.name,
            numbers.join(", ")
        ))
    })
}

/// The drives, of each that comes with several numbers of channels the one with the fewest.
pub(crate) fn families() -> Vec<&'static Personality> {
    let all = personalities::ALL.iter().copied();
    let is_wider = |drive: &Personality| {
        let suffix = format!("-{}", drive.axes.len());
        drive.axes.len() > 1
            && drive
                .name
                .strip_suffix(&suffix)
                .is_some_and(|name| personalities::by_name(name).is_some())
    };
    all.filter(|drive| !is_wider(drive)).collect()
}

/// The names of all personalities.
pub(crate) fn names() -> String {
    let names: Vec<&str> = personalities::ALL.iter().map(|drive| drive.name).collect();
    names.join(", ")
}
