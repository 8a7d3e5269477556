//! The motor and board behind each documented drive, and what such a drive has stored as it is
//! delivered.

use canopen::{Image, NodeId, store};
use personalities::Personality;
use plant::{Parameters, VIRTUAL_MD80, VIRTUAL_P3};

/// Motors and boards by the names of their personalities; the others have the P3's.
const WORLDS: &[(&str, Parameters)] = &[("md80", VIRTUAL_MD80)];

/// A drive's world, and the bytes of its store.
pub(crate) fn of(personality: &Personality) -> (Parameters, Vec<u8>) {
    let world = WORLDS.iter().find(|(name, _)| *name == personality.name);
    (
        world.map_or(VIRTUAL_P3, |(_, world)| *world),
        stored(personality),
    )
}

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
    fn every_world_can_be_and_is_that_of_a_drive() {
        for (name, world) in WORLDS {
            assert!(personalities::by_name(name).is_some(), "{name}");
            assert_eq!(world.check(), Ok(()), "{name}");
        }
    }

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
