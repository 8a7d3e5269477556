//! The fault manager: which errors there are, which are latched, what is announced.

use canopen::{Image, Instant};
use cia402::Conditions;
use control::Feedback;
use control::io::{Magnet, Signals};
use personalities::{Cause, FaultRow, Kind, Personality, States, Switch};

use crate::captures::{HOME, NEGATIVE_LIMIT, POSITIVE_LIMIT};
use crate::configuration::value;

/// Counts within a millisecond beyond which a position has not moved but got another sign (0x607E).
const RENAMED: u32 = 1 << 20;

/// What the host knows of the drive's health and the drive cannot measure: each is an event.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// This start follows a reset by the watchdog.
    pub watchdog_reset: bool,
    /// The stored parameters were damaged and are not used.
    pub store_damaged: bool,
    /// The CAN controller lost received frames.
    pub can_overrun: bool,
    /// The CAN controller has recovered from bus-off.
    pub bus_off_recovered: bool,
    /// The CAN controller is error passive, or has been since the last report.
    pub error_passive: bool,
}

/// Errors of communication that the node notices: a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct CommunicationErrors(u8);

impl CommunicationErrors {
    /// A monitored heartbeat or the guarding is missing.
    const HEARTBEAT_LOST: u8 = 1 << 0;
    /// An RPDO has not come within its time.
    const RPDO_TIMEOUT: u8 = 1 << 1;
    /// An RPDO was shorter than its mapping, and ignored.
    const PDO_TOO_SHORT: u8 = 1 << 2;
    /// An RPDO was longer than its mapping.
    const PDO_TOO_LONG: u8 = 1 << 3;
    /// A SYNC had another length than expected.
    const SYNC_LENGTH: u8 = 1 << 4;
    /// Those that are of a frame, and seen for a tick at least.
    const OF_A_FRAME: u8 = CommunicationErrors::PDO_TOO_SHORT
        | CommunicationErrors::PDO_TOO_LONG
        | CommunicationErrors::SYNC_LENGTH;

    /// What the node has noticed.
    pub(crate) fn of(errors: canopen::CommunicationErrors) -> CommunicationErrors {
        use canopen::CommunicationErrors as Node;
        let bits = [
            (Node::HEARTBEAT, CommunicationErrors::HEARTBEAT_LOST),
            (Node::LIFE_GUARD, CommunicationErrors::HEARTBEAT_LOST),
            (Node::RPDO_TIMEOUT, CommunicationErrors::RPDO_TIMEOUT),
            (Node::RPDO_TOO_SHORT, CommunicationErrors::PDO_TOO_SHORT),
            (Node::RPDO_TOO_LONG, CommunicationErrors::PDO_TOO_LONG),
            (Node::SYNC_LENGTH, CommunicationErrors::SYNC_LENGTH),
        ];
        let there = bits.into_iter().filter(|(noticed, _)| errors.has(*noticed));
        CommunicationErrors(there.fold(0, |set, (_, bit)| set | bit))
    }

    fn has(self, bit: u8) -> bool {
        self.0 & bit != 0
    }
}

/// What is judged once per millisecond.
pub(crate) struct Observation<'a> {
    pub(crate) now: Instant,
    pub(crate) conditions: Conditions,
    pub(crate) feedback: &'a Feedback<f32>,
    pub(crate) signals: &'a Signals,
    /// Of the motor's winding, as its sensor tells, °C.
    pub(crate) motor_temperature_c: f32,
    /// The rotor runs away from its field.
    pub(crate) phasing_error: bool,
    pub(crate) parameters_are_valid: bool,
    pub(crate) enabled: bool,
    /// In the order of 0x60FD.
    pub(crate) active_inputs: u32,
    /// Safe torque off has taken the torque from an axis under power.
    pub(crate) torque_lost: bool,
    /// Switches are no faults now: homing uses them, and in idle nothing moves.
    pub(crate) ignores_switches: bool,
    /// A lost connection is a fault now (0x6007 is 1 and the axis under power).
    pub(crate) connection_matters: bool,
    /// [`personalities::own::OwnBehaviour::causes`].
    pub(crate) own_causes: u32,
}

/// What the errors of a millisecond ask of the axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Judgement {
    /// A fault has newly come.
    pub(crate) is_fault: bool,
    /// One with which the motor cannot be controlled any more.
    pub(crate) frees: bool,
    /// The connection to the master is newly lost.
    pub(crate) connection_lost: bool,
}

