//! The PDO parameters of a device with everything, as CiA 301 7.5.2.35 to 7.5.2.38 describe them.

use canopen::Row;

use super::super::full::FULL;

const INVALID: u32 = 0x0609_0030;
const NO_SUB_INDEX: u32 = 0x0609_0011;
const NO_OBJECT: u32 = 0x0602_0000;
const UNSUPPORTED: u32 = 0x0601_0000;
const NOT_MAPPABLE: u32 = 0x0604_0041;
const TOO_LONG: u32 = 0x0604_0042;

/// One parameter of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    CobId,
    Type,
    Inhibit,
    Timer,
    SyncStart,
    Count,
    /// From 1.
    Entry(u8),
}

impl Parameter {
    /// Where it stands, for the PDO whose communication parameters are at `index`.
    pub fn address(self, index: u16) -> (u16, u8) {
        match self {
            Parameter::CobId => (index, 1),
            Parameter::Type => (index, 2),
            Parameter::Inhibit => (index, 3),
            Parameter::Timer => (index, 5),
            Parameter::SyncStart => (index, 6),
            Parameter::Count => (index + 0x200, 0),
            Parameter::Entry(sub) => (index + 0x200, sub),
        }
    }
}

/// One PDO.
#[derive(Clone, Debug)]
pub struct Pdo {
    pub index: u16,
    pub cob_id: u32,
    pub transmission_type: u32,
    pub inhibit: u32,
    pub timer_ms: u32,
    pub sync_start: u32,
    pub count: u32,
    pub entries: [u32; 64],
    /// Bits that it carries.
    pub bits: u32,
}

/// The row of an object that rows declare.
fn row(index: u16, sub: u8) -> Result<&'static Row, u32> {
    let rows = FULL.table.rows();
    let after = rows.partition_point(|row| (row.address.index, row.address.sub) <= (index, sub));
    let row = rows[..after]
        .last()
        .filter(|row| row.address.index == index);
    match row {
        Some(row) if u16::from(sub) < u16::from(row.address.sub) + u16::from(row.count) => Ok(row),
        Some(_) => Err(NO_SUB_INDEX),
        // Objects with sub-indices have a sub-index 0, which no PDO can carry.
        None => match (rows.get(after), sub) {
            (Some(next), 0) if next.address.index == index => Err(NOT_MAPPABLE),
            (Some(next), _) if next.address.index == index => Err(NO_SUB_INDEX),
            _ => Err(NO_OBJECT),
        },
    }
}

fn is_restricted(id: u32) -> bool {
    const KEPT: [(u32, u32); 6] = [
        (0, 0x7F),
        (0x101, 0x180),
        (0x581, 0x5FF),
        (0x601, 0x67F),
        (0x6E0, 0x6FF),
        (0x701, 0x7FF),
    ];
    KEPT.iter()
        .any(|(first, last)| (*first..=*last).contains(&id))
}

impl Pdo {
    /// The `n`th PDO of node 5 after boot-up: four RPDOs, then four TPDOs.
    pub fn new(n: u16) -> Pdo {
        let (index, base) = match n {
            0..4 => (0x1400 + n, 0x200 + 0x100 * u32::from(n)),
            _ => (0x1800 + n - 4, 0x180 + 0x100 * u32::from(n - 4)),
        };
        Pdo {
            index,
            cob_id: base + 5,
            transmission_type: 255,
            inhibit: 0,
            timer_ms: 0,
            sync_start: 0,
            count: 0,
            entries: [0; 64],
            bits: 0,
        }
    }

    pub fn transmits(&self) -> bool {
        self.index >= 0x1800
    }

    pub fn exists(&self) -> bool {
        self.cob_id >> 31 == 0
    }

    /// The key of its frames: see [`can::Frame::key`].
    pub fn key(&self) -> u32 {
        match self.cob_id >> 29 & 1 {
            0 => self.cob_id & 0x7FF,
            _ => self.cob_id & 0x1FFF_FFFF | 1 << 31,
        }
    }

    pub fn get(&self, parameter: Parameter) -> u32 {
        match parameter {
            Parameter::CobId => self.cob_id,
            Parameter::Type => self.transmission_type,
            Parameter::Inhibit => self.inhibit,
            Parameter::Timer => self.timer_ms,
            Parameter::SyncStart => self.sync_start,
            Parameter::Count => self.count,
            Parameter::Entry(sub) => self.entries[usize::from(sub) - 1],
        }
    }

