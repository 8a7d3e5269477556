//! The cases, and what a stack must offer to be measured.
//!
//! All stacks are driven by the loops of this module, through inlined methods, so that the frame of
//! the measurement is the same for all: a request in the stack's own frame type goes in, the frames
//! taken from the stack's transmit function come out.

use std::hint::black_box;

/// The node ID of every subject.
pub const NODE_ID: u8 = 5;

/// The objects mapped to the four TPDOs, two to each, all u32 at sub-index 0.
pub const MAPPED: [u16; 8] = [
    0x2000, 0x2001, 0x2002, 0x2003, 0x2004, 0x2005, 0x2006, 0x2007,
];

/// The COB-IDs of the four TPDOs: those of the predefined connection set (CiA 301 7.3.3).
pub const TPDO_COB_IDS: [u16; 4] = [0x185, 0x285, 0x385, 0x485];

/// The COB-ID of NMT commands.
pub const NMT_COB_ID: u16 = 0x000;

/// The COB-ID of SYNC.
pub const SYNC_COB_ID: u16 = 0x080;

/// The COB-ID of requests to the node's SDO server.
pub const SDO_REQUEST_COB_ID: u16 = 0x600 + NODE_ID as u16;

/// The COB-ID of the answers of the node's SDO server.
pub const SDO_RESPONSE_COB_ID: u16 = 0x580 + NODE_ID as u16;

/// The NMT command that makes the node operational (CiA 301 7.2.8.3.1.1).
pub const NMT_START: [u8; 2] = [1, NODE_ID];

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Case {
    /// Expedited SDO upload of a u32 from a dictionary of 50 objects: request received, answer
    /// taken from transmit. The mean over eight objects spread evenly over the application's part
    /// of the dictionary.
    SdoUpload,
    /// The same with 500 objects.
    SdoUpload500,
    /// Publication of eight values, SYNC received, four TPDOs of 2 × 32 bit taken from transmit.
    Sync4Tpdo,
    /// The periodic call of an operational node that has nothing to do: four TPDOs configured,
    /// heartbeat armed, nothing due.
    IdlePoll,
    /// SDO transfer of 1 MiB in blocks of 127 segments, with checksum.
    Block(Direction, Side),
}

/// Which way a transfer goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From server to client.
    Upload,
    /// From client to server.
    Download,
}

/// Which ends of a transfer are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Client and server.
    Pair,
    /// The server alone.
    Server,
    /// The client alone.
    Client,
}

impl Case {
    /// Every case, in the order of the report.
    pub const ALL: [Self; 10] = [
        Self::SdoUpload,
        Self::SdoUpload500,
        Self::Sync4Tpdo,
        Self::IdlePoll,
        Self::Block(Direction::Upload, Side::Pair),
        Self::Block(Direction::Upload, Side::Server),
        Self::Block(Direction::Upload, Side::Client),
        Self::Block(Direction::Download, Side::Pair),
        Self::Block(Direction::Download, Side::Server),
        Self::Block(Direction::Download, Side::Client),
    ];

    /// The case's name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SdoUpload => "sdo_upload",
            Self::SdoUpload500 => "sdo_upload_500",
            Self::Sync4Tpdo => "sync_4tpdo",
            Self::IdlePoll => "idle_poll",
            Self::Block(Direction::Upload, Side::Pair) => "block_upload",
            Self::Block(Direction::Upload, Side::Server) => "block_upload_server",
            Self::Block(Direction::Upload, Side::Client) => "block_upload_client",
            Self::Block(Direction::Download, Side::Pair) => "block_download",
            Self::Block(Direction::Download, Side::Server) => "block_download_server",
            Self::Block(Direction::Download, Side::Client) => "block_download_client",
        }
    }

    /// The name of its figure in the report.
    pub const fn metric(self) -> &'static str {
        match self {
            Self::SdoUpload => "sdo_upload_instructions",
            Self::SdoUpload500 => "sdo_upload_500_instructions",
            Self::Sync4Tpdo => "sync_4tpdo_instructions",
            Self::IdlePoll => "idle_poll_instructions",
            Self::Block(Direction::Upload, Side::Pair) => "block_upload_instructions_per_byte",
            Self::Block(Direction::Upload, Side::Server) => {
                "block_upload_server_instructions_per_byte"
            }
            Self::Block(Direction::Upload, Side::Client) => {
                "block_upload_client_instructions_per_byte"
            }
            Self::Block(Direction::Download, Side::Pair) => "block_download_instructions_per_byte",
            Self::Block(Direction::Download, Side::Server) => {
                "block_download_server_instructions_per_byte"
            }
            Self::Block(Direction::Download, Side::Client) => {
                "block_download_client_instructions_per_byte"
            }
        }
    }

    /// Whether an iteration is a transfer of [`crate::block::BYTES`] bytes, and the figure one
    /// for each byte.
    pub const fn is_block(self) -> bool {
        matches!(self, Self::Block(..))
    }

    /// The two run lengths, in iterations. They have as many digits as each other, so that reading
    /// them from the command line costs the same; their difference is a multiple of every cycle of
    /// requests, values and contents in the case.
    pub const fn run_lengths(self) -> [u64; 2] {
        if self.is_block() {
            [1, 3]
        } else {
            [1_000, 9_000]
        }
    }
}

