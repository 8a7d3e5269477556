//! SDO block transfers of 1 MiB between two ends without I/O: the pair, and each end alone.
//!
//! The pair is driven as programs drive such ends: after each frame that an end is given, it is
//! asked for what it has to send. One end alone is driven by the frames that the other one sent in
//! such a transfer, with the same calls in the same order, so that the two figures together are
//! about that of the pair.

use std::hint::black_box;

use can::Frame;

use crate::subject::Wrong;

/// Bytes of an object: 1 MiB.
pub const BYTES: usize = 1 << 20;

/// Steps of an exchange after which it is given up. A transfer takes one for each segment of 7
/// bytes, and few more.
const ENDLESS: usize = BYTES / 4;

/// What is transferred: two contents in turn, so that what an end has kept of the last transfer
/// is not taken for this one's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contents([Vec<u8>; 2]);

impl Contents {
    /// Two contents of `bytes` bytes that differ in each byte.
    pub fn new(bytes: usize) -> Self {
        let mut state = 0x2545_F491u32;
        let mut byte = || {
            // xorshift: no period, no long runs, the same in every run.
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state as u8
        };
        let first: Vec<u8> = (0..bytes).map(|_| byte()).collect();
        let second = first.iter().map(|byte| !byte).collect();
        Self([first, second])
    }

    /// What the transfer with this number carries.
    pub fn of(&self, transfer: u64) -> &[u8] {
        let [first, second] = &self.0;
        if transfer.is_multiple_of(2) {
            first
        } else {
            second
        }
    }
}

/// One end of a transfer, server or client.
///
/// Mark `receive` and `transmit` `#[inline(always)]`.
pub trait End {
    /// The transfer with this number, of that one of the [`Contents`], is about to begin. A client
    /// begins it; a server makes ready.
    fn begin(&mut self, transfer: u64);

    /// Takes a frame.
    fn receive(&mut self, frame: &Frame);

    /// The next frame to send, if there is one.
    fn transmit(&mut self) -> Option<Frame>;

    /// What the present transfer has transferred, as this end sees it. None if it has not ended
    /// well.
    fn transferred(&self) -> Option<&[u8]>;
}

/// What happens in one step of an exchange: the client is asked for a frame, and the server given
/// it; then the other way round.
#[derive(Debug, Clone, Copy)]
struct Step {
    request: Option<Frame>,
    answer: Option<Frame>,
}

/// The steps of a transfer of each of the [`Contents`].
#[derive(Debug, Clone)]
pub struct Script([Vec<Step>; 2]);

impl Script {
    /// Records a transfer of each of the contents.
    ///
    /// # Errors
    /// The first end that is wrong about what was transferred.
    pub fn record(
        client: &mut impl End,
        server: &mut impl End,
        contents: &Contents,
    ) -> Result<Self, Wrong> {
        let mut script = Self([Vec::new(), Vec::new()]);
        for (transfer, steps) in (0..).zip(&mut script.0) {
            transfer_seen(client, server, contents, transfer, |step| steps.push(step))?;
        }
        Ok(script)
    }

    fn of(&self, transfer: u64) -> &[Step] {
        let [first, second] = &self.0;
        if transfer.is_multiple_of(2) {
            first
        } else {
            second
        }
    }
}

/// Runs `transfers` transfers between a pair. Each is compared byte for byte, as both ends see it;
/// the two comparisons cost less than a third of an instruction a byte.
///
/// # Errors
/// The first end that is wrong about what was transferred.
pub fn run_pair(
    client: &mut impl End,
    server: &mut impl End,
    contents: &Contents,
    transfers: u64,
) -> Result<(), Wrong> {
    for transfer in 0..transfers {
        run_one(client, server, contents, transfer)?;
    }
    Ok(())
}

/// Runs the transfer with this number between a pair; compared as by [`run_pair`].
///
/// # Errors
/// The first end that is wrong about what was transferred.
pub fn run_one(
    client: &mut impl End,
    server: &mut impl End,
    contents: &Contents,
    transfer: u64,
) -> Result<(), Wrong> {
    transfer_seen(client, server, contents, transfer, |_| {})
}

/// Runs `transfers` transfers of a server alone. Its frames are compared before and after the
/// measured loop, and counted within it; what it has transferred is compared each time.
///
/// # Errors
/// The first frame that is wrong, or bytes that are.
pub fn run_server(
    server: &mut impl End,
    script: &Script,
    contents: &Contents,
    transfers: u64,
) -> Result<(), Wrong> {
    let serve =
        |server: &mut _, transfer, check| replay_server(server, script, contents, transfer, check);
    run_alone(server, transfers, serve)
}

