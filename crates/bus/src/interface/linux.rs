//! Linux: a raw CAN socket, bound to the interface.

use super::{Heard, InterfaceError, What};
use crate::ErrorFrame;
use can::Frame;
use socketcan::{CanFrame, CanSocket, EmbeddedFrame as _, Socket as _, SocketOptions as _};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;
use tokio::time::{Instant, sleep};

/// How long to wait before a frame is offered again that found no room in the interface's queue.
/// The system does not tell when there is room; about the time of four frames at 1 Mbit/s.
const AGAIN: Duration = Duration::from_micros(500);

/// Receive buffer asked for, bytes: some 1000 frames. The system may give less.
const BUFFER_BYTES: usize = 1 << 20;

/// An interface that is deleted goes down first. So long after that, it is clear which it is.
const FATE: Duration = Duration::from_millis(20);

/// An open interface.
#[derive(Debug)]
pub(crate) struct Interface {
    name: String,
    socket: AsyncFd<CanSocket>,
    /// The system has said that it is down, which it does once.
    down: AtomicBool,
}

impl Interface {
    /// Opens the interface of that name. To be called in a runtime, or with one entered.
    pub(crate) fn open(name: &str) -> Result<Interface, InterfaceError> {
        let socket = CanSocket::open(name).map_err(|error| cannot_open(name, error))?;
        let socket = prepare(socket).map_err(|error| trouble(name, error))?;
        Ok(Interface {
            name: name.to_owned(),
            socket,
            down: AtomicBool::new(false),
        })
    }

    /// What comes next; waits for it. May be cancelled without losing anything.
    pub(crate) async fn receive(&self) -> Result<Heard, InterfaceError> {
        loop {
            if self.down.load(Ordering::Relaxed) {
                sleep(FATE).await;
                let name = self.name.clone();
                return Err(match is_interface(&name) {
                    true => InterfaceError::Down { name },
                    false => InterfaceError::Missing { name },
                });
            }
            // An interface that goes down is told as an error alone, with nothing to be read.
            let interest = Interest::READABLE | Interest::ERROR;
            let read = self
                .socket
                .async_io(interest, |socket| socket.read_frame_with_timestamp());
            match read.await {
                Ok((frame, at)) => {
                    if let Some(what) = ours(&frame) {
                        let stamp_ns = since_1970_ns(at);
                        return Ok(Heard { stamp_ns, what });
                    }
                }
                Err(error) if error.raw_os_error() == Some(libc::ENETDOWN) => {
                    self.down.store(true, Ordering::Relaxed);
                }
                Err(error) => return Err(trouble(&self.name, error)),
            }
        }
    }

    /// Puts a frame into the interface's queue; waits at most `patience` for room in it.
    pub(crate) async fn send(
        &self,
        frame: &Frame,
        patience: Duration,
    ) -> Result<(), InterfaceError> {
        let frame = theirs(frame);
        let began = Instant::now();
        loop {
            // The system waits for room in the socket's buffer, but not in the interface's queue.
            let interest = Interest::WRITABLE | Interest::ERROR;
            let write = self
                .socket
                .async_io(interest, |socket| socket.write_frame(&frame));
            let full = match tokio::time::timeout(patience, write).await {
                Ok(Ok(())) => return Ok(()),
                Ok(Err(error)) if is_full(&error) => began.elapsed() >= patience,
                Ok(Err(error)) => return Err(trouble(&self.name, error)),
                Err(_) => true,
            };
            if full {
                let (name, waited) = (self.name.clone(), patience);
                return Err(InterfaceError::Stuck { name, waited });
            }
            sleep(AGAIN).await;
        }
    }
}

/// Sets the socket up and hands it to the runtime.
fn prepare(socket: CanSocket) -> io::Result<AsyncFd<CanSocket>> {
    socket.set_nonblocking(true)?;
    socket.set_recv_timestamp(true)?;
    socket.set_error_filter_accept_all()?;
    // Above `net.core.rmem_max` the system takes its own maximum.
    let _ = socket.as_raw_socket().set_recv_buffer_size(BUFFER_BYTES);
    // Binding to an interface that is down succeeds and leaves an error behind.
    if let Some(error) = socket.as_raw_socket().take_error()? {
        return Err(error);
    }
    #[expect(
        deprecated,
        reason = "its successor is unsafe, which is forbidden here; it asks for a descriptor that \
                  stays open and the same, and CanSocket's does"
    )]
    AsyncFd::new(socket)
}

/// ENOBUFS: no room in the queue.
fn is_full(error: &io::Error) -> bool {
    error.raw_os_error() == Some(libc::ENOBUFS)
}

fn cannot_open(name: &str, error: io::Error) -> InterfaceError {
    if error.raw_os_error() == Some(libc::ENODEV) {
        let name = name.to_owned();
        // Without CAN there are no CAN interfaces, and with that name there may be another one.
        return match CanSocket::open_iface(0) {
            Err(other) if no_can(&other) => InterfaceError::NoCan { name },
            _ if is_interface(&name) => InterfaceError::NotCan { name },
            _ => InterfaceError::Missing { name },
        };
    }
    trouble(name, error)
}

