//! The master's side of one CiA 402 axis: its state machine, modes, set-points and targets.
//!
//! Everything here goes by SDO and reads back what it did. Cyclic set-points go by PDO:
//! [`crate::pdo`].

mod error;

use std::fmt;

use canopen::{Address, DataType, Instant, NodeId};
use cia402::{Mode, State, Statusword};

use crate::sdo::{Cause, SdoError};
use crate::{Client, Link, Value};

pub use error::AxisError;

/// Controlwords. Bits 0 to 3 are the command (CiA 402-2, table "command coding").
mod word {
    pub(super) const DISABLE_VOLTAGE: u16 = 0x0000;
    pub(super) const SHUTDOWN: u16 = 0x0006;
    pub(super) const SWITCH_ON: u16 = 0x0007;
    pub(super) const ENABLE_OPERATION: u16 = 0x000F;
    pub(super) const FAULT_RESET: u16 = 0x0080;
    /// Bits of profile position mode.
    pub(super) const NEW_SET_POINT: u16 = 0x0010;
    pub(super) const RELATIVE: u16 = 0x0040;
}

/// How a master walks to operation enabled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Walk {
    /// One transition with each write: 0x0080, 0x0006, 0x0007, 0x000F.
    #[default]
    Standard,
    /// 0x0086 and 0x000F, as the P3's manual prints it (l.324): for drives that obey reset and
    /// command in one write.
    Short,
}

/// One axis of a node, seen by a master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axis {
    /// Whose.
    pub node: NodeId,
    /// Index of its first object: 0x6000, and 0x800 more for each further axis.
    pub base: u16,
    /// How it is enabled.
    pub walk: Walk,
    /// How often it is asked while something is waited for, in milliseconds.
    pub poll_ms: u64,
    /// How long a transition, a mode change or an acknowledge may take, in milliseconds.
    pub within_ms: u64,
}

/// What an axis is to come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// Actual position (0x6064).
    Position {
        /// In the drive's position unit.
        target: i32,
        /// How far off it may be.
        window: u32,
    },
    /// Actual velocity (0x606C).
    Velocity {
        /// In the drive's velocity unit.
        target: i32,
        /// How far off it may be.
        window: u32,
    },
    /// Actual torque (0x6077).
    Torque {
        /// Per mille of rated torque.
        target_pm: i16,
        /// How far off it may be, per mille.
        window_pm: u16,
    },
}

impl Goal {
    /// Whether an actual value is inside the window, its border included. Positions wrap at 32
    /// bits.
    pub fn holds(&self, actual: i64) -> bool {
        match *self {
            Goal::Position { target, window } => {
                (actual as i32).wrapping_sub(target).unsigned_abs() <= window
            }
            Goal::Velocity { target, window } => {
                actual.abs_diff(i64::from(target)) <= u64::from(window)
            }
            Goal::Torque {
                target_pm,
                window_pm,
            } => actual.abs_diff(i64::from(target_pm)) <= u64::from(window_pm),
        }
    }

    /// Index of the actual value above the axis's base, and its type.
    fn actual(&self) -> (u16, DataType) {
        match self {
            Goal::Position { .. } => (0x64, DataType::I32),
            Goal::Velocity { .. } => (0x6C, DataType::I32),
            Goal::Torque { .. } => (0x77, DataType::I16),
        }
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Goal::Position { target, window } => write!(f, "position {target} \u{b1} {window}"),
            Goal::Velocity { target, window } => write!(f, "velocity {target} \u{b1} {window}"),
            Goal::Torque {
                target_pm,
                window_pm,
            } => write!(f, "torque {target_pm} \u{b1} {window_pm} per mille"),
        }
    }
}

impl Axis {
    /// The first axis of `node`, walked by the standard, asked every 5 ms, with 500 ms for a
    /// transition.
    pub const fn new(node: NodeId) -> Axis {
        Axis {
            node,
            base: 0x6000,
            walk: Walk::Standard,
            poll_ms: 5,
            within_ms: 500,
        }
    }

