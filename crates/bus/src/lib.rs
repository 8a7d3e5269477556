//! Between a CAN bus and the rest of the world.
//!
//! - [`Endpoint`]: where a bus is reached, parsed from text (`socketcand://127.0.0.1:29536/can0`).
//! - [`Doors`]: lets outside programs onto a simulated bus, by socketcand and slcan over TCP, and
//!   puts it onto a CAN interface of this machine. The simulation is an ordinary synchronous
//!   thread; the sockets live in a thread of their own.
//! - [`connect`]: the other end, for a program that talks to a bus behind such a door or at an
//!   interface, simulated or real.
//! - [`SerialLines`]: the serial lines of simulated devices, as TCP ports or pseudo-terminals.
//! - [`recording`]: what went over a bus, as candump's log, pcapng or MCAP.
//!
//! Nothing here falls back: a bus that cannot be reached is an error, never an imitation.

mod connection;
mod doors;
mod endpoint;
mod error_frame;
mod interface;
pub mod recording;
mod serial;
mod socketcand;

pub use connection::{
    Connection, ConnectionError, Note, Options as ConnectOptions, Received, Report, connect,
    connect_with,
};
pub use doors::{ClientId, Doors, Event, LeaveReason, OpenError, Options, Peer, Trouble};
pub use endpoint::{Endpoint, EndpointError, Protocol};
pub use error_frame::ErrorFrame;
pub use interface::InterfaceError;
pub use serial::{NoSerialEndpoint, SerialEndpoint, SerialError, SerialEvent, SerialLines};
