//! The owner of a full device: judges as it is told, keeps what its streams get, and writes down
//! what it was asked. It panics where the node breaks its promises about streams.

use std::collections::BTreeMap;

use canopen::{Abort, Address, Handle, Image, Owner, Verdict};

use super::full::OBJECTS_CONST;

/// What an owner was asked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Call {
    /// To judge a write.
    Write(Address, Vec<u8>),
    /// To begin a download of so many bytes.
    Begin(Address, Option<u32>),
    /// To take bytes.
    Bytes(u32, Vec<u8>),
    /// To end a download of so many bytes.
    End(Address, u32),
    /// To forget a download.
    Abort(Address, Abort),
}

/// The owner.
#[derive(Clone, Debug)]
pub struct Streams {
    /// Of writes.
    pub verdict: Verdict,
    /// Of a download's begin.
    pub begin: Verdict,
    /// Of its end.
    pub end: Verdict,
    /// Bytes from here on are refused with 0x06060000.
    pub full_at: u32,
    /// What a DOMAIN reads as.
    pub contents: Vec<u8>,
    /// Whether its size is known before it is read.
    pub says_size: bool,
    /// Reading from here on fails with 0x06060000.
    pub broken_at: u32,
    /// No DOMAIN can be read.
    pub is_unreadable: bool,
    /// All that was asked.
    pub calls: Vec<Call>,
    /// What the last download gave, ended or not.
    pub taken: Vec<u8>,
    /// What downloads that have ended gave.
    pub ended: Vec<Vec<u8>>,
    /// Counted by every publication: the live objects show it.
    pub published: u32,
    /// Downloads that have begun: bytes so far.
    open: BTreeMap<Address, Vec<u8>>,
}

impl Default for Streams {
    fn default() -> Streams {
        Streams {
            verdict: Verdict::Accept,
            begin: Verdict::Accept,
            end: Verdict::Accept,
            full_at: u32::MAX,
            contents: Vec::new(),
            says_size: true,
            broken_at: u32::MAX,
            is_unreadable: false,
            calls: Vec::new(),
            taken: Vec::new(),
            ended: Vec::new(),
            published: 0,
            open: BTreeMap::new(),
        }
    }
}

impl Streams {
    /// With streams that read as `contents`.
    pub fn of(contents: &[u8]) -> Streams {
        Streams {
            contents: contents.to_vec(),
            ..Streams::default()
        }
    }

    /// Whether no download to a stream is under way.
    pub fn is_balanced(&self) -> bool {
        self.open.is_empty()
    }

    /// The owner itself refuses what it had said it would begin later.
    pub fn give_up(&mut self) {
        self.open.clear();
    }

    /// The same of one object.
    pub fn forget(&mut self, object: Option<Address>) {
        self.open.retain(|open, _| Some(*open) != object);
    }

    /// What was asked since the last time.
    pub fn take_calls(&mut self) -> Vec<Call> {
        std::mem::take(&mut self.calls)
    }

    fn is_stream(object: Address) -> bool {
        matches!(object.index, 0x1021 | 0x1F50 | 0x2020..=0x2022)
    }
}

const POSITION: Handle<i32> = OBJECTS_CONST.handle(0x2008, 0);
const VELOCITY: Handle<i32> = OBJECTS_CONST.handle(0x2009, 0);
const WIDE: Handle<i64> = OBJECTS_CONST.handle(0x2016, 0);
const TEXT: canopen::Field = OBJECTS_CONST.need(0x2010, 4);

impl Owner for Streams {
    fn write(&mut self, _: &Image<'_>, object: Address, new: &[u8]) -> Verdict {
        assert!(!Streams::is_stream(object), "{object} is no value");
        self.calls.push(Call::Write(object, new.to_vec()));
        self.verdict
    }

    fn publish(&mut self, image: &mut Image<'_>) {
        self.published = self.published.wrapping_add(1);
        image.set(POSITION, self.published as i32);
        image.set(VELOCITY, -(self.published as i32));
        image.set(WIDE, -i64::from(self.published));
        image.set_bytes(TEXT, format!("publication {}", self.published).as_bytes());
    }

    fn stream_size(&mut self, object: Address) -> Result<Option<u32>, Abort> {
        assert!(Streams::is_stream(object), "{object} is no stream");
        if self.is_unreadable {
            return Err(Abort::NO_DATA);
        }
        Ok(self.says_size.then_some(self.contents.len() as u32))
    }

    fn stream_read(&mut self, object: Address, at: u32, into: &mut [u8]) -> Result<usize, Abort> {
        assert!(Streams::is_stream(object), "{object} is no stream");
        if at.saturating_add(into.len() as u32) > self.broken_at {
            return Err(Abort::HARDWARE);
        }
        let rest = self.contents.get(at as usize..).expect("not past the end");
        let count = rest.len().min(into.len());
        into[..count].copy_from_slice(&rest[..count]);
        Ok(count)
    }

    fn stream_begin(&mut self, object: Address, size: Option<u32>) -> Verdict {
        assert!(Streams::is_stream(object), "{object} is no stream");
        self.calls.push(Call::Begin(object, size));
        if !matches!(self.begin, Verdict::Refuse(_)) {
            let before = self.open.insert(object, Vec::new());
            assert_eq!(before, None, "{object} is being written already");
            self.taken.clear();
        }
        self.begin
    }

    fn stream_write(&mut self, object: Address, at: u32, bytes: &[u8]) -> Result<(), Abort> {
        self.calls.push(Call::Bytes(at, bytes.to_vec()));
        let so_far = self.open.get_mut(&object).expect("it has begun");
        assert_eq!(so_far.len() as u32, at, "without gaps");
        so_far.extend_from_slice(bytes);
        if so_far.len() as u32 > self.full_at {
            self.open.remove(&object);
            return Err(Abort::HARDWARE);
        }
        self.taken.extend_from_slice(bytes);
        Ok(())
    }

    fn stream_end(&mut self, object: Address, size: u32) -> Verdict {
        self.calls.push(Call::End(object, size));
        let all = self.open.remove(&object).expect("it has begun");
        assert_eq!(all.len() as u32, size, "all has come");
        self.ended.push(all);
        self.end
    }

    fn stream_abort(&mut self, object: Address, why: Abort) {
        self.calls.push(Call::Abort(object, why));
        let begun = self.open.remove(&object);
        assert!(begun.is_some(), "{object}: nothing to abort ({why})");
    }
}
