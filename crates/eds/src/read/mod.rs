//! Sections to a model.

mod check;
mod entry;
mod lists;

use std::collections::BTreeMap;

use crate::finding::{Finding, Findings, Place, Rule, Severity, quoted};
use crate::info::{self, INFO_SECTIONS};
use crate::ini::{self, RawSection};
use crate::model::{Compact, Eds, Entry, List, Object, Section};
use crate::number::Number;
use crate::text::{self, Newline};
use crate::types::ObjectType;
use crate::value::Value;
use crate::write::Style;

/// What was read of a file.
#[derive(Clone, Debug)]
pub struct Reading {
    /// As much as could be used.
    pub eds: Eds,
    /// What is wrong, in the order of the file; at most 1,000.
    pub findings: Vec<Finding>,
    /// Findings beyond those.
    pub more_findings: u64,
    /// The severity of the worst finding, those beyond included.
    pub worst: Option<Severity>,
    /// How the file was written.
    pub style: Style,
}

impl Reading {
    fn of(eds: Eds, findings: Findings, style: Style) -> Reading {
        let worst = findings.worst();
        let (findings, more_findings) = findings.finish();
        Reading {
            eds,
            findings,
            more_findings,
            worst,
            style,
        }
    }
}

/// Reads an EDS or DCF. Never fails: what cannot be used is a finding.
pub fn read(bytes: &[u8]) -> Reading {
    let mut findings = Findings::default();
    let Some((text, encoding)) = text::decode(bytes, &mut findings) else {
        return Reading::of(Eds::default(), findings, Style::default());
    };
    let raw = ini::parse(&text, &mut findings);
    let mut reader = Reader {
        eds: Eds::default(),
        findings,
        places: BTreeMap::new(),
    };
    reader.eds.trailing_comments = raw.trailing;
    reader.sections(&raw.sections);
    let style = Style {
        encoding,
        newline: Newline::of(&text),
    };
    Reading::of(reader.eds, reader.findings, style)
}

/// What a section's name says it is.
enum Role {
    Info(&'static str),
    List(List),
    Object(u16),
    Sub(u16, Option<u8>),
    Table(u16, Table),
    Other,
}

/// The tables of compact sub-objects.
#[derive(Clone, Copy)]
enum Table {
    Name,
    Value,
    Denotation,
}

impl Role {
    fn of(section: &RawSection<'_>) -> Role {
        let name = section.name;
        let same = |known: &str| name.eq_ignore_ascii_case(known);
        if let Some(info) = INFO_SECTIONS.into_iter().find(|known| same(known)) {
            return Role::Info(info);
        }
        if same("DeviceCommissioning") {
            return Role::Info(info::COMMISSIONING);
        }
        if let Some(list) = List::ALL.into_iter().find(|list| same(list.section())) {
            return Role::List(list);
        }
        let hexadecimal = |text: &str| text.bytes().all(|byte| byte.is_ascii_hexdigit());
        if name.len() <= 4 && hexadecimal(name) {
            // Some files write the index of a type without its zeros; but a short word made of the
            // letters A to F may be anything.
            let is_object = name.len() == 4
                || (section.keys.iter()).any(|key| key.key.eq_ignore_ascii_case("ParameterName"));
            if let (true, Ok(index)) = (is_object, u16::from_str_radix(name, 16)) {
                return Role::Object(index);
            }
        }
        // Of an index without its zeros, too.
        let digits = name
            .bytes()
            .take(4)
            .take_while(u8::is_ascii_hexdigit)
            .count();
        let (index, rest) = name.split_at(digits);
        let Ok(index) = u16::from_str_radix(index, 16) else {
            return Role::Other;
        };
        let rest = rest.to_ascii_lowercase();
        match rest.as_str() {
            "name" => Role::Table(index, Table::Name),
            "value" => Role::Table(index, Table::Value),
            "denotation" => Role::Table(index, Table::Denotation),
            rest => match rest.strip_prefix("sub") {
                Some(sub) if !sub.is_empty() && hexadecimal(sub) => {
                    Role::Sub(index, u8::from_str_radix(sub, 16).ok())
                }
                _ => Role::Other,
            },
        }
    }
}

/// Where the parts of an entry stand, and the counts that it claims.
#[derive(Clone, Copy, Debug, Default)]
struct Places {
    header: Place,
    name: Place,
    default: Place,
    value: Place,
    low_limit: Place,
    data_type: Place,
    sub_number: Option<(i128, Place)>,
    compact: Option<(i128, Place)>,
    /// The object has no section; its sub-objects have.
    is_assumed: bool,
}

struct Reader {
    eds: Eds,
    findings: Findings,
    /// By index and, for sub-objects, sub-index.
    places: BTreeMap<(u16, Option<u8>), Places>,
}

impl Reader {
    fn add(&mut self, rule: Rule, place: Place, what: impl Into<String>, advice: &str) {
        self.findings.add(rule, place, what, advice);
    }

