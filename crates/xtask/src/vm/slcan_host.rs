//! Virtual drives on the host, behind an slcan door: the kernel in the virtual machine reaches them
//! with its own slcan driver, over what it takes for a serial line.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use crate::command::ask;
use crate::step::Trouble;
use crate::workspace::Workspace;

/// The drives' recording, in the folder that is shared with the machine.
pub(super) const LOG: &str = "slcan-host.log";

/// The running simulation; ended when dropped.
#[derive(Debug)]
pub(super) struct SlcanHost {
    child: Child,
    // Kept open, or its last words would find no reader.
    _output: BufReader<ChildStdout>,
    port: u16,
}

impl SlcanHost {
    /// Starts it; what it says goes to `slcan-host.stderr.txt` in `out`.
    pub(super) fn start(workspace: &Workspace, out: &Path) -> Result<SlcanHost, Trouble> {
        let broken = |error: std::io::Error| Trouble::Failed(format!("servobus sim: {error}"));
        let said = File::create(out.join("slcan-host.stderr.txt")).map_err(broken)?;
        let mut child = workspace
            .command(workspace.servobus())
            .args(["sim", "--nodes", "1-3", "--bus", "slcan://127.0.0.1:0"])
            .arg("--record")
            .arg(out.join(LOG))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(said)
            .spawn()
            .map_err(broken)?;
        let stdout = child
            .stdout
            .take()
            .ok_or_else(|| Trouble::failed("servobus sim has no output"))?;
        let mut output = BufReader::new(stdout);
        let mut text = String::new();
        let mut port = None;
        // `ready: ...`, then `slcan://127.0.0.1:40001`.
        while port.is_none() && output.read_line(&mut text).map_err(broken)? > 0 {
            port = text
                .trim_end()
                .rsplit(':')
                .next()
                .and_then(|p| p.parse().ok());
        }
        let host = SlcanHost {
            child,
            _output: output,
            port: port.unwrap_or(0),
        };
        match host.port {
            0 => Err(Trouble::Failed(format!(
                "servobus sim told no slcan address, but: {text}"
            ))),
            _ => Ok(host),
        }
    }

    /// Where its door is.
    pub(super) fn port(&self) -> u16 {
        self.port
    }

    /// Ends it as Ctrl-C does, so that its recording is complete.
    pub(super) fn end(mut self) -> Result<(), Trouble> {
        let id = self.child.id().to_string();
        let _ = ask(Command::new("kill").args(["-INT", &id]));
        match self.child.wait() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(Trouble::Failed(format!("servobus sim ended with {status}"))),
            Err(error) => Err(Trouble::Failed(format!("servobus sim: {error}"))),
        }
    }
}

impl Drop for SlcanHost {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
