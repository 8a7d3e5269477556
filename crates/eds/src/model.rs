//! An EDS or DCF as data.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::types::{Access, DataType, ObjectType};
use crate::value::Value;

/// An electronic data sheet, or with [`Eds::commissioning`] a device configuration file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Eds {
    /// `[FileInfo]`, `[DeviceInfo]`, `[DeviceComissioning]`, `[DummyUsage]` and `[Comments]`, as far
    /// as there are any, in the order of the file.
    pub info: Vec<Section>,
    /// What the lists of objects hold beside the objects: mandatory, optional, manufacturer.
    pub lists: [ListSection; 3],
    /// The objects by index.
    pub objects: BTreeMap<u16, Object>,
    /// Every other section, in the order of the file.
    pub other: Vec<Section>,
    /// Comments at the end of the file, without their `;`.
    pub trailing_comments: Vec<String>,
}

/// A section as it was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Section {
    /// Its name; a spelling of the standard's, if the standard knows it.
    pub name: String,
    /// Comment lines in front of it, without their `;`.
    pub comments: Vec<String>,
    /// Comment lines in it.
    pub inner_comments: Vec<String>,
    /// Keys and values.
    pub keys: Vec<(String, String)>,
}

impl Section {
    /// A section without keys.
    pub fn new(name: &str) -> Section {
        Section {
            name: name.to_owned(),
            ..Section::default()
        }
    }

    /// The value of a key, whatever its case.
    pub fn get(&self, key: &str) -> Option<&str> {
        let found = self
            .keys
            .iter()
            .find(|(is, _)| is.eq_ignore_ascii_case(key));
        found.map(|(_, value)| value.as_str())
    }

    /// Sets a key in its place, or appends it.
    pub fn set(&mut self, key: &str, value: impl ToString) {
        let value = value.to_string();
        match self
            .keys
            .iter_mut()
            .find(|(is, _)| is.eq_ignore_ascii_case(key))
        {
            Some((_, is)) => *is = value,
            None => self.keys.push((key.to_owned(), value)),
        }
    }
}

/// In which list an object stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum List {
    /// `[MandatoryObjects]`
    Mandatory,
    /// `[OptionalObjects]`
    Optional,
    /// `[ManufacturerObjects]`
    Manufacturer,
}

impl List {
    /// All three, in the order of the file.
    pub const ALL: [List; 3] = [List::Mandatory, List::Optional, List::Manufacturer];

    /// The section's name.
    pub const fn section(self) -> &'static str {
        match self {
            List::Mandatory => "MandatoryObjects",
            List::Optional => "OptionalObjects",
            List::Manufacturer => "ManufacturerObjects",
        }
    }

    /// Where an object belongs (CiA 306): 0x1000, 0x1001 and 0x1018 are mandatory (CiA 301 7.5.2),
    /// 0x2000 to 0x5FFF the manufacturer's.
    pub const fn of(index: u16) -> List {
        match index {
            0x1000 | 0x1001 | 0x1018 => List::Mandatory,
            0x2000..=0x5FFF => List::Manufacturer,
            _ => List::Optional,
        }
    }
}

/// What stands in the section of a list beside the objects.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ListSection {
    /// Comment lines in front of it.
    pub comments: Vec<String>,
    /// Comment lines in it.
    pub inner_comments: Vec<String>,
    /// Keys that only their vendor knows.
    pub extra: Vec<(String, String)>,
}

/// What the section of an object or sub-object says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Entry {
    /// `ParameterName`
    pub name: String,
    /// `Denotation`: the name that a DCF gives it.
    pub denotation: Option<String>,
    /// `ObjectType`
    pub object_type: ObjectType,
    /// `DataType`
    pub data_type: Option<DataType>,
    /// `AccessType`
    pub access: Option<Access>,
    /// `LowLimit`
    pub low_limit: Option<Value>,
    /// `HighLimit`
    pub high_limit: Option<Value>,
    /// `DefaultValue`
    pub default: Option<Value>,
    /// `ParameterValue`: the value that a DCF gives it.
    pub value: Option<Value>,
    /// `PDOMapping`: whether a PDO may map it.
    pub pdo_mapping: Option<bool>,
    /// `ObjFlags`: bit 0 refuses writing on download, bit 1 reading on scan.
    pub flags: Option<u32>,
    /// `UploadFile`
    pub upload_file: Option<String>,
    /// `DownloadFile`
    pub download_file: Option<String>,
    /// Keys that the standard does not know, or that could not be used.
    pub extra: Vec<(String, String)>,
    /// Comment lines in front of the section, without their `;`.
    pub comments: Vec<String>,
    /// Comment lines in it.
    pub inner_comments: Vec<String>,
}

