//! What contradicts what.

use std::collections::HashMap;

use super::{Places, Reader, Role};
use crate::finding::{Findings, Place, Rule, quoted};
use crate::info::{self, COMMENTS, COMMISSIONING, DEVICE_INFO, FILE_INFO};
use crate::ini::RawSection;
use crate::model::{Entry, Object};
use crate::types::ObjectType;
use crate::value::Value;

/// The longest `ParameterName` (CiA 306).
const LONGEST_NAME: usize = 241;

/// The objects that every device has (CiA 301 7.5.2).
const MANDATORY: [(u16, &str); 3] = [
    (0x1000, "device type"),
    (0x1001, "error register"),
    (0x1018, "identity"),
];

impl Reader {
    pub(super) fn check(&mut self, sections: &[RawSection<'_>]) {
        let whole = Place::default();
        for name in [FILE_INFO, DEVICE_INFO] {
            if self.eds.section(name).is_none() {
                let what = format!("the section [{name}] is missing");
                self.add(
                    Rule::MissingSection,
                    whole,
                    what,
                    "every EDS has one; add it",
                );
            }
        }
        for (index, name) in MANDATORY {
            if !self.eds.objects.contains_key(&index) {
                let what = format!("the object {index:04X} ({name}) is missing");
                self.add(
                    Rule::MissingMandatory,
                    whole,
                    what,
                    "every device has it; add it",
                );
            }
        }
        self.check_info(sections);
        let mut names: HashMap<&str, u16> = HashMap::new();
        for object in self.eds.objects.values() {
            let places = |sub| {
                let places = self.places.get(&(object.index, sub));
                places.copied().unwrap_or_default()
            };
            let own = places(None);
            let name = object.entry.name.as_str();
            if let Some(first) = names.get(name).filter(|_| !name.is_empty()) {
                let what = format!("{} is the name of {first:04X}, too", quoted(name));
                let advice = "read; programs that look objects up by name find one of them";
                self.findings
                    .add(Rule::RepeatedName, own.name, what, advice);
            }
            names.entry(name).or_insert(object.index);
            check_counts(&mut self.findings, object, &own);
            let mut inside: HashMap<&str, u8> = HashMap::new();
            for (&sub, entry) in &object.subs {
                let places = places(Some(sub));
                if let Some(first) = inside.get(entry.name.as_str())
                    && !entry.name.is_empty()
                {
                    let what = format!(
                        "{} is the name of {:04X}sub{first:X}, too",
                        quoted(&entry.name),
                        object.index
                    );
                    let advice = "read; programs that look sub-objects up by name find one of them";
                    self.findings
                        .add(Rule::DuplicateName, places.name, what, advice);
                }
                inside.entry(&entry.name).or_insert(sub);
                check_entry(&mut self.findings, entry, &places, true);
            }
            let is_described = !object.has_subs() || object.compact.is_some();
            check_entry(&mut self.findings, &object.entry, &own, is_described);
            check_sub_0(&mut self.findings, object, &own, &places(Some(0)));
            let entries = std::iter::once((None, &object.entry))
                .chain(object.subs.iter().map(|(sub, entry)| (Some(*sub), entry)));
            for (sub, entry) in entries {
                let Some(data_type) = entry.data_type else {
                    continue;
                };
                if data_type.name().is_none() && !self.eds.objects.contains_key(&data_type.0) {
                    let what = format!("DataType 0x{:04X} is not known", data_type.0);
                    let advice = "its values are kept as text; describe the type or correct it";
                    let at = places(sub).data_type;
                    self.findings.add(Rule::UnknownDataType, at, what, advice);
                }
            }
        }
    }

    fn check_info(&mut self, sections: &[RawSection<'_>]) {
        // Where a key stands; the section was found before.
        let place = |name: &str, key: &str| {
            let mut sections = sections.iter();
            let section = sections
                .find(|section| matches!(Role::of(section), Role::Info(is) if is == name))?;
            let mut keys = section.keys.iter();
            let key = keys.find(|is| is.key.eq_ignore_ascii_case(key))?;
            Some(key.value_at)
        };
        let objects = |first: u16| self.eds.objects.range(first..first + 0x200).count() as u32;
        for (key, count) in [
            ("NrOfRXPDO", objects(0x1400)),
            ("NrOfTXPDO", objects(0x1800)),
        ] {
            let claimed = self.eds.section(DEVICE_INFO);
            let Some(claimed) = claimed.and_then(|section| info::number(section, key)) else {
                continue;
            };
            if claimed != count {
                let what = format!("{key} is {claimed}, but {count} are described");
                let at = place(DEVICE_INFO, key).unwrap_or_default();
                self.findings
                    .add(Rule::WrongCount, at, what, "correct it or describe them");
            }
        }
        if let Some(section) = self.eds.section(COMMISSIONING) {
            let node_id = info::number(section, "NodeID");
            if node_id.is_none_or(|id| !(1..=127).contains(&id)) {
                let at = place(COMMISSIONING, "NodeID").unwrap_or_default();
                let what = format!("NodeID is {}", quoted(section.get("NodeID").unwrap_or("")));
                self.findings
                    .add(Rule::BadNodeId, at, what, "node IDs are 1 to 127");
            }
        }
        if let Some(section) = self.eds.section(COMMENTS) {
            let is_line = |key: &str| {
                key.len() > 4
                    && key
                        .get(..4)
                        .is_some_and(|key| key.eq_ignore_ascii_case("line"))
                    && !key.eq_ignore_ascii_case("lines")
            };
            let lines = section.keys.iter().filter(|(key, _)| is_line(key)).count();
            let claimed = info::number(section, "Lines");
            if claimed.is_some_and(|claimed| claimed as usize != lines) {
                let at = place(COMMENTS, "Lines").unwrap_or_default();
                let what = format!("Lines is {}, but there are {lines}", claimed.unwrap_or(0));
                self.findings.add(
                    Rule::WrongCount,
                    at,
                    what,
                    "all of them are kept; correct the count",
                );
            }
        }
    }
}

/// `SubNumber`, and whether there are sub-objects where there should be.
fn check_counts(findings: &mut Findings, object: &Object, places: &Places) {
    let index = object.index;
    let found = object.subs.len() as i128;
    let advice = "the sub-objects that are described are used; correct it";
    match places.sub_number {
        // Beside compact sub-objects, 0 says that none has a section of its own.
        Some((claimed, at)) if claimed != found && !(object.compact.is_some() && claimed == 0) => {
            let what = format!("SubNumber of {index:04X} is {claimed}, but {found} are described");
            findings.add(Rule::WrongSubNumber, at, what, advice);
        }
        None if places.is_assumed || !object.has_subs() || object.compact.is_some() => {}
        None if found > 0 => {
            let what = format!("[{index:04X}] has no SubNumber, but {found} sub-objects");
            let advice = format!("write SubNumber={found}");
            findings.add(Rule::WrongSubNumber, places.header, what, advice);
        }
        _ => {}
    }
    if object.has_subs() && object.compact.is_none() {
        if found == 0 && object.entry.object_type != ObjectType::DefStruct {
            let what = format!(
                "[{index:04X}] is a {}, but has no sub-objects",
                object.entry.object_type.name()
            );
            findings.add(
                Rule::NoSubs,
                places.header,
                what,
                "describe them, or write ObjectType=0x7",
            );
        } else if found > 0 && !object.subs.contains_key(&0) {
            let what = format!("{index:04X} has no sub-index 0");
            let advice = "read without; describe it, it holds the highest sub-index";
            findings.add(Rule::MissingSub0, places.header, what, advice);
        }
    }
}

/// One section by itself; `is_described` if it must tell type and access.
fn check_entry(findings: &mut Findings, entry: &Entry, places: &Places, is_described: bool) {
    if entry.name.is_empty() {
        let advice = "read without a name; other programs refuse that";
        findings.add(
            Rule::MissingName,
            places.name,
            "ParameterName is missing or empty",
            advice,
        );
    } else if entry.name.contains(" ;") || entry.name.chars().count() > LONGEST_NAME {
        let what = format!("the name {}", quoted(&entry.name));
        let advice = format!("read whole; others cut it off at ; or {LONGEST_NAME} characters");
        findings.add(Rule::NameForm, places.name, what, advice);
    }
    let needs_type = !matches!(
        entry.object_type,
        ObjectType::Null | ObjectType::DefType | ObjectType::DefStruct
    );
    let unread = |key: &str| {
        entry
            .extra
            .iter()
            .any(|(is, _)| is.eq_ignore_ascii_case(key))
    };
    if is_described && needs_type && entry.data_type.is_none() && !unread("DataType") {
        let advice = "its values are kept as text; add it";
        findings.add(
            Rule::MissingDataType,
            places.header,
            "DataType is missing",
            advice,
        );
    }
    if is_described && needs_type && entry.access.is_none() && !unread("AccessType") {
        let advice = "add it: ro, wo, rw, rwr, rww or const";
        findings.add(
            Rule::MissingAccess,
            places.header,
            "AccessType is missing",
            advice,
        );
    }
    let (low, high) = (entry.low_limit.as_ref(), entry.high_limit.as_ref());
    if let (Some(low), Some(high)) = (low, high)
        && is_above(low, high)
    {
        let what = format!(
            "the low limit {} is above the high limit {}",
            low.text(),
            high.text()
        );
        findings.add(
            Rule::CrossedLimits,
            places.low_limit,
            what,
            "kept; correct them",
        );
        return;
    }
    for (what, value, at) in [
        ("default", &entry.default, places.default),
        ("value", &entry.value, places.value),
    ] {
        let Some(value) = value else { continue };
        if low.is_some_and(|low| is_above(low, value))
            || high.is_some_and(|high| is_above(value, high))
        {
            let text = |limit: Option<&Value>| limit.map_or("", Value::text).to_owned();
            let what = format!(
                "the {what} {} is not within {}..{}",
                value.text(),
                text(low),
                text(high)
            );
            findings.add(
                Rule::OutsideLimits,
                at,
                what,
                "kept; correct it or the limits",
            );
        }
    }
}

/// Compares values of one type; of others, nothing is above anything.
fn is_above(one: &Value, other: &Value) -> bool {
    match (one.base(), other.base()) {
        (Some(one), Some(other)) => one > other,
        _ => match (one.real(), other.real()) {
            (Some(one), Some(other)) => one > other,
            _ => false,
        },
    }
}

/// Sub-index 0 holds the highest sub-index (CiA 301 7.4.3), but for lists, where it counts what is
/// in use.
fn check_sub_0(findings: &mut Findings, object: &Object, own: &Places, places: &Places) {
    let index = object.index;
    let Some(sub_0) = object.subs.get(&0) else {
        return;
    };
    let Some(count) = sub_0.default.as_ref().and_then(Value::base) else {
        return;
    };
    let at = match places.default.line {
        0 => own.header,
        _ => places.default,
    };
    // 0xFF describes the object's structure and does not count.
    let mut subs = object.subs.keys().rev();
    let described = subs.find(|sub| (1..255).contains(*sub)).copied();
    let compact = object.compact.as_ref().map(|compact| compact.highest);
    let Some(highest) = described.max(compact) else {
        return;
    };
    match index {
        0x1003 => {}
        0x1600..=0x17FF | 0x1A00..=0x1BFF => {
            // 254 and 255 say that a multiplexed PDO is mapped (CiA 301 7.5.2.36).
            if (254..=255).contains(&count) {
                return;
            }
            let maps = |sub: &i128| {
                let sub = u8::try_from(*sub).ok();
                let entry = sub.and_then(|sub| object.subs.get(&sub));
                let mapped = entry.and_then(|entry| entry.default.as_ref()?.base());
                mapped.is_some_and(|mapped| mapped != 0)
            };
            if let Some(empty) = (1..=count.min(255)).find(|sub| !maps(sub)) {
                let what = format!(
                    "{index:04X} counts {count} mapped objects, but sub-index {empty} maps none"
                );
                findings.add(Rule::MappingCount, at, what, "kept; correct sub-index 0");
            }
        }
        _ if count != i128::from(highest) => {
            let what = format!(
                "sub-index 0 of {index:04X} is {count}, but the highest sub-index is {highest}"
            );
            findings.add(Rule::WrongHighest, at, what, "kept; correct it");
        }
        _ => {}
    }
}