/// A CANopen device under measurement, operational, with 50 or 500 objects. Its
/// application's objects are u32 at ascending indices from [`MAPPED`]`[0]`, each with the value
/// [`value_of`] its index; TPDO 1 to 4 map [`MAPPED`] with transmission type 1.
///
/// Mark every method `#[inline(always)]`.
pub trait Subject {
    /// A received frame, in the form in which the stack takes it.
    type Received;

    /// A frame to send, in the form in which the stack gives it.
    type Sent;

    /// Makes a received frame. Not measured.
    fn received(cob_id: u16, data: &[u8]) -> Self::Received;

    /// The COB-ID and the data of a sent frame. Not measured.
    fn content(sent: &Self::Sent) -> (u16, &[u8]);

    /// How many objects the application has, the eight of [`MAPPED`] included. Not measured.
    fn application_objects(&self) -> u16;

    /// Takes one received frame, does all that it asks for, and hands every frame that is then to
    /// be sent to `taken`: exactly as many as are due, without asking for one more.
    fn exchange(&mut self, received: &Self::Received, due: usize, taken: impl FnMut(Self::Sent));

    /// Writes the process data: `values[i]` into the object `MAPPED[i]`.
    fn publish(&mut self, values: &[u32; 8]);

    /// A frame that waits for transmission, if there is one. Not measured.
    fn waiting(&mut self) -> Option<Self::Sent>;
}

/// A device with a clock: it must be called from time to time.
pub trait Polled: Subject {
    /// The periodic call, at a time when nothing is due.
    fn poll(&mut self);
}

/// The value of the application's object `index`: the index in both halves.
pub const fn value_of(index: u16) -> u32 {
    (index as u32) << 16 | index as u32
}

/// A stack that did not do what the case asks for.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Wrong {
    /// A frame other than the one due, or none.
    #[error("{what}: expected {expected:02X?}, got {got:02X?}")]
    Frame {
        /// What was asked.
        what: String,
        /// COB-ID and data that were due.
        expected: Option<(u16, Vec<u8>)>,
        /// COB-ID and data that came.
        got: Option<(u16, Vec<u8>)>,
    },
    /// A count of frames other than the one due over the measured loop.
    #[error("{got} frames sent in the measured loop, {expected} expected")]
    Count {
        /// Frames due.
        expected: u64,
        /// Frames taken.
        got: u64,
    },
    /// A block transfer that did not end well.
    #[error("the transfer did not end well for the {end}")]
    Unfinished {
        /// "client" or "server".
        end: &'static str,
    },
    /// A block transfer that does not end.
    #[error("the transfer does not end")]
    Endless,
    /// A block transfer of bytes other than those that should have come.
    #[error("the bytes that the {end} sees are wrong from offset {offset} on")]
    Bytes {
        /// "client" or "server".
        end: &'static str,
        /// The first that is wrong or missing, or that is one too many.
        offset: usize,
    },
}

/// Runs [`Case::SdoUpload`] or [`Case::SdoUpload500`], depending on the subject's dictionary. The
/// answers are compared byte for byte before and after the measured loop, and counted within it.
///
/// # Errors
/// The first answer that is wrong.
pub fn run_upload<S: Subject>(subject: &mut S, iterations: u64) -> Result<(), Wrong> {
    let last = subject.application_objects() - 1;
    let targets: [u16; 8] = std::array::from_fn(|i| MAPPED[0] + last * i as u16 / 7);
    let requests = targets.map(|index| S::received(SDO_REQUEST_COB_ID, &upload_request(index)));

    check_uploads(subject, &targets, &requests)?;
    let mut taken = 0;
    for i in 0..iterations {
        let request = black_box(&requests[(i % 8) as usize]);
        subject.exchange(request, 1, |frame| {
            black_box(frame);
            taken += 1;
        });
    }
    check_count(iterations, taken)?;
    check_uploads(subject, &targets, &requests)
}

