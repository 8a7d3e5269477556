//! Values of objects in words.

use canopen::{Abort, Address, DataType, Table};
use cia402::{Controlword, Mode, Statusword};

use super::emergency::register_text;
use super::frame::Node;
use super::meaning::ObjectValue;
use super::modes::axis;
use super::standard;
use crate::Value;
use crate::sdo::Data;

/// What is known of an object.
#[derive(Clone, Copy, Debug)]
struct Known {
    name: &'static str,
    data_type: DataType,
    unit: &'static str,
}

/// From the node's own dictionary if there is one, else from the standard.
fn known(table: Option<&Table>, address: Address) -> Option<Known> {
    let own = table.and_then(|table| {
        match table.find(address.index, address.sub) {
            Ok(entry) => table.row(&entry).map(|row| Known {
                name: row.name,
                data_type: row.data_type,
                unit: row.unit,
            }),
            // Sub-index 0 that no row declares is the highest sub-index (CiA 301 7.4.3).
            Err(Abort::NO_SUB_INDEX) if address.sub == 0 => Some(Known {
                name: "highest sub-index",
                data_type: DataType::U8,
                unit: "",
            }),
            Err(_) => None,
        }
    });
    own.or_else(|| {
        // Other axes have the objects of the first, 0x800 above.
        let (name, data_type) = standard::find(axis(address).1)?;
        Some(Known {
            name,
            data_type,
            unit: "",
        })
    })
}

/// The name of an object.
pub(super) fn name(table: Option<&Table>, address: Address) -> Option<String> {
    known(table, address).map(|known| known.name.to_owned())
}

/// A value that a PDO carries: the whole object, or the low bytes of a longer number.
pub(super) fn mapped_value(node: &Node, address: Address, data: Data) -> ObjectValue {
    let known = known(node.words.table.as_ref(), address);
    let bits = 8 * data.bytes().len();
    let part = known.and_then(|known| low_part(known.data_type, bits));
    match (known, part) {
        (Some(known), Some(data_type)) => {
            let part = Known { data_type, ..known };
            let mut value = value_of(node, address, data, Some(part));
            value.text.push_str(&format!(" (low {bits} bits)"));
            value
        }
        (known, _) => value_of(node, address, data, known),
    }
}

/// The type of the low `bits` of a longer number; `None` if there are no fewer than it has.
fn low_part(data_type: DataType, bits: usize) -> Option<DataType> {
    match (data_type, bits) {
        (DataType::I16 | DataType::I32, 8) => Some(DataType::I8),
        (DataType::I32, 16) => Some(DataType::I16),
        (DataType::U16 | DataType::U32, 8) => Some(DataType::U8),
        (DataType::U32, 16) => Some(DataType::U16),
        _ => None,
    }
}

/// A value that an SDO carries.
pub(super) fn value(node: &Node, address: Address, data: Data) -> ObjectValue {
    value_of(
        node,
        address,
        data,
        known(node.words.table.as_ref(), address),
    )
}

fn value_of(node: &Node, address: Address, data: Data, known: Option<Known>) -> ObjectValue {
    let typed = known.and_then(|known| data.value(known.data_type));
    let text = match (typed, known) {
        (Some(Value::Integer(number)), Some(known)) => match meaning(node, address, number) {
            Some(words) => {
                let digits = 2 * usize::from(known.data_type.size());
                format!(
                    "0x{:0digits$X}: {words}",
                    data.raw() & mask(known.data_type)
                )
            }
            None => number_text(number, known),
        },
        (Some(value), Some(known)) => with_unit(value.to_string(), known.unit),
        _ => untyped(data),
    };
    ObjectValue {
        index: address.index,
        sub: address.sub,
        name: known.map(|known| known.name.to_owned()),
        bytes: data.bytes().to_vec(),
        text,
    }
}

fn mask(data_type: DataType) -> u32 {
    match data_type.size() {
        1 => 0xFF,
        2 => 0xFFFF,
        _ => u32::MAX,
    }
}

fn with_unit(text: String, unit: &str) -> String {
    if unit.is_empty() {
        text
    } else {
        format!("{text} {unit}")
    }
}

fn number_text(number: i64, known: Known) -> String {
    let text = if number > 9 && !known.data_type.is_signed() {
        format!("{number} (0x{number:X})")
    } else {
        number.to_string()
    };
    with_unit(text, known.unit)
}

