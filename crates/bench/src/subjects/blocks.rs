//! Our own SDO client and server: block transfers of a DOMAIN object that streams.

use bench::block::{self, BYTES, Contents, End, Script};
use bench::subject::{Direction, NODE_ID, Side, Wrong};
use can::Frame;
use canopen::row::{domain, u8, u32};
use canopen::sdo_client::{Channel, Done, Method, NoData, SdoClient, Settings};
use canopen::{
    Abort, Address, Device, Dialect, Dictionary, Image, Instant, Node, NodeId, Owner, Row, Verdict,
    dictionary,
};

/// The object that is transferred.
const OBJECT: Address = Address::new(0x2000, 0);

const ROWS: &[Row] = &[
    u32(0x1000, 0, "Device type").constant().default(0),
    u8(0x1001, 0, "Error register").tpdo(),
    u32(0x1018, 1, "Identity").subs(4),
    domain(OBJECT.index, OBJECT.sub, "Data").rw(),
];
const PARTS: &[&[Row]] = &[ROWS];
static OBJECTS: Dictionary<{ dictionary::count(PARTS) }> = dictionary::layout(PARTS);
/// The standard: blocks of 127 segments, with checksum.
static DEVICE: Device = Device::new(&OBJECTS, Dialect::STANDARD);

/// Runs transfers of one direction, everything compared that is transferred.
pub(crate) fn run(direction: Direction, side: Side, transfers: u64) -> Result<(), Wrong> {
    let contents = Contents::new(BYTES);
    let server = Server::new(&contents);
    match direction {
        Direction::Upload => run_side(Upload::new(), server, side, &contents, transfers),
        Direction::Download => {
            run_side(Download::new(&contents), server, side, &contents, transfers)
        }
    }
}

fn run_side(
    mut client: impl End,
    mut server: impl End,
    side: Side,
    contents: &Contents,
    transfers: u64,
) -> Result<(), Wrong> {
    if side == Side::Pair {
        return block::run_pair(&mut client, &mut server, contents, transfers);
    }
    let script = Script::record(&mut client, &mut server, contents)?;
    match side {
        Side::Client => block::run_client(&mut client, &script, contents, transfers),
        Side::Server | Side::Pair => block::run_server(&mut server, &script, contents, transfers),
    }
}

/// A pair that makes an upload each call.
pub(crate) fn uploads(contents: &Contents) -> impl FnMut() -> Result<(), Wrong> {
    transfers(Upload::new(), Server::new(contents), contents)
}

/// A pair that makes a download each call.
pub(crate) fn downloads(contents: &Contents) -> impl FnMut() -> Result<(), Wrong> {
    transfers(Download::new(contents), Server::new(contents), contents)
}

fn transfers(
    mut client: impl End,
    mut server: impl End,
    contents: &Contents,
) -> impl FnMut() -> Result<(), Wrong> {
    let mut transfer = 0;
    move || {
        transfer += 1;
        block::run_one(&mut client, &mut server, contents, transfer)
    }
}

/// The owner of the object.
#[derive(Debug)]
struct Store<'a> {
    given: &'a [u8],
    /// What a download has brought.
    taken: Vec<u8>,
    has_begun: bool,
    has_ended: bool,
}

impl Owner for Store<'_> {
    fn write(&mut self, _: &Image<'_>, _: Address, _: &[u8]) -> Verdict {
        Verdict::Accept
    }

    fn publish(&mut self, _: &mut Image<'_>) {}

    fn stream_size(&mut self, _: Address) -> Result<Option<u32>, Abort> {
        Ok(u32::try_from(self.given.len()).ok())
    }

    #[inline]
    fn stream_read(&mut self, _: Address, at: u32, into: &mut [u8]) -> Result<usize, Abort> {
        let rest = self.given.get(at as usize..).ok_or(Abort::GENERAL)?;
        let count = rest.len().min(into.len());
        into[..count].copy_from_slice(&rest[..count]);
        Ok(count)
    }

    fn stream_begin(&mut self, _: Address, size: Option<u32>) -> Verdict {
        if size.is_some_and(|size| size as usize != self.taken.len()) {
            return Verdict::Refuse(Abort::LENGTH);
        }
        (self.has_begun, self.has_ended) = (true, false);
        Verdict::Accept
    }

    #[inline]
    fn stream_write(&mut self, _: Address, at: u32, bytes: &[u8]) -> Result<(), Abort> {
        put(&mut self.taken, at, bytes)
    }

    fn stream_end(&mut self, _: Address, size: u32) -> Verdict {
        self.has_ended = size as usize == self.taken.len();
        Verdict::Accept
    }
}

