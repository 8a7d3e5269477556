//! What only this drive does: BarrettCAN, modes without a state machine, properties.

use can::Frame;
use canopen::nmt::Command;
use canopen::{Abort, Address, Field, Handle, Image, NmtState, NodeId, Reset, Verdict};
use cia402::{Mode, State};

use super::OBJECTS_CONST;
use super::barrett_can;
use super::properties::INDEX;
use crate::Personality;
use crate::own::{AxisView, Heard, Orders, OwnBehaviour};

const DEFAULT_MODE: Handle<i8> = OBJECTS_CONST.handle(0x3F60, 0);
const PRESET: Handle<i32> = OBJECTS_CONST.handle(0x3F63, 0);
const MODE_DISPLAY: Handle<i8> = OBJECTS_CONST.handle(0x6061, 0);
const INTERNAL_POSITION: Handle<i32> = OBJECTS_CONST.handle(0x6063, 0);
const SENSOR_VELOCITY: Handle<i32> = OBJECTS_CONST.handle(0x6069, 0);
const ERROR_REGISTER: Handle<u8> = OBJECTS_CONST.handle(0x1001, 0);
const SERIAL_NUMBER: Handle<u32> = OBJECTS_CONST.handle(0x1018, 4);
const ROLE: Handle<u32> = OBJECTS_CONST.handle(0x1018, 6);
const ACCELERATION: Handle<i32> = OBJECTS_CONST.handle(0x6083, 0);

/// A property's place.
const fn place(number: u8) -> Field {
    OBJECTS_CONST.need(INDEX, number)
}

/// What is behind the numbers that properties show.
const SHOWN: Shown = Shown {
    role: place(1),
    serial: place(2),
    id: place(3),
    error: place(4),
    mode: place(8),
    temperature: place(9),
    peak_temperature: place(10),
    thermistor: place(20),
    bus_voltage: place(21),
    motor_current: place(22),
    torque: place(42),
    velocity: place(44),
    position: place(48),
    endpoint: place(52),
    up_seconds: place(63),
    mechanical: place(66),
    acceleration: place(82),
    encoder: place(94),
    joint_position: place(96),
};

struct Shown {
    role: Field,
    serial: Field,
    id: Field,
    error: Field,
    mode: Field,
    temperature: Field,
    peak_temperature: Field,
    thermistor: Field,
    bus_voltage: Field,
    motor_current: Field,
    torque: Field,
    velocity: Field,
    position: Field,
    endpoint: Field,
    up_seconds: Field,
    mechanical: Field,
    acceleration: Field,
    encoder: Field,
    joint_position: Field,
}

/// Controlwords of a trajectory: enabled, to be changed at once; and its start.
const TRAJECTORY_IDLE: u16 = 0x2F;
const TRAJECTORY_START: u16 = 0x3F;

/// 0x6060, the manual's modes (l.154).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OwnMode {
    /// 0: the motor is free.
    Idle,
    /// 1: the position follows its target at once.
    Position,
    /// 3.
    ProfileVelocity,
    /// 4: driven by 0x6074 (J15).
    Torque,
    /// 6: no object tells how; the motor is free.
    Homing,
    /// 7: Barrett's trapezoid (J15): each target that is written is moved to at once.
    Trapezoid,
}

impl OwnMode {
    /// By its number; 5 is reserved, and there are no others.
    const fn of(number: i8) -> Option<OwnMode> {
        Some(match number {
            0 => OwnMode::Idle,
            1 => OwnMode::Position,
            3 => OwnMode::ProfileVelocity,
            4 => OwnMode::Torque,
            6 => OwnMode::Homing,
            7 => OwnMode::Trapezoid,
            _ => return None,
        })
    }

    const fn number(self) -> i8 {
        match self {
            OwnMode::Idle => 0,
            OwnMode::Position => 1,
            OwnMode::ProfileVelocity => 3,
            OwnMode::Torque => 4,
            OwnMode::Homing => 6,
            OwnMode::Trapezoid => 7,
        }
    }

