//! Fastscan from the master's side: which question comes next.

use super::{Identity, Part, Request, Test};

/// What is known of the device that is looked for. A known number costs one question instead of 33.
/// A number that is known behind one that is not does not help to find: the scan follows the lowest
/// of the unknown number, and the device with the known one may be another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Known {
    /// Vendor ID.
    pub vendor: Option<u32>,
    /// Product code.
    pub product: Option<u32>,
    /// Revision number.
    pub revision: Option<u32>,
    /// Serial number.
    pub serial: Option<u32>,
}

impl Known {
    /// Nothing is known.
    pub const NOTHING: Known = Known {
        vendor: None,
        product: None,
        revision: None,
        serial: None,
    };

    /// One of the four numbers.
    pub const fn get(&self, part: Part) -> Option<u32> {
        match part {
            Part::Vendor => self.vendor,
            Part::Product => self.product,
            Part::Revision => self.revision,
            Part::Serial => self.serial,
        }
    }
}

/// How a scan ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScanEnd {
    /// This device was found, and is in state configuration now. Where frames were lost, devices
    /// that missed the beginning can have added numbers of theirs: a device that answers
    /// [`super::Job::Select`] is one that is there.
    Found(Identity),
    /// No unconfigured device is there.
    Nobody,
    /// Devices are there, but none answered to this number as it was known or found out. Frames
    /// were lost, or nobody is what [`Known`] says.
    Lost {
        /// Which number.
        part: Part,
        /// The numbers up to this one as they were known or found out. If `part` is the serial
        /// number, a device may have this identity and be in state configuration, for its last
        /// answer can have been the frame that was lost.
        tried: Identity,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    /// Is anybody there?
    Reset,
    /// Is this bit 0, and are those above it as found?
    Bit(u8),
    /// Is this the whole number?
    Confirm,
}

/// One scan. The numbers are found one after the other, each from its highest bit on: a device
/// that has a 0 answers, and those that have a 1 drop out. So the lowest identity is found first.
#[derive(Clone, Copy, Debug)]
pub struct Scan {
    known: Known,
    found: Identity,
    part: Part,
    question: Question,
    asked: u16,
}

impl Scan {
    /// A scan at its first question.
    pub const fn new(known: Known) -> Scan {
        Scan {
            known,
            found: Identity {
                vendor: 0,
                product: 0,
                revision: 0,
                serial: 0,
            },
            part: Part::Vendor,
            question: Question::Reset,
            asked: 0,
        }
    }

    /// How many questions were answered, by word or by silence: at most 133, of 128 bits, four
    /// whole numbers and the first.
    pub const fn asked(&self) -> u16 {
        self.asked
    }

    /// The question of the moment.
    pub const fn request(&self) -> Request {
        let number = self.found.get(self.part);
        let (test, next) = match self.question {
            Question::Reset => (Test::Reset, self.part),
            Question::Bit(bit) => (Test::Bits { bit }, self.part),
            Question::Confirm => {
                let next = match self.part.following() {
                    Some(part) => part,
                    // Before the last one: the slave is found.
                    None => Part::Vendor,
                };
                (Test::Bits { bit: 0 }, next)
            }
        };
        Request::Fastscan {
            number,
            test,
            sub: self.part,
            next,
        }
    }

    /// Takes notice that somebody answered or nobody did; gives the end, if this was it.
    pub fn answered(&mut self, somebody: bool) -> Option<ScanEnd> {
        self.asked = self.asked.saturating_add(1);
        match (self.question, somebody) {
            (Question::Reset, false) => return Some(ScanEnd::Nobody),
            (Question::Confirm, false) => {
                return Some(ScanEnd::Lost {
                    part: self.part,
                    tried: self.found,
                });
            }
            (Question::Reset, true) => self.begin(Part::Vendor),
            (Question::Bit(bit), somebody) => {
                if !somebody {
                    let number = self.found.get(self.part) | 1 << (bit & 31);
                    self.found.set(self.part, number);
                }
                self.question = match bit.checked_sub(1) {
                    Some(lower) => Question::Bit(lower),
                    None => Question::Confirm,
                };
            }
            (Question::Confirm, true) => match self.part.following() {
                Some(part) => self.begin(part),
                None => return Some(ScanEnd::Found(self.found)),
            },
        }
        None
    }

    fn begin(&mut self, part: Part) {
        self.part = part;
        self.question = match self.known.get(part) {
            Some(number) => {
                self.found.set(part, number);
                Question::Confirm
            }
            None => Question::Bit(31),
        };
    }
}
