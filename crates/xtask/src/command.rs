//! Running other programs, with the command shown first.

use std::io::{self, BufRead, BufReader, Write};
use std::process::{Command, ExitStatus, Stdio};

use crate::step::Trouble;

/// A program that ran to its end.
#[derive(Debug)]
pub(crate) struct Ended {
    /// How.
    pub(crate) status: ExitStatus,
    /// What it printed to its standard output, which was also shown.
    pub(crate) output: String,
}

/// Shows the command and what it prints, and returns when it ends.
///
/// # Errors
/// [`Trouble::Impossible`] if there is no such program.
pub(crate) fn run(command: &mut Command) -> Result<Ended, Trouble> {
    println!("$ {}", line(command));
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| cannot_start(command, &error))?;
    let mut output = String::new();
    if let Some(stdout) = child.stdout.take() {
        let mut shown = io::stdout().lock();
        for text in BufReader::new(stdout).split(b'\n') {
            let text = text.map_err(|error| cannot_start(command, &error))?;
            let text = String::from_utf8_lossy(&text);
            // A reader that went away does not stop the checks.
            let _ = writeln!(shown, "{text}");
            output.push_str(&text);
            output.push('\n');
        }
    }
    let status = child
        .wait()
        .map_err(|error| cannot_start(command, &error))?;
    Ok(Ended { status, output })
}

/// As [`run`], for a program that must succeed.
///
/// # Errors
/// [`Trouble::Failed`] if it does not.
pub(crate) fn succeed(command: &mut Command) -> Result<String, Trouble> {
    let ended = run(command)?;
    if ended.status.success() {
        Ok(ended.output)
    } else {
        Err(Trouble::Failed(format!(
            "`{}` ended with {}",
            line(command),
            ended.status
        )))
    }
}

/// Runs a question silently: its standard output, or `None` if it fails or is not there.
pub(crate) fn ask(command: &mut Command) -> Option<String> {
    let output = command.stdin(Stdio::null()).output().ok()?;
    if !output.status.success() {
        return None;
    }
    String::from_utf8(output.stdout).ok()
}

fn cannot_start(command: &Command, error: &io::Error) -> Trouble {
    let program = command.get_program().to_string_lossy().into_owned();
    if error.kind() == io::ErrorKind::NotFound {
        let remedy = format!("install {program}");
        return Trouble::impossible(format!("{program} is not installed"), remedy);
    }
    Trouble::Failed(format!("{program}: {error}"))
}

/// The command as one would type it, with the variables that are set for it.
fn line(command: &Command) -> String {
    let mut words = Vec::new();
    for (name, value) in command.get_envs() {
        if let Some(value) = value {
            words.push(format!(
                "{}={}",
                name.to_string_lossy(),
                quoted(&value.to_string_lossy())
            ));
        }
    }
    let program = command.get_program().to_string_lossy();
    // rustup's cargo by its short name.
    let program = match program.rsplit_once('/') {
        Some((_, "cargo")) => "cargo",
        _ => &program,
    };
    words.push(quoted(program));
    for argument in command.get_args() {
        words.push(quoted(&argument.to_string_lossy()));
    }
    words.join(" ")
}

/// A word for a shell.
pub(crate) fn quoted(word: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_./=:,+@%".contains(&byte);
    if !word.is_empty() && word.bytes().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_shown_as_one_would_type_it() {
        let mut command = Command::new("/anywhere/bin/cargo");
        command
            .args(["doc", "it's"])
            .env("RUSTDOCFLAGS", "-D warnings");
        command.env_remove("CARGO_PKG_NAME");
        assert_eq!(
            line(&command),
            r"RUSTDOCFLAGS='-D warnings' cargo doc 'it'\''s'"
        );
    }

    #[test]
    fn a_program_that_is_not_there_is_named() {
        let mut command = Command::new("no-such-program-of-servobus");
        let trouble = succeed(&mut command).unwrap_err();
        assert!(
            matches!(&trouble, Trouble::Impossible { why, .. }
                if why == "no-such-program-of-servobus is not installed"),
            "{trouble:?}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn output_is_kept_and_failure_told() {
        let mut good = Command::new("sh");
        good.args(["-c", "echo one; echo two"]);
        assert_eq!(succeed(&mut good).unwrap(), "one\ntwo\n");
        let mut bad = Command::new("sh");
        bad.args(["-c", "exit 3"]);
        let trouble = succeed(&mut bad).unwrap_err();
        assert!(matches!(&trouble, Trouble::Failed(what) if what.contains("exit status: 3")));
        assert_eq!(ask(&mut bad), None);
        assert_eq!(ask(&mut good).as_deref(), Some("one\ntwo\n"));
    }
}
