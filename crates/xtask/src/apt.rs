//! Debian packages, for a machine that this program may change: one where it runs as root.

use std::process::Command;

use crate::command::{ask, succeed};
use crate::step::Trouble;

/// Whether `program` can be started from `PATH`.
pub(crate) fn has(program: &str) -> bool {
    ask(Command::new("sh").args(["-c", "command -v -- \"$0\"", program])).is_some()
}

/// Whether this program runs as root where there is apt.
pub(crate) fn may_install() -> bool {
    let root = ask(Command::new("id").arg("-u")).is_some_and(|id| id.trim() == "0");
    root && has("apt-get")
}

/// Makes sure that `program` is there, if need be from the Debian package of that name.
///
/// # Errors
/// [`Trouble::Impossible`] where that is not for this program to do.
pub(crate) fn need(program: &str, packages: &[&str]) -> Result<(), Trouble> {
    if has(program) {
        return Ok(());
    }
    install(packages, &format!("{program} is not installed"))?;
    if has(program) {
        Ok(())
    } else {
        Err(Trouble::Failed(format!(
            "{} brought no {program}",
            packages.join(", ")
        )))
    }
}

/// Installs packages; `why` says what is missing.
///
/// # Errors
/// [`Trouble::Impossible`] where that is not for this program to do, or apt could not.
pub(crate) fn install(packages: &[&str], why: &str) -> Result<(), Trouble> {
    let remedy = format!(
        "install it (Debian: apt-get install {})",
        packages.join(" ")
    );
    if !may_install() {
        return Err(Trouble::impossible(why, remedy));
    }
    println!(
        "{why}: installing the Debian packages {}",
        packages.join(", ")
    );
    let install = || {
        succeed(
            Command::new("apt-get")
                .args(["install", "-y", "-q", "--no-install-recommends"])
                .args(packages)
                .env("DEBIAN_FRONTEND", "noninteractive"),
        )
    };
    // A fresh machine knows no packages, a stale one asks for versions that are gone.
    if !packages.iter().all(|package| known(package)) || install().is_err() {
        let again = update().and_then(|()| install());
        return match again {
            Ok(_) => Ok(()),
            Err(_) => Err(Trouble::impossible(
                format!("{why}, and apt could not"),
                remedy,
            )),
        };
    }
    Ok(())
}

/// Whether apt knows the package.
pub(crate) fn known(package: &str) -> bool {
    candidate(package).is_some()
}

/// The version of a package that apt would install.
pub(crate) fn candidate(package: &str) -> Option<String> {
    let policy = ask(Command::new("apt-cache").args(["policy", package]))?;
    parse_candidate(&policy)
}

fn parse_candidate(policy: &str) -> Option<String> {
    let line = policy
        .lines()
        .find_map(|line| line.trim().strip_prefix("Candidate:"))?;
    Some(line.trim().to_owned()).filter(|version| version != "(none)")
}

/// Fetches the lists of packages.
///
/// # Errors
/// Apt's own.
pub(crate) fn update() -> Result<(), Trouble> {
    succeed(Command::new("apt-get").args(["update", "-q"])).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_candidate_is_read_from_the_policy() {
        let policy =
            "tshark:\n  Installed: (none)\n  Candidate: 4.0.17-0+deb12u3\n  Version table:\n";
        assert_eq!(parse_candidate(policy).as_deref(), Some("4.0.17-0+deb12u3"));
        assert_eq!(parse_candidate("x:\n  Candidate: (none)\n"), None);
        assert_eq!(parse_candidate(""), None);
    }
}