    fn judge_entry(&self, entry: u32) -> Result<(), u32> {
        let row = row((entry >> 16) as u16, (entry >> 8) as u8)?;
        let may = if self.transmits() {
            row.maps_tpdo
        } else {
            row.maps_rpdo
        };
        if !may || entry & 0xFF != u32::from(row.data_type.bits()) {
            return Err(NOT_MAPPABLE);
        }
        Ok(())
    }

    fn judge(&self, parameter: Parameter, value: u32) -> Result<(), u32> {
        let tpdo_only = matches!(parameter, Parameter::Inhibit | Parameter::SyncStart);
        if tpdo_only && !self.transmits() {
            return Err(NO_SUB_INDEX);
        }
        if tpdo_only && self.exists() && value != self.get(parameter) {
            return Err(INVALID);
        }
        match parameter {
            Parameter::CobId if value >> 31 != 0 => Ok(()),
            Parameter::CobId => {
                let wide = value >> 29 & 1 != 0;
                let is_bad = !wide && (is_restricted(value & 0x7FF) || value & 0x1FFF_F800 != 0);
                let moves = self.exists() && (value ^ self.cob_id) & 0x3FFF_FFFF != 0;
                if is_bad || moves {
                    Err(INVALID)
                } else {
                    Ok(())
                }
            }
            Parameter::Type => match value {
                241..=251 => Err(INVALID),
                252 | 253 if !self.transmits() => Err(INVALID),
                _ => Ok(()),
            },
            Parameter::SyncStart if value > 240 => Err(INVALID),
            Parameter::Inhibit | Parameter::SyncStart | Parameter::Timer => Ok(()),
            Parameter::Count | Parameter::Entry(_) if self.exists() => Err(UNSUPPORTED),
            Parameter::Count if value > 64 => Err(TOO_LONG),
            Parameter::Count => {
                let mut bits = 0;
                for entry in &self.entries[..value as usize] {
                    self.judge_entry(*entry)?;
                    bits += entry & 0xFF;
                    if bits > 64 {
                        return Err(TOO_LONG);
                    }
                }
                Ok(())
            }
            Parameter::Entry(_) if self.count != 0 => Err(UNSUPPORTED),
            Parameter::Entry(_) if value == 0 => Ok(()),
            Parameter::Entry(_) => self.judge_entry(value),
        }
    }

    /// A write by SDO: what it gives, and what becomes of the PDO.
    pub fn write(&mut self, parameter: Parameter, value: u32) -> Result<(), u32> {
        self.judge(parameter, value)?;
        match parameter {
            Parameter::CobId => self.cob_id = value,
            Parameter::Type => self.transmission_type = value,
            Parameter::Inhibit => self.inhibit = value,
            Parameter::Timer => self.timer_ms = value,
            Parameter::SyncStart => self.sync_start = value,
            Parameter::Count => {
                self.count = value;
                self.bits = self.entries[..value as usize]
                    .iter()
                    .map(|entry| entry & 0xFF)
                    .sum();
            }
            Parameter::Entry(sub) => self.entries[usize::from(sub) - 1] = value,
        }
        Ok(())
    }
}

/// The parameters of other services at sub-index 0, as they were written.
#[derive(Clone, Debug)]
pub struct Services([(u16, u32); 10]);

impl Services {
    /// After boot-up of node 5.
    pub const DEFAULT: Services = Services([
        (0x1005, 0x80),
        (0x1006, 0),
        (0x1007, 0),
        (0x100C, 0),
        (0x100D, 0),
        (0x1012, 0x100),
        (0x1014, 0x85),
        (0x1015, 0),
        (0x1017, 0),
        (0x1019, 0),
    ]);

    pub fn get(&self, index: u16) -> u32 {
        let found = self.0.iter().find(|(other, _)| *other == index);
        found.expect("one of them").1
    }

    pub fn set(&mut self, index: u16, value: u32) {
        if let Some(place) = self.0.iter_mut().find(|(other, _)| *other == index) {
            place.1 = value;
        }
    }
}
