//! A transfer in blocks that goes wrong at one end is not measured.

use bench::block::{Contents, End, Script, run_client, run_pair, run_server};
use bench::subject::Wrong;
use can::Frame;

const BYTES: usize = 20;

/// One end of a transfer written for these tests, with a fault to choose: the client asks for the
/// byte at each offset, and the server answers with it.
#[derive(Debug)]
struct Toy<'a> {
    is_client: bool,
    contents: &'a Contents,
    transfer: u64,
    taken: Vec<u8>,
    waiting: Option<Frame>,
    fault: Fault,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
enum Fault {
    #[default]
    None,
    /// Takes byte 7 of the transfer with number 3 wrong.
    WrongByte,
    /// Believes to be done one byte too early.
    Short,
    /// Ceases after ten bytes.
    Silent,
    /// Sends a wrong frame in the transfer with number 1.
    WrongFrame,
    /// Sends one frame too many, at the end.
    ExtraFrame,
    /// Never comes to an end.
    Endless,
}

const CLIENT: u16 = 0x605;
const SERVER: u16 = 0x585;

impl Toy<'_> {
    fn ask(&mut self) {
        let asks = match self.fault {
            Fault::Silent if self.taken.len() == 10 => false,
            Fault::Endless | Fault::ExtraFrame => true,
            _ => self.taken.len() < BYTES,
        };
        self.waiting = asks.then(|| {
            let offset = self.taken.len() as u8;
            Frame::classic(CLIENT, [offset, 0, 0, 0, 0, 0, 0, 0], 1)
        });
    }
}

impl End for Toy<'_> {
    fn begin(&mut self, transfer: u64) {
        self.transfer = transfer;
        self.waiting = None;
        if self.is_client {
            self.taken.clear();
            self.ask();
        }
    }

    fn receive(&mut self, frame: &Frame) {
        let [byte, ..] = frame.bytes();
        if self.is_client {
            let is_wrong =
                self.fault == Fault::WrongByte && self.transfer == 3 && self.taken.len() == 7;
            if self.taken.len() < BYTES {
                self.taken.push(byte ^ u8::from(is_wrong));
            }
            return self.ask();
        }
        let content = self.contents.of(self.transfer);
        // The client of the endless transfer asks past the end.
        let byte = content.get(usize::from(byte)).copied().unwrap_or_default();
        let is_wrong = self.fault == Fault::WrongFrame && self.transfer == 1;
        let id = if is_wrong { SERVER + 1 } else { SERVER };
        self.waiting = Some(Frame::classic(id, [byte, 0, 0, 0, 0, 0, 0, 0], 1));
    }

    fn transmit(&mut self) -> Option<Frame> {
        self.waiting.take()
    }

    fn transferred(&self) -> Option<&[u8]> {
        if !self.is_client {
            return Some(self.contents.of(self.transfer));
        }
        match self.fault {
            Fault::Short => self.taken.get(..BYTES - 1),
            _ => (self.taken.len() == BYTES).then_some(&*self.taken),
        }
    }
}

fn toy(is_client: bool, contents: &Contents, fault: Fault) -> Toy<'_> {
    Toy {
        is_client,
        contents,
        transfer: 0,
        taken: Vec::new(),
        waiting: None,
        fault,
    }
}

fn pair(client: Fault, server: Fault, transfers: u64) -> Result<(), Wrong> {
    let contents = Contents::new(BYTES);
    let mut client = toy(true, &contents, client);
    let mut server = toy(false, &contents, server);
    run_pair(&mut client, &mut server, &contents, transfers)
}

fn script(contents: &Contents) -> Script {
    let mut client = toy(true, contents, Fault::None);
    let mut server = toy(false, contents, Fault::None);
    Script::record(&mut client, &mut server, contents).expect("a right pair")
}

fn client_alone(fault: Fault, transfers: u64) -> Result<(), Wrong> {
    let contents = Contents::new(BYTES);
    let mut client = toy(true, &contents, fault);
    run_client(&mut client, &script(&contents), &contents, transfers)
}

fn server_alone(fault: Fault, transfers: u64) -> Result<(), Wrong> {
    let contents = Contents::new(BYTES);
    let mut server = toy(false, &contents, fault);
    run_server(&mut server, &script(&contents), &contents, transfers)
}

#[test]
fn two_contents_differ_in_each_byte_and_do_not_repeat() {
    let contents = Contents::new(1000);
    let (first, second) = (contents.of(0), contents.of(1));
    assert_eq!((first.len(), second.len()), (1000, 1000));
    assert!(
        first
            .iter()
            .zip(second)
            .all(|(first, second)| first != second)
    );
    assert_eq!((first, second), (contents.of(2), contents.of(3)));
    for shift in 1..100 {
        assert_ne!(first[shift..], first[..1000 - shift], "{shift}");
    }
}

#[test]
fn right_ends_pass() {
    assert_eq!(pair(Fault::None, Fault::None, 5), Ok(()));
    assert_eq!(client_alone(Fault::None, 5), Ok(()));
    assert_eq!(server_alone(Fault::None, 5), Ok(()));
}

#[test]
fn a_wrong_byte_in_any_transfer_is_seen() {
    let wrong = Wrong::Bytes {
        end: "client",
        offset: 7,
    };
    assert_eq!(pair(Fault::WrongByte, Fault::None, 3), Ok(()));
    assert_eq!(pair(Fault::WrongByte, Fault::None, 4), Err(wrong.clone()));
    assert_eq!(client_alone(Fault::WrongByte, 4), Err(wrong));
}

#[test]
fn a_byte_too_few_is_seen() {
    let wrong = Wrong::Bytes {
        end: "client",
        offset: BYTES - 1,
    };
    assert_eq!(pair(Fault::Short, Fault::None, 1), Err(wrong));
}

#[test]
fn a_transfer_that_does_not_end_is_seen() {
    let silent = pair(Fault::Silent, Fault::None, 1);
    assert_eq!(silent, Err(Wrong::Unfinished { end: "client" }));
    let endless = pair(Fault::Endless, Fault::None, 1);
    assert_eq!(endless, Err(Wrong::Endless));
}

#[test]
fn a_frame_of_an_end_alone_that_is_wrong_is_seen() {
    let content = Contents::new(BYTES).of(1)[0];
    let wrong = Wrong::Frame {
        what: "frame 1 of the server".to_owned(),
        expected: Some((SERVER, vec![content])),
        got: Some((SERVER + 1, vec![content])),
    };
    assert_eq!(server_alone(Fault::WrongFrame, 0), Err(wrong));
}

#[test]
fn a_frame_of_an_end_alone_that_is_too_many_is_seen() {
    let wrong = Wrong::Frame {
        what: "frame 20 of the client".to_owned(),
        expected: None,
        got: Some((CLIENT, vec![BYTES as u8])),
    };
    assert_eq!(client_alone(Fault::ExtraFrame, 0), Err(wrong));
}