/// Bytes of an unknown type, or too few, or too many for their type.
fn untyped(data: Data) -> String {
    let bytes: Vec<String> = data
        .bytes()
        .iter()
        .map(|byte| format!("{byte:02X}"))
        .collect();
    let note = if data.is_sized() {
        ""
    } else {
        " (size not said)"
    };
    match bytes.is_empty() {
        true => "no data".to_owned(),
        false => format!("{}{note}", bytes.join(" ")),
    }
}

/// A dictionary has a state machine behind its statusword: its value changes by itself. Without a
/// dictionary that is taken for granted.
fn has_states(table: Option<&Table>) -> bool {
    let Some(table) = table else { return true };
    let row = table.find(0x6041, 0).ok();
    let row = row.and_then(|entry| table.row(&entry));
    row.is_none_or(|row| row.is_live)
}

/// Objects whose numbers mean something; `None` for plain quantities.
fn meaning(node: &Node, address: Address, number: i64) -> Option<String> {
    let (words, raw) = (&node.words, number as u32);
    let table = words.table.as_ref();
    let (axis, general) = axis(address);
    let mode = node.modes.of(axis).map(|mode| words.bits_of(mode));
    Some(match (general.index, general.sub) {
        (0x6040 | 0x6041, 0) if !has_states(table) => return None,
        (0x6040, 0) => match mode {
            Some(mode) => Controlword(raw as u16).in_mode(mode).to_string(),
            None => Controlword(raw as u16).to_string(),
        },
        (0x6041, 0) => match mode {
            Some(mode) => Statusword(raw as u16).in_mode(mode).to_string(),
            None => Statusword(raw as u16).to_string(),
        },
        (0x6060 | 0x6061, 0) => words.mode(raw as i8),
        (0x6502, 0) => modes(raw),
        (0x1000, 0) => format!("profile {}, additional 0x{:04X}", raw & 0xFFFF, raw >> 16),
        (0x1001, 0) => register_text(words, raw as u8),
        (0x603F, 0) => words.error(raw as u16).to_owned(),
        (0x1003, 1..) => words.error(raw as u16).to_owned(),
        (0x1010 | 0x1011, 1..) => return store(table, address, raw),
        (0x1400..=0x15FF | 0x1800..=0x19FF, 1) => cob_id(raw),
        (0x1600..=0x17FF | 0x1A00..=0x1BFF, 1..) => mapped(table, raw),
        _ => return words.set_bits(address, raw),
    })
}

fn modes(raw: u32) -> String {
    let modes: Vec<String> = (0..32_i8)
        .filter(|bit| raw >> bit & 1 == 1)
        .map(|bit| match Mode(bit + 1).name() {
            Some(name) => name.to_owned(),
            None => format!("bit {bit}"),
        })
        .collect();
    if modes.is_empty() {
        "none".to_owned()
    } else {
        modes.join(", ")
    }
}

/// "save" and "load", or the object that the P3's single-entry save names (P4).
fn store(table: Option<&Table>, address: Address, raw: u32) -> Option<String> {
    match raw.to_le_bytes() {
        bytes if &bytes == b"save" || &bytes == b"load" => {
            Some(format!("\"{}\"", String::from_utf8_lossy(&bytes)))
        }
        _ if (address.index, address.sub) == (0x1010, 4) && raw > 0xFF => {
            let object = Address::from_key(raw)?;
            Some(match name(table, object) {
                Some(name) => format!("{object} {name}"),
                None => object.to_string(),
            })
        }
        _ => None,
    }
}

fn cob_id(raw: u32) -> String {
    match raw {
        0 => "0, off".to_owned(),
        raw if raw >> 31 == 1 => format!("0x{:03X}, off", raw & 0x7FF),
        raw => format!("0x{:03X}", raw & 0x1FFF_FFFF),
    }
}

/// The object that a mapping entry names.
fn mapped(table: Option<&Table>, raw: u32) -> String {
    if raw == 0 {
        return "nothing".to_owned();
    }
    let object = Address::new((raw >> 16) as u16, (raw >> 8) as u8);
    let bits = raw & 0xFF;
    match name(table, object) {
        Some(name) => format!("{object} {name}, {bits} bits"),
        None => format!("{object}, {bits} bits"),
    }
}