/// A change of one error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Announcement {
    /// Its code, or 0 if it ended.
    pub(crate) code: u16,
    /// Error register from now on.
    pub(crate) register: u8,
    /// Bytes 3 to 7 of the emergency frame.
    pub(crate) vendor: [u8; 5],
    /// What 0x603F shows from now on, if that changes.
    pub(crate) shown: Option<u16>,
}

/// What was told of the drive as a whole since the last tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Happened {
    /// Events that have happened and are not yet judged.
    events: Health,
    /// Present errors of communication, and its events that are not yet judged.
    communication: CommunicationErrors,
}

/// Errors of a drive that are active: a bit for each row of its table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Errors {
    /// Warnings whose cause persists, and latched faults.
    active: u64,
    /// Those of them that are latched faults.
    latched: u64,
}

impl Errors {
    /// Those of both.
    pub(crate) fn and(self, other: Errors) -> Errors {
        Errors {
            active: self.active | other.active,
            latched: self.latched | other.latched,
        }
    }

    /// 0x1001: bit 0 is set with any other (P3 l.579).
    fn register(self, table: &'static [FaultRow]) -> u8 {
        rows(table, self.active).fold(0, |register, row| {
            register | 1 | 1 << (row.register_bit & 7)
        })
    }

    /// 0x1002: a bit for each active error.
    pub(crate) fn status_register(self, table: &'static [FaultRow]) -> u32 {
        rows(table, self.active).fold(0, |register, row| {
            register | 1u32.checked_shl(u32::from(row.status_bit)).unwrap_or(0)
        })
    }

    /// The code of an active error, faults before warnings, else in the table's order; 0 if there
    /// is none.
    fn present(self, table: &'static [FaultRow]) -> u16 {
        let fault = rows(table, self.latched).next();
        let row = fault.or_else(|| rows(table, self.active).next());
        row.map_or(0, |row| row.code)
    }
}

fn rows(table: &'static [FaultRow], set: u64) -> impl Iterator<Item = &'static FaultRow> {
    (0u32..64)
        .zip(table)
        .filter(move |(bit, _)| set & (1 << bit) != 0)
        .map(|(_, row)| row)
}

/// What a drive announces of its axes' errors. At most [`personalities::MOST_FAULTS`] rows.
///
/// A row is active while it is with any axis: one table, one producer of emergencies.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaultManager {
    happened: Happened,
    /// Errors that have come and gone, waiting to be announced.
    raised: u64,
    cleared: u64,
}

impl FaultManager {
    /// Something has happened that the host saw.
    pub(crate) fn report(&mut self, event: Health) {
        let events = &mut self.happened.events;
        events.watchdog_reset |= event.watchdog_reset;
        events.store_damaged |= event.store_damaged;
        events.can_overrun |= event.can_overrun;
        events.bus_off_recovered |= event.bus_off_recovered;
        events.error_passive |= event.error_passive;
    }

    /// The errors of communication as they are now.
    pub(crate) fn report_communication(&mut self, now: CommunicationErrors) {
        let CommunicationErrors(before) = self.happened.communication;
        let of_frames = before & CommunicationErrors::OF_A_FRAME;
        self.happened.communication = CommunicationErrors(now.0 | of_frames);
    }

    /// What the axes are to judge now, once.
    pub(crate) fn take_happened(&mut self) -> Happened {
        let happened = self.happened;
        self.happened = Happened {
            events: Health::default(),
            communication: CommunicationErrors(
                happened.communication.0 & !CommunicationErrors::OF_A_FRAME,
            ),
        };
        happened
    }

    /// The errors of all axes together have become others.
    pub(crate) fn note(&mut self, before: Errors, after: Errors) {
        self.raised |= after.active & !before.active;
        self.cleared |= before.active & !after.active;
    }

    /// The next change to announce, ended errors first, with `errors` of all axes together.
    pub(crate) fn announce(
        &mut self,
        personality: &Personality,
        errors: Errors,
    ) -> Option<Announcement> {
        if self.cleared | self.raised == 0 {
            return None;
        }
        let rules = personality.errors;
        let table = personality.faults;
        let register = errors.register(table);
        if self.cleared != 0 {
            let bit = self.cleared.trailing_zeros();
            self.cleared &= self.cleared - 1;
            let ended = table.get(bit as usize)?.code;
            let [low, high] = if rules.names_ended_error { ended } else { 0 }.to_le_bytes();
            return Some(Announcement {
                code: 0,
                register,
                vendor: [0, 0, 0, low, high],
                shown: (!rules.keeps_last_code).then(|| errors.present(table)),
            });
        }
        if self.raised != 0 {
            let bit = self.raised.trailing_zeros();
            self.raised &= self.raised - 1;
            let code = table.get(bit as usize)?.code;
            return Some(Announcement {
                code,
                register,
                vendor: [0; 5],
                shown: Some(if rules.keeps_last_code {
                    code
                } else {
                    errors.present(table)
                }),
            });
        }
        None
    }
}