/// EAFNOSUPPORT, EPROTONOSUPPORT: no CAN sockets, or none for frames.
fn no_can(error: &io::Error) -> bool {
    matches!(
        error.raw_os_error(),
        Some(libc::EPROTONOSUPPORT | libc::EAFNOSUPPORT)
    )
}

fn is_interface(name: &str) -> bool {
    socketcan::CanAddr::from_iface(name).is_ok()
}

fn trouble(name: &str, source: io::Error) -> InterfaceError {
    let name = name.to_owned();
    match source.raw_os_error() {
        _ if no_can(&source) => InterfaceError::NoCan { name },
        Some(libc::ENODEV | libc::ENXIO) => InterfaceError::Missing { name },
        Some(libc::ENETDOWN) => InterfaceError::Down { name },
        Some(libc::EPERM | libc::EACCES) => InterfaceError::Permission { name, source },
        _ => InterfaceError::System { name, source },
    }
}

fn since_1970_ns(at: SystemTime) -> u64 {
    let since = at
        .duration_since(SystemTime::UNIX_EPOCH)
        .unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// The system's frame as ours; nothing for a kind that does not exist.
fn ours(frame: &CanFrame) -> Option<What> {
    match frame {
        CanFrame::Data(frame) => Frame::data_frame(frame.id(), frame.data()).map(What::Frame),
        CanFrame::Remote(frame) => {
            let length = u8::try_from(frame.dlc()).ok()?;
            Frame::remote_frame(frame.id(), length).map(What::Frame)
        }
        CanFrame::Error(frame) => {
            let mut data = [0; 8];
            for (byte, value) in data.iter_mut().zip(frame.data()) {
                *byte = *value;
            }
            let class = frame.error_bits();
            Some(What::Error(ErrorFrame { class, data }))
        }
    }
}

/// Our frame as the system's.
fn theirs(frame: &Frame) -> CanFrame {
    let made = if frame.is_remote() {
        CanFrame::new_remote(frame.id(), usize::from(frame.len()))
    } else {
        CanFrame::new(frame.id(), frame.data())
    };
    // Of at most eight bytes, so there is one.
    made.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::{ExtendedId, Id, StandardId};

    #[test]
    fn frames_go_over_and_back() {
        let standard: Id = StandardId::new(0x601).unwrap().into();
        let extended: Id = ExtendedId::new(0x1ABC_DEF0).unwrap().into();
        let frames = [
            Frame::data_frame(standard, &[]),
            Frame::data_frame(standard, &[1, 2, 3, 4, 5, 6, 7, 8]),
            Frame::data_frame(extended, &[0xAB]),
            Frame::remote_frame(standard, 0),
            Frame::remote_frame(extended, 8),
        ];
        for frame in frames {
            let frame = frame.unwrap();
            assert_eq!(ours(&theirs(&frame)), Some(What::Frame(frame)));
        }
    }

    #[test]
    fn error_frames_are_told_apart() {
        let frame = socketcan::CanErrorFrame::new_error(0x204, &[0, 4, 0, 0, 0, 0, 1, 2]).unwrap();
        let expected = ErrorFrame {
            class: 0x204,
            data: [0, 4, 0, 0, 0, 0, 1, 2],
        };
        assert_eq!(ours(&frame.into()), Some(What::Error(expected)));
    }

    /// Each number of an error becomes the message that helps.
    #[test]
    fn errors_in_words() {
        let table = [
            (
                libc::ENODEV,
                "there is no CAN interface vcan9: `ip link` lists",
            ),
            (libc::ENXIO, "there is no CAN interface vcan9"),
            (
                libc::ENETDOWN,
                "the CAN interface vcan9 is down: switch it on by `ip link set vcan9 up`",
            ),
            (
                libc::EAFNOSUPPORT,
                "this kernel has no CAN sockets (AF_CAN), so there is no vcan9",
            ),
            (libc::EPROTONOSUPPORT, "this kernel has no CAN sockets"),
            (
                libc::EPERM,
                "this user may not open the CAN interface vcan9",
            ),
            (libc::EACCES, "this user may not open"),
            (libc::ENOMEM, "the CAN interface vcan9: "),
        ];
        for (number, words) in table {
            let error = io::Error::from_raw_os_error(number);
            let message = trouble("vcan9", error).to_string();
            assert!(message.starts_with(words), "{number}: {message}");
        }
    }

    /// Here there may be CAN or not: in either case one message.
    #[tokio::test]
    async fn what_is_not_there_is_told() {
        let error = Interface::open("no-such-can").unwrap_err();
        assert!(
            matches!(
                error,
                InterfaceError::Missing { .. }
                    | InterfaceError::NoCan { .. }
                    | InterfaceError::Permission { .. }
            ),
            "{error}"
        );
    }
}
