//! What a CAN controller's driver reports about errors.

use std::fmt;

/// An error frame of SocketCAN (linux/can/error.h): a message from the driver of this machine's
/// controller, made by no participant of the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorFrame {
    /// Classes of error, bits 0–28; several may be set.
    pub class: u32,
    /// Particulars, whose meaning depends on the classes.
    pub data: [u8; 8],
}

/// Classes of error (`CAN_ERR_*`), each with its words.
const CLASSES: [(u32, &str); 8] = [
    (0x001, "a frame was not sent in time"),
    (0x002, "arbitration was lost"),
    (0x008, "a frame broke the rules of the protocol"),
    (0x010, "the transceiver reports a fault"),
    (0x020, "nobody acknowledged a frame"),
    (
        0x040,
        "the controller is bus-off and takes no part any more",
    ),
    (0x080, "there was an error on the wire"),
    (0x100, "the controller was started again after bus-off"),
];
/// `CAN_ERR_CRTL`: particulars are the bits of byte 1.
const CONTROLLER: u32 = 0x004;
/// `CAN_ERR_CNT`: bytes 6 and 7 are the error counters.
const COUNTERS: u32 = 0x200;

/// The controller's bits (`CAN_ERR_CRTL_*`).
const CONTROLLER_STATES: [(u8, &str); 7] = [
    (0x01, "received frames were lost"),
    (0x02, "frames to be sent were lost"),
    (0x04, "warning level of receive errors"),
    (0x08, "warning level of transmit errors"),
    (0x10, "error-passive by receive errors"),
    (0x20, "error-passive by transmit errors"),
    (0x40, "error-active again"),
];

impl fmt::Display for ErrorFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [_, states, _, _, _, _, transmit, receive] = self.data;
        let classes = CLASSES
            .iter()
            .filter(|(class, _)| self.class & class != 0)
            .map(|(_, words)| (*words).to_owned());
        let states = CONTROLLER_STATES
            .iter()
            .filter(|(state, _)| self.class & CONTROLLER != 0 && states & state != 0)
            .map(|(_, words)| (*words).to_owned());
        let counters = (self.class & COUNTERS != 0)
            .then(|| format!("{transmit} transmit and {receive} receive errors counted"));
        let words: Vec<String> = classes.chain(states).chain(counters).collect();
        if words.is_empty() {
            write!(f, "error of class 0x{:X}", self.class)
        } else {
            f.write_str(&words.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Real drivers set several classes at once.
    #[test]
    fn error_frames_in_words() {
        let table = [
            (
                0x040,
                [0; 8],
                "the controller is bus-off and takes no part any more",
            ),
            (
                0x204,
                [0, 0x0C, 0, 0, 0, 0, 96, 8],
                "warning level of receive errors, warning level of transmit errors, 96 transmit \
                 and 8 receive errors counted",
            ),
            (
                0x0A8,
                [0; 8],
                "a frame broke the rules of the protocol, nobody acknowledged a frame, there was \
                 an error on the wire",
            ),
            (0x004, [0; 8], "error of class 0x4"),
            (0x1000, [0; 8], "error of class 0x1000"),
        ];
        for (class, data, words) in table {
            assert_eq!(ErrorFrame { class, data }.to_string(), words);
        }
    }
}
