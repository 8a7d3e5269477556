//! A model to text.
//!
//! The order is the standard's: what describes the file and the device, then each list with its
//! objects, then everything else. Counts are those of what is written.

use std::collections::BTreeMap;

use crate::model::{Eds, Entry, List, Object, Section};
use crate::text::{self, Encoding, Newline};
use crate::value::Value;

/// How a file is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Style {
    /// Characters.
    pub encoding: Encoding,
    /// Ends of lines.
    pub newline: Newline,
}

impl Style {
    /// The bytes of an EDS or DCF. Text that the encoding cannot hold is written as UTF-8.
    pub fn bytes(self, eds: &Eds) -> Vec<u8> {
        text::encode(&write(eds), self.encoding, self.newline)
    }
}

/// The text of an EDS or DCF, its lines ended by line feeds.
pub fn write(eds: &Eds) -> String {
    let mut out = Writer::default();
    for section in &eds.info {
        out.section(section);
    }
    for (list, kept) in List::ALL.into_iter().zip(&eds.lists) {
        let objects = || {
            eds.objects
                .values()
                .filter(move |object| object.list == list)
        };
        out.begin(list.section(), &kept.comments, &kept.inner_comments);
        out.key("SupportedObjects", &objects().count().to_string());
        for (number, object) in objects().enumerate() {
            out.key(
                &(number + 1).to_string(),
                &format!("0x{:04X}", object.index),
            );
        }
        out.keys(&kept.extra);
        for object in objects() {
            out.object(object);
        }
    }
    for section in &eds.other {
        out.section(section);
    }
    if !eds.trailing_comments.is_empty() {
        out.gap();
        out.comments(&eds.trailing_comments);
    }
    out.text
}

#[derive(Default)]
struct Writer {
    text: String,
}

impl Writer {
    /// A line. What would break it in two becomes a space.
    fn line(&mut self, parts: &[&str]) {
        for part in parts {
            let broken = part.contains(['\r', '\n']);
            match broken {
                true => self.text.push_str(&part.replace(['\r', '\n'], " ")),
                false => self.text.push_str(part),
            }
        }
        self.text.push('\n');
    }

    /// An empty line between sections.
    fn gap(&mut self) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
    }

    fn comments(&mut self, comments: &[String]) {
        for comment in comments {
            self.line(&[";", comment]);
        }
    }

    fn begin(&mut self, name: &str, comments: &[String], inner: &[String]) {
        self.gap();
        self.comments(comments);
        self.line(&["[", name, "]"]);
        self.comments(inner);
    }

    fn key(&mut self, key: &str, value: &str) {
        self.line(&[key, "=", value]);
    }

    fn keys(&mut self, keys: &[(String, String)]) {
        for (key, value) in keys {
            self.key(key, value);
        }
    }

    fn section(&mut self, section: &Section) {
        self.begin(&section.name, &section.comments, &section.inner_comments);
        self.keys(&section.keys);
    }

    fn object(&mut self, object: &Object) {
        let index = object.index;
        let mut counts = Vec::new();
        let has_subs = object.has_subs();
        if has_subs && (object.compact.is_none() || !object.subs.is_empty()) {
            counts.push(("SubNumber", object.subs.len().to_string()));
        }
        let compact = object.compact.as_ref().filter(|_| has_subs);
        if let Some(compact) = compact {
            counts.push(("CompactSubObj", compact.highest.to_string()));
        }
        self.entry(&format!("{index:04X}"), &object.entry, &counts);
        if let Some(compact) = compact {
            self.table(index, "Name", &compact.names, String::as_str);
            self.table(index, "Value", &compact.values, Value::text);
            self.table(index, "Denotation", &compact.denotations, String::as_str);
        }
        if has_subs {
            for (sub, entry) in &object.subs {
                self.entry(&format!("{index:04X}sub{sub:X}"), entry, &[]);
            }
        }
    }

    fn table<T>(
        &mut self,
        index: u16,
        name: &str,
        table: &BTreeMap<u8, T>,
        text: impl Fn(&T) -> &str,
    ) {
        if table.is_empty() {
            return;
        }
        self.begin(&format!("{index:04X}{name}"), &[], &[]);
        self.key("NrOfEntries", &table.len().to_string());
        for (sub, value) in table {
            self.key(&sub.to_string(), text(value));
        }
    }

    fn entry(&mut self, name: &str, entry: &Entry, counts: &[(&str, String)]) {
        self.begin(name, &entry.comments, &entry.inner_comments);
        self.key("ParameterName", &entry.name);
        self.optional("Denotation", entry.denotation.as_deref());
        self.key("ObjectType", &format!("0x{:X}", entry.object_type.code()));
        for (key, count) in counts {
            self.key(key, count);
        }
        if let Some(data_type) = entry.data_type {
            self.key("DataType", &format!("0x{:04X}", data_type.0));
        }
        self.optional("AccessType", entry.access.map(|access| access.name()));
        self.optional("LowLimit", entry.low_limit.as_ref().map(Value::text));
        self.optional("HighLimit", entry.high_limit.as_ref().map(Value::text));
        self.optional("DefaultValue", entry.default.as_ref().map(Value::text));
        self.optional("ParameterValue", entry.value.as_ref().map(Value::text));
        let mapping = entry.pdo_mapping.map(|is| if is { "1" } else { "0" });
        self.optional("PDOMapping", mapping);
        if let Some(flags) = entry.flags {
            self.key("ObjFlags", &format!("0x{flags:X}"));
        }
        self.optional("UploadFile", entry.upload_file.as_deref());
        self.optional("DownloadFile", entry.download_file.as_deref());
        self.keys(&entry.extra);
    }

    fn optional(&mut self, key: &str, value: Option<&str>) {
        if let Some(value) = value {
            self.key(key, value);
        }
    }
}
