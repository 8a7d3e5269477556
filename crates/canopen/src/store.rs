//! Stored parameters: a checksummed list of (object, bytes) records.
//!
//! Records, not a copy of the image: firmware whose dictionary has grown, shrunk or been laid out
//! anew still reads what an older one stored. Layout: `SBP1`, length and CRC-32 (ISO HDLC) of the
//! records as little-endian UNSIGNED32, then per record index (2), sub-index (1), size (1), bytes.
//! Records that are no objects' lie in the area of data types, below 0x0020 ([`lss`]).

pub mod lss;
mod restore;

use crc::{CRC_32_ISO_HDLC, Crc};

use crate::row::{Default, Group};
use crate::{Abort, Address, DataType, Field, Image, NodeId, Row, Table};
pub use restore::{RESTORE_SIGNATURE, restore};

/// "save" as an UNSIGNED32 (CiA 301 7.5.2.13).
pub const SIGNATURE: u32 = u32::from_le_bytes(*b"save");

const MAGIC: [u8; 4] = *b"SBP1";
const HEADER: usize = 12;
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// What is to be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Every object that can be stored (0x1010,1).
    All,
    /// Communication parameters (0x1010,2).
    Communication,
    /// Application parameters (0x1010,3).
    Application,
    /// One object (the P3's 0x1010,4).
    Single(Address),
    /// Sub-indices of one object that are one setting.
    Run {
        /// The first of them.
        first: Address,
        /// How many.
        count: u8,
    },
}

impl Request {
    /// What a write of `value` to 0x1010, `sub` (1 to 3) asks.
    ///
    /// # Errors
    /// [`Abort::CANNOT_STORE`] without the signature, [`Abort::NO_SUB_INDEX`] for another `sub`.
    pub const fn from_write(sub: u8, value: u32) -> Result<Request, Abort> {
        let request = match sub {
            1 => Request::All,
            2 => Request::Communication,
            3 => Request::Application,
            _ => return Err(Abort::NO_SUB_INDEX),
        };
        if value == SIGNATURE {
            Ok(request)
        } else {
            Err(Abort::CANNOT_STORE)
        }
    }

    /// Whether it is this very object that is asked for.
    fn names(self, address: Address) -> bool {
        match self {
            Request::Single(single) => single == address,
            Request::Run { first, count } => {
                let step = address.sub.wrapping_sub(first.sub);
                first.index == address.index && step < count
            }
            Request::All | Request::Communication | Request::Application => false,
        }
    }

    fn covers(self, row: &Row, address: Address) -> bool {
        match self {
            Request::All => row.group != Group::None,
            Request::Communication => row.group == Group::Communication,
            Request::Application => row.group == Group::Application,
            Request::Single(_) | Request::Run { .. } => self.names(address),
        }
    }
}

/// Why stored parameters cannot be used. None of them was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// They do not begin as stored parameters do.
    NotParameters,
    /// They end before the length that they state.
    Truncated {
        /// Bytes that should be there.
        expected: u32,
        /// Bytes that are.
        found: u32,
    },
    /// The checksum differs.
    Checksum {
        /// The stored checksum.
        stored: u32,
        /// The checksum of what is there.
        computed: u32,
    },
    /// A record runs past the end.
    Record {
        /// Where it begins, in bytes from the start.
        at: u32,
    },
}

impl core::fmt::Display for Damage {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Damage::NotParameters => f.write_str("not a parameter store (it does not begin SBP1)"),
            Damage::Truncated { expected, found } => {
                write!(
                    f,
                    "truncated: {expected} bytes of records expected, {found} found"
                )
            }
            Damage::Checksum { stored, computed } => {
                write!(
                    f,
                    "checksum 0x{stored:08X} stored, 0x{computed:08X} computed"
                )
            }
            Damage::Record { at } => write!(f, "the record at byte {at} runs past the end"),
        }
    }
}

impl core::error::Error for Damage {}

/// Whether an object can be stored at all.
pub fn is_stored(table: &Table, address: Address) -> bool {
    let row = table
        .find(address.index, address.sub)
        .ok()
        .and_then(|entry| table.row(&entry));
    row.is_some_and(|row| row.group != Group::None)
}

/// What [`load`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loaded {
    /// Records put into the image.
    pub applied: u16,
    /// Records that this dictionary has no place for, or whose value it does not allow.
    pub skipped: u16,
}

