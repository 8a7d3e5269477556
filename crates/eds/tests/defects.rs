//! What is said about damaged files, and what can be used of them all the same: one file in
//! `fixtures` for each class of defect.

use std::collections::HashSet;
use std::fmt::Write;
use std::path::PathBuf;

use eds::{Access, Constant, Eds, ObjectType, Reading, Rule, Severity};

fn fixture(name: &str) -> Reading {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures")
        .join(name);
    eds::read(&std::fs::read(path).unwrap())
}

/// Every finding of every file, as LINE:COLUMN RULE.
const TABLE: &[(&str, &str)] = &[
    ("well_formed.eds", ""),
    ("crlf.eds", ""),
    ("cr.eds", ""),
    ("dcf.dcf", ""),
    ("compact.eds", ""),
    ("vendor_keys.eds", ""),
    ("latin_1.eds", "168:20 latin-1"),
    ("utf_8.eds", "168:20 utf-8"),
    ("utf_8_mark.eds", "1:1 byte-order-mark"),
    ("utf_16.eds", "0:0 utf-16"),
    (
        "node_id_forms.eds",
        "40:14 node-id-form, 96:14 node-id-form",
    ),
    (
        "numbers.eds",
        "3:13 not-a-number, 40:14 leading-zero, 160:14 octal-number, 173:11 real-bits, \
         174:14 inline-comment",
    ),
    (
        "flags.eds",
        "48:14 boolean-word, 49:12 bad-flag, 176:10 not-a-number",
    ),
    ("access.eds", "39:12 access-form, 47:12 unknown-access"),
    (
        "empty_values.eds",
        "49:12 empty-pdo-mapping, 65:15 missing-name",
    ),
    (
        "missing_keys.eds",
        "167:1 missing-name, 167:1 missing-data-type, 167:1 missing-access",
    ),
    (
        "missing_sections.eds",
        "0:0 missing-section, 0:0 missing-section, 0:0 missing-mandatory, 4:3 listed-missing, \
         36:1 not-listed, 57:1 not-listed, 86:1 not-listed",
    ),
    ("missing_parent.eds", "128:1 missing-parent"),
    ("subs_of_variable.eds", "78:1 subs-of-variable"),
    (
        "no_subs.eds",
        "51:1 no-subs, 54:11 wrong-sub-number, 62:1 missing-sub-0, 65:11 wrong-sub-number",
    ),
    (
        "wrong_counts.eds",
        "26:11 wrong-count, 54:11 wrong-sub-number, 99:1 wrong-sub-number, 108:14 mapping-count, \
         137:14 wrong-highest, 163:18 wrong-count",
    ),
    (
        "lists.eds",
        "73:18 wrong-count, 75:3 listed-twice, 76:3 wrong-list, 77:3 not-a-number, \
         78:3 listed-missing, 101:1 not-listed, 130:1 not-listed",
    ),
    (
        "duplicates.eds",
        "88:1 duplicate-key, 89:1 repeated-key, 156:15 duplicate-name, 170:15 repeated-name, \
         180:1 duplicate-section, 191:1 duplicate-section",
    ),
    (
        "unknown_types.eds",
        "46:10 not-a-number, 169:12 unknown-object-type, 170:10 unknown-data-type",
    ),
    (
        "out_of_range.eds",
        "40:14 bad-value, 48:14 out-of-range, 158:10 crossed-limits, 174:14 outside-limits",
    ),
    (
        "compact_broken.eds",
        "170:15 bad-compact, 170:15 bad-compact, 175:13 wrong-count, 177:1 compact-orphan, \
         179:1 compact-orphan",
    ),
    (
        "garbage.eds",
        "1:1 outside-section, 21:256 long-line, 44:1 unclosed-section, 65:1 bad-sub-index, \
         172:1 hash-comment, 173:15 name-form, 183:9 after-section, 184:1 no-key, 185:1 no-key, \
         189:1 empty-section",
    ),
    (
        "device_commissioning.eds",
        "29:1 section-spelling, 30:8 bad-node-id, 34:7 wrong-count",
    ),
];

#[test]
fn findings_by_line_and_column() {
    for (name, expected) in TABLE {
        let mut found = String::new();
        for finding in &fixture(name).findings {
            let separator = if found.is_empty() { "" } else { ", " };
            let (place, rule) = (finding.place, finding.rule.name());
            write!(found, "{separator}{}:{} {rule}", place.line, place.column).unwrap();
        }
        assert_eq!(found, *expected, "{name}");
    }
}

#[test]
fn every_fixture_is_in_the_table_and_every_rule_has_one() {
    let directory = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    for file in directory.read_dir().unwrap() {
        let name = file.unwrap().file_name().into_string().unwrap();
        assert!(TABLE.iter().any(|(is, _)| *is == name), "{name}");
    }
    let found: HashSet<&str> = TABLE
        .iter()
        .flat_map(|(_, findings)| findings.split(", "))
        .filter_map(|finding| finding.split(' ').nth(1))
        .collect();
    let missing: Vec<_> = Rule::ALL
        .iter()
        .filter(|rule| !found.contains(rule.name()))
        .collect();
    // Its file would be large; the test below makes one.
    assert_eq!(missing, [&Rule::TooLarge]);
    let names: HashSet<&str> = Rule::ALL.iter().map(|rule| rule.name()).collect();
    assert_eq!(names.len(), Rule::ALL.len());
}