/// The errors of one axis.
#[derive(Clone, Debug)]
pub(crate) struct AxisFaults {
    errors: Errors,
    /// The position at the last tick, counts, if it was looked at.
    position: i32,
    has_position: bool,
    /// Ticks until the control half shows a position by its new name.
    renaming: u8,
    /// The last SYNC, or when the time-out was switched on; never: it is off.
    sync_since: Instant,
    /// Since when the supply has been too high, and too low; never: it is not.
    supply_high_since: Instant,
    supply_low_since: Instant,
}

impl Default for AxisFaults {
    fn default() -> AxisFaults {
        AxisFaults {
            errors: Errors::default(),
            position: 0,
            has_position: false,
            renaming: 0,
            sync_since: Instant::NEVER,
            supply_high_since: Instant::NEVER,
            supply_low_since: Instant::NEVER,
        }
    }
}

impl AxisFaults {
    /// Those that are active.
    pub(crate) fn errors(&self) -> Errors {
        self.errors
    }

    /// The actual position gets another name, which is no motion.
    pub(crate) fn position_renamed(&mut self) {
        self.renaming = 2;
    }

    /// A SYNC was received.
    pub(crate) fn sync(&mut self, now: Instant) {
        self.sync_since = now;
    }

    /// Judges every row.
    pub(crate) fn judge(
        &mut self,
        personality: &Personality,
        image: &Image<'_>,
        seen: &Observation<'_>,
        happened: &Happened,
    ) -> Judgement {
        let mut judgement = Judgement {
            connection_lost: happened.events.bus_off_recovered,
            ..Judgement::default()
        };
        for (bit, row) in (0u32..64).zip(personality.faults) {
            let mask = 1 << bit;
            let looked_for = match row.states {
                States::All => true,
                States::OperationEnabled => seen.enabled,
            };
            let is_connection = row.cause.is_lost_connection();
            let matters = seen.connection_matters && is_connection;
            let possible = (is_possible(image, row.switch) || matters) && looked_for;
            if !possible {
                self.forget(row.cause);
            }
            let limit_time_ms = personality.supply.limit_time_ms;
            let there = possible && self.is_there(image, row, limit_time_ms, seen, happened);
            let active = self.errors.active & mask != 0;
            if there && !active {
                self.errors.active |= mask;
                judgement.connection_lost |= is_connection;
                if row.kind != Kind::Warning || matters {
                    self.errors.latched |= mask;
                    judgement.is_fault = true;
                    judgement.frees |= !row.cause.leaves_control();
                }
            } else if !there && active && self.errors.latched & mask == 0 {
                self.errors.active &= !mask;
            }
        }
        judgement
    }

    /// A fault reset: every latched fault of `table` ends that is not critical. Those whose cause
    /// persists come again with the next [`AxisFaults::judge`].
    pub(crate) fn reset(&mut self, table: &[FaultRow]) {
        let critical = (0u32..64)
            .zip(table)
            .filter(|(_, row)| row.kind == Kind::Critical)
            .fold(0, |bits, (bit, _)| bits | 1 << bit);
        self.errors.active &= !self.errors.latched | critical;
        self.errors.latched &= critical;
    }

    /// Whether a fault is latched.
    pub(crate) fn has_fault(&self) -> bool {
        self.errors.latched != 0
    }

    /// Whether a warning is active.
    pub(crate) fn has_warning(&self) -> bool {
        self.errors.active & !self.errors.latched != 0
    }

    /// A cause that is not looked for starts its time anew when it is again.
    fn forget(&mut self, cause: Cause) {
        match cause {
            Cause::BusOverVoltage => self.supply_high_since = Instant::NEVER,
            Cause::BusUnderVoltage => self.supply_low_since = Instant::NEVER,
            Cause::SyncLoss => self.sync_since = Instant::NEVER,
            Cause::PositionWrapped => self.has_position = false,
            _ => {}
        }
    }

