//! The server's side of socketcand: which message is allowed when, and what it is answered.
//!
//! Understood are `open`, `rawmode`, `send`, `sendrtr`, `echo` and, of our own, `notes`. Of
//! socketcand's other modes (BCM, control, ISO-TP) there are none.
//!
//! Remote frames (`sendrtr`, `rtr`) came late to the protocol, and python-can knows neither word:
//! it sends a remote frame as a `send` without data, which is refused if it asks for any bytes and
//! cannot be told from an empty data frame if it asks for none. So `rtr` is sent only to clients
//! that have used `sendrtr`. Nor does python-can show the text of an `< error … >`: its `recv`
//! raises a `CanError`.

use super::{Action, Effect, LeaveReason, Text};
use crate::socketcand::{Messages, Piece, parse_send, shown};

const OK: &[u8] = b"< ok >";

/// How far a client has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Greeted,
    Opened,
    Raw,
}

/// One client's conversation.
#[derive(Debug)]
pub(super) struct Server {
    messages: Messages,
    stage: Stage,
    channel: String,
}

impl Server {
    pub(super) fn new(channel: &str) -> Server {
        let channel = channel.to_owned();
        Server {
            messages: Messages::default(),
            stage: Stage::Greeted,
            channel,
        }
    }

    pub(super) fn push(&mut self, byte: u8) -> Option<Action> {
        Some(match self.messages.push(byte)? {
            Piece::Message(text) => self.message(&text),
            Piece::CutShort => {
                Effect::None.answered(error("a message was not closed by a bracket"))
            }
            Piece::Lost(lost) => give_up(lost.to_string()),
        })
    }

    fn message(&mut self, text: &str) -> Action {
        let mut words = text.split_ascii_whitespace();
        let word = words.next().unwrap_or("");
        match (word, self.stage) {
            ("echo", _) => Effect::None.answered(&b"< echo >"[..]),
            ("open", Stage::Greeted) => {
                let channel = words.next().unwrap_or("");
                if channel == self.channel {
                    self.stage = Stage::Opened;
                    return Effect::None.answered(OK);
                }
                let (asked, served) = (shown(channel), &self.channel);
                give_up(format!(
                    "there is no bus {asked} here, open {served} instead"
                ))
            }
            ("rawmode", Stage::Opened) => {
                self.stage = Stage::Raw;
                Effect::Join {
                    listen_only: false,
                    bit_rate: None,
                }
                .answered(OK)
            }
            ("notes", Stage::Raw) => Effect::Notes.answered(OK),
            // Harmless, and the real server confirms it too.
            ("rawmode", Stage::Raw) => Effect::None.answered(OK),
            ("send" | "sendrtr", Stage::Raw) => match parse_send(words, word == "sendrtr") {
                Ok(frame) => Effect::Send(frame).answered(&b""[..]),
                Err(bad) => Effect::None.answered(error(&format!("{word}: {bad}"))),
            },
            ("open", _) => refuse(word, "a bus is open already"),
            ("rawmode" | "send" | "sendrtr", Stage::Greeted) => refuse(word, "open a bus first"),
            ("send" | "sendrtr", _) => refuse(word, "switch to rawmode first"),
            _ => refuse(
                &shown(word),
                "unknown command; open, rawmode, send, sendrtr and echo are known",
            ),
        }
    }
}

/// A message that tells the client what was wrong.
pub(super) fn error(text: &str) -> Text {
    let text: String = text
        .chars()
        .map(|c| if matches!(c, '<' | '>') { '?' } else { c })
        .collect();
    format!("< error {text} >").into_bytes().into()
}

fn refuse(word: &str, why: &str) -> Action {
    Effect::None.answered(error(&format!("{word}: {why}")))
}

/// The text reaches the client as its farewell.
fn give_up(why: String) -> Action {
    Effect::Drop(LeaveReason::Protocol(why)).answered(&b""[..])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a whole conversation is answered.
    fn talk(server: &mut Server, text: &str) -> Vec<(Effect, String)> {
        text.bytes()
            .filter_map(|byte| server.push(byte))
            .map(|action| {
                (
                    action.effect,
                    String::from_utf8(action.answer.into_owned()).unwrap(),
                )
            })
            .collect()
    }

    const JOIN: Effect = Effect::Join {
        listen_only: false,
        bit_rate: None,
    };

    #[test]
    fn handshake_then_frames() {
        let mut server = Server::new("can0");
        let said = talk(
            &mut server,
            "< open can0 >< rawmode >< send 123 1 ff >< echo >",
        );
        let [open, raw, (Effect::Send(frame), none), echo] = &said[..] else {
            panic!("{said:?}")
        };
        assert_eq!(*open, (Effect::None, "< ok >".to_owned()));
        assert_eq!(*raw, (JOIN, "< ok >".to_owned()));
        assert_eq!((frame.to_string().as_str(), none.as_str()), ("123#FF", ""));
        assert_eq!(*echo, (Effect::None, "< echo >".to_owned()));
        let notes = talk(&mut server, "< notes >");
        assert_eq!(notes, [(Effect::Notes, "< ok >".to_owned())]);
    }

    /// Each mistake is answered by one message, and the conversation goes on.
    #[test]
    fn mistakes_are_named() {
        let table = [
            ("", "< rawmode >", "< error rawmode: open a bus first >"),
            ("", "< send 123 0 >", "< error send: open a bus first >"),
            (
                "< open can0 >",
                "< send 123 0 >",
                "< error send: switch to rawmode first >",
            ),
            (
                "< open can0 >",
                "< open can0 >",
                "< error open: a bus is open already >",
            ),
            (
                "",
                "< subscribe 0 0 123 >",
                "< error 'subscribe': unknown command; open,",
            ),
            ("", "<>", "< error '': unknown command;"),
            (
                "< open can0 >< rawmode >",
                "< send 123 9 1 >",
                "< error send: length '9' is not",
            ),
            (
                "< open can0 >< rawmode >",
                "< send 123 0<",
                "< error a message was not closed",
            ),
        ];
        for (before, text, answer) in table {
            let mut server = Server::new("can0");
            talk(&mut server, before);
            let said = talk(&mut server, text);
            let [(Effect::None, got)] = &said[..] else {
                panic!("{text}: {said:?}")
            };
            assert!(
                got.starts_with(answer) && got.ends_with(" >"),
                "{text}: {got}"
            );
            assert_eq!(got.matches(['<', '>']).count(), 2);
        }
    }

    #[test]
    fn hopeless_ones_are_dropped() {
        let table = [
            (
                "< open can7 >",
                "there is no bus 'can7' here, open can0 instead",
            ),
            (
                "GET / HTTP/1.1",
                "'G' between two messages, where only '<' may stand",
            ),
            ("< \u{1}", "a byte 0x01 inside a message, which is text"),
        ];
        for (text, why) in table {
            let said = talk(&mut Server::new("can0"), text);
            let why = LeaveReason::Protocol(why.to_owned());
            assert_eq!(said[0], (Effect::Drop(why), String::new()), "{text}");
        }
    }
}