    fn sections(&mut self, sections: &[RawSection<'_>]) {
        for section in sections {
            match Role::of(section) {
                Role::Info(name) => self.info(section, name),
                Role::Object(index) => self.object(section, index),
                Role::Other => self.eds.other.push(kept(section, section.name)),
                _ => {}
            }
        }
        for section in sections {
            match Role::of(section) {
                Role::Sub(index, Some(sub)) => self.sub(section, index, sub),
                Role::Sub(_, None) => {
                    let what = format!("[{}] has a sub-index above FF", section.name);
                    self.add(
                        Rule::BadSubIndex,
                        section.at,
                        what,
                        "the section is not used",
                    );
                }
                _ => {}
            }
        }
        self.structure();
        for section in sections {
            if let Role::Table(index, table) = Role::of(section) {
                self.table(section, index, table);
            }
        }
        let mut lists = Vec::new();
        for section in sections {
            if let Role::List(list) = Role::of(section) {
                lists.push((list, section));
            }
        }
        self.lists(&lists);
        self.check(sections);
    }

    fn info(&mut self, section: &RawSection<'_>, name: &'static str) {
        if !section.name.eq_ignore_ascii_case(name) {
            let what = format!("the section [{}]", section.name);
            let advice = format!("read as [{name}], as the standard spells it");
            self.findings
                .add(Rule::SectionSpelling, section.at, what, advice);
        }
        if self.eds.section(name).is_some() {
            let what = format!("there is a section [{name}] already");
            let advice = "the second one is not used; remove or merge it";
            self.add(Rule::DuplicateSection, section.at, what, advice);
            return;
        }
        for key in &section.keys {
            if !info::is_numeric(name, key.key) {
                continue;
            }
            match Number::read_commented(key.value) {
                Some((number, _)) => self.odd_number(&number, key),
                None => self.no_number(key),
            }
        }
        self.eds.info.push(kept(section, name));
    }

    fn object(&mut self, section: &RawSection<'_>, index: u16) {
        if let Some(first) = self.places.get(&(index, None)) {
            let line = first.header.line;
            let what = format!("the object {index:04X} is in line {line} already");
            let advice = "the second one is not used; remove or merge it";
            self.add(Rule::DuplicateSection, section.at, what, advice);
            return;
        }
        let (entry, places) = self.entry(section, true);
        self.places.insert((index, None), places);
        self.eds.objects.insert(index, Object::new(index, entry));
    }

    fn sub(&mut self, section: &RawSection<'_>, index: u16, sub: u8) {
        if let Some(first) = self.places.get(&(index, Some(sub))) {
            let line = first.header.line;
            let what = format!("the sub-object {index:04X}sub{sub:X} is in line {line} already");
            let advice = "the second one is not used; remove or merge it";
            self.add(Rule::DuplicateSection, section.at, what, advice);
            return;
        }
        if !self.eds.objects.contains_key(&index) {
            let what = format!(
                "[{}] belongs to [{index:04X}], which is missing",
                section.name
            );
            let advice = "a record is assumed; describe it";
            self.add(Rule::MissingParent, section.at, what, advice);
            let entry = Entry {
                name: format!("Object 0x{index:04X}"),
                object_type: ObjectType::Record,
                ..Entry::default()
            };
            self.eds.objects.insert(index, Object::new(index, entry));
            let places = Places {
                header: section.at,
                is_assumed: true,
                ..Places::default()
            };
            self.places.insert((index, None), places);
        }
        let (entry, places) = self.entry(section, false);
        self.places.insert((index, Some(sub)), places);
        if let Some(object) = self.eds.objects.get_mut(&index) {
            object.subs.insert(sub, entry);
        }
    }

    /// Makes objects with sub-objects out of those that have some.
    fn structure(&mut self) {
        let indices: Vec<u16> = self.eds.objects.keys().copied().collect();
        for index in indices {
            let places = self.places.get(&(index, None)).copied().unwrap_or_default();
            let Some(object) = self.eds.objects.get_mut(&index) else {
                continue;
            };
            let claimed = object.entry.object_type;
            if let Some((count, at)) = places.compact.filter(|(count, _)| *count > 0) {
                object.compact = Some(Compact {
                    highest: u8::try_from(count).unwrap_or(254).min(254),
                    ..Compact::default()
                });
                if count > 254 {
                    let what = format!("CompactSubObj is {count}");
                    let advice = "254 is used, the highest sub-index of an array";
                    self.findings.add(Rule::BadCompact, at, what, advice);
                }
                if !claimed.has_subs() {
                    object.entry.object_type = ObjectType::Array;
                    let what = format!(
                        "[{index:04X}] has CompactSubObj, but is a {}",
                        claimed.name()
                    );
                    let advice = "read as an ARRAY; write ObjectType=0x8";
                    self.findings.add(Rule::BadCompact, at, what, advice);
                }
            } else if !object.subs.is_empty() && !claimed.has_subs() {
                object.entry.object_type = ObjectType::Record;
                let what = format!("[{index:04X}] has sub-objects, but is a {}", claimed.name());
                let advice = "read as a RECORD; write ObjectType=0x9 or 0x8";
                self.findings
                    .add(Rule::SubsOfVariable, places.header, what, advice);
            }
        }
    }

    /// `[2000Name]`, `[2000Value]`, `[2000Denotation]`.
    fn table(&mut self, section: &RawSection<'_>, index: u16, table: Table) {
        let object = self.eds.objects.get_mut(&index);
        let Some((entry, compact)) =
            object.and_then(|object| Some((&mut object.entry, object.compact.as_mut()?)))
        else {
            let what = format!("[{}] belongs to no compact sub-objects", section.name);
            let advice = "kept, but without effect; set CompactSubObj in its object";
            self.add(Rule::CompactOrphan, section.at, what, advice);
            self.eds.other.push(kept(section, section.name));
            return;
        };
        entry.comments.extend(section.comments.iter().cloned());
        entry.comments.extend(section.inner.iter().cloned());
        let mut found = 0;
        let mut claimed = None;
        for key in &section.keys {
            if key.key.eq_ignore_ascii_case("NrOfEntries") {
                claimed = Some((Number::read_commented(key.value), key));
                continue;
            }
            let sub = key.key.parse().ok();
            let Some(sub) = sub.filter(|sub| (1..=compact.highest).contains(sub)) else {
                let what = format!("there is no sub-object {} of {index:04X}", quoted(key.key));
                let advice = "it is not used; CompactSubObj says how many there are";
                self.findings.add(Rule::CompactOrphan, key.at, what, advice);
                continue;
            };
            found += 1;
            match table {
                Table::Name => {
                    compact.names.insert(sub, key.value.to_owned());
                }
                Table::Denotation => {
                    compact.denotations.insert(sub, key.value.to_owned());
                }
                Table::Value => {
                    let (value, odd) = Value::read(key.value, entry.data_type);
                    entry::note_oddities(&mut self.findings, &odd, key);
                    compact.values.insert(sub, value);
                }
            }
        }
        if let Some((number, key)) = claimed
            && number.is_none_or(|(number, _)| number.base != found)
        {
            let what = format!(
                "NrOfEntries is {}, but there are {found}",
                quoted(key.value)
            );
            let advice = "all that are there are used; correct the count";
            self.add(Rule::WrongCount, key.value_at, what, advice);
        }
    }
}

/// A section whose keys are kept as they are.
fn kept(section: &RawSection<'_>, name: &str) -> Section {
    let keys = section.keys.iter();
    Section {
        name: name.to_owned(),
        comments: section.comments.clone(),
        inner_comments: section.inner.clone(),
        keys: keys
            .map(|key| (key.key.to_owned(), key.value.to_owned()))
            .collect(),
    }
}
