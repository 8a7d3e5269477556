//! What stands in a virtual drive's objects when it starts for the first time.

use canopen::{Access, Field, Image, NodeId, Table};
use personalities::Personality;

use super::address;

/// A drive's values.
pub(super) struct Start {
    table: Table,
    bytes: Vec<u8>,
}

impl Start {
    /// Its defaults, and what a commissioned drive has stored.
    pub(super) fn of(drive: &Personality) -> Start {
        let table = drive.device.table;
        let mut bytes = vec![0; table.image_bytes()];
        let mut image = Image::new(&mut bytes);
        if let Some(id) = NodeId::new(1) {
            table.defaults(&mut image, id);
        }
        for setting in drive.commissioned {
            if let Ok(entry) = table.find(setting.object.index, setting.object.sub) {
                image.set_bytes(entry.field, setting.bytes);
            }
        }
        Start { table, bytes }
    }

    /// Address, value and unit of the object that lies there.
    pub(super) fn object(&self, field: Field) -> String {
        let rows = self.table.rows().iter();
        let mut places = rows
            .filter(|row| row.access != Access::Internal)
            .flat_map(|row| (0..row.count).map(move |step| (row, row.address.sub + step)));
        let here = places.find(|(row, sub)| {
            let entry = self.table.find(row.address.index, *sub);
            entry.is_ok_and(|entry| entry.field == field)
        });
        let mut bytes = self.bytes.clone();
        let image = Image::new(&mut bytes);
        let value = match field.data_type() {
            canopen::DataType::F32 => image.real(field).to_string(),
            _ => image.number(field).to_string(),
        };
        match here {
            Some((row, sub)) => {
                let words = format!("{} {value} {}", address(row.address.index, sub), row.unit);
                words.trim_end().to_owned()
            }
            // It is no object for a master.
            None => value,
        }
    }
}