impl Entry {
    /// Whether a tool may read it while it reads all parameters (`ObjFlags`, bit 1).
    pub fn scans(&self) -> bool {
        self.flags.is_none_or(|flags| flags & 2 == 0)
    }
}

/// Sub-objects that are described once for all (`CompactSubObj`).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Compact {
    /// The highest sub-index, 1 to 254.
    pub highest: u8,
    /// Names of sub-objects that have one of their own (`[2000Name]`).
    pub names: BTreeMap<u8, String>,
    /// Values of sub-objects (`[2000Value]`).
    pub values: BTreeMap<u8, Value>,
    /// Denotations of sub-objects (`[2000Denotation]`).
    pub denotations: BTreeMap<u8, String>,
}

/// An object.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Index.
    pub index: u16,
    /// In which list it stands.
    pub list: List,
    /// What its own section says: of a variable everything, of an array or record its name, of
    /// compact sub-objects what they have in common.
    pub entry: Entry,
    /// The sub-objects that have sections of their own.
    pub subs: BTreeMap<u8, Entry>,
    /// The sub-objects that have none.
    pub compact: Option<Compact>,
}

impl Object {
    /// An object without sub-objects, in the list where it belongs.
    pub fn new(index: u16, entry: Entry) -> Object {
        Object {
            index,
            list: List::of(index),
            entry,
            subs: BTreeMap::new(),
            compact: None,
        }
    }

    /// Whether it has sub-indices, or only the value at sub-index 0.
    pub fn has_subs(&self) -> bool {
        self.entry.object_type.has_subs()
    }

    /// The entry at a sub-index.
    pub fn sub(&self, sub: u8) -> Option<Cow<'_, Entry>> {
        if !self.has_subs() {
            return (sub == 0).then_some(Cow::Borrowed(&self.entry));
        }
        if let Some(entry) = self.subs.get(&sub) {
            return Some(Cow::Borrowed(entry));
        }
        let compact = self.compact.as_ref()?;
        (sub <= compact.highest).then(|| Cow::Owned(self.compact_sub(compact, sub)))
    }

    /// CiA 306, "compact storage": sub-index 0 is implied, the others are like the object.
    fn compact_sub(&self, compact: &Compact, sub: u8) -> Entry {
        if sub == 0 {
            return Entry {
                name: "NrOfObjects".to_owned(),
                data_type: Some(DataType::UNSIGNED8),
                access: Some(Access::ReadOnly),
                default: Some(Value::new(
                    &compact.highest.to_string(),
                    Some(DataType::UNSIGNED8),
                )),
                pdo_mapping: Some(false),
                ..Entry::default()
            };
        }
        let name = compact.names.get(&sub).cloned();
        Entry {
            name: name.unwrap_or_else(|| format!("{}{sub}", self.entry.name)),
            denotation: compact.denotations.get(&sub).cloned(),
            object_type: ObjectType::Var,
            data_type: self.entry.data_type,
            access: self.entry.access,
            low_limit: self.entry.low_limit.clone(),
            high_limit: self.entry.high_limit.clone(),
            default: self.entry.default.clone(),
            value: compact.values.get(&sub).cloned(),
            pdo_mapping: self.entry.pdo_mapping,
            flags: self.entry.flags,
            ..Entry::default()
        }
    }

    /// All sub-indices in order.
    pub fn sub_indices(&self) -> impl Iterator<Item = u8> {
        (0..=u8::MAX).filter(|&sub| {
            if !self.has_subs() {
                return sub == 0;
            }
            let compact = self.compact.as_ref();
            self.subs.contains_key(&sub) || compact.is_some_and(|compact| sub <= compact.highest)
        })
    }
}

impl Eds {
    /// The entry at an index and sub-index; of an object without sub-objects, sub-index 0.
    pub fn entry(&self, index: u16, sub: u8) -> Option<Cow<'_, Entry>> {
        self.objects.get(&index)?.sub(sub)
    }

    /// Every index and sub-index with its entry, in order.
    pub fn entries(&self) -> impl Iterator<Item = (u16, u8, Cow<'_, Entry>)> {
        self.objects.values().flat_map(|object| {
            let subs = object.sub_indices();
            subs.filter_map(|sub| Some((object.index, sub, object.sub(sub)?)))
        })
    }

    /// A section that describes no object, whatever its case.
    pub fn section(&self, name: &str) -> Option<&Section> {
        let mut sections = self.info.iter().chain(&self.other);
        sections.find(|section| section.name.eq_ignore_ascii_case(name))
    }
}