#[test]
fn sizes_are_limited() {
    let reading = eds::read(&vec![b'a'; eds::MAX_BYTES + 1]);
    assert_eq!(reading.findings.len(), 1);
    assert_eq!(reading.findings[0].rule, Rule::TooLarge);
    let reading = eds::read(&b"x\n".repeat(100_000));
    assert_eq!(reading.findings.len(), 1_000);
    assert!(reading.more_findings >= 99_000);
    let mut text = String::new();
    for number in 0..70_000 {
        writeln!(text, "[section {number}]\na=1").unwrap();
    }
    let reading = eds::read(text.as_bytes());
    assert_eq!(reading.eds.other.len(), 32_768);
    let found = reading
        .findings
        .iter()
        .find(|finding| finding.rule == Rule::TooLarge);
    assert_eq!(found.unwrap().place.line, 2 * 32_768 + 1);
    // 254 sub-objects each, but no more memory than the text.
    let mut text = String::new();
    for index in 0x2000..0x6000 {
        writeln!(
            text,
            "[{index:04X}]\nParameterName=A\nObjectType=8\nCompactSubObj=254"
        )
        .unwrap();
    }
    let eds = eds::read(text.as_bytes()).eds;
    assert_eq!(eds.objects.len(), 0x4000);
    assert!(eds.objects.values().all(|object| object.subs.is_empty()));
    assert_eq!(eds.entry(0x5FFF, 254).unwrap().name, "A254");
    assert!(eds.entry(0x5FFF, 255).is_none());
}

#[test]
fn messages_say_file_place_and_remedy() {
    let reading = fixture("numbers.eds");
    let found = reading
        .findings
        .iter()
        .find(|finding| finding.rule == Rule::OctalNumber);
    assert_eq!(
        found.unwrap().in_file("numbers.eds").to_string(),
        "numbers.eds:160:14: warning: DefaultValue is \"0100\"; read as octal, as the standard \
         says; write it decimal or after 0x [octal-number]"
    );
    assert_eq!(reading.worst, Some(Severity::Error));
    assert_eq!(fixture("utf_8.eds").worst, Some(Severity::Tolerated));
    assert_eq!(fixture("well_formed.eds").worst, None);
}

fn number(eds: &Eds, index: u16, sub: u8) -> Option<i128> {
    let node = canopen::NodeId::new(5).unwrap();
    eds.entry(index, sub)?.default.as_ref()?.number(node)
}

fn name(eds: &Eds, index: u16, sub: u8) -> Option<String> {
    Some(eds.entry(index, sub)?.name.clone())
}

/// What is wrong does not stand in the way of what is right.
#[test]
fn as_much_as_can_be_used() {
    let eds = fixture("well_formed.eds").eds;
    assert_eq!(eds.entries().count(), 13);
    assert_eq!(number(&eds, 0x607D, 1), Some(-1000));
    let minimum = eds.entry(0x607D, 1).unwrap().into_owned();
    let low = minimum.low_limit.unwrap();
    assert_eq!(low.constant(), Some(&Constant::Integer(-0x8000_0000)));
    assert_eq!(low.text(), "0x80000000");
    assert_eq!(minimum.access, Some(Access::ReadWriteOutput));
    assert_eq!(minimum.comments, [" unit: cts"]);
    assert!(eds.entry(0x1000, 1).is_none() && eds.entry(0x2001, 0).is_none());

    let eds = fixture("node_id_forms.eds").eds;
    assert_eq!(number(&eds, 0x1800, 1), Some(0x185));
    assert_eq!(number(&eds, 0x1000, 0), Some(6));

    let eds = fixture("numbers.eds").eds;
    assert_eq!(number(&eds, 0x607D, 1), Some(16));
    assert_eq!(number(&eds, 0x607D, 2), Some(64));
    assert_eq!(number(&eds, 0x1000, 0), Some(89));
    let gain = eds.entry(0x2000, 0).unwrap().into_owned();
    assert_eq!(
        gain.high_limit.unwrap().constant(),
        Some(&Constant::Real(10.5))
    );
    assert_eq!(gain.default.unwrap().text(), "1.5");

    let eds = fixture("latin_1.eds").eds;
    assert_eq!(name(&eds, 0x2000, 0).as_deref(), Some("Verstärkung"));
    assert_eq!(fixture("utf_8.eds").eds, eds);
    for same in ["crlf.eds", "cr.eds", "utf_8_mark.eds"] {
        assert_eq!(fixture(same).eds, fixture("well_formed.eds").eds, "{same}");
    }

    let eds = fixture("access.eds").eds;
    assert_eq!(eds.entry(0x1000, 0).unwrap().access, Some(Access::ReadOnly));
    let often = eds.entry(0x1001, 0).unwrap().into_owned();
    assert_eq!((often.access, often.extra.len()), (None, 1));
    assert_eq!(
        eds.entry(0x607D, 1).unwrap().access,
        Some(Access::ReadWriteOutput)
    );
    assert_eq!(
        eds.entry(0x607D, 2).unwrap().access,
        Some(Access::ReadWriteInput)
    );

    let eds = fixture("empty_values.eds").eds;
    let register = eds.entry(0x1001, 0).unwrap().into_owned();
    assert_eq!(
        (register.default, register.pdo_mapping),
        (None, Some(false))
    );
    // An empty text is a text.
    let text = eds.entry(0x2000, 0).unwrap().into_owned().default.unwrap();
    assert_eq!(text.constant(), Some(&Constant::Text(String::new())));

    let eds = fixture("missing_parent.eds").eds;
    assert_eq!(eds.objects[&0x607D].entry.object_type, ObjectType::Record);
    assert_eq!(number(&eds, 0x607D, 2), Some(1000));
    let eds = fixture("subs_of_variable.eds").eds;
    assert_eq!(number(&eds, 0x1800, 1), Some(0x185));

    let eds = fixture("duplicates.eds").eds;
    assert_eq!(eds.entry(0x1800, 0).unwrap().access, Some(Access::Constant));
    let gain = eds.entry(0x2000, 0).unwrap().into_owned();
    assert_eq!(gain.default.unwrap().text(), "1.5");
    assert_eq!(name(&eds, 0x1018, 1).as_deref(), Some("Vendor ID"));

    let eds = fixture("garbage.eds").eds;
    assert_eq!(eds.entries().count(), 13);
    assert_eq!(
        eds.section("Tools").unwrap().get("toolname"),
        Some("a tool")
    );
}