    /// Whether the cause of a row is there now.
    fn is_there(
        &mut self,
        image: &Image<'_>,
        row: &FaultRow,
        supply_time_ms: u32,
        seen: &Observation<'_>,
        happened: &Happened,
    ) -> bool {
        let Happened {
            events,
            communication,
        } = happened;
        let conditions = &seen.conditions;
        let feedback = seen.feedback;
        let now = seen.now;
        let supply_ns = u64::from(supply_time_ms) * 1_000_000;
        let threshold = match row.switch {
            Switch::Object(object) => value(image, object),
            _ => 0.0,
        };
        match row.cause {
            Cause::WatchdogReset => events.watchdog_reset,
            Cause::ParameterError => events.store_damaged || !seen.parameters_are_valid,
            Cause::CanOverrun => events.can_overrun,
            Cause::BusOffRecovered => events.bus_off_recovered,
            Cause::CurrentLimit => feedback.i2t_active,
            Cause::BusOverVoltage => {
                let beyond = feedback.bus_voltage_v > threshold;
                lasts(&mut self.supply_high_since, beyond, now, supply_ns)
            }
            Cause::BusUnderVoltage => {
                let beyond = feedback.bus_voltage_v < threshold;
                lasts(&mut self.supply_low_since, beyond, now, supply_ns)
            }
            Cause::AmplifierTemperature => feedback.temperature_c > threshold,
            Cause::SyncLoss => {
                self.sync_since = self.sync_since.min(now);
                now.since_ns(self.sync_since) as f32 > threshold * 1e9
            }
            Cause::VelocityTrackingWarning => conditions.velocity_warning,
            Cause::VelocityTrackingFault => conditions.velocity_fault,
            Cause::PositionTrackingWarning => conditions.following_warning,
            Cause::PositionTrackingFault => conditions.following_fault,
            Cause::AccelerationLimit => conditions.acceleration_limited,
            Cause::VelocityLimit => match row.switch {
                Switch::Either(above, below) => {
                    let speed = control::Real::abs(feedback.velocity_reported);
                    let (above, below) = (value(image, above), value(image, below));
                    (above > 0.0 && speed > above) || (below > 0.0 && speed < below)
                }
                _ => false,
            },
            Cause::PositiveSoftStop => conditions.above_greatest_position,
            Cause::NegativeSoftStop => conditions.below_least_position,
            Cause::PositionWrapped => {
                let before = core::mem::replace(&mut self.position, feedback.position);
                let had = core::mem::replace(&mut self.has_position, true);
                let renaming = self.renaming > 0;
                self.renaming = self.renaming.saturating_sub(1);
                !renaming && had && wrapped(before, feedback.position)
            }
            Cause::HeartbeatLost => communication.has(CommunicationErrors::HEARTBEAT_LOST),
            Cause::RpdoTimeout => communication.has(CommunicationErrors::RPDO_TIMEOUT),
            Cause::ErrorPassive => events.error_passive,
            Cause::PdoTooShort => communication.has(CommunicationErrors::PDO_TOO_SHORT),
            Cause::PdoTooLong => communication.has(CommunicationErrors::PDO_TOO_LONG),
            Cause::SyncLength => communication.has(CommunicationErrors::SYNC_LENGTH),
            Cause::MagnetDistance => seen.signals.magnet != Magnet::Good,
            Cause::ShortCircuit => feedback.overcurrent,
            Cause::EncoderFeedback => !feedback.encoder_valid,
            Cause::PositiveLimitSwitch => is_pressed(seen, POSITIVE_LIMIT),
            Cause::NegativeLimitSwitch => is_pressed(seen, NEGATIVE_LIMIT),
            Cause::HomeSwitch => is_pressed(seen, HOME),
            Cause::Homing => conditions.homing_failed,
            Cause::MotorTemperature => seen.motor_temperature_c > threshold,
            Cause::MotorPhasing => seen.phasing_error,
            Cause::TorqueOff => seen.torque_lost,
            Cause::Own(bit) => seen.own_causes & 1u32.checked_shl(bit.into()).unwrap_or(0) != 0,
        }
    }
}

/// Whether a switch is active that should not be.
fn is_pressed(seen: &Observation<'_>, switch: u32) -> bool {
    !seen.ignores_switches && seen.active_inputs & switch != 0
}

fn is_possible(image: &Image<'_>, switch: Switch) -> bool {
    match switch {
        Switch::Always => true,
        Switch::Off => false,
        Switch::Object(object) => image.raw(object.field) != 0,
        Switch::Either(one, other) => image.raw(one.field) != 0 || image.raw(other.field) != 0,
    }
}

/// Whether a position has gone beyond the end of its 32 bits.
fn wrapped(before: i32, now: i32) -> bool {
    let moved = now.wrapping_sub(before);
    before.checked_add(moved).is_none() && moved.unsigned_abs() < RENAMED
}

/// Whether `is` has been so for `ns`.
fn lasts(since: &mut Instant, is: bool, now: Instant, ns: u64) -> bool {
    if !is {
        *since = Instant::NEVER;
        return false;
    }
    // "Never" is later than anything.
    *since = (*since).min(now);
    now.since_ns(*since) > ns
}
