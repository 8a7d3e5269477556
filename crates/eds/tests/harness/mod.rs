//! Rules that hold for whatever is read, for the tests and for the fuzz target `eds_reader`.

#![allow(
    unreachable_pub,
    reason = "the fuzz crate includes this file as a public module"
)]

use eds::{Commissioning, Dcf, Live, Reading, Severity};

/// Entries that are looked at: compact sub-objects are 254 for a few bytes.
const MANY: usize = 300;

/// Reads any bytes and checks what must hold.
///
/// # Panics
/// If a rule is broken.
pub fn run(input: &[u8]) {
    let reading = eds::read(input);
    findings_are_in_order(&reading);
    look_up_finds_every_entry(&reading);
    round_trip(&reading);
    // Of compact sub-objects there may be very many, all alike.
    if reading.eds.entries().take(MANY).count() < MANY {
        dcf(&reading);
    }
}

fn findings_are_in_order(reading: &Reading) {
    let places = || reading.findings.iter().map(|finding| finding.place);
    assert!(places().is_sorted());
    for finding in &reading.findings {
        assert_eq!(finding.place.line == 0, finding.place.column == 0);
        let line = finding.in_file("a.eds").to_string();
        assert!(!line.contains('\n'), "{line:?}");
        assert!(line.contains(finding.severity().name()));
    }
    assert_eq!(
        reading.worst == Some(Severity::Error),
        (reading.findings.iter()).any(|finding| finding.severity() == Severity::Error)
    );
}

fn look_up_finds_every_entry(reading: &Reading) {
    let node = canopen::NodeId::new(127).expect("a node ID");
    let mut last = None;
    for (index, sub, entry) in reading.eds.entries().take(MANY) {
        assert!(last < Some((index, sub)));
        last = Some((index, sub));
        let found = reading.eds.entry(index, sub).expect("what was listed");
        assert_eq!(found, entry);
        let values = [
            &entry.default,
            &entry.value,
            &entry.low_limit,
            &entry.high_limit,
        ];
        for value in values.into_iter().flatten() {
            let Some(data_type) = entry.data_type else {
                continue;
            };
            let bytes = value.bytes(data_type, node);
            if let (Some(bytes), Some(size)) = (&bytes, data_type.kind().size()) {
                assert_eq!(bytes.len(), size);
            }
            if let Some(bytes) = bytes
                && let Some(again) = eds::Value::from_bytes(data_type, &bytes, Some(value))
            {
                let again = again.bytes(data_type, node);
                // Texts lose what cannot be shown.
                let is_text = matches!(data_type.kind(), eds::Kind::Text);
                assert!(is_text || again.as_deref() == Some(&bytes), "{value:?}");
            }
        }
    }
}

fn round_trip(reading: &Reading) {
    let bytes = reading.style.bytes(&reading.eds);
    let again = eds::read(&bytes);
    let text = String::from_utf8_lossy(&bytes);
    assert_eq!(again.eds, reading.eds, "{text}");
    // What was written is in order, so that writing it again changes nothing.
    assert_eq!(again.style.bytes(&again.eds), bytes, "{text}");
}

fn dcf(reading: &Reading) {
    let commissioning = Commissioning {
        node_id: 5,
        bit_rate_kbit: 1000,
        ..Commissioning::default()
    };
    let dcf = Dcf::new(&reading.eds, &commissioning, |_, sub, entry| {
        match (&entry.default, sub % 3) {
            (Some(value), 0 | 1) => Live::Value(value.clone()),
            (_, 2) => Live::Unread("no answer".to_owned()),
            _ => Live::Nothing,
        }
    });
    let again = eds::read(eds::write(dcf.eds()).as_bytes());
    assert_eq!(&again.eds, dcf.eds());
    assert_eq!(again.eds.commissioning(), Some(commissioning));
}
