//! Names and types of the objects that CiA 301 and 302 define as arrays and records.

use crate::types::ObjectType;

use ObjectType::{Array, Record};

/// First and last index, type, name. Objects of a longer range are numbered from 1.
const OBJECTS: &[(u16, u16, ObjectType, &str)] = &[
    (0x1003, 0x1003, Array, "Pre-defined error field"),
    (0x1010, 0x1010, Array, "Store parameters"),
    (0x1011, 0x1011, Array, "Restore default parameters"),
    (0x1016, 0x1016, Array, "Consumer heartbeat time"),
    (0x1018, 0x1018, Record, "Identity object"),
    (0x1020, 0x1020, Array, "Verify configuration"),
    (0x1023, 0x1023, Record, "OS command"),
    (0x1025, 0x1025, Record, "OS debugger interface"),
    (0x1026, 0x1026, Array, "OS prompt"),
    (0x1027, 0x1027, Array, "Module list"),
    (0x1028, 0x1028, Array, "Emergency consumer object"),
    (0x1029, 0x1029, Array, "Error behavior object"),
    (0x1200, 0x127F, Record, "SDO server parameter"),
    (0x1280, 0x12FF, Record, "SDO client parameter"),
    (0x1400, 0x15FF, Record, "RPDO communication parameter"),
    (0x1600, 0x17FF, Record, "RPDO mapping parameter"),
    (0x1800, 0x19FF, Record, "TPDO communication parameter"),
    (0x1A00, 0x1BFF, Record, "TPDO mapping parameter"),
    (0x1F50, 0x1F50, Array, "Program data"),
    (0x1F51, 0x1F51, Array, "Program control"),
    (0x1F56, 0x1F56, Array, "Program software identification"),
    (0x1F57, 0x1F57, Array, "Flash status identification"),
];

/// Type and name of a standard object with sub-objects.
pub(crate) fn standard(index: u16) -> Option<(ObjectType, String)> {
    let mut objects = OBJECTS.iter();
    let (first, last, object_type, name) =
        objects.find(|(first, last, ..)| (*first..=*last).contains(&index))?;
    let name = match first == last {
        true => (*name).to_owned(),
        false => format!("{name} {}", index - first + 1),
    };
    Some((*object_type, name))
}

/// The words that all names begin with, without the punctuation behind them.
pub(crate) fn common_words(names: &[&str]) -> String {
    let Some((first, others)) = names.split_first() else {
        return String::new();
    };
    let mut words: Vec<&str> = first.split_whitespace().collect();
    for name in others {
        let same = words.iter().zip(name.split_whitespace());
        let same = same.take_while(|(one, other)| *one == other).count();
        words.truncate(same);
    }
    let text = words.join(" ");
    text.trim_end_matches([',', ':', '-', ' ']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_standard_objects() {
        assert_eq!(standard(0x1018), Some((Record, "Identity object".into())));
        assert_eq!(
            standard(0x1A03),
            Some((Record, "TPDO mapping parameter 4".into()))
        );
        assert_eq!(standard(0x2000), None);
        assert!(OBJECTS.is_sorted_by(|one, other| one.1 < other.0));
    }

    #[test]
    fn what_names_have_in_common() {
        assert_eq!(
            common_words(&["Position minimum", "Position maximum"]),
            "Position"
        );
        assert_eq!(
            common_words(&["Bias, phase A", "Bias, phase B"]),
            "Bias, phase"
        );
        assert_eq!(common_words(&["Bias, A", "Bias, B"]), "Bias");
        assert_eq!(common_words(&["Poles", "Polarity"]), "");
    }
}
