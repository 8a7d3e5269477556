//! What can be done to the wire on purpose: bits flipped, frames lost, a node cut off or held back,
//! a babbling node, a broken cable.

mod text;

pub use text::{NoBitPlace, NoParticipant, NoWireAct};

use can::{Frame, Id};

use crate::place::Place;

/// Who takes part in a bus: each has one CAN controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Participant {
    /// A virtual drive.
    Drive(Place),
    /// The outside programs, which share one controller.
    Outside,
    /// The node that [`WireAct::Flood`] lets babble.
    Stranger,
}

/// A bit of a frame on the wire, as it is sent: stuff bits count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BitPlace {
    /// Counted from start of frame, which is 0, to [`BitPlace::LAST`].
    Number(u16),
    /// CRC delimiter.
    CrcDelimiter,
    /// Acknowledge slot.
    AckSlot,
    /// Acknowledge delimiter.
    AckDelimiter,
    /// Bit 1 to 7 of end of frame. A flip of the last one makes receivers take the frame and its
    /// sender repeat it: so frames come twice.
    EndOfFrame(u8),
    /// Bit 1 to 3 of intermission.
    Intermission(u8),
}

impl BitPlace {
    /// The largest number: the last bit of intermission behind the longest frame that there is.
    pub const LAST: u16 = 159;
}

/// Which frames an act is about: of those that fit, counted from the act on in the order in which
/// they begin on the wire, repetitions included, `skip` are left alone and then `times` are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WhichFrames {
    /// A frame fits whose [`Frame::key`] is this in the bits of `mask`.
    pub key: u32,
    /// What is looked at; 0: every frame fits.
    pub mask: u32,
    /// Who sends them; `None`: anybody.
    pub sender: Option<Participant>,
    /// So many of them are left alone first.
    pub skip: u32,
    /// So many are meant then.
    pub times: u32,
}

impl WhichFrames {
    /// The next frame, whatever it is.
    pub const NEXT: WhichFrames = WhichFrames {
        key: 0,
        mask: 0,
        sender: None,
        skip: 0,
        times: 1,
    };

    /// The next frame of an identifier, data or remote.
    pub fn with_id(id: impl Into<Id>) -> WhichFrames {
        const REMOTE: u32 = 1 << 30;
        let frame = Frame::data_frame(id, &[]);
        WhichFrames {
            key: frame.map_or(0, |frame| frame.key()),
            mask: !REMOTE,
            ..WhichFrames::NEXT
        }
    }

    /// Whether a frame fits.
    pub(crate) fn fits(
        &self,
        frame: &Frame,
        senders: impl IntoIterator<Item = Participant>,
    ) -> bool {
        (frame.key() ^ self.key) & self.mask == 0
            && self
                .sender
                .is_none_or(|wanted| senders.into_iter().any(|sender| sender == wanted))
    }
}

/// What a broken cable does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireFault {
    /// CAN_H and CAN_L touch: the wire is recessive whatever anybody sends. Who wants to send reads
    /// another bit than it sends, and is bus-off after a while.
    Recessive,
    /// The wire is dominant. Who is sending then is bus-off soon; the others become error passive
    /// and wait.
    Dominant,
}

/// Something that is done to the wire on purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireAct {
    /// A bit arrives as its opposite.
    Flip {
        /// In which frames.
        frames: WhichFrames,
        /// Which bit of them.
        bit: BitPlace,
        /// Who reads it so, sender included; `None`: everybody. A flip that one alone reads becomes
        /// an error of all by its error flag.
        seen_by: Option<Participant>,
    },
    /// Whole frames that one receiver's controller loses after it has acknowledged them. No error
    /// on the wire can do that: frames that are destroyed there are repeated.
    Lose {
        /// Which.
        frames: WhichFrames,
        /// Who loses them.
        receiver: Participant,
    },
    /// Somebody's frames wait before they take part in arbitration.
    Hold {
        /// Whose.
        who: Participant,
        /// From the act on, ns.
        for_ns: u64,
    },
    /// A node that is no drive sends this frame again and again.
    Flood {
        /// What it sends.
        frame: Frame,
        /// From one to the next, ns; 0: back to back.
        every_ns: u64,
        /// From the act on, ns.
        for_ns: u64,
    },
    /// Cuts somebody off: it hears nothing but itself, and nobody acknowledges what it sends.
    Disconnect(Participant),
    /// Ends that.
    Connect(Participant),
    /// The cable is broken.
    Break {
        /// How.
        fault: WireFault,
        /// From the act on, ns.
        for_ns: u64,
    },
}

/// Why an act is impossible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImpossibleAct {
    /// There is no such drive.
    #[error("there is no drive {0} on this bus")]
    NoDrive(Place),
    /// There is no such bit.
    #[error(
        "no frame has bit '{0}': bits are 0 to 159, crc-delimiter, ack-slot, ack-delimiter, eof1 to \
         eof7, and intermission1 to intermission3"
    )]
    NoBit(BitPlace),
    /// No frame is meant.
    #[error("the act is about no frame: it must happen at least once")]
    NoFrames,
    /// The babbling node has nothing to lose, and comes and goes with its flood.
    #[error("the babbling node cannot be held back, cut off or robbed of frames")]
    Stranger,
}

