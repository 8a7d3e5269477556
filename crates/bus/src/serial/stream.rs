//! A socket or a terminal.

use std::io;

use tokio::net::TcpStream;

/// The other end of a line. Its functions can be given up without losing anything.
#[derive(Debug)]
pub(super) enum Stream<'a> {
    Tcp(TcpStream),
    #[cfg(unix)]
    Pty(&'a super::pty::Pty),
    #[cfg(not(unix))]
    Never(std::convert::Infallible, std::marker::PhantomData<&'a ()>),
}

impl Stream<'_> {
    /// Reads what there is; 0 is the end. Waits until there is something.
    pub(super) async fn read(&self, into: &mut [u8]) -> io::Result<usize> {
        match self {
            Stream::Tcp(stream) => loop {
                stream.readable().await?;
                match stream.try_read(into) {
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                    read => return read,
                }
            },
            #[cfg(unix)]
            Stream::Pty(pty) => pty.read(into).await,
            #[cfg(not(unix))]
            Stream::Never(never, _) => match *never {},
        }
    }

    /// Writes some of it, and says how much. Waits until there is room.
    pub(super) async fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Stream::Tcp(stream) => loop {
                stream.writable().await?;
                match stream.try_write(bytes) {
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                    written => return written,
                }
            },
            #[cfg(unix)]
            Stream::Pty(pty) => pty.write(bytes).await,
            #[cfg(not(unix))]
            Stream::Never(never, _) => match *never {},
        }
    }
}