    /// The axis's mode.
    const fn mode(self) -> Mode {
        match self {
            OwnMode::Idle | OwnMode::Homing => Mode::IDLE,
            OwnMode::Position => Mode::CYCLIC_POSITION,
            OwnMode::ProfileVelocity => Mode::PROFILE_VELOCITY,
            OwnMode::Torque => Mode::PROFILE_TORQUE,
            OwnMode::Trapezoid => Mode::PROFILE_POSITION,
        }
    }
}

/// Whether a number is one of its modes (l.154).
pub const fn offers(mode: i8) -> bool {
    OwnMode::of(mode).is_some()
}

/// Of a P3 of 2016.
#[derive(Clone, Debug)]
pub struct Behaviour {
    /// No NMT message has come yet: the drive speaks BarrettCAN.
    waits: bool,
    answer: Option<Frame>,
    reset: Option<Reset>,
    id: u8,
    mode: OwnMode,
    /// 0x3F60 is to be taken.
    takes_default: bool,
    /// It has been taken, or could have been.
    was_operational: bool,
    /// A target was written in mode 7.
    new_target: bool,
    /// The axis has been told of the last one.
    told: bool,
    peak_temperature_c: f32,
    up_ms: u32,
}

impl Behaviour {
    fn choose(&mut self, mode: OwnMode, view: &AxisView, orders: &mut Orders) {
        self.mode = mode;
        self.new_target = false;
        self.told = false;
        orders.mode = Some(mode.mode().0);
        if mode == OwnMode::Trapezoid {
            orders.controlword = Some(TRAJECTORY_IDLE);
        }
        let is_enabled = view.state == State::OperationEnabled;
        orders.enable = match mode.mode() {
            Mode::IDLE => Some(false),
            _ if is_enabled => None,
            _ => Some(true),
        };
    }

    fn write_mode(&mut self, number: u8, view: &AxisView, orders: &mut Orders) -> Verdict {
        match OwnMode::of(number as i8) {
            None => Verdict::Refuse(Abort::INVALID_VALUE),
            // J17: nothing but a reset ends it.
            Some(mode) if view.has_fault && mode != OwnMode::Idle => {
                Verdict::Refuse(Abort::DEVICE_STATE)
            }
            Some(mode) => {
                self.takes_default = false;
                self.choose(mode, view, orders);
                Verdict::Accept
            }
        }
    }
}

impl OwnBehaviour for Behaviour {
    fn new(_: &'static Personality, _: &Image<'_>) -> Behaviour {
        Behaviour {
            waits: true,
            answer: None,
            reset: None,
            id: 0,
            mode: OwnMode::Idle,
            takes_default: false,
            was_operational: false,
            new_target: false,
            told: false,
            peak_temperature_c: f32::MIN,
            up_ms: 0,
        }
    }

    fn waits(&self) -> bool {
        self.waits
    }

    fn hear(&mut self, frame: &Frame, id: NodeId, image: &mut Image<'_>, view: &AxisView) -> Heard {
        self.id = id.get();
        if frame.key() == 0
            && let [command, target] = *frame.data()
            && (target == 0 || target == id.get())
            && let Some(command) = Command::from_byte(command)
        {
            if command == Command::ResetNode {
                self.reset = Some(Reset::Node);
                return Heard::Nothing;
            }
            self.waits = false;
            return Heard::Boots;
        }
        if let Some(number) = barrett_can::read(frame, id) {
            self.publish(image, view);
            let value = OBJECTS_CONST
                .field(INDEX, number)
                .map_or(0, |field| image.raw(field));
            self.answer = barrett_can::answer(id, number, value);
        }
        Heard::Nothing
    }

    fn take_frame(&mut self) -> Option<Frame> {
        self.answer.take()
    }

    fn entered(&mut self, state: NmtState) {
        if state == NmtState::Operational && !self.was_operational {
            self.was_operational = true;
            self.takes_default = self.mode == OwnMode::Idle;
        }
    }

