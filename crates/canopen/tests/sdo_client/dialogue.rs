//! Dialogues as tables: what the client sends, what it is answered, how the transfer ends.

use can::{Frame, StandardId};
use canopen::sdo_client::{
    Channel, Done, Failure, Method, NoData, SdoClient, Settings, Sink, Source, Stage,
};
use canopen::{Abort, Address, Instant, NodeId};

/// The object of all dialogues.
pub(crate) const OBJECT: Address = Address::new(0x2345, 6);

/// One line of a dialogue. Frames are hexadecimal; spaces are for the reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// The client sends this, and nothing else before it.
    Sends(&'static str),
    /// The server sends this, and the client takes it for its own.
    Answer(&'static str),
    /// The server sends this, and the client leaves it to others.
    Stale(&'static str),
    /// Nothing happens for so many milliseconds.
    Wait(u64),
    /// The caller gives up.
    Cancel(Abort),
    /// So many bytes are done, and so many there are.
    Progress(u32, Option<u32>),
    /// The next line happens although the client has more to send.
    Interrupt,
}

pub(crate) use Line::{Answer, Cancel, Interrupt, Progress, Sends, Stale, Wait};

/// So many attempts, all else by default.
pub(crate) fn attempts(attempts: u32) -> Settings {
    Settings {
        attempts,
        ..Settings::DEFAULT
    }
}

/// Two attempts, blocks of `segments`.
pub(crate) fn blocks(segments: u8) -> Settings {
    Settings {
        block_size: segments,
        ..attempts(2)
    }
}

/// A transfer that succeeded.
pub(crate) const fn done(bytes: u32) -> Result<Done, Failure> {
    Ok(Done {
        bytes,
        is_sized: true,
    })
}

pub(crate) const fn timed_out(stage: Stage) -> Result<Done, Failure> {
    Err(Failure::TimedOut { stage })
}

/// `count` bytes, of which no two neighbours are the same.
pub(crate) fn pattern(count: usize) -> Vec<u8> {
    (0..count).map(|n| (n % 251) as u8).collect()
}

/// Plays an upload and gives the bytes that the sink has.
pub(crate) fn upload(
    what: &str,
    settings: Settings,
    method: Method,
    lines: &[Line],
    outcome: Result<Done, Failure>,
) -> Vec<u8> {
    let mut bytes: Vec<u8> = Vec::new();
    let mut sink = |offset: u32, new: &[u8]| {
        bytes.truncate(offset as usize);
        assert_eq!(bytes.len(), offset as usize, "{what}: a gap");
        bytes.extend_from_slice(new);
        Ok(())
    };
    let mut client = client(settings);
    client.upload(OBJECT, method).unwrap();
    play(what, &mut client, lines, outcome, &mut sink, &mut NoData);
    bytes
}

/// Plays a download of `bytes`.
pub(crate) fn download(
    what: &str,
    settings: Settings,
    method: Method,
    mut bytes: &[u8],
    lines: &[Line],
    outcome: Result<Done, Failure>,
) {
    let mut client = client(settings);
    let count = bytes.len() as u32;
    client.download(OBJECT, count, method).unwrap();
    play(what, &mut client, lines, outcome, &mut NoData, &mut bytes);
}

/// A client of node 5.
pub(crate) fn client(settings: Settings) -> SdoClient {
    SdoClient::new(Channel::of(NodeId::new(5).unwrap()), settings)
}

/// A frame of node 5's server, as long as what is written.
pub(crate) fn answer(text: &str) -> Frame {
    let digits: Vec<u8> = text.bytes().filter(|byte| *byte != b' ').collect();
    let bytes: Vec<u8> = digits
        .chunks(2)
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect();
    Frame::data_frame(StandardId::new(0x585).unwrap(), &bytes).unwrap()
}

/// Plays a dialogue to its end.
pub(crate) fn play(
    what: &str,
    client: &mut SdoClient,
    lines: &[Line],
    outcome: Result<Done, Failure>,
    sink: &mut impl Sink,
    source: &mut impl Source,
) {
    let mut now = Instant(1_000);
    let mut before = None;
    for (number, line) in lines.iter().enumerate() {
        let place = format!("{what}, line {number} {line:?}");
        let may_send = matches!(line, Sends(_) | Interrupt) || before == Some(Interrupt);
        before = Some(*line);
        if !may_send {
            let more = client.transmit(now, source);
            assert_eq!(more, None, "{place}: the client has more to send");
        }
        match *line {
            Sends(text) => {
                let sent = client.transmit(now, source).map(|frame| frame.to_string());
                let text: String = text.split(' ').collect();
                assert_eq!(sent, Some(format!("605#{text}")), "{place}");
            }
            Answer(text) => assert!(client.receive(&answer(text), now, sink), "{place}"),
            Stale(text) => assert!(!client.receive(&answer(text), now, sink), "{place}"),
            Wait(ms) => {
                now = now.plus_ms(ms);
                client.poll(now);
            }
            Cancel(why) => client.cancel(why),
            Interrupt => {}
            Progress(done, total) => {
                let progress = client.progress();
                assert_eq!((progress.done, progress.total), (done, total), "{place}");
            }
        }
    }
    assert_eq!(client.transmit(now, source), None, "{what}: more to send");
    assert_eq!(client.outcome(), Some(outcome), "{what}");
    assert_eq!(client.stage(), None, "{what}");
    assert_eq!(client.next_deadline(), Instant::NEVER, "{what}");
}
