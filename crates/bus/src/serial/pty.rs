//! A pseudo-terminal whose other side a program opens as it would open a serial port.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

/// The terminal. While nobody has it open, this holds the other side open too: otherwise the system
/// would take the settings back that make it carry bytes as they are.
#[derive(Debug)]
pub(super) struct Pty {
    name: PathBuf,
    master: AsyncFd<File>,
    held: Option<File>,
}

impl Pty {
    /// A new one. To be called with the runtime entered in which it is to be read and written.
    pub(super) fn open() -> io::Result<Pty> {
        let pair = openpty(None, None)?;
        let name = ttyname(&pair.slave)?;
        make_raw(&pair.slave)?;
        fcntl(&pair.master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK))?;
        Ok(Pty {
            name,
            master: register(File::from(pair.master))?,
            held: Some(File::from(pair.slave)),
        })
    }

    pub(super) fn name(&self) -> &Path {
        &self.name
    }

    /// Somebody has the other side open: from now on its closing is noticed.
    pub(super) fn let_go(&mut self) {
        self.held = None;
    }

    /// Nobody has the other side open any more. Must be called after that was noticed.
    pub(super) fn hold(&mut self) -> io::Result<()> {
        let slave = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(OFlag::O_NOCTTY.bits())
            .open(&self.name)?;
        make_raw(&slave)?;
        self.held = Some(slave);
        // What has been closed once stays closed to the runtime, however often it is opened again.
        self.master = register(self.master.get_ref().try_clone()?)?;
        Ok(())
    }

    pub(super) async fn read(&self, into: &mut [u8]) -> io::Result<usize> {
        let read = |mut file: &File| file.read(into);
        self.master.async_io(Interest::READABLE, read).await
    }

    pub(super) async fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        let write = |mut file: &File| file.write(bytes);
        self.master.async_io(Interest::WRITABLE, write).await
    }
}

fn register(file: File) -> io::Result<AsyncFd<File>> {
    #[allow(
        deprecated,
        reason = "its successor is unsafe, which is forbidden here; it asks for a descriptor that \
                  stays open and the same, and File's does"
    )]
    AsyncFd::new(file)
}

/// Bytes go through as they are, and are not sent back by the system.
fn make_raw(terminal: &impl AsFd) -> io::Result<()> {
    let mut settings = tcgetattr(terminal)?;
    cfmakeraw(&mut settings);
    tcsetattr(terminal, SetArg::TCSANOW, &settings)?;
    Ok(())
}