/// One stored object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record<'a> {
    /// Which object.
    pub address: Address,
    /// Its bytes, little-endian.
    pub bytes: &'a [u8],
}

/// The records of a store; empty bytes are an empty store.
///
/// # Errors
/// The [`Damage`], found before the first record is given.
pub fn records(stored: &[u8]) -> Result<impl Iterator<Item = Record<'_>>, Damage> {
    let body = check(stored)?;
    Ok(Records { rest: body })
}

struct Records<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for Records<'a> {
    type Item = Record<'a>;

    fn next(&mut self) -> Option<Record<'a>> {
        let (&[low, high, sub, size], rest) = self.rest.split_first_chunk::<4>()?;
        let (bytes, rest) = rest.split_at_checked(usize::from(size))?;
        self.rest = rest;
        Some(Record {
            address: Address::new(u16::from_le_bytes([low, high]), sub),
            bytes,
        })
    }
}

fn check(stored: &[u8]) -> Result<&[u8], Damage> {
    if stored.is_empty() {
        return Ok(&[]);
    }
    let Some((header, body)) = stored.split_first_chunk::<HEADER>() else {
        return Err(Damage::NotParameters);
    };
    let [m0, m1, m2, m3, l0, l1, l2, l3, c0, c1, c2, c3] = *header;
    if [m0, m1, m2, m3] != MAGIC {
        return Err(Damage::NotParameters);
    }
    let expected = u32::from_le_bytes([l0, l1, l2, l3]);
    let Some(body) = usize::try_from(expected)
        .ok()
        .and_then(|length| body.get(..length))
    else {
        return Err(Damage::Truncated {
            expected,
            found: body.len() as u32,
        });
    };
    let (stored, computed) = (u32::from_le_bytes([c0, c1, c2, c3]), CRC.checksum(body));
    if stored != computed {
        return Err(Damage::Checksum { stored, computed });
    }
    let mut records = Records { rest: body };
    while records.next().is_some() {}
    if !records.rest.is_empty() {
        let at = HEADER + body.len() - records.rest.len();
        return Err(Damage::Record { at: at as u32 });
    }
    Ok(body)
}

/// Puts stored values into `image`. Call between [`crate::Node::new`] and [`crate::Node::start`].
///
/// # Errors
/// The [`Damage`]; the image is then untouched.
pub fn load(table: &Table, image: &mut Image<'_>, stored: &[u8]) -> Result<Loaded, Damage> {
    load_where(table, image, stored, |_| true)
}

/// Like [`load`], communication parameters only.
pub(crate) fn load_communication(
    table: &Table,
    image: &mut Image<'_>,
    stored: &[u8],
) -> Result<Loaded, Damage> {
    load_where(table, image, stored, Address::is_communication)
}

fn load_where(
    table: &Table,
    image: &mut Image<'_>,
    stored: &[u8],
    wanted: impl Fn(Address) -> bool,
) -> Result<Loaded, Damage> {
    let mut loaded = Loaded {
        applied: 0,
        skipped: 0,
    };
    let wanted = |address| !lss::is_lss(address) && wanted(address);
    for record in records(stored)?.filter(|record| wanted(record.address)) {
        let place = table
            .find(record.address.index, record.address.sub)
            .ok()
            .filter(|entry| fits(entry.field, record.bytes.len()))
            .filter(|entry| {
                table
                    .row(entry)
                    .is_some_and(|row| allows(row, record.bytes))
            });
        match place {
            Some(entry) => {
                image.set_bytes(entry.field, record.bytes);
                loaded.applied = loaded.applied.saturating_add(1);
            }
            None => loaded.skipped = loaded.skipped.saturating_add(1),
        }
    }
    Ok(loaded)
}

/// A text may be shorter than its place.
fn fits(field: Field, length: usize) -> bool {
    let room = usize::from(field.size());
    length == room || (length < room && field.data_type() == DataType::Text)
}

fn allows(row: &Row, bytes: &[u8]) -> bool {
    let mut raw = [0; 8];
    for (place, byte) in raw.iter_mut().zip(bytes) {
        *place = *byte;
    }
    let raw = u64::from_le_bytes(raw);
    let in_range = match row.data_type.size() {
        8 => row.check_wide_range(raw),
        _ => row.check_range(raw as u32),
    };
    row.group != Group::None && in_range.is_ok()
}

