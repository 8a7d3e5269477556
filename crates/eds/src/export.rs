//! A dictionary table as an EDS.

use std::collections::BTreeSet;

use canopen::{Row, Table};

use crate::from_table;
use crate::info::{BIT_RATES_KBIT, COMMENTS, DEVICE_INFO, DUMMY_USAGE, FILE_INFO};
use crate::model::{Eds, Entry, Object, Section};
use crate::names;
use crate::types::{Access, DataType, ObjectType};
use crate::value::Value;

/// A day and a minute, as `[FileInfo]` writes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileDate {
    /// Year.
    pub year: u16,
    /// 1 to 12.
    pub month: u8,
    /// 1 to 31.
    pub day: u8,
    /// 0 to 23.
    pub hour: u8,
    /// 0 to 59.
    pub minute: u8,
}

impl FileDate {
    /// `MM-DD-YYYY`.
    pub fn date(self) -> String {
        format!("{:02}-{:02}-{:04}", self.month, self.day, self.year)
    }

    /// `hh:mmAM`, twelve hours.
    pub fn time(self) -> String {
        let half = if self.hour < 12 { "AM" } else { "PM" };
        let hour = match self.hour % 12 {
            0 => 12,
            hour => hour,
        };
        format!("{hour:02}:{:02}{half}", self.minute)
    }
}

/// What an EDS says beside the objects.
#[derive(Clone, Copy, Debug)]
pub struct Exported<'a> {
    /// The dictionary.
    pub table: Table,
    /// `FileName`
    pub file_name: &'a str,
    /// `Description`
    pub description: &'a str,
    /// `CreatedBy` and `ModifiedBy`
    pub author: &'a str,
    /// When the file was made.
    pub date: FileDate,
    /// `VendorName`
    pub vendor_name: &'a str,
    /// `ProductName`
    pub product_name: &'a str,
    /// `OrderCode`
    pub order_code: &'a str,
    /// The bit rates that the device takes, out of [`BIT_RATES_KBIT`].
    pub bit_rates_kbit: &'a [u16],
    /// The smallest piece that a PDO maps, in bits; 0 if mapping is fixed.
    pub granularity_bits: u8,
    /// Whether it is an LSS slave (CiA 305).
    pub lss: bool,
}

/// Below are data types, which stand for dummy entries of PDOs (CiA 301 7.4.8).
const FIRST_OBJECT: u16 = 0x1000;

/// Makes an EDS of a dictionary.
pub fn export(exported: &Exported<'_>) -> Eds {
    let rows = exported.table.rows();
    let mut eds = Eds {
        info: vec![
            file_info(exported),
            device_info(exported),
            dummy_usage(rows),
            comments(),
        ],
        ..Eds::default()
    };
    let mut names = BTreeSet::new();
    for group in rows.chunk_by(|one, other| one.address.index == other.address.index) {
        let Some(first) = group.first() else { continue };
        let index = first.address.index;
        if index < FIRST_OBJECT {
            continue;
        }
        let mut object = object(exported, index, group);
        if !names.insert(object.entry.name.clone()) {
            object.entry.name = format!("{} 0x{index:04X}", object.entry.name);
            names.insert(object.entry.name.clone());
        }
        eds.objects.insert(index, object);
    }
    eds
}

fn file_info(exported: &Exported<'_>) -> Section {
    let (date, time) = (exported.date.date(), exported.date.time());
    let mut section = Section::new(FILE_INFO);
    section.set("FileName", clean(exported.file_name));
    section.set("FileVersion", 1);
    section.set("FileRevision", 0);
    section.set("EDSVersion", "4.0");
    section.set("Description", clean(exported.description));
    section.set("CreationTime", &time);
    section.set("CreationDate", &date);
    section.set("CreatedBy", clean(exported.author));
    section.set("ModificationTime", &time);
    section.set("ModificationDate", &date);
    section.set("ModifiedBy", clean(exported.author));
    section
}