#[test]
fn compact_sub_objects() {
    let eds = fixture("compact.eds").eds;
    assert_eq!(eds.objects[&0x2000].sub_indices().count(), 17);
    assert_eq!(number(&eds, 0x2000, 0), Some(16));
    assert_eq!(name(&eds, 0x2000, 1).as_deref(), Some("First point"));
    assert_eq!(name(&eds, 0x2000, 2).as_deref(), Some("Point2"));
    assert_eq!(name(&eds, 0x2000, 16).as_deref(), Some("Last point"));
    let third = eds.entry(0x2000, 3).unwrap().into_owned();
    assert_eq!(
        third.value.unwrap().constant(),
        Some(&Constant::Integer(-1))
    );
    assert_eq!(
        third.default.unwrap().constant(),
        Some(&Constant::Integer(7))
    );
    assert!(eds.entry(0x2000, 17).is_none());
    let eds = fixture("compact_broken.eds").eds;
    assert_eq!(eds.objects[&0x2000].entry.object_type, ObjectType::Array);
    assert_eq!(eds.objects[&0x2000].sub_indices().count(), 255);
    assert!(eds.section("1018Name").is_some());
}

#[test]
fn a_configuration_file() {
    let eds = fixture("dcf.dcf").eds;
    let there = eds.commissioning().unwrap();
    assert_eq!((there.node_id, there.bit_rate_kbit), (5, 500));
    assert_eq!(
        (there.node_name.as_str(), there.network_name.as_str()),
        ("elbow", "arm")
    );
    assert_eq!(there.lss_serial_number, 17);
    assert_eq!(eds.dummies(), [0x05, 0x1B]);
    let gain = eds.entry(0x2000, 0).unwrap().into_owned();
    assert_eq!(
        gain.value.as_ref().unwrap().constant(),
        Some(&Constant::Real(2.5))
    );
    assert_eq!(gain.upload_file.as_deref(), Some("up.bin"));
    assert_eq!(gain.download_file.as_deref(), Some("down.bin"));
    assert_eq!((gain.flags, gain.scans()), (Some(1), true));
    let denotation = eds.entry(0x1800, 1).unwrap().into_owned().denotation;
    assert_eq!(denotation.as_deref(), Some("of the elbow"));
    assert_eq!(eds.file_info().unwrap().eds_version, "4.0");
    let wrong = fixture("device_commissioning.eds").eds;
    assert_eq!(wrong.commissioning(), None);
}

/// Files in the writer's order come out as they went in; what a vendor wrote stays.
#[test]
fn writing_changes_nothing() {
    for name in [
        "well_formed.eds",
        "crlf.eds",
        "cr.eds",
        "dcf.dcf",
        "compact.eds",
        "vendor_keys.eds",
        "latin_1.eds",
        "utf_8.eds",
        "node_id_forms.eds",
    ] {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("tests/fixtures")
            .join(name);
        let before = std::fs::read(path).unwrap();
        let reading = eds::read(&before);
        let after = reading.style.bytes(&reading.eds);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert_eq!(text(&after), text(&before), "{name}");
        assert_eq!(after, before, "{name}");
    }
}

#[test]
fn every_fixture_keeps_the_rules() {
    for (name, _) in TABLE {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("tests/fixtures")
            .join(name);
        harness::run(&std::fs::read(path).unwrap());
    }
}

mod harness;