#[derive(Debug)]
struct Server<'a> {
    /// A memory of another type than the other cases have: their code is then not shared with
    /// this one's, and costs what it costs alone.
    node: Node<Box<[u8]>>,
    store: Store<'a>,
    contents: &'a Contents,
    now: Instant,
}

impl<'a> Server<'a> {
    fn new(contents: &'a Contents) -> Self {
        let memory = vec![0; DEVICE.table.image_bytes()].into_boxed_slice();
        let mut node = Node::new(&DEVICE, memory, node_id());
        let mut store = Store {
            given: contents.of(0),
            taken: vec![0; BYTES],
            has_begun: false,
            has_ended: false,
        };
        let now = Instant::ZERO;
        node.start(now);
        assert!(node.transmit(&mut store).is_some(), "the boot-up frame");
        Self {
            node,
            store,
            contents,
            now,
        }
    }
}

impl End for Server<'_> {
    fn begin(&mut self, transfer: u64) {
        self.store.given = self.contents.of(transfer);
        (self.store.has_begun, self.store.has_ended) = (false, false);
    }

    #[inline(always)]
    fn receive(&mut self, frame: &Frame) {
        self.node.receive(frame, self.now, &mut self.store);
    }

    #[inline(always)]
    fn transmit(&mut self) -> Option<Frame> {
        self.node.transmit(&mut self.store)
    }

    fn transferred(&self) -> Option<&[u8]> {
        if self.store.has_begun {
            self.store.has_ended.then_some(&*self.store.taken)
        } else {
            // The end of an upload is told to nobody: what its client has got tells.
            Some(self.store.given)
        }
    }
}

/// A client that reads.
#[derive(Debug)]
struct Upload {
    client: SdoClient,
    taken: Vec<u8>,
    now: Instant,
}

impl Upload {
    fn new() -> Self {
        Self {
            client: client(),
            taken: vec![0; BYTES],
            now: Instant::ZERO,
        }
    }
}

impl End for Upload {
    fn begin(&mut self, _: u64) {
        let begun = self.client.upload(OBJECT, Method::Block);
        begun.expect("the last transfer has ended");
    }

    #[inline(always)]
    fn receive(&mut self, frame: &Frame) {
        let taken = &mut self.taken;
        let mut sink = |offset: u32, bytes: &[u8]| put(taken, offset, bytes);
        self.client.receive(frame, self.now, &mut sink);
    }

    #[inline(always)]
    fn transmit(&mut self) -> Option<Frame> {
        self.client.transmit(self.now, &mut NoData)
    }

    fn transferred(&self) -> Option<&[u8]> {
        has_all(&self.client, &self.taken).then_some(&*self.taken)
    }
}

/// A client that writes.
#[derive(Debug)]
struct Download<'a> {
    client: SdoClient,
    contents: &'a Contents,
    given: &'a [u8],
    now: Instant,
}

impl<'a> Download<'a> {
    fn new(contents: &'a Contents) -> Self {
        Self {
            client: client(),
            contents,
            given: contents.of(0),
            now: Instant::ZERO,
        }
    }
}

impl End for Download<'_> {
    fn begin(&mut self, transfer: u64) {
        self.given = self.contents.of(transfer);
        let bytes = self.given.len() as u32;
        let begun = self.client.download(OBJECT, bytes, Method::Block);
        begun.expect("the last transfer has ended");
    }

    #[inline(always)]
    fn receive(&mut self, frame: &Frame) {
        self.client.receive(frame, self.now, &mut NoData);
    }

    #[inline(always)]
    fn transmit(&mut self) -> Option<Frame> {
        self.client.transmit(self.now, &mut self.given)
    }

    fn transferred(&self) -> Option<&[u8]> {
        has_all(&self.client, self.given).then_some(self.given)
    }
}

fn node_id() -> NodeId {
    NodeId::new(NODE_ID).expect("a node ID from 1 to 127")
}

fn client() -> SdoClient {
    // Blocks of 127 segments, with checksum.
    SdoClient::new(Channel::of(node_id()), Settings::DEFAULT)
}

fn has_all(client: &SdoClient, bytes: &[u8]) -> bool {
    let done = |done: Done| done.is_sized && done.bytes as usize == bytes.len();
    matches!(client.outcome(), Some(Ok(end)) if done(end))
}

#[inline]
fn put(into: &mut [u8], at: u32, bytes: &[u8]) -> Result<(), Abort> {
    let rest = into.get_mut(at as usize..).ok_or(Abort::TOO_LONG)?;
    let place = rest.get_mut(..bytes.len()).ok_or(Abort::TOO_LONG)?;
    place.copy_from_slice(bytes);
    Ok(())
}