    /// The address of an object of this axis, given as that of the first: 0x6040 for the
    /// controlword.
    const fn object(&self, index: u16) -> Address {
        Address::new(self.base.wrapping_add(index & 0x7FF), 0)
    }

    async fn read<L: Link>(
        &self,
        client: &mut Client<L>,
        index: u16,
        data_type: DataType,
    ) -> Result<i64, SdoError> {
        let object = self.object(index);
        match client.read(self.node, object, data_type).await? {
            Value::Integer(value) => Ok(value),
            // No integer type decodes to these.
            Value::Real(_) | Value::Text(_) => Ok(0),
        }
    }

    /// Writes an integer object of this axis, given by the index that it has at the first axis.
    ///
    /// # Errors
    /// A value that does not fit, or an SDO transfer that failed.
    pub async fn write<L: Link>(
        &self,
        client: &mut Client<L>,
        index: u16,
        data_type: DataType,
        value: i64,
    ) -> Result<(), AxisError> {
        let data = Value::Integer(value).encode(data_type)?;
        client.download(self.node, self.object(index), data).await?;
        Ok(())
    }

    /// Reads the statusword (0x6041).
    ///
    /// # Errors
    /// The SDO transfer failed.
    pub async fn statusword<L: Link>(
        &self,
        client: &mut Client<L>,
    ) -> Result<Statusword, AxisError> {
        let word = self.read(client, 0x6041, DataType::U16).await?;
        Ok(Statusword(word as u16))
    }

    /// Writes the controlword (0x6040).
    ///
    /// # Errors
    /// The SDO transfer failed.
    pub async fn command<L: Link>(
        &self,
        client: &mut Client<L>,
        word: u16,
    ) -> Result<(), AxisError> {
        self.write(client, 0x6040, DataType::U16, i64::from(word))
            .await
    }

    /// Waits `poll_ms`, or less if `until` is nearer. Frames that come go to the client's inbox.
    async fn pause<L: Link>(
        &self,
        client: &mut Client<L>,
        until: Instant,
    ) -> Result<(), AxisError> {
        let until = client.now().plus_ms(self.poll_ms.max(1)).min(until);
        let nothing = client.wait_for(until, |_, _| None::<()>).await;
        nothing.map(|_| ()).map_err(|error| {
            AxisError::Sdo(SdoError {
                node: self.node,
                object: self.object(0x6041),
                access: crate::sdo::Access::Read,
                cause: Cause::Link(error),
            })
        })
    }

    /// The fault with the code that the drive tells.
    async fn fault<L: Link>(&self, client: &mut Client<L>) -> AxisError {
        let code = self.read(client, 0x603F, DataType::U16).await;
        AxisError::Fault {
            node: self.node,
            code: code.ok().map(|code| code as u16),
        }
    }

    /// Writes `word` and asks until the state is `wanted`.
    async fn go<L: Link>(
        &self,
        client: &mut Client<L>,
        word: u16,
        wanted: State,
    ) -> Result<Statusword, AxisError> {
        self.command(client, word).await?;
        let until = client.now().plus_ms(self.within_ms);
        loop {
            let seen = self.statusword(client).await?;
            match seen.state() {
                Some(state) if state == wanted => return Ok(seen),
                Some(State::Fault) => return Err(self.fault(client).await),
                _ if client.now() >= until => {
                    return Err(AxisError::State {
                        node: self.node,
                        wanted,
                        seen,
                        within_ms: self.within_ms,
                    });
                }
                _ => self.pause(client, until).await?,
            }
        }
    }

    /// Resets a fault: the drive is in switch on disabled afterwards. Does nothing if there is none.
    ///
    /// # Errors
    /// [`AxisError::Fault`] if the cause is still there.
    pub async fn reset_fault<L: Link>(&self, client: &mut Client<L>) -> Result<(), AxisError> {
        if self.settled(client).await?.state() != Some(State::Fault) {
            return Ok(());
        }
        // Only the rising edge of bit 7 acts.
        self.command(client, word::DISABLE_VOLTAGE).await?;
        self.go(client, word::FAULT_RESET, State::SwitchOnDisabled)
            .await?;
        Ok(())
    }

