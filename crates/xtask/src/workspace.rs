//! Where things are.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The checkout.
#[derive(Debug)]
pub(crate) struct Workspace {
    root: PathBuf,
    target: PathBuf,
}

impl Workspace {
    /// The workspace that this program was built in.
    ///
    /// # Errors
    /// A sentence, if that place is gone.
    pub(crate) fn find() -> Result<Workspace, String> {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
        let root = manifest
            .ancestors()
            .nth(2)
            .filter(|root| root.join("Cargo.lock").is_file())
            .ok_or_else(|| format!("{} is not in a workspace any more", manifest.display()))?;
        let target = match env::var_os("CARGO_TARGET_DIR") {
            Some(target) => root.join(target),
            None => root.join("target"),
        };
        Ok(Workspace {
            root: root.to_path_buf(),
            target,
        })
    }

    /// The checkout's directory.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Cargo's target directory, which also takes what the steps download and write.
    pub(crate) fn target(&self) -> &Path {
        &self.target
    }

    /// The `servobus` program of the dev profile; `cargo build` makes it.
    pub(crate) fn servobus(&self) -> PathBuf {
        let name = format!("servobus{}", env::consts::EXE_SUFFIX);
        self.target.join("debug").join(name)
    }

    /// A command that starts in the checkout.
    pub(crate) fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command.current_dir(&self.root);
        // What `cargo run` tells this program about itself is not for its children: a build script
        // that watches one of these would run again each time.
        for (name, _) in env::vars_os() {
            let name = name.to_string_lossy().into_owned();
            if name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_") {
                command.env_remove(name);
            }
        }
        command
    }

    /// Cargo, in the checkout.
    pub(crate) fn cargo(&self) -> Command {
        self.command(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
    }
}
