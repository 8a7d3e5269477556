//! Electronic data sheets (EDS) and device configuration files (DCF) of CiA 306.
//!
//! [`read`] takes the bytes of any file and gives what can be used of it as an [`Eds`], with a list
//! of [`Finding`]s that say by line and column what is broken and what was made of it. [`write()`]
//! gives the text back: reading that again gives an equal model, and keywords and sections that
//! nobody but a vendor knows are kept. [`export()`] makes an [`Eds`] from a dictionary table, and
//! [`Dcf`] from an [`Eds`] and the values of a device.
//!
//! ```
//! let reading = eds::read(b"[1017]\nParameterName=Heartbeat\nDataType=6\nAccessType=rw\n");
//! let entry = reading.eds.entry(0x1017, 0).unwrap();
//! assert_eq!(entry.data_type, Some(eds::DataType::UNSIGNED16));
//! assert!(reading.findings.iter().any(|finding| finding.rule == eds::Rule::NotListed));
//! ```
//!
//! The way of a file: `text` decodes bytes, `ini` cuts lines into sections and keys, `read` makes
//! the model of them, `read::check` looks for contradictions between objects.

mod dcf;
mod export;
mod finding;
mod from_table;
mod info;
mod ini;
mod model;
mod names;
mod number;
mod read;
mod text;
mod types;
mod value;
mod write;

pub use dcf::{Dcf, Live};
pub use export::{Exported, FileDate, export};
pub use finding::{Finding, Place, Rule, Severity};
pub use info::{BIT_RATES_KBIT, Commissioning, DeviceInfo, FileInfo};
pub use model::{Compact, Eds, Entry, List, ListSection, Object, Section};
pub use read::{Reading, read};
pub use text::{Encoding, MAX_BYTES, Newline};
pub use types::{Access, DataType, Kind, ObjectType};
pub use value::{Constant, Value};
pub use write::{Style, write};