/// The same of a client alone.
///
/// # Errors
/// The first frame that is wrong, or bytes that are.
pub fn run_client(
    client: &mut impl End,
    script: &Script,
    contents: &Contents,
    transfers: u64,
) -> Result<(), Wrong> {
    let ask =
        |client: &mut _, transfer, check| replay_client(client, script, contents, transfer, check);
    run_alone(client, transfers, ask)
}

/// Whether the frames of an end are compared, or only counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Check {
    Count,
    Compare,
}

fn run_alone<E: End>(
    end: &mut E,
    transfers: u64,
    replay: impl Fn(&mut E, u64, Check) -> Result<(), Wrong>,
) -> Result<(), Wrong> {
    let both = [0, 1];
    for transfer in both {
        replay(end, transfer, Check::Compare)?;
    }
    for transfer in 0..transfers {
        replay(end, transfer, Check::Count)?;
    }
    for transfer in both {
        replay(end, transfer, Check::Compare)?;
    }
    Ok(())
}

fn transfer_seen(
    client: &mut impl End,
    server: &mut impl End,
    contents: &Contents,
    transfer: u64,
    mut seen: impl FnMut(Step),
) -> Result<(), Wrong> {
    server.begin(transfer);
    client.begin(transfer);
    let mut steps = 0;
    loop {
        let request = client.transmit();
        if let Some(frame) = &request {
            server.receive(frame);
        }
        let answer = server.transmit();
        if let Some(frame) = &answer {
            client.receive(frame);
        }
        if request.is_none() && answer.is_none() {
            break;
        }
        seen(Step { request, answer });
        steps += 1;
        if steps > ENDLESS {
            return Err(Wrong::Endless);
        }
    }
    let content = contents.of(transfer);
    check_bytes("client", client, content)?;
    check_bytes("server", server, content)
}

fn replay_server(
    server: &mut impl End,
    script: &Script,
    contents: &Contents,
    transfer: u64,
    check: Check,
) -> Result<(), Wrong> {
    let mut frames = Frames::new("server", check);
    server.begin(transfer);
    for step in script.of(transfer) {
        if let Some(frame) = &step.request {
            server.receive(black_box(frame));
        }
        frames.see(server.transmit(), step.answer)?;
    }
    frames.end(server)?;
    check_bytes("server", server, contents.of(transfer))
}

fn replay_client(
    client: &mut impl End,
    script: &Script,
    contents: &Contents,
    transfer: u64,
    check: Check,
) -> Result<(), Wrong> {
    let mut frames = Frames::new("client", check);
    client.begin(transfer);
    for step in script.of(transfer) {
        frames.see(client.transmit(), step.request)?;
        if let Some(frame) = &step.answer {
            client.receive(black_box(frame));
        }
    }
    frames.end(client)?;
    check_bytes("client", client, contents.of(transfer))
}

/// The frames that an end sends in a transfer.
#[derive(Debug)]
struct Frames {
    end: &'static str,
    check: Check,
    due: u64,
    taken: u64,
}

impl Frames {
    fn new(end: &'static str, check: Check) -> Self {
        let (due, taken) = (0, 0);
        Self {
            end,
            check,
            due,
            taken,
        }
    }

    #[inline(always)]
    fn see(&mut self, got: Option<Frame>, expected: Option<Frame>) -> Result<(), Wrong> {
        self.due += u64::from(expected.is_some());
        self.taken += u64::from(got.is_some());
        if self.check == Check::Compare && got != expected {
            return Err(self.wrong(got, expected));
        }
        black_box(got);
        Ok(())
    }

    /// The transfer is over: so many frames were due, and no more is.
    fn end(&self, end: &mut impl End) -> Result<(), Wrong> {
        if let Some(frame) = end.transmit() {
            return Err(self.wrong(Some(frame), None));
        }
        match self.due == self.taken {
            true => Ok(()),
            false => Err(Wrong::Count {
                expected: self.due,
                got: self.taken,
            }),
        }
    }

    #[cold]
    fn wrong(&self, got: Option<Frame>, expected: Option<Frame>) -> Wrong {
        let content = |frame: Frame| (frame.raw_id() as u16, frame.data().to_vec());
        Wrong::Frame {
            what: format!("frame {} of the {}", self.due, self.end),
            expected: expected.map(content),
            got: got.map(content),
        }
    }
}

fn check_bytes(name: &'static str, end: &impl End, content: &[u8]) -> Result<(), Wrong> {
    let Some(transferred) = end.transferred() else {
        return Err(Wrong::Unfinished { end: name });
    };
    if transferred == content {
        return Ok(());
    }
    let same = transferred.iter().zip(content);
    let offset = same.take_while(|(got, expected)| got == expected).count();
    Err(Wrong::Bytes { end: name, offset })
}