    /// The statusword when the drive is in no state that it leaves by itself.
    async fn settled<L: Link>(&self, client: &mut Client<L>) -> Result<Statusword, AxisError> {
        let until = client.now().plus_ms(self.within_ms);
        loop {
            let seen = self.statusword(client).await?;
            let passing = matches!(
                seen.state(),
                None | Some(State::NotReadyToSwitchOn | State::FaultReactionActive)
            );
            if !passing || client.now() >= until {
                return Ok(seen);
            }
            self.pause(client, until).await?;
        }
    }

    /// Walks to operation enabled from whatever state it is in, resetting a fault on the way.
    ///
    /// # Errors
    /// [`AxisError::Fault`] if there is a fault that does not go, [`AxisError::State`] if the drive
    /// does not follow.
    pub async fn enable<L: Link>(&self, client: &mut Client<L>) -> Result<Statusword, AxisError> {
        let mut seen = self.settled(client).await?;
        if seen.state() == Some(State::QuickStopActive) {
            seen = self
                .go(client, word::DISABLE_VOLTAGE, State::SwitchOnDisabled)
                .await?;
        }
        if seen.state() == Some(State::Fault) {
            match self.walk {
                Walk::Standard => self.reset_fault(client).await?,
                Walk::Short => self.command(client, word::DISABLE_VOLTAGE).await?,
            }
            seen = Statusword(State::SwitchOnDisabled.pattern());
        }
        if seen.state() == Some(State::SwitchOnDisabled) {
            let shutdown = match self.walk {
                Walk::Standard => word::SHUTDOWN,
                Walk::Short => word::FAULT_RESET | word::SHUTDOWN,
            };
            seen = self.go(client, shutdown, State::ReadyToSwitchOn).await?;
        }
        if seen.state() == Some(State::ReadyToSwitchOn) && self.walk == Walk::Standard {
            self.go(client, word::SWITCH_ON, State::SwitchedOn).await?;
        }
        self.go(client, word::ENABLE_OPERATION, State::OperationEnabled)
            .await
    }

    /// Takes the power from the motor: switch on disabled. A drive in fault stays there.
    ///
    /// # Errors
    /// [`AxisError`].
    pub async fn disable<L: Link>(&self, client: &mut Client<L>) -> Result<Statusword, AxisError> {
        self.go(client, word::DISABLE_VOLTAGE, State::SwitchOnDisabled)
            .await
    }

    /// Sets the mode of operation (0x6060) and waits until the drive shows it (0x6061).
    ///
    /// # Errors
    /// [`AxisError::Sdo`] if the drive refuses it, [`AxisError::Mode`] if it never shows it.
    pub async fn set_mode<L: Link>(
        &self,
        client: &mut Client<L>,
        mode: Mode,
    ) -> Result<(), AxisError> {
        self.write(client, 0x6060, DataType::I8, i64::from(mode.0))
            .await?;
        let until = client.now().plus_ms(self.within_ms);
        loop {
            let shown = Mode(self.read(client, 0x6061, DataType::I8).await? as i8);
            if shown == mode {
                return Ok(());
            }
            if client.now() >= until {
                return Err(AxisError::Mode {
                    node: self.node,
                    wanted: mode,
                    shown,
                    within_ms: self.within_ms,
                });
            }
            self.pause(client, until).await?;
        }
    }

    /// Hands a target to profile position mode: 0x607A, then the handshake of controlword bit 4 and
    /// statusword bit 12. Returns when the set-point was acknowledged and released; the move may be
    /// under way still. A relative target counts from the target before.
    ///
    /// # Errors
    /// [`AxisError::Handshake`]; [`AxisError::State`] if the drive is not in operation enabled.
    pub async fn move_to<L: Link>(
        &self,
        client: &mut Client<L>,
        target: i32,
        relative: bool,
    ) -> Result<(), AxisError> {
        let word = match relative {
            true => word::ENABLE_OPERATION | word::RELATIVE,
            false => word::ENABLE_OPERATION,
        };
        self.write(client, 0x607A, DataType::I32, i64::from(target))
            .await?;
        self.handshake(client, word | word::NEW_SET_POINT, true)
            .await?;
        self.handshake(client, word::ENABLE_OPERATION, false).await
    }

