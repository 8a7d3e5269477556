//! Network management: the slave's states, the master's commands, and what errors do to the state.

use crate::outbox::Slot;
use crate::{Abort, Events, Instant, Node, NodeId, NodeMemory, Owner, SDO_SERVERS};

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

impl<M: NodeMemory> Node<M> {
    pub(crate) fn obey<O: Owner>(
        &mut self,
        command: Command,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        if self.state == NmtState::Initialising {
            return;
        }
        let state = match command {
            Command::Start => NmtState::Operational,
            Command::Stop => NmtState::Stopped,
            Command::EnterPreOperational => NmtState::PreOperational,
            Command::ResetNode => return events.reset = Some(Reset::Node),
            Command::ResetCommunication => return events.reset = Some(Reset::Communication),
        };
        self.change_state(state, now, owner, events);
    }

    /// A communication error that CiA 301 7.5.2.32 names has happened: a bus-off, or a heartbeat or
    /// guarding that has ceased (those the node notices itself). 0x1029,1 says what becomes of the
    /// state: 0 (and a device without the object) leaves operational, 1 changes nothing, 2 stops.
    pub fn communication_error<O: Owner>(
        &mut self,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let behaviour = match self.device.objects.error_behaviour {
            Some(handle) => self.raw(handle.field()),
            None => 0,
        };
        match behaviour {
            0 if self.state == NmtState::Operational => {
                self.change_state(NmtState::PreOperational, now, owner, events);
            }
            2 => self.change_state(NmtState::Stopped, now, owner, events),
            _ => {}
        }
    }

    fn change_state<O: Owner>(
        &mut self,
        state: NmtState,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        if self.state == state || self.state == NmtState::Initialising {
            return;
        }
        if state == NmtState::Stopped {
            // No SDO in stopped (CiA 301 table 37), so transfers end here.
            for n in 0..SDO_SERVERS as u8 {
                self.drop_transfer(n, Abort::DEVICE_STATE, owner);
                self.outbox.withdraw(Slot::Sdo(n));
            }
        }
        self.enter(state, now, events);
        events.entered = Some(state);
    }

    pub(crate) fn enter(&mut self, state: NmtState, now: Instant, events: &mut Events) {
        if self.state == NmtState::Stopped {
            self.sync.restart();
        }
        self.state = state;
        let sends_pdos = self.sends_pdos(state);
        let with_counter = self.sync.overflow > 1;
        for (n, tpdo) in self.tpdo.iter_mut().enumerate() {
            tpdo.forget();
            tpdo.count_anew(with_counter);
            if !sends_pdos {
                let slot = Slot::Tpdo(n as u8);
                if self.outbox.is_waiting(slot) {
                    // What is not sent inhibits nothing.
                    tpdo.free_at = Instant::ZERO;
                }
                self.outbox.withdraw(slot);
            }
        }
        for rpdo in &mut self.rpdo {
            rpdo.discard();
        }
        if state == NmtState::Operational {
            self.start_event_timers(now);
        }
        if state == NmtState::Stopped {
            self.outbox.withdraw(Slot::Sync);
            self.outbox.withdraw(Slot::Time);
        }
        self.outbox.hold_emergencies(state == NmtState::Stopped);
        self.release_emergency(now);
        self.sum_up_errors(events);
    }

    /// Whether TPDOs answer SYNC in `state`.
    #[inline]
    pub(crate) fn sends_pdos(&self, state: NmtState) -> bool {
        match state {
            NmtState::Operational => true,
            NmtState::PreOperational => self.device.dialect.tpdo_in_pre_operational,
            NmtState::Initialising | NmtState::Stopped => false,
        }
    }
}
