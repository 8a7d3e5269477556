//! Which frames a node may send: whose they can be, and whether these may be so now.

use can::Frame;
use canopen::NmtState;

use super::super::stand::ID;
use super::World;

/// Who may send a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sender {
    ErrorControl,
    Sdo,
    Emergency,
    Sync,
    Time,
    Tpdo(usize),
}

/// All of them.
pub const SENDERS: [Sender; 9] = [
    Sender::ErrorControl,
    Sender::Sdo,
    Sender::Emergency,
    Sender::Sync,
    Sender::Time,
    Sender::Tpdo(0),
    Sender::Tpdo(1),
    Sender::Tpdo(2),
    Sender::Tpdo(3),
];

impl World {
    /// Whether nobody else has the sender's identifier, so that its frames are known.
    pub fn is_known(&self, sender: Sender) -> bool {
        let key = self.key(sender);
        SENDERS
            .into_iter()
            .filter(|other| self.key(*other) == key)
            .count()
            == 1
    }

    /// The key of a service's frames, if it exists.
    pub fn key(&self, sender: Sender) -> Option<u32> {
        let of = |cob_id: u32| match cob_id >> 29 & 1 {
            0 => cob_id & 0x7FF,
            _ => cob_id & 0x1FFF_FFFF | 1 << 31,
        };
        match sender {
            Sender::ErrorControl => Some(0x700 + ID),
            Sender::Sdo => Some(0x580 + ID),
            Sender::Emergency => Some(self.services.get(0x1014))
                .filter(|cob_id| cob_id >> 31 == 0)
                .map(of),
            Sender::Sync => {
                let produces = self.services.get(0x1006) != 0;
                let cob_id = Some(self.services.get(0x1005));
                cob_id
                    .filter(|cob_id| produces && cob_id >> 30 & 1 != 0)
                    .map(of)
            }
            Sender::Time => Some(self.services.get(0x1012))
                .filter(|id| id >> 30 & 1 != 0)
                .map(of),
            Sender::Tpdo(n) => {
                let pdo = &self.pdos[4 + n];
                (pdo.exists() && pdo.bits != 0).then(|| pdo.key())
            }
        }
    }

    pub fn may_send(&self, sender: Sender, frame: &Frame) -> bool {
        let state = self.node.state();
        let [first, ..] = frame.bytes();
        match sender {
            Sender::ErrorControl => {
                let guards = !self.eager || self.services.get(0x1017) == 0;
                let reports = first == state as u8 || (guards && first == state as u8 | 0x80);
                frame.len() == 1 && if self.boots { first == 0 } else { reports }
            }
            Sender::Sdo => self.talks() && self.awaits_answer && frame.len() == 8,
            Sender::Emergency => self.talks() && frame.len() == 8,
            Sender::Sync => {
                let overflow = self.services.get(0x1019);
                let counts = (1..=overflow).contains(&u32::from(first));
                self.talks() && frame.len() == u8::from(overflow > 1) && (overflow < 2 || counts)
            }
            Sender::Time => self.talks() && frame.len() == 6,
            Sender::Tpdo(n) => {
                let bits = self.pdos[4 + n].bits;
                let unused = u64::from_le_bytes(frame.bytes())
                    .checked_shr(bits)
                    .unwrap_or(0);
                state == NmtState::Operational
                    && u32::from(frame.len()) == bits.div_ceil(8)
                    && unused == 0
            }
        }
    }
}
