//! The electronic data sheet of a drive that is built in, made of its dictionary.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use canopen::DataType;
use eds::{Eds, Exported, FileDate};
use personalities::Personality;

/// The same dictionary gives the same file, so the date is this exporter's, not today's.
const EXPORTER_DATE: FileDate = FileDate {
    year: 2026,
    month: 11,
    day: 25,
    hour: 0,
    minute: 0,
};

/// The EDS of a drive.
pub fn data_sheet(drive: &Personality) -> Eds {
    let table = drive.device.table;
    let maps_bits = table
        .rows()
        .iter()
        .any(|row| row.data_type == DataType::Bool && (row.maps_rpdo || row.maps_tpdo));
    let lss = drive.device.dialect.lss;
    eds::export(&Exported {
        table,
        file_name: &format!("{}.eds", drive.name),
        description: &format!("virtual drive of servobus: {}", drive.title),
        author: "servobus",
        date: EXPORTER_DATE,
        vendor_name: drive.title.split(' ').next().unwrap_or_default(),
        product_name: drive.title,
        order_code: drive.name,
        bit_rates_kbit: if lss {
            &[10, 20, 50, 125, 250, 500, 800, 1000]
        } else {
            &[1000]
        },
        granularity_bits: if maps_bits { 1 } else { 8 },
        lss,
    })
}

/// The same as text, made once for each drive: what 0x1021 hands out.
pub(crate) fn data_sheet_text(drive: &'static Personality) -> &'static str {
    static TEXTS: Mutex<BTreeMap<&str, &str>> = Mutex::new(BTreeMap::new());
    let mut texts = TEXTS.lock().unwrap_or_else(PoisonError::into_inner);
    texts
        .entry(drive.name)
        .or_insert_with(|| Box::leak(eds::write(&data_sheet(drive)).into_boxed_str()))
}
