//! Transfers of any length over a link, with the model of a server that the SDO client's own tests
//! have.

#[path = "../../canopen/tests/sdo_client/harness/model.rs"]
#[allow(dead_code, unreachable_pub, reason = "this file uses a part")]
mod model;

use std::ops::ControlFlow;

use can::{Frame, StandardId};
use canopen::{Abort, Address, Instant, NodeId};
use client::sdo::{Cause, Failure, Method, NoData, Progress};
use client::{Client, Link, LinkError, Settings, block_on};

use model::{Server, Traits};

const NODE: NodeId = NodeId::new(5).unwrap();
const OBJECT: Address = Address::new(0x2345, 6);

const COMPLETE: Traits = Traits {
    sizes: true,
    crc: true,
    blocks: true,
    block_sizes: [127, 127],
    switches: true,
};

/// The model on a bus that takes 100 µs for a frame.
struct Model {
    server: Server,
    now: Instant,
    sent: Vec<Frame>,
    /// Answers nothing after so many requests.
    answers: usize,
    /// An emergency comes before each answer.
    is_noisy: bool,
    noise: bool,
}

impl Model {
    fn new(traits: Traits, value: Vec<u8>) -> Model {
        Model {
            server: Server::new(traits, value),
            now: Instant(1),
            sent: Vec::new(),
            answers: usize::MAX,
            is_noisy: false,
            noise: false,
        }
    }

    /// First bytes of what was sent.
    fn commands(&self) -> Vec<u8> {
        self.sent.iter().map(|frame| frame.bytes()[0]).collect()
    }
}

impl Link for Model {
    fn now(&self) -> Instant {
        self.now
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        self.now = self.now.plus_us(100);
        if self.sent.len() < self.answers {
            self.server.receive(&frame);
        }
        self.sent.push(frame);
        Ok(())
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        if until <= self.now {
            return Ok(None);
        }
        if self.is_noisy && !self.noise && !self.server.out.is_empty() {
            self.noise = true;
            let id = StandardId::new(0x85).unwrap();
            return Ok(Some((self.now, Frame::data_frame(id, &[0; 8]).unwrap())));
        }
        self.noise = false;
        if let Some(frame) = self.server.out.pop_front() {
            self.now = self.now.plus_us(100);
            return Ok(Some((self.now, frame)));
        }
        self.now = until;
        Ok(None)
    }
}

fn bytes(count: usize) -> Vec<u8> {
    (0..count).map(|n| (n % 251) as u8).collect()
}

fn client(traits: Traits, value: Vec<u8>, method: Method) -> Client<Model> {
    let mut client = Client::new(Model::new(traits, value));
    client.settings.method = method;
    client
}

/// First bytes: 0x40 and 0x60 for segments, 0xA4 and 0xA3 for blocks, 0x80 to change over.
#[test]
fn uploads_of_every_length_use_the_protocol_that_fits() {
    use Method::{Auto, Block, Expedited, Segmented};
    for (method, count, begin) in [
        (Auto, 0, &[0x40, 0x60][..]),
        (Auto, 4, &[0x40]),
        (Auto, 5, &[0x40, 0x60]),
        (Auto, 256, &[0x40, 0x60, 0x70]),
        (Auto, 257, &[0x40, 0x80, 0xA4, 0xA3]),
        (Auto, 65_536, &[0x40, 0x80, 0xA4, 0xA3, 0xA2]),
        (Expedited, 4, &[0x40]),
        (Segmented, 4, &[0x40]),
        (Segmented, 2000, &[0x40, 0x60, 0x70]),
        (Block, 4, &[0xA4]),
        (Block, 21, &[0xA4, 0x60]),
        (Block, 22, &[0xA4, 0xA3]),
    ] {
        let mut client = client(COMPLETE, bytes(count), method);
        let read = block_on(client.upload_all(NODE, OBJECT)).unwrap();
        assert_eq!(read, bytes(count), "{method:?} {count}");
        let commands = client.link().commands();
        assert!(
            commands.starts_with(begin),
            "{method:?} {count}: {commands:02X?}"
        );
    }
}

#[test]
fn downloads_of_every_length_use_the_protocol_that_fits() {
    use Method::{Auto, Block, Expedited, Segmented};
    for (method, count, begin) in [
        (Auto, 0, &[0x21, 0x0F][..]),
        (Auto, 1, &[0x2F]),
        (Auto, 4, &[0x23]),
        (Auto, 5, &[0x21, 0x05]),
        (Auto, 256, &[0x21, 0x00, 0x10]),
        (Auto, 257, &[0xC6, 0x01, 0x02]),
        (Auto, 65_536, &[0xC6, 0x01, 0x02]),
        (Expedited, 4, &[0x23]),
        (Segmented, 4, &[0x21, 0x07]),
        (Block, 4, &[0xC6, 0x81]),
    ] {
        let mut client = client(COMPLETE, Vec::new(), method);
        block_on(client.download_all(NODE, OBJECT, &bytes(count))).unwrap();
        let written = client.link().server.written.take();
        assert_eq!(written, Some(bytes(count)), "{method:?} {count}");
        let commands = client.link().commands();
        assert!(
            commands.starts_with(begin),
            "{method:?} {count}: {commands:02X?}"
        );
    }
}

