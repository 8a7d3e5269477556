//! Bytes as a script: a client with the model on a bad wire, or with a server that says anything.
//! The fuzz target, the replay of its corpus and the property tests run this same code.

use can::{Frame, StandardId};
use canopen::sdo_client::{
    Channel, Failure, Method, RequestForm, SdoClient, Settings, Sink, Source,
};
use canopen::{Abort, Instant, NodeId};

use super::model::{ANSWERS, Server, Traits};
use super::wire::{Fate, OBJECT, Wire};

fn take<const N: usize>(input: &mut &[u8]) -> Option<[u8; N]> {
    let (bytes, rest) = input.split_first_chunk::<N>()?;
    *input = rest;
    Some(*bytes)
}

fn method(byte: u8) -> Method {
    match byte % 3 {
        0 => Method::Expedited,
        1 => Method::Segmented,
        _ => Method::Block,
    }
}

fn settings([flags, size, threshold]: [u8; 3]) -> Settings {
    Settings {
        attempts: u32::from(flags & 3),
        form: match flags >> 2 & 3 {
            0 => RequestForm::Unsized,
            1 => RequestForm::Short,
            _ => RequestForm::Sized,
        },
        crc: flags & 0x10 != 0,
        block_size: size,
        switch_threshold: threshold,
        ..Settings::DEFAULT
    }
}

fn client(settings: Settings) -> SdoClient {
    SdoClient::new(Channel::of(NodeId::new(5).expect("an ID")), settings)
}

/// Runs a whole script.
///
/// # Panics
/// If a rule is broken.
pub fn run(mut input: &[u8]) {
    match take(&mut input) {
        Some([first]) if first & 1 == 0 => with_model(input),
        Some(_) => with_anything(input),
        None => {}
    }
}

/// Transfers with the model, each byte of the script the fates of four frames: right data or a
/// failure.
fn with_model(mut input: &[u8]) {
    let Some([first, second, third]) = take(&mut input) else {
        return;
    };
    let settings = settings([first, second, third]);
    let Some([flags, size_0, size_1, low, high, what, salt]) = take(&mut input) else {
        return;
    };
    let traits = Traits {
        sizes: flags & 1 != 0,
        crc: flags & 2 != 0,
        blocks: flags & 12 != 0,
        block_sizes: [size_0, size_1],
        switches: flags & 16 != 0,
    };
    let count = usize::from(u16::from_le_bytes([low, high]) % 4000);
    let case = Case {
        settings,
        traits,
        method: method(what >> 1),
        is_upload: what & 1 == 0,
        value: bytes(count, salt),
    };
    let fates = input.iter().flat_map(|byte| {
        (0..4).map(move |n| match byte >> (2 * n) & 3 {
            0 | 1 => Fate::Arrives,
            2 => Fate::Lost,
            _ => Fate::Doubled,
        })
    });
    case.run(fates);
}

/// `count` bytes without period.
pub fn bytes(count: usize, salt: u8) -> Vec<u8> {
    let mut state = u32::from(salt) | 0x9E37_7900;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as u8
    };
    (0..count).map(|_| next()).collect()
}

/// A transfer between the client and the model.
#[derive(Clone, Debug)]
pub struct Case {
    /// The client's.
    pub settings: Settings,
    /// The server's.
    pub traits: Traits,
    /// Which protocol.
    pub method: Method,
    /// Or else a download.
    pub is_upload: bool,
    /// The object.
    pub value: Vec<u8>,
}

impl Case {
    /// In blocks of one segment nothing tells a doubled one from the next, nor its confirmation
    /// from the next one's. The checksum does, but for one time in 65536, and a fuzzer finds that.
    fn cannot_be_safe(&self) -> bool {
        let smallest = match self.is_upload {
            true => self.settings.block_size,
            false => self.traits.block_sizes[0].min(self.traits.block_sizes[1]),
        };
        self.method == Method::Block && smallest <= 1
    }

