//! The section of one object or sub-object.

use super::{Places, Reader};
use crate::finding::{Findings, Rule, quoted};
use crate::ini::{RawKey, RawSection};
use crate::model::Entry;
use crate::number::Number;
use crate::types::{Access, DataType, Kind, ObjectType};
use crate::value::Value;

/// What was made of something odd.
fn advice(rule: Rule) -> &'static str {
    match rule {
        Rule::OctalNumber => "read as octal, as the standard says; write it decimal or after 0x",
        Rule::LeadingZero => "read as decimal; write it without the 0",
        Rule::InlineComment => "read without the comment; put comments on lines of their own",
        Rule::NodeIdForm => "read as meant; write it like $NODEID+0x180",
        Rule::RealBits => "read as the bits of a real number; write it like 1.5",
        Rule::BooleanWord => "read as 1 or 0; write that",
        Rule::OutOfRange => "kept as it is; it does not fit its data type",
        _ => "kept as text; it is no value of its data type",
    }
}

/// Findings about the value of a key.
pub(super) fn note_oddities(findings: &mut Findings, oddities: &[Rule], key: &RawKey<'_>) {
    for rule in oddities {
        let what = format!("{} is {}", key.key, quoted(key.value));
        findings.add(*rule, key.value_at, what, advice(*rule));
    }
}

impl Reader {
    pub(super) fn odd_number(&mut self, number: &Number, key: &RawKey<'_>) {
        note_oddities(&mut self.findings, &number.oddities, key);
    }

    pub(super) fn no_number(&mut self, key: &RawKey<'_>) {
        let what = format!(
            "{} is {}, which is no number that fits",
            key.key,
            quoted(key.value)
        );
        let advice = "it is not used; write it like 100 or 0x64";
        self.add(Rule::NotANumber, key.value_at, what, advice);
    }

    /// The number of a key that must have one.
    pub(super) fn number(&mut self, key: &RawKey<'_>) -> Option<i128> {
        let read = Number::read_commented(key.value).filter(|(number, _)| !number.plus_node_id);
        match read {
            Some((number, _)) => {
                self.odd_number(&number, key);
                Some(number.base)
            }
            None => {
                self.no_number(key);
                None
            }
        }
    }

    /// The number of a key, if it fits.
    fn fitting<T: TryFrom<i128>>(&mut self, key: &RawKey<'_>) -> Option<T> {
        let number = self.number(key)?;
        let fitting = T::try_from(number).ok();
        if fitting.is_none() {
            self.no_number(key);
        }
        fitting
    }

    fn value(&mut self, key: &RawKey<'_>, data_type: Option<DataType>) -> Option<Value> {
        let kind = data_type.map_or(Kind::Other, DataType::kind);
        // An empty value is a missing one, but for strings.
        if key.value.is_empty() && !matches!(kind, Kind::Text | Kind::Bytes) {
            return None;
        }
        let (value, oddities) = Value::read(key.value, data_type);
        note_oddities(&mut self.findings, &oddities, key);
        Some(value)
    }

    /// Reads a section; `has_counts` if it may tell of sub-objects.
    pub(super) fn entry(&mut self, section: &RawSection<'_>, has_counts: bool) -> (Entry, Places) {
        let mut entry = Entry {
            comments: section.comments.clone(),
            inner_comments: section.inner.clone(),
            ..Entry::default()
        };
        let mut places = Places {
            header: section.at,
            name: section.at,
            ..Places::default()
        };
        // The values cannot be read without it.
        let mut keys = section.keys.iter();
        if let Some(key) = keys.find(|key| key.key.eq_ignore_ascii_case("DataType")) {
            places.data_type = key.value_at;
            entry.data_type = self.fitting(key).map(DataType);
        }
        for key in &section.keys {
            let used = self.key(key, &mut entry, &mut places, has_counts);
            if !used {
                entry.extra.push((key.key.to_owned(), key.value.to_owned()));
            }
        }
        (entry, places)
    }

    /// Reads one key; `false` if it is to be kept as it is.
    fn key(
        &mut self,
        key: &RawKey<'_>,
        entry: &mut Entry,
        places: &mut Places,
        has_counts: bool,
    ) -> bool {
        match key.key.to_ascii_lowercase().as_str() {
            "parametername" => {
                places.name = key.value_at;
                entry.name = key.value.to_owned();
            }
            "denotation" => entry.denotation = Some(key.value.to_owned()),
            "uploadfile" => entry.upload_file = Some(key.value.to_owned()),
            "downloadfile" => entry.download_file = Some(key.value.to_owned()),
            "objecttype" => {
                let code = self.number(key);
                let known = code.and_then(|code| u64::try_from(code).ok());
                match known.and_then(ObjectType::from_code) {
                    Some(object_type) => entry.object_type = object_type,
                    None if code.is_some() => {
                        let what = format!("ObjectType is {}", quoted(key.value));
                        let advice = "VAR is assumed; 0x7 is VAR, 0x8 ARRAY, 0x9 RECORD";
                        self.add(Rule::UnknownObjectType, key.value_at, what, advice);
                    }
                    None => {}
                }
            }
            "datatype" => return entry.data_type.is_some(),
            "accesstype" => {
                let word = key.value.split(';').next().unwrap_or_default().trim();
                let Some((access, is_usual)) = Access::from_word(word) else {
                    let what = format!("AccessType is {}", quoted(key.value));
                    let advice = "kept, but without effect; write ro, wo, rw, rwr, rww or const";
                    self.add(Rule::UnknownAccess, key.value_at, what, advice);
                    return false;
                };
                if !is_usual || word != key.value {
                    let what = format!("AccessType is {}", quoted(key.value));
                    let advice = format!("read as {}", access.name());
                    self.findings
                        .add(Rule::AccessForm, key.value_at, what, advice);
                }
                entry.access = Some(access);
            }
            "lowlimit" => {
                places.low_limit = key.value_at;
                entry.low_limit = self.value(key, entry.data_type);
            }
            "highlimit" => entry.high_limit = self.value(key, entry.data_type),
            "defaultvalue" => {
                places.default = key.value_at;
                entry.default = self.value(key, entry.data_type);
            }
            "parametervalue" => {
                places.value = key.value_at;
                entry.value = self.value(key, entry.data_type);
            }
            "pdomapping" => {
                entry.pdo_mapping = self.flag(key);
                return entry.pdo_mapping.is_some();
            }
            "objflags" => {
                entry.flags = self.fitting(key);
                return entry.flags.is_some();
            }
            "subnumber" if has_counts => {
                places.sub_number = self.number(key).map(|count| (count, key.value_at));
            }
            "compactsubobj" if has_counts => {
                places.compact = self.number(key).map(|count| (count, key.value_at));
            }
            _ => return false,
        }
        true
    }

    fn flag(&mut self, key: &RawKey<'_>) -> Option<bool> {
        if key.value.is_empty() {
            let what = format!("{} is empty", key.key);
            self.add(Rule::EmptyPdoMapping, key.value_at, what, "read as 0");
            return Some(false);
        }
        let number = self.number(key)?;
        if !(0..=1).contains(&number) {
            let what = format!("{} is {}", key.key, quoted(key.value));
            self.add(Rule::BadFlag, key.value_at, what, "read as 1; write 0 or 1");
        }
        Some(number != 0)
    }
}
