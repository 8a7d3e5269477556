//! What a write means is the owner's business.

use crate::{Abort, Address, Image};

/// The owner's judgement of a write to an object whose row is marked `.asks()`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The value is committed.
    Accept,
    /// The write was obeyed as a command; the value is not committed.
    Done,
    /// Nothing is committed, and the client gets this abort.
    Refuse(Abort),
    /// The answer comes by [`crate::Node::complete`] (erasing, storing); nothing is committed.
    /// Until then uploads are served, and other downloads get [`Abort::DEVICE_STATE`], whichever
    /// server they come by. A receive PDO gets no answer, so there is nothing to complete.
    Later,
}

/// The part of a device that gives its objects meaning. Passed into the node's functions, never
/// stored.
pub trait Owner {
    /// Judges a write, by SDO or RPDO, before it is committed. `new` are the little-endian bytes,
    /// as many as the object has. Called in the order: plain objects of an RPDO are committed
    /// first, then asking objects in the order of their index, so that a controlword sees the
    /// target that came with it and 0x6040 acts before 0x6060.
    fn write(&mut self, image: &Image<'_>, object: Address, new: &[u8]) -> Verdict;

    /// Refreshes the live objects; called before one is read or sampled.
    fn publish(&mut self, image: &mut Image<'_>);

    /// A DOMAIN object is about to be read: its length in bytes, `None` if that is not known yet.
    ///
    /// # Errors
    /// Why it cannot be read now. Owners without streams refuse every one.
    fn stream_size(&mut self, object: Address) -> Result<Option<u32>, Abort> {
        let _ = object;
        Err(Abort::UNSUPPORTED_ACCESS)
    }

    /// Reads a DOMAIN object from byte `at` on and says how many bytes were put into `into`; fewer
    /// than it holds only at the end. The same bytes may be asked for again, when a segment of a
    /// block was lost.
    ///
    /// # Errors
    /// Why it cannot be read on; the transfer is aborted.
    fn stream_read(&mut self, object: Address, at: u32, into: &mut [u8]) -> Result<usize, Abort> {
        let _ = (object, at, into);
        Err(Abort::UNSUPPORTED_ACCESS)
    }

    /// A download to a DOMAIN object begins, of `size` bytes if the client said so. Until it has
    /// ended or was aborted, there is no other download to the same object. With
    /// [`Verdict::Later`] the client waits for [`crate::Node::complete`] (erasing);
    /// [`Verdict::Done`] means the same as accept.
    fn stream_begin(&mut self, object: Address, size: Option<u32>) -> Verdict {
        let _ = (object, size);
        Verdict::Refuse(Abort::UNSUPPORTED_ACCESS)
    }

    /// The next bytes of a download, which come in order and without gaps: `at` is the number of
    /// those before.
    ///
    /// # Errors
    /// Why they cannot be taken; the transfer is aborted, and [`Owner::stream_abort`] not called.
    fn stream_write(&mut self, object: Address, at: u32, bytes: &[u8]) -> Result<(), Abort> {
        let _ = (object, at, bytes);
        Err(Abort::UNSUPPORTED_ACCESS)
    }

    /// All `size` bytes have come, and their checksum was right if there was one.
    fn stream_end(&mut self, object: Address, size: u32) -> Verdict {
        let _ = (object, size);
        Verdict::Refuse(Abort::UNSUPPORTED_ACCESS)
    }

    /// A download that began has ended before its end: aborted by its client, timed out, its
    /// checksum wrong, or shorter or longer than it said.
    fn stream_abort(&mut self, object: Address, why: Abort) {
        let _ = (object, why);
    }
}

/// An owner without opinions: accepts every write.
#[derive(Clone, Copy, Debug)]
pub struct NoOwner;

impl Owner for NoOwner {
    fn write(&mut self, _: &Image<'_>, _: Address, _: &[u8]) -> Verdict {
        Verdict::Accept
    }

    fn publish(&mut self, _: &mut Image<'_>) {}
}

/// Which classes of objects were written (`Row::tells`). A set, so that nothing overflows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Changed(pub(crate) u32);

impl Changed {
    /// Nothing was written.
    pub const NOTHING: Changed = Changed(0);
    /// Everything may have been written: what a start needs.
    pub const EVERYTHING: Changed = Changed(u32::MAX);

    /// Whether an object of `class` (1 to 31) was written.
    #[inline]
    pub const fn has(self, class: u8) -> bool {
        self.0 & (1u32 << (class & 31)) != 0
    }

    /// Whether nothing was written that tells.
    #[inline]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    #[inline]
    pub(crate) fn insert(&mut self, class: u8) {
        // Class 0 means "tells nobody"; its bit is masked out.
        self.0 |= (1u32 << (class & 31)) & !1;
    }

    /// Adds all of `other`.
    pub fn merge(&mut self, other: Changed) {
        self.0 |= other.0;
    }
}