    /// Runs the transfer on a wire with these fates, and then one where everything arrives. True
    /// if the first one succeeded.
    ///
    /// # Panics
    /// If wrong data came out, or no end was found, or the client cannot be used again.
    pub fn run(&self, fates: impl Iterator<Item = Fate>) -> bool {
        let mut client = client(self.settings);
        let count = self.value.len();
        let is_expedited = self.method == Method::Expedited;
        if is_expedited && !self.is_upload && !(1..=4).contains(&count) {
            return false;
        }
        let safe = !self.cannot_be_safe();
        let fates = fates.map(|fate| match fate {
            Fate::Doubled if !safe => Fate::Arrives,
            other => other,
        });
        let stored = if self.is_upload { &self.value[..] } else { &[] };
        let mut server = Server::new(self.traits, stored.to_vec());
        let mut wire = Wire::new(fates);
        let first = self.transfer(&mut wire, &mut client, &mut server);
        wire.settle(&mut client, &mut server);
        // The same client and server, which has given up if it was left in the middle.
        server.time_out();
        let mut clean = Wire::new(std::iter::empty());
        let second = self.transfer(&mut clean, &mut client, &mut server);
        let possible = match self.method {
            Method::Expedited => !self.is_upload || self.is_one_exchange(),
            Method::Segmented => true,
            Method::Block => self.traits.blocks,
        };
        assert_eq!(second.is_ok(), possible, "{second:?} {self:?}");
        first.is_ok()
    }

    fn is_one_exchange(&self) -> bool {
        match self.value.len() {
            4 => true,
            1..=3 => self.traits.sizes,
            _ => false,
        }
    }

    fn transfer<F: Iterator<Item = Fate>>(
        &self,
        wire: &mut Wire<F>,
        client: &mut SdoClient,
        server: &mut Server,
    ) -> Result<(), Failure> {
        let count = self.value.len();
        if self.is_upload {
            let (outcome, taken) = wire.upload(client, server, self.method);
            let done = outcome?;
            assert_eq!(done.bytes as usize, count, "{self:?}");
            assert!(taken == self.value, "wrong data {self:?}");
        } else {
            server.written = None;
            let done = wire.download(client, server, self.method, &self.value)?;
            assert_eq!(done.bytes as usize, count, "{self:?}");
            let written = server.written.take().unwrap_or_default();
            // A form without size writes four bytes.
            let right = match (self.method, self.settings.form) {
                (Method::Expedited, RequestForm::Unsized | RequestForm::Short) => {
                    written.starts_with(&self.value)
                }
                _ => written == self.value,
            };
            assert!(right, "wrong data {self:?}");
        }
        Ok(())
    }
}

/// A sink that checks that bytes come in order, and refuses at some offset.
#[derive(Debug)]
struct Checker {
    next: u32,
    refuses_from: u32,
}