    fn write(
        &mut self,
        _: &Image<'_>,
        object: Address,
        new: &[u8],
        view: &AxisView,
        orders: &mut Orders,
    ) -> Option<Verdict> {
        let first = new.first().copied().unwrap_or(0);
        match (object.index, object.sub) {
            // "NOT IMPLEMENTED": acknowledged, without effect.
            (0x2A10 | 0x2A12 | 0x6040 | 0x606F, _) => Some(Verdict::Done),
            (0x3F60, 0) => Some(match OwnMode::of(first as i8) {
                Some(_) => Verdict::Accept,
                None => Verdict::Refuse(Abort::INVALID_VALUE),
            }),
            (0x6060, 0) => Some(self.write_mode(first, view, orders)),
            (0x607A, 0) => {
                self.new_target = self.mode == OwnMode::Trapezoid;
                Some(Verdict::Accept)
            }
            _ => None,
        }
    }

    fn tick(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        self.up_ms = self.up_ms.saturating_add(1);
        if view.amplifier_temperature_c > self.peak_temperature_c {
            self.peak_temperature_c = view.amplifier_temperature_c;
        }
        if view.has_fault {
            self.mode = OwnMode::Idle;
            self.takes_default = false;
        }
        if core::mem::take(&mut self.takes_default)
            && let Some(mode) = OwnMode::of(image.get(DEFAULT_MODE))
            && mode != OwnMode::Idle
        {
            image.set(OBJECTS_CONST.handle::<i8>(0x6060, 0), mode.number());
            self.choose(mode, view, orders);
            return;
        }
        if self.mode == OwnMode::Trapezoid {
            // The axis takes a set-point with the rising edge of bit 4.
            if core::mem::take(&mut self.told) {
                orders.controlword = Some(TRAJECTORY_IDLE);
            } else if core::mem::take(&mut self.new_target) {
                self.told = true;
                orders.controlword = Some(TRAJECTORY_START);
            }
        }
    }

    fn publish(&self, image: &mut Image<'_>, view: &AxisView) {
        let mode = i32::from(self.mode.number());
        image.set(MODE_DISPLAY, mode as i8);
        image.set(PRESET, view.position);
        image.set(INTERNAL_POSITION, view.position);
        image.set(SENSOR_VELOCITY, rounded(view.velocity));
        let counts_per_ms = rounded(view.velocity * 1e-3);
        let acceleration = image.get(ACCELERATION) as f32 * 1e-6;
        for (field, value) in [
            (SHOWN.role, image.get(ROLE) as i32),
            (SHOWN.serial, image.get(SERIAL_NUMBER) as i32),
            (SHOWN.id, i32::from(self.id)),
            (SHOWN.error, i32::from(image.get(ERROR_REGISTER))),
            (SHOWN.mode, mode),
            (SHOWN.temperature, q8(view.amplifier_temperature_c)),
            (SHOWN.peak_temperature, q8(self.peak_temperature_c)),
            (SHOWN.thermistor, q8(view.motor_temperature_c)),
            (SHOWN.bus_voltage, q8(view.bus_voltage_v)),
            (SHOWN.motor_current, rounded(view.current_a[1] * 1e3)),
            (SHOWN.torque, rounded(view.torque_pm)),
            (SHOWN.velocity, counts_per_ms),
            (SHOWN.position, view.position),
            (SHOWN.endpoint, view.position_demand),
            (SHOWN.up_seconds, (self.up_ms / 1000) as i32),
            (SHOWN.mechanical, view.encoder),
            (SHOWN.acceleration, rounded(acceleration)),
            (SHOWN.encoder, view.encoder),
            (SHOWN.joint_position, view.position),
        ] {
            // Two's complement, where a property is less than 0.
            image.set_raw(field, value as u32);
        }
    }

    fn take_reset(&mut self) -> Option<Reset> {
        self.reset.take()
    }
}

/// To the nearest; `as` saturates.
fn rounded(value: f32) -> i32 {
    (if value < 0.0 {
        value - 0.5
    } else {
        value + 0.5
    }) as i32
}

/// Q8.8, held within 16 bits.
fn q8(value: f32) -> i32 {
    let units = rounded(value * 256.0);
    units.clamp(i32::from(i16::MIN), i32::from(i16::MAX))
}
