//! Which documented drive, by the name on the command line.

use personalities::Personality;

/// Finds a personality by its name.
///
/// # Errors
/// The names there are.
pub(crate) fn parse(name: &str) -> Result<&'static Personality, String> {
    personalities::by_name(name)
        .ok_or_else(|| format!("there is no such drive; there are: {}", names()))
}

/// The names of all personalities.
pub(crate) fn names() -> String {
    let names: Vec<&str> = personalities::ALL.iter().map(|drive| drive.name).collect();
    names.join(", ")
}