/// A node that knows no blocks is asked once.
#[test]
fn a_node_without_blocks_is_read_and_written_in_segments() {
    let traits = Traits {
        blocks: false,
        ..COMPLETE
    };
    let mut client = client(traits, bytes(1000), Method::Auto);
    let read = block_on(client.upload_all(NODE, OBJECT)).unwrap();
    assert_eq!(read, bytes(1000));
    let commands = client.link().commands();
    assert!(
        commands.starts_with(&[0x40, 0x80, 0xA4, 0x40, 0x60, 0x70]),
        "{commands:02X?}"
    );
    client.link().sent.clear();
    let read = block_on(client.upload_all(NODE, OBJECT)).unwrap();
    assert_eq!(read, bytes(1000));
    assert_eq!(client.link().commands()[..2], [0x40, 0x60]);
    client.link().sent.clear();
    block_on(client.download_all(NODE, OBJECT, &bytes(1000))).unwrap();
    assert_eq!(client.link().commands()[..2], [0x21, 0x00]);
    // Who insists gets the refusal.
    client.settings.method = Method::Block;
    let error = block_on(client.upload_all(NODE, OBJECT)).unwrap_err();
    assert_eq!(error.abort(), Some(Abort::COMMAND));

    let mut client = self::client(traits, Vec::new(), Method::Auto);
    block_on(client.download_all(NODE, OBJECT, &bytes(1000))).unwrap();
    assert_eq!(client.link().commands()[..3], [0xC6, 0x21, 0x00]);
    assert_eq!(client.link().server.written.take(), Some(bytes(1000)));
}

#[test]
fn a_method_that_cannot_be_is_an_error() {
    let mut client = client(COMPLETE, bytes(5), Method::Expedited);
    let error = block_on(client.upload_all(NODE, OBJECT)).unwrap_err();
    assert_eq!(error.cause, Cause::NotExpedited { bytes: Some(5) });
    let error = block_on(client.download_all(NODE, OBJECT, &bytes(5))).unwrap_err();
    assert_eq!(
        error.to_string(),
        "node 5: writing 0x2345,6: an expedited transfer carries 1 to 4 bytes, not 5"
    );
}

#[test]
fn progress_is_told_and_may_end_the_transfer() {
    for (method, count) in [(Method::Segmented, 300), (Method::Block, 3000)] {
        let mut client = client(COMPLETE, bytes(count), method);
        let mut taken = 0;
        let mut sink = |offset: u32, new: &[u8]| {
            taken = offset as usize + new.len();
            Ok(())
        };
        let mut seen = Progress::default();
        let watch = |now: Progress| {
            assert!(now.done >= seen.done, "it goes back");
            seen = now;
            match now.done >= 100 {
                true => ControlFlow::Break(Abort::LOCAL_CONTROL),
                false => ControlFlow::Continue(()),
            }
        };
        let error = block_on(client.upload_to(NODE, OBJECT, &mut sink, watch)).unwrap_err();
        let cancelled = Failure::Cancelled(Abort::LOCAL_CONTROL);
        assert_eq!(error.cause, Cause::Failed(cancelled));
        assert_eq!(seen.total, Some(count as u32));
        assert!((100..count).contains(&taken));
        let last = client.link().sent.last().unwrap().to_string();
        assert_eq!(last, "605#8045230621000008");
        // And is ready for the next one.
        let read = block_on(client.upload_all(NODE, OBJECT)).unwrap();
        assert_eq!(read, bytes(count));
    }
    let mut client = client(COMPLETE, Vec::new(), Method::Block);
    let data = bytes(3000);
    let mut source = &data[..];
    let watch = |now: Progress| match now.done > 0 {
        true => ControlFlow::Break(Abort::GENERAL),
        false => ControlFlow::Continue(()),
    };
    let written = client.download_from(NODE, OBJECT, 3000, &mut source, watch);
    let error = block_on(written).unwrap_err();
    assert_eq!(
        error.cause,
        Cause::Failed(Failure::Cancelled(Abort::GENERAL))
    );
    assert_eq!(client.link().server.written, None);
}

/// The caller is asked while nothing comes, too.
#[test]
fn a_silent_node_can_be_given_up_before_the_time_is_out() {
    let mut client = client(COMPLETE, bytes(9), Method::Segmented);
    client.link().answers = 0;
    client.settings.answer_ms = 60_000;
    let mut looks = 0;
    let watch = |_: Progress| {
        looks += 1;
        match looks > 10 {
            true => ControlFlow::Break(Abort::GENERAL),
            false => ControlFlow::Continue(()),
        }
    };
    let error = block_on(client.upload_to(NODE, OBJECT, &mut NoData, watch)).unwrap_err();
    assert!(matches!(error.cause, Cause::Failed(Failure::Cancelled(_))));
    assert!(
        client.now() < Instant::ZERO.plus_ms(1_000),
        "{:?}",
        client.now()
    );
    assert_eq!(client.link().commands(), [0x40, 0x80]);
}

#[test]
fn silence_on_the_way_is_told_with_its_place() {
    let mut client = client(COMPLETE, bytes(100), Method::Segmented);
    client.settings = Settings {
        answer_ms: 20,
        attempts: 1,
        ..client.settings
    };
    client.link().answers = 3;
    let error = block_on(client.upload_all(NODE, OBJECT)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "node 5: reading 0x2345,6: no answer to a segment"
    );
    assert_eq!(client.link().commands(), [0x40, 0x60, 0x70, 0x60, 0x80]);
}

#[test]
fn other_frames_are_kept() {
    let mut client = client(COMPLETE, bytes(1000), Method::Block);
    client.link().is_noisy = true;
    let read = block_on(client.upload_all(NODE, OBJECT)).unwrap();
    assert_eq!(read, bytes(1000));
    let mut kept = 0;
    while let Some((_, frame)) = block_on(client.receive(Instant::ZERO)).unwrap() {
        assert_eq!(frame.key(), 0x85);
        kept += 1;
    }
    // Beginning, 143 segments, end.
    assert_eq!((kept, client.lost()), (145, 0));
}
