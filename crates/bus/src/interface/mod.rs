//! A CAN interface of this machine, through Linux's CAN sockets (SocketCAN).
//!
//! What an interface hears includes what other programs on this machine send by it; what this
//! program sends by it does not come back. Frames of CAN FD are left out by the system, because
//! nobody here asks for them.

#[cfg(target_os = "linux")]
mod linux;
#[cfg(not(target_os = "linux"))]
mod missing;

#[cfg(target_os = "linux")]
pub(crate) use linux::Interface;
#[cfg(not(target_os = "linux"))]
pub(crate) use missing::Interface;

use crate::ErrorFrame;
use can::Frame;
use std::io;
use std::time::Duration;

/// What came from an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Heard {
    /// When the system got it, in nanoseconds since 1970.
    pub(crate) stamp_ns: u64,
    pub(crate) what: What,
}

/// A frame of the bus, or a message from the controller's driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    not(target_os = "linux"),
    expect(dead_code, reason = "other systems have no interfaces to hear")
)]
pub(crate) enum What {
    Frame(Frame),
    Error(ErrorFrame),
}

/// Why an interface cannot be used, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InterfaceError {
    /// Another operating system.
    #[error(
        "socketcan://{name} needs Linux, whose CAN sockets it uses: reach the bus by \
         socketcand:// or slcan:// instead"
    )]
    NotLinux {
        /// The interface asked for.
        name: String,
    },
    /// The system has no CAN sockets.
    #[error(
        "this kernel has no CAN sockets (AF_CAN), so there is no {name}: load them by \
         `modprobe can-raw`, or reach the bus by socketcand:// or slcan://"
    )]
    NoCan {
        /// The interface asked for.
        name: String,
    },
    /// No interface of that name, or not any more.
    #[error(
        "there is no CAN interface {name}: `ip link` lists those there are; a virtual one is made \
         by `ip link add {name} type vcan`"
    )]
    Missing {
        /// The interface asked for.
        name: String,
    },
    /// An interface for something else.
    #[error("{name} is a network interface, but none for CAN: `ip link show type can` lists those")]
    NotCan {
        /// The interface asked for.
        name: String,
    },
    /// It is switched off.
    #[error(
        "the CAN interface {name} is down: switch it on by `ip link set {name} up` (a real one \
         needs its bit rate before: `ip link set {name} type can bitrate 1000000`)"
    )]
    Down {
        /// Which interface.
        name: String,
    },
    /// The system does not let this user.
    #[error("this user may not open the CAN interface {name}: {source}; ask for CAP_NET_RAW")]
    Permission {
        /// Which interface.
        name: String,
        /// What the system says.
        source: io::Error,
    },
    /// It sends nothing.
    #[error(
        "the CAN interface {name} has sent no frame for {waited:?}: nobody on the bus acknowledges \
         them; check the wiring, its termination and the bit rate, or whether it is bus-off \
         (`ip -details link show {name}`)"
    )]
    Stuck {
        /// Which interface.
        name: String,
        /// How long a frame has waited.
        waited: Duration,
    },
    /// Something else.
    #[error("the CAN interface {name}: {source}")]
    System {
        /// Which interface.
        name: String,
        /// What the system says.
        source: io::Error,
    },
}
