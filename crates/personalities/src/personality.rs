//! One documented drive.

use core::ops::RangeInclusive;

use crate::commissioning::Commissioning;
use crate::operation::Operation;
use crate::own::OwnKind;
use crate::serial::SerialPort;
use crate::{
    AmplifierObjects, AxisObjects, Cause, ErrorRules, FaultRow, InputObjects, MotorObjects,
    SupplyRules, Words, md80, p3, p3_extended, p3_jpl, roboteq,
};

/// Everything by which one drive differs from another. Constant data.
#[derive(Debug)]
pub struct Personality {
    /// The name on the command line.
    pub name: &'static str,
    /// What it is, for people.
    pub title: &'static str,
    /// Dictionary, communication objects and CANopen dialect.
    pub device: canopen::Device,
    /// The bit rates that it can have, slowest first.
    pub bit_rates: &'static [can::BitRate],
    /// CiA 402 dialect.
    pub cia402: cia402::Dialect,
    /// Its axes, each with a motor of its own. All have the rate of the first one's bridge.
    pub axes: &'static [AxisPersonality],
    /// The errors it announces.
    pub faults: &'static [FaultRow],
    /// What its document calls the causes of errors that only it has ([`crate::Cause::Own`]), by their
    /// numbers.
    pub own_causes: &'static [&'static str],
    /// How it shows them.
    pub errors: ErrorRules,
    /// What it expects of its motor supply.
    pub supply: SupplyRules,
    /// 0x603F: the error code shown.
    pub error_code: Option<canopen::Handle<u16>>,
    /// 0x1002: a bit for each error.
    pub status_register: Option<canopen::Handle<u32>>,
    /// 0x1018,4: the serial number, which each device sets for itself.
    pub serial_number: Option<canopen::Handle<u32>>,
    /// The object by which the node ID is changed, if there is one (the P3's 0x21B0).
    pub node_id: Option<NodeIdObject>,
    /// The object that stores a single entry, if there is one (the P3's 0x1010,4).
    pub stores_single_entry: Option<canopen::Address>,
    /// The object that switches the bus's terminating resistor, if there is one.
    pub termination: Option<canopen::Handle<u8>>,
    /// What its document calls things.
    pub words: Words,
    /// How a master moves it.
    pub operation: Operation,
    /// How it and its motor are brought together.
    pub commissioning: Commissioning,
    /// What only this drive does.
    pub own: OwnKind,
    /// Its serial command line, if it has one.
    pub serial: Option<&'static SerialPort>,
    /// What a commissioned drive has stored, where its defaults are those of one that knows no motor.
    pub commissioned: &'static [Setting],
    /// Where the dictionary reaches into what carries the drive, if it does.
    pub host: Option<HostObjects>,
}

/// One stored parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The object.
    pub object: canopen::Address,
    /// Its little-endian bytes.
    pub bytes: &'static [u8],
}

/// An object that is the node ID.
#[derive(Clone, Copy, Debug)]
pub struct NodeIdObject {
    /// The object.
    pub address: canopen::Address,
    /// Where it lies, an unsigned number.
    pub field: canopen::Field,
    /// A new one counts once its write is acknowledged. If not, from the next start on that finds it
    /// stored.
    pub at_once: bool,
}

impl Personality {
    /// The node IDs that it can have: those that the object of its node ID takes, else CiA 301's.
    pub fn node_ids(&self) -> RangeInclusive<u8> {
        let own = self.node_id.and_then(|object| {
            let table = self.device.table;
            let address = object.address;
            let entry = table.find(address.index, address.sub).ok()?;
            table.row(&entry)
        });
        let bound = |value: Option<i64>, usual| match value.map(u8::try_from) {
            Some(Ok(value)) => value.clamp(1, 127),
            _ => usual,
        };
        bound(own.and_then(|row| row.minimum), 1)..=bound(own.and_then(|row| row.maximum), 127)
    }

    /// Whether a master may choose this mode (0x6060): one of CiA 402's, or of the drive's own list.
    pub const fn offers(&self, mode: i8) -> bool {
        match self.own {
            OwnKind::P3Jpl => p3_jpl::offers(mode),
            OwnKind::Roboteq => roboteq::mode(mode).is_some(),
            OwnKind::Md80 => md80::offers(mode),
            OwnKind::Nothing => self.cia402.modes().contains(cia402::Mode(mode)),
        }
    }

    /// What a cause of errors is called; `None` for a number that is none of its own.
    pub fn cause_name(&self, cause: Cause) -> Option<&'static str> {
        match cause {
            Cause::Own(number) => self.own_causes.get(usize::from(number)).copied(),
            cause => cause.name(),
        }
    }
}

/// One axis of a drive: where it finds everything in the dictionary.
#[derive(Clone, Copy, Debug)]
pub struct AxisPersonality {
    /// Where the axis finds its objects.
    pub objects: AxisObjects,
    /// Where the controllers find the motor's parameters.
    pub motor: MotorObjects,
    /// Where the controllers find the amplifier's parameters.
    pub amplifier: AmplifierObjects,
    /// The object whose write presets the actual position, if there is one (the P3's 0x6064).
    pub presets_position: Option<canopen::Address>,
    /// Where the axis finds its digital inputs, if it has any.
    pub inputs: Option<InputObjects>,
}

/// Objects whose contents lie outside the drive core: data sheet and program memory.
#[derive(Clone, Copy, Debug)]
pub struct HostObjects {
    /// 0x1021: the electronic data sheet, a DOMAIN.
    pub data_sheet: canopen::Address,
    /// Memory to try transfers with, a DOMAIN.
    pub scratch: canopen::Address,
    /// 0x100A: the version of the program that runs, a string in the image.
    pub software_version: canopen::Field,
    /// 0x1F50,1: a new program, a DOMAIN.
    pub program: canopen::Address,
    /// 0x1F51,1: program control.
    pub program_control: canopen::Address,
    /// What 0x1F51,1 reads as.
    pub program_state: canopen::Handle<u8>,
    /// 0x1F56,1: program software identification.
    pub program_identification: canopen::Handle<u32>,
    /// 0x1F57,1: flash status identification.
    pub program_status: canopen::Handle<u32>,
}

/// Every personality.
pub static ALL: &[&Personality] = &[
    &p3::P3,
    &p3_extended::P3_EXTENDED,
    &p3_jpl::P3_JPL,
    &roboteq::ROBOTEQ,
    &roboteq::ROBOTEQ_2,
    &roboteq::ROBOTEQ_3,
    &md80::MD80,
];

/// The personality of that name.
pub fn by_name(name: &str) -> Option<&'static Personality> {
    ALL.iter()
        .copied()
        .find(|personality| personality.name == name)
}
