//! Network management: the slave's states and the master's commands.

use crate::NodeId;

/// State of an NMT slave (CiA 301 7.3.2.2). The number is what a heartbeat carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum NmtState {
    /// Not started yet; answers nothing.
    Initialising = 0x00,
    /// NMT and heartbeat only.
    Stopped = 0x04,
    /// Everything.
    Operational = 0x05,
    /// Everything but PDOs (a dialect may differ).
    PreOperational = 0x7F,
}

impl NmtState {
    /// From a heartbeat's byte; bit 7 (the toggle of node guarding) is ignored.
    pub const fn from_heartbeat(byte: u8) -> Option<NmtState> {
        match byte & 0x7F {
            0x00 => Some(NmtState::Initialising),
            0x04 => Some(NmtState::Stopped),
            0x05 => Some(NmtState::Operational),
            0x7F => Some(NmtState::PreOperational),
            _ => None,
        }
    }
}

impl core::fmt::Display for NmtState {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            NmtState::Initialising => "boot-up",
            NmtState::Stopped => "stopped",
            NmtState::Operational => "operational",
            NmtState::PreOperational => "pre-operational",
        })
    }
}

/// What an NMT master asks (CiA 301 7.2.8.3.1). The number is the command specifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Command {
    /// Enter operational.
    Start = 0x01,
    /// Enter stopped.
    Stop = 0x02,
    /// Enter pre-operational.
    EnterPreOperational = 0x80,
    /// Start over as after power-on.
    ResetNode = 0x81,
    /// Start over with the communication parameters only.
    ResetCommunication = 0x82,
}

impl Command {
    /// From the first byte of an NMT frame.
    pub const fn from_byte(byte: u8) -> Option<Command> {
        match byte {
            0x01 => Some(Command::Start),
            0x02 => Some(Command::Stop),
            0x80 => Some(Command::EnterPreOperational),
            0x81 => Some(Command::ResetNode),
            0x82 => Some(Command::ResetCommunication),
            _ => None,
        }
    }
}

impl core::fmt::Display for Command {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Command::Start => "start",
            Command::Stop => "stop",
            Command::EnterPreOperational => "enter pre-operational",
            Command::ResetNode => "reset node",
            Command::ResetCommunication => "reset communication",
        })
    }
}

/// What was asked to start over. The node does nothing by itself: its owner builds it anew from
/// what is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// The whole device, as after power-on.
    Node,
    /// Communication only: the application keeps its state.
    Communication,
}

/// The command in an NMT frame if it is addressed to `node` (or to all). Anything but exactly two
/// bytes is not an NMT command.
pub(crate) fn command_for(node: NodeId, data: &[u8]) -> Option<Command> {
    let &[command, target] = data else {
        return None;
    };
    (target == 0 || target == node.get())
        .then(|| Command::from_byte(command))
        .flatten()
}