impl Sink for Checker {
    fn take(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Abort> {
        assert!(bytes.len() <= 7);
        assert!(offset == 0 || offset == self.next, "a gap");
        self.next = offset + bytes.len() as u32;
        match self.next >= self.refuses_from {
            true => Err(Abort::OUT_OF_MEMORY),
            false => Ok(()),
        }
    }
}

/// A source that checks what is asked of it.
#[derive(Debug)]
struct Pattern {
    count: u32,
}

impl Source for Pattern {
    fn give(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Abort> {
        assert!(!bytes.is_empty() && bytes.len() <= 7);
        assert!(offset + bytes.len() as u32 <= self.count);
        for (place, n) in bytes.iter_mut().zip(offset..) {
            *place = n as u8;
        }
        Ok(())
    }
}

/// A server that says anything, at any time.
fn with_anything(mut input: &[u8]) {
    let Some([first, second, third, refuses]) = take(&mut input) else {
        return;
    };
    let settings = settings([first, second, third]);
    let mut client = client(settings);
    let mut now = Instant(1);
    let mut sink = Checker {
        next: 0,
        refuses_from: match refuses {
            0 => u32::MAX,
            refuses => u32::from(refuses),
        },
    };
    let mut source = Pattern { count: 0 };
    while let Some([what]) = take(&mut input) {
        let was_idle = client.stage().is_none();
        match what & 0x0F {
            // A frame that says something of the object.
            0..=2 => {
                let Some([command, d0, d1]) = take(&mut input) else {
                    return;
                };
                let [low, high] = OBJECT.index.to_le_bytes();
                let data = [command, low, high, OBJECT.sub, d0, d1, 0, 0];
                client.receive(&Frame::classic(ANSWERS, data, 8), now, &mut sink);
            }
            // A segment or a confirmation, perhaps several that follow each other.
            3..=6 => {
                let Some([command, d0, d1]) = take(&mut input) else {
                    return;
                };
                for n in 0..=what >> 4 {
                    let command = match what & 0x0F {
                        3 => command,
                        4 => command.wrapping_add(n),
                        _ => command ^ (n & 1) << 4,
                    };
                    let data = [command, d0, d1, n, 0, 0, 0, 0];
                    client.receive(&Frame::classic(ANSWERS, data, 8), now, &mut sink);
                    if what & 0x0F == 6 {
                        transmit_all(&mut client, now, &mut source);
                    }
                }
            }
            // Any frame of any length.
            7 => {
                let Some(data) = take::<8>(&mut input) else {
                    return;
                };
                let id = if what & 0x80 == 0 { ANSWERS } else { 0x584 };
                let len = usize::from(what >> 4 & 7) + 1;
                let id = StandardId::new(id).expect("an ID");
                let frame = Frame::data_frame(id, &data[..len]).expect("at most eight bytes");
                let taken = client.receive(&frame, now, &mut sink);
                assert!(!taken || id.as_raw() == ANSWERS);
            }
            8 => {
                now = now.plus_ms(u64::from(what >> 4) * 50);
                client.poll(now);
                assert!(client.next_deadline() > now, "a deadline has passed");
            }
            9 => {
                now = client.next_deadline().min(now.plus_ms(1_000));
                client.poll(now);
                let before = (client.next_deadline(), client.outcome(), client.stage());
                client.poll(now);
                let after = (client.next_deadline(), client.outcome(), client.stage());
                assert_eq!(before, after);
            }
            10 => {
                client.transmit(now, &mut source);
            }
            11 | 12 => transmit_all(&mut client, now, &mut source),
            13 if what & 0xC0 == 0 => client.cancel(Abort::GENERAL),
            13 | 14 => {
                let begun = client.upload(OBJECT, method(what >> 4));
                assert_eq!(begun.is_ok(), was_idle);
            }
            _ => {
                let Some([low, high]) = take(&mut input) else {
                    return;
                };
                let count = u32::from(u16::from_le_bytes([low, high]));
                if client.download(OBJECT, count, method(what >> 4)).is_ok() {
                    source.count = count;
                }
            }
        }
        assert!(client.outcome().is_none() || client.stage().is_none());
        let progress = client.progress();
        assert!(progress.done <= progress.total.unwrap_or(u32::MAX));
    }
    client.cancel(Abort::GENERAL);
    transmit_all(&mut client, now, &mut source);
    assert_eq!(client.stage(), None);
}

/// A block, an abort and a first request: more cannot wait.
fn transmit_all(client: &mut SdoClient, now: Instant, source: &mut Pattern) {
    for _ in 0..129 {
        let Some(frame) = client.transmit(now, source) else {
            assert!(client.stage().is_none() || client.next_deadline() > now);
            return;
        };
        assert_eq!(frame.key(), 0x605);
        assert!(frame.len() == 8 || matches!(frame.data()[0], 0x22 | 0x40));
    }
    panic!("transmit has no end");
}