/// The buffer given to [`save`] is too small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full {
    /// Bytes that the buffer has.
    pub capacity: usize,
}

/// Writes a new store into `out`: what `request` covers from `image`, all else as it stands in
/// `old`, objects that this dictionary does not have included (another firmware may). Only
/// [`Request::All`] leaves those out. What LSS has stored ([`lss`]) stays. COB-IDs that are at their
/// default are left out, because the node ID may change. `old` is taken as empty if it is damaged.
/// Returns the bytes used.
///
/// # Errors
/// [`Full`] if `out` is too small; its contents are then of no use.
pub fn save(
    table: &Table,
    image: &Image<'_>,
    node: NodeId,
    request: Request,
    old: &[u8],
    out: &mut [u8],
) -> Result<usize, Full> {
    let old = check(old).unwrap_or(&[]);
    let mut writer = Writer::new(out);
    lss::keep(old, &mut writer)?;
    for row in table.rows() {
        for step in 0..row.count {
            let address = Address::new(row.address.index, row.address.sub.saturating_add(step));
            let Ok(entry) = table.find(address.index, address.sub) else {
                continue;
            };
            if row.group == Group::None {
                continue;
            }
            if request.covers(row, address) {
                if !is_default_cob_id(row, image.raw(entry.field), node) {
                    writer.bytes(address, worth_storing(image, entry.field))?;
                }
            } else if let Some(kept) = find(old, address) {
                writer.bytes(address, kept)?;
            }
        }
    }
    if request != Request::All {
        for record in (Records { rest: old }).filter(|record| !lss::is_lss(record.address)) {
            if table
                .find(record.address.index, record.address.sub)
                .is_err()
            {
                writer.bytes(record.address, record.bytes)?;
            }
        }
    }
    writer.finish()
}

fn is_default_cob_id(row: &Row, raw: u32, node: NodeId) -> bool {
    matches!(row.default, Default::PlusNode(base) if raw == base.wrapping_add(u32::from(node.get())))
}

/// The bytes of `address` in the records of a checked store.
fn find(checked: &[u8], address: Address) -> Option<&[u8]> {
    Records { rest: checked }
        .find(|record| record.address == address)
        .map(|record| record.bytes)
}

struct Writer<'a> {
    out: &'a mut [u8],
    used: usize,
    capacity: usize,
}

/// A value's bytes; of a text those before its end.
fn worth_storing<'a>(image: &'a Image<'_>, field: Field) -> &'a [u8] {
    let bytes = image.bytes(field);
    let length = match field.data_type() {
        DataType::Text => bytes.iter().position(|byte| *byte == 0),
        _ => None,
    };
    length.and_then(|end| bytes.get(..end)).unwrap_or(bytes)
}

impl Writer<'_> {
    fn new(out: &mut [u8]) -> Writer<'_> {
        let capacity = out.len();
        Writer {
            out,
            used: HEADER,
            capacity,
        }
    }

    fn bytes(&mut self, address: Address, bytes: &[u8]) -> Result<(), Full> {
        let [low, high] = address.index.to_le_bytes();
        self.push(&[low, high, address.sub, bytes.len() as u8])?;
        self.push(bytes)
    }

    fn push(&mut self, bytes: &[u8]) -> Result<(), Full> {
        let end = self.used + bytes.len();
        let place = self.out.get_mut(self.used..end).ok_or(Full {
            capacity: self.capacity,
        })?;
        place.copy_from_slice(bytes);
        self.used = end;
        Ok(())
    }

    fn finish(self) -> Result<usize, Full> {
        let full = Full {
            capacity: self.capacity,
        };
        let body = self.out.get(HEADER..self.used).ok_or(full)?;
        let (length, checksum) = (body.len() as u32, CRC.checksum(body));
        let header = self.out.first_chunk_mut::<HEADER>().ok_or(full)?;
        let [l0, l1, l2, l3] = length.to_le_bytes();
        let [c0, c1, c2, c3] = checksum.to_le_bytes();
        let [m0, m1, m2, m3] = MAGIC;
        *header = [m0, m1, m2, m3, l0, l1, l2, l3, c0, c1, c2, c3];
        Ok(self.used)
    }
}
