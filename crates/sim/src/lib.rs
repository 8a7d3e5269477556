//! Virtual drives on a simulated CAN bus, in virtual time.
//!
//! A [`Bus`] is one medium with its drives. [`Bus::run_until`] moves it forward event by event;
//! nothing in it reads a clock, so the same seed and the same injections give the same trace. At
//! equal times the order is: plants and loops, frames, the scenario's acts, polls, what the scenario
//! does about these, arbitration; then the drive's place.
//!
//! Each [`VirtualDrive`] is the drive core that also runs as firmware, closed around a simulated
//! motor, behind a CAN controller with a finite receive FIFO. Outside programs reach the bus
//! through its gateway ([`Bus::send`]); [`Recording`] writes down what they did, so that the run
//! can be repeated.
mod axes;
mod bus;
mod commissioned;
mod controller;
mod data_sheet;
mod disturbance;
mod drive;
mod error_frame;
mod flash;
mod flash_file;
mod fleet;
mod gateway;
mod host;
mod latency;
mod link;
mod lss;
mod medium;
mod notice;
mod pace;
mod place;
mod power;
mod probe;
mod recording;
mod replay;
pub mod scenario;
mod serial;
mod spoil;
mod store;
mod stranger;
mod wire_act;
mod world;

pub use axes::{Axes, Virtual};
pub use bus::{Bus, BusSettings};
pub use can::BitRate;
pub use data_sheet::data_sheet;
pub use disturbance::{Disturbance, Disturbed, NoShare, Share};
pub use drive::{DriveSettings, Extremes, VirtualDrive};
pub use error_frame::ErrorSeen;
pub use flash::{MemoryFlash, PowerCut, Refusal, Steps};
pub use flash_file::FlashFile;
pub use fleet::run_fleet;
pub use host::product_code;
pub use link::{Listener, VirtualLink};
pub use medium::{ErrorCounters, ErrorKind, ErrorState, Sender, Traffic};
pub use notice::{Happening, Notice, NoticeKind};
pub use pace::Pacer;
pub use place::{NoPlace, Place};
pub use probe::ProbeSample;
pub use recording::{
    Injection, Recording, RunHeader, StoredBefore, begin_frames, write_error, write_frame,
    write_notice,
};
pub use replay::{ReadError, Replayed, replay, replay_each};
pub use serial::{SerialAct, SerialByte};
pub use store::StoreError;
pub use wire_act::{
    BitPlace, ImpossibleAct, NoBitPlace, NoParticipant, NoWireAct, Participant, WhichFrames,
    WireAct, WireFault,
};
