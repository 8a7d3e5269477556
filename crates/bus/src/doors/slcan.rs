//! The adapter's side of slcan, as a server: which command is allowed when, and what it is
//! answered. Frames flow only while the channel is open.

use super::{Action, Effect, LeaveReason, Text};
use can::Frame;
use can::slcan::{Answer, Command, Commands, TIMESTAMP_WRAP_MS};

/// Bytes without a carriage return after which a client is given up.
const LONGEST: u32 = 1024;

/// "Receive everything", the only acceptance mask there is.
const ALL: u32 = u32::MAX;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Channel {
    #[default]
    Closed,
    Open,
    Listening,
}

/// One client's conversation.
#[derive(Debug, Default)]
pub(super) struct Server {
    commands: Commands,
    channel: Channel,
    bit_rate: Option<u32>,
}

impl Server {
    pub(super) fn push(&mut self, byte: u8) -> Option<Action> {
        match self.commands.push(byte) {
            Some(Ok(command)) => Some(self.command(command)),
            Some(Err(_)) => Some(Effect::None.answered(text(Answer::Refused))),
            None if self.commands.unfinished() > LONGEST => {
                let why = format!("more than {LONGEST} bytes without a carriage return");
                Some(Effect::Drop(LeaveReason::Protocol(why)).answered(&b""[..]))
            }
            None => None,
        }
    }

    fn command(&mut self, command: Command) -> Action {
        let (effect, answer) = match (command, self.channel) {
            (Command::Empty, _) => (Effect::None, Answer::Done),
            (Command::Open | Command::Listen, Channel::Closed) => {
                let listen_only = command == Command::Listen;
                self.channel = if listen_only {
                    Channel::Listening
                } else {
                    Channel::Open
                };
                (
                    Effect::Join {
                        listen_only,
                        bit_rate: self.bit_rate,
                    },
                    Answer::Done,
                )
            }
            (Command::Close, Channel::Open | Channel::Listening) => {
                self.channel = Channel::Closed;
                (Effect::Leave, Answer::Done)
            }
            (Command::BitRate(rate), Channel::Closed) => {
                self.bit_rate = Some(rate.bits_per_s());
                (Effect::None, Answer::Done)
            }
            (Command::BitTiming(_), Channel::Closed) => {
                self.bit_rate = None;
                (Effect::None, Answer::Done)
            }
            (Command::Send(frame), Channel::Open) => (
                Effect::Send(frame),
                Answer::Queued {
                    extended: frame.is_extended(),
                },
            ),
            (Command::Version, _) => (
                Effect::None,
                Answer::Version {
                    hardware: 0x10,
                    software: 0x13,
                },
            ),
            (Command::SerialNumber, _) => (Effect::None, Answer::SerialNumber(*b"0001")),
            // No flag ever stands: nothing is overrun here without the client being dropped.
            (Command::Flags, Channel::Open | Channel::Listening) => {
                (Effect::None, Answer::Flags(0))
            }
            (Command::Timestamps(on), _) => (Effect::Timestamps(on), Answer::Done),
            // There is no acceptance filter. One that lets all pass is no lie, others would be.
            (Command::AcceptanceCode(_) | Command::AcceptanceMask(ALL), Channel::Closed) => {
                (Effect::None, Answer::Done)
            }
            // Open twice, close twice, send while closed or listening, set up while open.
            _ => (Effect::None, Answer::Refused),
        };
        effect.answered(text(answer))
    }
}

fn text(answer: Answer) -> Text {
    match answer {
        // The frequent ones need no memory.
        Answer::Queued { extended: false } => Text::Borrowed(b"z\r"),
        Answer::Queued { extended: true } => Text::Borrowed(b"Z\r"),
        other => Text::Owned(other.encode().as_bytes().to_vec()),
    }
}

pub(super) fn write_frame(text: &mut Vec<u8>, timestamps: bool, stamp_ns: u64, frame: &Frame) {
    let millis = stamp_ns / 1_000_000 % u64::from(TIMESTAMP_WRAP_MS);
    let timestamp_ms = timestamps.then_some(millis as u16);
    text.extend_from_slice(
        Answer::Received {
            frame: *frame,
            timestamp_ms,
        }
        .encode()
        .as_bytes(),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::StandardId;

    fn talk(server: &mut Server, text: &str) -> String {
        let actions = text.bytes().filter_map(|byte| server.push(byte));
        let answers: Vec<u8> = actions
            .flat_map(|action| action.answer.into_owned())
            .collect();
        String::from_utf8(answers)
            .unwrap()
            .replace('\r', ".")
            .replace('\x07', "!")
    }

    /// What python-can sends to begin with: close, bit rate, an empty line, open, open. It is
    /// refused twice (nothing to close, open already) and does not mind.
    #[test]
    fn python_can_opens() {
        assert_eq!(talk(&mut Server::default(), "C\rS6\r\rO\rO\r"), "!...!");
    }

    #[test]
    fn each_command_in_each_state() {
        //            command          closed   open     listening
        let table = [
            ("\r", ".", ".", "."),
            ("O\r", ".", "!", "!"),
            ("L\r", ".", "!", "!"),
            ("C\r", "!", ".", "."),
            ("S8\r", ".", "!", "!"),
            ("s031C\r", ".", "!", "!"),
            ("t1230\r", "!", "z.", "!"),
            ("T000001230\r", "!", "Z.", "!"),
            ("r1230\r", "!", "z.", "!"),
            ("V\r", "V1013.", "V1013.", "V1013."),
            ("N\r", "N0001.", "N0001.", "N0001."),
            ("F\r", "!", "F00.", "F00."),
            ("Z1\r", ".", ".", "."),
            ("M12345678\r", ".", "!", "!"),
            ("mFFFFFFFF\r", ".", "!", "!"),
            ("m00000000\r", "!", "!", "!"),
            ("?\r", "!", "!", "!"),
        ];
        for (command, closed, open, listening) in table {
            for (before, expected) in [("", closed), ("O\r", open), ("L\r", listening)] {
                let mut server = Server::default();
                talk(&mut server, before);
                assert_eq!(
                    talk(&mut server, command),
                    expected,
                    "{command:?} after {before:?}"
                );
            }
        }
    }

    #[test]
    fn the_bit_rate_is_passed_on() {
        let mut server = Server::default();
        talk(&mut server, "S6\r");
        let effects: Vec<Effect> = b"O\r"
            .iter()
            .filter_map(|byte| server.push(*byte))
            .map(|action| action.effect)
            .collect();
        assert_eq!(
            effects,
            [Effect::Join {
                listen_only: false,
                bit_rate: Some(500_000)
            }]
        );
    }

    #[test]
    fn a_line_without_end_is_given_up() {
        let mut server = Server::default();
        let dropped = (0..2_000).filter_map(|_| server.push(b'0')).next().unwrap();
        assert!(matches!(
            dropped.effect,
            Effect::Drop(LeaveReason::Protocol(_))
        ));
    }

    #[test]
    fn time_stamps_count_within_the_minute() {
        let frame = Frame::data_frame(StandardId::new(0x80).unwrap(), &[]).unwrap();
        let mut text = Vec::new();
        // 61.5 s: 1500 ms = 5DCh.
        write_frame(&mut text, true, 61_500_000_000, &frame);
        write_frame(&mut text, false, 61_500_000_000, &frame);
        assert_eq!(text, b"t080005DC\rt0800\r");
    }
}