    async fn handshake<L: Link>(
        &self,
        client: &mut Client<L>,
        word: u16,
        wanted: bool,
    ) -> Result<(), AxisError> {
        self.command(client, word).await?;
        let until = client.now().plus_ms(self.within_ms);
        loop {
            let seen = self.statusword(client).await?;
            self.must_be_enabled(client, seen).await?;
            if seen.set_point_acknowledge() == wanted {
                return Ok(());
            }
            if client.now() >= until {
                return Err(AxisError::Handshake {
                    node: self.node,
                    wanted,
                    seen,
                    within_ms: self.within_ms,
                });
            }
            self.pause(client, until).await?;
        }
    }

    async fn must_be_enabled<L: Link>(
        &self,
        client: &mut Client<L>,
        seen: Statusword,
    ) -> Result<(), AxisError> {
        match seen.state() {
            Some(State::OperationEnabled) => Ok(()),
            Some(State::Fault | State::FaultReactionActive) => Err(self.fault(client).await),
            _ => Err(AxisError::State {
                node: self.node,
                wanted: State::OperationEnabled,
                seen,
                within_ms: 0,
            }),
        }
    }

    /// Sets the target torque (0x6071) of the torque modes, per mille of rated torque.
    ///
    /// # Errors
    /// The SDO transfer failed.
    pub async fn set_torque<L: Link>(
        &self,
        client: &mut Client<L>,
        torque_pm: i16,
    ) -> Result<(), AxisError> {
        self.write(client, 0x6071, DataType::I16, i64::from(torque_pm))
            .await
    }

    /// Asks until statusword bit 10 says "target reached" and the actual value is in the goal's
    /// window. For the modes that have bit 10: profile position, velocity and torque.
    ///
    /// # Errors
    /// [`AxisError::NotReached`] after `within_ms`; [`AxisError::Fault`] or [`AxisError::State`] as
    /// soon as the drive leaves operation enabled.
    pub async fn wait_for_target<L: Link>(
        &self,
        client: &mut Client<L>,
        goal: Goal,
        within_ms: u64,
    ) -> Result<Instant, AxisError> {
        let until = client.now().plus_ms(within_ms);
        let (index, data_type) = goal.actual();
        loop {
            let seen = self.statusword(client).await?;
            self.must_be_enabled(client, seen).await?;
            let actual = self.read(client, index, data_type).await?;
            if seen.target_reached() && goal.holds(actual) {
                return Ok(client.now());
            }
            if client.now() >= until {
                return Err(AxisError::NotReached {
                    node: self.node,
                    goal,
                    actual,
                    seen,
                    within_ms,
                });
            }
            self.pause(client, until).await?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_is_held_inside_its_window_and_across_the_wrap() {
        let goal = Goal::Position {
            target: i32::MAX - 1,
            window: 3,
        };
        assert!(goal.holds(i64::from(i32::MIN) + 1)); // 3 counts further
        assert!(!goal.holds(i64::from(i32::MIN) + 2));
        assert!(goal.holds(i64::from(i32::MAX) - 4));
        assert!(!goal.holds(i64::from(i32::MAX) - 5));
        let torque = Goal::Torque {
            target_pm: -500,
            window_pm: 10,
        };
        assert!(torque.holds(-510) && torque.holds(-490));
        assert!(!torque.holds(-489) && !torque.holds(500));
    }

    #[test]
    fn further_axes_lie_0x800_above() {
        let mut axis = Axis::new(NodeId::new(1).unwrap());
        assert_eq!(axis.object(0x6040), Address::new(0x6040, 0));
        axis.base = 0x7000;
        assert_eq!(axis.object(0x6040), Address::new(0x7040, 0));
        assert_eq!(axis.object(0x603F), Address::new(0x703F, 0));
    }
}
