//! Whatever is read is written so that it reads the same.

mod harness;

use proptest::prelude::*;

/// Words that readers know, which random bytes would never hit.
const WORDS: &[&str] = &[
    "[FileInfo]",
    "[DeviceInfo]",
    "[DeviceComissioning]",
    "[DeviceCommissioning]",
    "[DummyUsage]",
    "[Comments]",
    "[MandatoryObjects]",
    "[OptionalObjects]",
    "[ManufacturerObjects]",
    "[Tools]",
    "[1000]",
    "[1018]",
    "[1018sub0]",
    "[1018Sub1]",
    "[1018sub0A]",
    "[1018sub1FF]",
    "[2000]",
    "[2000Name]",
    "[2000Value]",
    "[2000Denotation]",
    "[2000ObjectLinks]",
    "[A0]",
    "[A0sub1]",
    "[1A00]",
    "[1A00sub0]",
    "[1A00sub1]",
    "[2001sub1]",
    "[vendor",
    "[]",
    "[x] y",
    "ParameterName=",
    "Denotation=",
    "ObjectType=",
    "DataType=",
    "AccessType=",
    "LowLimit=",
    "HighLimit=",
    "DefaultValue=",
    "ParameterValue=",
    "PDOMapping=",
    "ObjFlags=",
    "SubNumber=",
    "CompactSubObj=",
    "UploadFile=",
    "SupportedObjects=",
    "NrOfEntries=",
    "NodeID=",
    "Lines=",
    "NrOfRXPDO=",
    "Dummy0002=",
    "1=",
    "2=",
    "254=",
    "vendor key=",
    "=",
    ";",
    "#",
    " ; note",
    "\n",
    "\r",
    "\r\n",
    "0x7",
    "0x8",
    "0x9",
    "0x2",
    "7",
    "8",
    "0x0007",
    "0x0009",
    "0x000A",
    "0x0008",
    "0x0011",
    "0x001B",
    "0x40",
    "0x1000",
    "0x2000",
    "rw",
    "ro",
    "RWW",
    "r",
    "$NODEID",
    "+",
    "$nodeid + ",
    "0x180",
    "0100",
    "0128",
    "-1",
    "1.5",
    "1e999",
    "nan",
    "true",
    "ab cd",
    "300",
    "\u{e4}",
    "\u{feff}",
    "\u{3a9}",
    "\u{85}",
    "\0",
    " ",
];

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 3_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn of_words(words in prop::collection::vec(
        prop_oneof![
            6 => prop::sample::select(WORDS).prop_map(|word| format!("{word}\n")),
            3 => (prop::sample::select(WORDS), prop::sample::select(WORDS))
                .prop_map(|(key, value)| format!("{key}{value}\n")),
            1 => ".{0,12}".prop_map(|text| format!("{text}\n")),
            1 => prop::sample::select(WORDS).prop_map(str::to_owned),
        ],
        0..60,
    )) {
        harness::run(words.concat().as_bytes());
    }

    #[test]
    fn of_latin_1(words in prop::collection::vec(
        (prop::sample::select(WORDS), any::<[u8; 3]>()), 0..30,
    )) {
        let mut bytes = Vec::new();
        for (word, tail) in words {
            bytes.extend_from_slice(word.as_bytes());
            bytes.extend_from_slice(&tail);
            bytes.push(b'\n');
        }
        harness::run(&bytes);
    }

    #[test]
    fn of_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        harness::run(&bytes);
    }
}