impl WireAct {
    /// Whether it is possible, as far as it does not depend on which drives there are.
    ///
    /// # Errors
    /// [`ImpossibleAct`].
    pub fn check(&self) -> Result<(), ImpossibleAct> {
        match self {
            WireAct::Flip { frames, bit, .. } => {
                bit.check()?;
                frames.check()
            }
            WireAct::Lose {
                receiver: Participant::Stranger,
                ..
            }
            | WireAct::Hold {
                who: Participant::Stranger,
                ..
            }
            | WireAct::Disconnect(Participant::Stranger)
            | WireAct::Connect(Participant::Stranger) => Err(ImpossibleAct::Stranger),
            WireAct::Lose { frames, .. } => frames.check(),
            WireAct::Hold { .. }
            | WireAct::Flood { .. }
            | WireAct::Disconnect(_)
            | WireAct::Connect(_)
            | WireAct::Break { .. } => Ok(()),
        }
    }

    /// Whether the drives that it names are there, too.
    ///
    /// # Errors
    /// [`ImpossibleAct`].
    pub fn check_drives(&self, drives: &[Place]) -> Result<(), ImpossibleAct> {
        self.check()?;
        let missing = self
            .named()
            .into_iter()
            .flatten()
            .find_map(|one| match one {
                Participant::Drive(place) if !drives.contains(&place) => Some(place),
                _ => None,
            });
        missing.map_or(Ok(()), |place| Err(ImpossibleAct::NoDrive(place)))
    }

    /// Everybody whom it names.
    fn named(&self) -> [Option<Participant>; 2] {
        match *self {
            WireAct::Flip {
                frames, seen_by, ..
            } => [frames.sender, seen_by],
            WireAct::Lose { frames, receiver } => [frames.sender, Some(receiver)],
            WireAct::Hold { who, .. } | WireAct::Disconnect(who) | WireAct::Connect(who) => {
                [Some(who), None]
            }
            WireAct::Flood { .. } | WireAct::Break { .. } => [None, None],
        }
    }
}

impl WhichFrames {
    fn check(&self) -> Result<(), ImpossibleAct> {
        match self.times {
            0 => Err(ImpossibleAct::NoFrames),
            _ => Ok(()),
        }
    }
}

impl BitPlace {
    fn check(self) -> Result<(), ImpossibleAct> {
        let exists = match self {
            BitPlace::Number(n) => n <= BitPlace::LAST,
            BitPlace::CrcDelimiter | BitPlace::AckSlot | BitPlace::AckDelimiter => true,
            BitPlace::EndOfFrame(n) => (1..=7).contains(&n),
            BitPlace::Intermission(n) => (1..=3).contains(&n),
        };
        if exists {
            Ok(())
        } else {
            Err(ImpossibleAct::NoBit(self))
        }
    }

    /// Its number in this frame.
    pub(crate) fn number_in(self, frame: &Frame) -> u16 {
        let end = frame.frame_bits();
        match self {
            BitPlace::Number(n) => n,
            BitPlace::CrcDelimiter => end - 10,
            BitPlace::AckSlot => end - 9,
            BitPlace::AckDelimiter => end - 8,
            BitPlace::EndOfFrame(n) => end - 8 + u16::from(n),
            BitPlace::Intermission(n) => end - 1 + u16::from(n),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::StandardId;

    #[test]
    fn frames_are_chosen_by_identifier_and_sender() {
        let id = StandardId::new(0x181).unwrap();
        let data = Frame::data_frame(id, &[1]).unwrap();
        let remote = Frame::remote_frame(id, 1).unwrap();
        let wide = Frame::data_frame(can::ExtendedId::new(0x181).unwrap(), &[1]).unwrap();
        let which = WhichFrames::with_id(id);
        let fits = |which: &WhichFrames, frame| which.fits(frame, [Participant::Outside]);
        assert!(fits(&which, &data) && fits(&which, &remote) && !fits(&which, &wide));
        assert!(fits(&WhichFrames::NEXT, &wide));
        let of_another = WhichFrames {
            sender: Some(Participant::Stranger),
            ..which
        };
        assert!(!fits(&of_another, &data));
    }

    #[test]
    fn named_bits_are_counted_from_the_end() {
        let frame = Frame::data_frame(StandardId::new(0x80).unwrap(), &[]).unwrap();
        // 34 bits and four stuff bits (see `can`), then the tail.
        for (bit, number) in [
            (BitPlace::Number(5), 5),
            (BitPlace::CrcDelimiter, 38),
            (BitPlace::AckSlot, 39),
            (BitPlace::AckDelimiter, 40),
            (BitPlace::EndOfFrame(1), 41),
            (BitPlace::EndOfFrame(7), 47),
            (BitPlace::Intermission(1), 48),
            (BitPlace::Intermission(3), 50),
        ] {
            assert_eq!(bit.number_in(&frame), number);
        }
    }
}