fn device_info(exported: &Exported<'_>) -> Section {
    let rows = exported.table.rows();
    let identity = |sub| {
        let mut rows = rows.iter();
        let row = rows.find(|row| (row.address.index, row.address.sub) == (0x1018, sub));
        match row.map(|row| row.default) {
            Some(canopen::Default::Value(value)) => value,
            _ => 0,
        }
    };
    let count = |first: u16| {
        let indices = rows.iter().map(|row| row.address.index);
        let indices: BTreeSet<u16> = indices.collect();
        indices.range(first..first + 0x200).count()
    };
    let mut section = Section::new(DEVICE_INFO);
    section.set("VendorName", clean(exported.vendor_name));
    section.set("VendorNumber", format!("0x{:08X}", identity(1)));
    section.set("ProductName", clean(exported.product_name));
    section.set("ProductNumber", format!("0x{:08X}", identity(2)));
    section.set("RevisionNumber", format!("0x{:08X}", identity(3)));
    section.set("OrderCode", clean(exported.order_code));
    for rate in BIT_RATES_KBIT {
        let takes = exported.bit_rates_kbit.contains(&rate);
        section.set(&format!("BaudRate_{rate}"), u8::from(takes));
    }
    section.set("SimpleBootUpMaster", 0);
    section.set("SimpleBootUpSlave", 1);
    section.set("Granularity", exported.granularity_bits);
    section.set("DynamicChannelsSupported", 0);
    section.set("GroupMessaging", 0);
    section.set("NrOfRXPDO", count(0x1400));
    section.set("NrOfTXPDO", count(0x1800));
    section.set("LSS_Supported", u8::from(exported.lss));
    section
}

/// The data types that the table declares as objects, which is how a PDO may map them.
fn dummy_usage(rows: &[Row]) -> Section {
    let mut section = Section::new(DUMMY_USAGE);
    for index in 1..=7 {
        let used = rows.iter().any(|row| row.address.index == index);
        section.set(&format!("Dummy{index:04X}"), u8::from(used));
    }
    section
}

fn comments() -> Section {
    let mut section = Section::new(COMMENTS);
    section.set("Lines", 0);
    section
}

/// A text on one line without what ends a value for some readers.
fn clean(text: &str) -> String {
    let text = text.replace(['=', ';'], ",").replace(char::is_control, " ");
    text.trim().to_owned()
}

fn object(exported: &Exported<'_>, index: u16, rows: &[Row]) -> Object {
    if let [row] = rows
        && row.address.sub == 0
        && row.count == 1
    {
        return Object::new(index, entry(row, clean(row.name)));
    }
    let mut object = Object::new(index, Entry::default());
    if let Some(highest) = exported.table.highest_sub_index(index) {
        object.subs.insert(0, highest_sub_index(highest));
    }
    let mut names = BTreeSet::new();
    for row in rows {
        for step in 0..row.count {
            let sub = row.address.sub.saturating_add(step);
            let mut name = clean(row.name);
            if row.count > 1 || names.contains(&name) {
                name = format!("{name} {sub}");
            }
            names.insert(name.clone());
            object.subs.insert(sub, entry(row, name));
        }
    }
    let members = || rows.iter().filter(|row| row.address.sub > 0);
    let mut types = members().map(from_table::data_type);
    let first = types.next();
    let alike = types.all(|data_type| Some(data_type) == first);
    let standard = names::standard(index);
    object.entry.object_type = match standard {
        Some((ObjectType::Record, _)) => ObjectType::Record,
        _ if alike => ObjectType::Array,
        _ => ObjectType::Record,
    };
    object.entry.name = match standard {
        Some((_, name)) => name,
        None => {
            let names: Vec<&str> = members().map(|row| row.name).collect();
            match names::common_words(&names) {
                common if common.is_empty() => format!("Object 0x{index:04X}"),
                common => clean(&common),
            }
        }
    };
    object
}

/// Sub-index 0 of an object that declares only others (CiA 301 7.4.3).
fn highest_sub_index(highest: u8) -> Entry {
    let data_type = Some(DataType::UNSIGNED8);
    Entry {
        name: "Highest sub-index supported".to_owned(),
        data_type,
        access: Some(Access::Constant),
        default: Some(Value::new(&highest.to_string(), data_type)),
        pdo_mapping: Some(false),
        ..Entry::default()
    }
}

fn entry(row: &Row, name: String) -> Entry {
    let data_type = Some(from_table::data_type(row));
    let limit = |limit: Option<i64>| limit.map(|limit| Value::new(&limit.to_string(), data_type));
    // There is no keyword for it.
    let unit = (!row.unit.is_empty()).then(|| format!(" unit: {}", clean(row.unit)));
    Entry {
        name,
        data_type,
        access: Some(from_table::access(row)),
        low_limit: limit(row.minimum),
        high_limit: limit(row.maximum),
        default: from_table::default(row),
        pdo_mapping: Some(row.maps_rpdo || row.maps_tpdo),
        comments: unit.into_iter().collect(),
        ..Entry::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twelve_hours() {
        let at = |hour, minute| FileDate {
            year: 2026,
            month: 3,
            day: 9,
            hour,
            minute,
        };
        assert_eq!(at(0, 5).time(), "12:05AM");
        assert_eq!(at(12, 0).time(), "12:00PM");
        assert_eq!(at(23, 59).time(), "11:59PM");
        assert_eq!(at(1, 0).date(), "03-09-2026");
    }
}