/// Runs [`Case::Sync4Tpdo`], with the TPDOs compared and counted in the same way.
///
/// # Errors
/// The first frame that is wrong.
pub fn run_sync<S: Subject>(subject: &mut S, iterations: u64) -> Result<(), Wrong> {
    let values: [[u32; 8]; 2] = [
        std::array::from_fn(|i| 0x1111_1111 * (i as u32 + 1)),
        std::array::from_fn(|i| 0x8765_4321 + i as u32),
    ];
    let sync = S::received(SYNC_COB_ID, &[]);

    check_sync(subject, &values, &sync)?;
    let mut taken = 0;
    for i in 0..iterations {
        subject.publish(black_box(&values[(i % 2) as usize]));
        subject.exchange(black_box(&sync), 4, |frame| {
            black_box(frame);
            taken += 1;
        });
    }
    check_count(4 * iterations, taken)?;
    check_sync(subject, &values, &sync)
}

/// Runs [`Case::IdlePoll`]. That the node lives is seen by its answers to SYNC before and after the
/// measured loop; that it is idle, by its silence.
///
/// # Errors
/// The first frame that is wrong.
pub fn run_poll<S: Polled>(subject: &mut S, iterations: u64) -> Result<(), Wrong> {
    run_sync(subject, 0)?;
    for _ in 0..iterations {
        // The compiler must not see that an idle poll changes nothing.
        black_box(&mut *subject).poll();
    }
    check_silence(subject, "idle poll")?;
    run_sync(subject, 0)
}

/// The request of an SDO upload of sub-index 0 (CiA 301 7.2.4.3.6).
fn upload_request(index: u16) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    [0x40, low, high, 0, 0, 0, 0, 0]
}

fn check_uploads<S: Subject>(
    subject: &mut S,
    targets: &[u16; 8],
    requests: &[S::Received; 8],
) -> Result<(), Wrong> {
    for (&index, request) in targets.iter().zip(requests) {
        // Expedited, size indicated, four bytes (CiA 301 7.2.4.3.6).
        let mut answer = upload_request(index);
        answer[0] = 0x43;
        answer[4..].copy_from_slice(&value_of(index).to_le_bytes());
        let expected = [(SDO_RESPONSE_COB_ID, answer.to_vec())];
        check_exchange(
            subject,
            &format!("upload of {index:X}h"),
            request,
            &expected,
        )?;
    }
    Ok(())
}

fn check_sync<S: Subject>(
    subject: &mut S,
    values: &[[u32; 8]; 2],
    sync: &S::Received,
) -> Result<(), Wrong> {
    for values in values {
        subject.publish(values);
        let expected: [(u16, Vec<u8>); 4] = std::array::from_fn(|i| {
            let data =
                (u64::from(values[2 * i + 1]) << 32 | u64::from(values[2 * i])).to_le_bytes();
            (TPDO_COB_IDS[i], data.to_vec())
        });
        check_exchange(subject, "SYNC", sync, &expected)?;
    }
    Ok(())
}

fn check_exchange<S: Subject>(
    subject: &mut S,
    what: &str,
    received: &S::Received,
    expected: &[(u16, Vec<u8>)],
) -> Result<(), Wrong> {
    let mut got = Vec::new();
    subject.exchange(received, expected.len(), |frame| {
        got.push(owned::<S>(&frame))
    });
    for i in 0..expected.len().max(got.len()) {
        if expected.get(i) != got.get(i) {
            return Err(Wrong::Frame {
                what: what.to_owned(),
                expected: expected.get(i).cloned(),
                got: got.get(i).cloned(),
            });
        }
    }
    check_silence(subject, what)
}

fn check_silence<S: Subject>(subject: &mut S, after: &str) -> Result<(), Wrong> {
    match subject.waiting() {
        None => Ok(()),
        Some(frame) => Err(Wrong::Frame {
            what: format!("after {after}"),
            expected: None,
            got: Some(owned::<S>(&frame)),
        }),
    }
}

fn check_count(expected: u64, got: u64) -> Result<(), Wrong> {
    if expected == got {
        Ok(())
    } else {
        Err(Wrong::Count { expected, got })
    }
}

fn owned<S: Subject>(sent: &S::Sent) -> (u16, Vec<u8>) {
    let (cob_id, data) = S::content(sent);
    (cob_id, data.to_vec())
}
