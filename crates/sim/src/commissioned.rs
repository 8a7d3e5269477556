//! What a drive has stored as it is delivered.

use canopen::{Image, NodeId, store};
use personalities::Personality;

/// What a commissioning has stored; empty where there is nothing to commission.
pub(crate) fn stored(personality: &Personality) -> Vec<u8> {
    if personality.commissioned.is_empty() {
        return Vec::new();
    }
    let table = personality.device.table;
    let mut bytes = vec![0; table.image_bytes()];
    let mut image = Image::new(&mut bytes);
    let node = NodeId::new(1).expect("an ID");
    table.defaults(&mut image, node);
    for setting in personality.commissioned {
        let object = setting.object;
        let entry = table.find(object.index, object.sub).expect("a row");
        image.set_bytes(entry.field, setting.bytes);
    }
    // One by one: what else could be stored, the node ID for one, is the drive's own.
    let mut stored = Vec::new();
    for setting in personality.commissioned {
        let mut out = vec![0; 4096];
        let one = store::Request::Single(setting.object);
        let used = store::save(&table, &image, node, one, &stored, &mut out).expect("room for it");
        out.truncate(used);
        stored = out;
    }
    stored
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_is_what_was_commissioned() {
        for personality in personalities::ALL {
            let stored = stored(personality);
            let records: Vec<_> = store::records(&stored).expect("a store").collect();
            for setting in personality.commissioned {
                let record = records
                    .iter()
                    .find(|record| record.address == setting.object);
                let record = record.unwrap_or_else(|| panic!("{}", setting.object));
                assert!(
                    record.bytes.starts_with(setting.bytes),
                    "{}",
                    setting.object
                );
            }
        }
    }
}
