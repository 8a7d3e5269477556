//! Device configuration files: an EDS with a node's place in the network and its values.

use crate::info::{COMMISSIONING, Commissioning, DEVICE_INFO, FILE_INFO};
use crate::model::{Eds, Entry, Section};
use crate::value::Value;

/// What a device holds at an index and sub-index.
#[derive(Clone, Debug, PartialEq)]
pub enum Live {
    /// This value.
    Value(Value),
    /// It could not be read; a comment says why.
    Unread(String),
    /// Nothing that belongs into the file.
    Nothing,
}

/// A device configuration file.
#[derive(Clone, Debug, PartialEq)]
pub struct Dcf {
    eds: Eds,
}

impl Dcf {
    /// The configuration of a device of type `eds`: `values` is asked for every index and sub-index
    /// what the device holds there, and that becomes its `ParameterValue`. Values that `eds` has
    /// already are replaced, so that nothing is taken for a live value that is not.
    pub fn new(
        eds: &Eds,
        commissioning: &Commissioning,
        mut values: impl FnMut(u16, u8, &Entry) -> Live,
    ) -> Dcf {
        let mut eds = eds.clone();
        name_file(&mut eds);
        set_commissioning(&mut eds, commissioning);
        for object in eds.objects.values_mut() {
            let index = object.index;
            let subs: Vec<u8> = object.sub_indices().collect();
            let live: Vec<(u8, Live)> = subs
                .into_iter()
                .filter_map(|sub| Some((sub, values(index, sub, &*object.sub(sub)?))))
                .collect();
            let has_subs = object.has_subs();
            if let Some(compact) = &mut object.compact {
                compact.values.clear();
            }
            object.entry.value = None;
            for (sub, live) in live {
                let entry = match has_subs {
                    true => object.subs.get_mut(&sub),
                    false => Some(&mut object.entry),
                };
                match (entry, live) {
                    (Some(entry), Live::Value(value)) => entry.value = Some(value),
                    (Some(entry), Live::Unread(why)) => {
                        entry.value = None;
                        entry.comments.push(format!(" not read: {why}"));
                    }
                    (Some(entry), Live::Nothing) => entry.value = None,
                    (None, Live::Value(value)) => {
                        // Sub-index 0 of compact sub-objects has no place for a value.
                        if let Some(compact) = object.compact.as_mut().filter(|_| sub > 0) {
                            compact.values.insert(sub, value);
                        }
                    }
                    (None, Live::Unread(why)) => {
                        let comment = format!(" sub-index {sub} not read: {why}");
                        object.entry.comments.push(comment);
                    }
                    (None, Live::Nothing) => {}
                }
            }
        }
        Dcf { eds }
    }

    /// The file's contents.
    pub fn eds(&self) -> &Eds {
        &self.eds
    }

    /// The file's contents, to go on with.
    pub fn into_eds(self) -> Eds {
        self.eds
    }
}

fn section<'a>(eds: &'a mut Eds, name: &str, at: usize) -> &'a mut Section {
    let found = eds.info.iter().position(|section| section.name == name);
    let at = found.unwrap_or_else(|| {
        let at = at.min(eds.info.len());
        eds.info.insert(at, Section::new(name));
        at
    });
    &mut eds.info[at]
}

/// `p3.eds` becomes `p3.dcf`, made from `p3.eds`.
fn name_file(eds: &mut Eds) {
    let section = section(eds, FILE_INFO, 0);
    let name = section.get("FileName").unwrap_or_default().to_owned();
    let stem = match name.rsplit_once('.') {
        Some((stem, ending)) if ending.eq_ignore_ascii_case("eds") => stem,
        _ if name.to_ascii_lowercase().ends_with(".dcf") => return,
        _ => name.as_str(),
    };
    section.set("FileName", format!("{stem}.dcf"));
    if !name.is_empty() {
        section.set("LastEDS", &name);
    }
}

fn set_commissioning(eds: &mut Eds, commissioning: &Commissioning) {
    let after = eds
        .info
        .iter()
        .position(|section| section.name == DEVICE_INFO);
    let section = section(eds, COMMISSIONING, after.map_or(1, |at| at + 1));
    section.set("NodeID", commissioning.node_id);
    section.set("NodeName", &commissioning.node_name);
    section.set("Baudrate", commissioning.bit_rate_kbit);
    section.set("NetNumber", commissioning.net_number);
    section.set("NetworkName", &commissioning.network_name);
    section.set("CANopenManager", u8::from(commissioning.canopen_manager));
    section.set("LSS_SerialNumber", commissioning.lss_serial_number);
}
