//! Acts as text, as run files have them.

use std::fmt;
use std::str::FromStr;

use can::Frame;

use super::{BitPlace, Participant, WhichFrames, WireAct, WireFault};

impl fmt::Display for Participant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Participant::Drive(place) => write!(f, "{place}"),
            Participant::Outside => f.write_str("outside"),
            Participant::Stranger => f.write_str("stranger"),
        }
    }
}

/// A text that names no [`Participant`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a participant is a drive (1 to 127, u1 to u127), 'outside' or 'stranger'")]
pub struct NoParticipant;

impl FromStr for Participant {
    type Err = NoParticipant;

    fn from_str(text: &str) -> Result<Participant, NoParticipant> {
        match text {
            "outside" => Ok(Participant::Outside),
            "stranger" => Ok(Participant::Stranger),
            place => place
                .parse()
                .map(Participant::Drive)
                .map_err(|_| NoParticipant),
        }
    }
}

impl fmt::Display for BitPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BitPlace::Number(n) => write!(f, "{n}"),
            BitPlace::CrcDelimiter => f.write_str("crc-delimiter"),
            BitPlace::AckSlot => f.write_str("ack-slot"),
            BitPlace::AckDelimiter => f.write_str("ack-delimiter"),
            BitPlace::EndOfFrame(n) => write!(f, "eof{n}"),
            BitPlace::Intermission(n) => write!(f, "intermission{n}"),
        }
    }
}

/// A text that names no [`BitPlace`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a bit is a number from 0 to 159, crc-delimiter, ack-slot, ack-delimiter, eof1 to eof7, or \
     intermission1 to intermission3"
)]
pub struct NoBitPlace;

impl FromStr for BitPlace {
    type Err = NoBitPlace;

    fn from_str(text: &str) -> Result<BitPlace, NoBitPlace> {
        let number = |text: &str| text.parse().map_err(|_| NoBitPlace);
        let place = match text {
            "crc-delimiter" => BitPlace::CrcDelimiter,
            "ack-slot" => BitPlace::AckSlot,
            "ack-delimiter" => BitPlace::AckDelimiter,
            _ => match (text.strip_prefix("eof"), text.strip_prefix("intermission")) {
                (Some(n), _) => BitPlace::EndOfFrame(number(n)?),
                (_, Some(n)) => BitPlace::Intermission(number(n)?),
                _ => BitPlace::Number(text.parse().map_err(|_| NoBitPlace)?),
            },
        };
        place.check().map_err(|_| NoBitPlace)?;
        Ok(place)
    }
}

/// `flip 12 181/7FF from any skip 0 times 1 seen-by all`, and so on: one line of a run file.
impl fmt::Display for WireAct {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WireAct::Flip {
                frames,
                bit,
                seen_by,
            } => {
                write!(f, "flip {bit} {frames} seen-by ")?;
                match seen_by {
                    Some(one) => write!(f, "{one}"),
                    None => f.write_str("all"),
                }
            }
            WireAct::Lose { frames, receiver } => write!(f, "lose-at {receiver} {frames}"),
            WireAct::Hold { who, for_ns } => write!(f, "hold {who} {for_ns}ns"),
            WireAct::Flood {
                frame,
                every_ns,
                for_ns,
            } => write!(f, "flood {frame} {every_ns}ns {for_ns}ns"),
            WireAct::Disconnect(who) => write!(f, "disconnect {who}"),
            WireAct::Connect(who) => write!(f, "connect {who}"),
            WireAct::Break { fault, for_ns } => {
                let word = match fault {
                    WireFault::Recessive => "recessive",
                    WireFault::Dominant => "dominant",
                };
                write!(f, "break {word} {for_ns}ns")
            }
        }
    }
}

impl fmt::Display for WhichFrames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let WhichFrames {
            key,
            mask,
            sender,
            skip,
            times,
        } = self;
        write!(f, "{key:X}/{mask:X} from ")?;
        match sender {
            Some(sender) => write!(f, "{sender}")?,
            None => f.write_str("any")?,
        }
        write!(f, " skip {skip} times {times}")
    }
}

/// A text that is no [`WireAct`]: what was expected, and after how many bytes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{expected}")]
pub struct NoWireAct {
    /// Bytes of the text before the word that is wrong.
    pub at: usize,
    /// What was expected there.
    pub expected: String,
}

impl FromStr for WireAct {
    type Err = NoWireAct;

    fn from_str(text: &str) -> Result<WireAct, NoWireAct> {
        let mut words = Words { text, at: 0 };
        let act = words.act()?;
        let rest = words.next();
        if !rest.1.is_empty() {
            return Err(expected(rest.0, "nothing more is expected here"));
        }
        act.check().map_err(|impossible| NoWireAct {
            at: 0,
            expected: impossible.to_string(),
        })?;
        Ok(act)
    }
}

fn expected(at: usize, what: impl Into<String>) -> NoWireAct {
    NoWireAct {
        at,
        expected: what.into(),
    }
}

struct Words<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Words<'t> {
    /// The next word and where it begins; empty at the end.
    fn next(&mut self) -> (usize, &'t str) {
        let rest = self.text.get(self.at..).unwrap_or("");
        let begin = self.at + (rest.len() - rest.trim_start_matches(' ').len());
        let word = self.text.get(begin..).unwrap_or("");
        let word = word.split(' ').next().unwrap_or("");
        self.at = begin + word.len();
        (begin, word)
    }

    fn parse<T: FromStr>(&mut self) -> Result<T, NoWireAct>
    where
        T::Err: fmt::Display,
    {
        let (at, word) = self.next();
        word.parse()
            .map_err(|error: T::Err| expected(at, error.to_string()))
    }

    fn keyword(&mut self, wanted: &str) -> Result<(), NoWireAct> {
        match self.next() {
            (_, word) if word == wanted => Ok(()),
            (at, _) => Err(expected(at, format!("'{wanted}' is expected"))),
        }
    }

    fn ns(&mut self) -> Result<u64, NoWireAct> {
        let (at, word) = self.next();
        word.strip_suffix("ns")
            .and_then(|number| number.parse().ok())
            .ok_or_else(|| expected(at, "nanoseconds are expected, like 1000ns"))
    }

    /// A participant, or `None` for `nobody`.
    fn participant_or(&mut self, nobody: &str) -> Result<Option<Participant>, NoWireAct> {
        match self.next() {
            (_, word) if word == nobody => Ok(None),
            (at, word) => match word.parse() {
                Ok(participant) => Ok(Some(participant)),
                Err(NoParticipant) => {
                    let or = format!("{NoParticipant}, or '{nobody}'");
                    Err(expected(at, or))
                }
            },
        }
    }

    fn frames(&mut self) -> Result<WhichFrames, NoWireAct> {
        let (at, word) = self.next();
        let numbers = word.split_once('/').and_then(|(key, mask)| {
            let hex = |text| u32::from_str_radix(text, 16).ok();
            Some((hex(key)?, hex(mask)?))
        });
        let Some((key, mask)) = numbers else {
            return Err(expected(
                at,
                "identifier and mask are expected, like 181/7FF",
            ));
        };
        self.keyword("from")?;
        let sender = self.participant_or("any")?;
        self.keyword("skip")?;
        let skip = self.parse()?;
        self.keyword("times")?;
        let times = self.parse()?;
        Ok(WhichFrames {
            key,
            mask,
            sender,
            skip,
            times,
        })
    }

    fn frame(&mut self) -> Result<Frame, NoWireAct> {
        let (at, word) = self.next();
        let line = format!("(0.000000) can0 {word}");
        let mut reader = bus::recording::candump::Reader::new(line.as_bytes());
        match reader.next() {
            Some(Ok(record)) => match record.content {
                bus::recording::Content::Frame(frame) => Ok(frame),
                bus::recording::Content::Error(_) => {
                    Err(expected(at, "a frame is expected, like 181#00"))
                }
            },
            _ => Err(expected(at, "a frame is expected, like 181#00")),
        }
    }

    fn act(&mut self) -> Result<WireAct, NoWireAct> {
        let (at, word) = self.next();
        Ok(match word {
            "flip" => {
                let bit = self.parse()?;
                let frames = self.frames()?;
                self.keyword("seen-by")?;
                WireAct::Flip {
                    frames,
                    bit,
                    seen_by: self.participant_or("all")?,
                }
            }
            "lose-at" => WireAct::Lose {
                receiver: self.parse()?,
                frames: self.frames()?,
            },
            "hold" => WireAct::Hold {
                who: self.parse()?,
                for_ns: self.ns()?,
            },
            "flood" => WireAct::Flood {
                frame: self.frame()?,
                every_ns: self.ns()?,
                for_ns: self.ns()?,
            },
            "disconnect" => WireAct::Disconnect(self.parse()?),
            "connect" => WireAct::Connect(self.parse()?),
            "break" => {
                let fault = match self.next() {
                    (_, "recessive") => WireFault::Recessive,
                    (_, "dominant") => WireFault::Dominant,
                    (at, _) => return Err(expected(at, "'recessive' or 'dominant' is expected")),
                };
                WireAct::Break {
                    fault,
                    for_ns: self.ns()?,
                }
            }
            _ => {
                return Err(expected(
                    at,
                    "flip, lose-at, hold, flood, disconnect, connect or break is expected",
                ));
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::StandardId;

    fn acts() -> Vec<WireAct> {
        let drive = |n: &str| Participant::Drive(n.parse().unwrap());
        let id = StandardId::new(0x181).unwrap();
        let frames = WhichFrames {
            sender: Some(drive("1")),
            skip: 3,
            times: 2,
            ..WhichFrames::with_id(id)
        };
        let bits = [
            BitPlace::Number(0),
            BitPlace::Number(BitPlace::LAST),
            BitPlace::CrcDelimiter,
            BitPlace::AckSlot,
            BitPlace::AckDelimiter,
            BitPlace::EndOfFrame(7),
            BitPlace::Intermission(3),
        ];
        let flips = bits.into_iter().map(|bit| WireAct::Flip {
            frames,
            bit,
            seen_by: None,
        });
        let for_ns = 123_456_789;
        let others = [
            WireAct::Flip {
                frames: WhichFrames::NEXT,
                bit: BitPlace::Number(12),
                seen_by: Some(Participant::Outside),
            },
            WireAct::Lose {
                frames,
                receiver: drive("u2"),
            },
            WireAct::Hold {
                who: drive("5"),
                for_ns,
            },
            WireAct::Flood {
                frame: Frame::data_frame(id, &[1, 2, 0xFF]).unwrap(),
                every_ns: 0,
                for_ns,
            },
            WireAct::Flood {
                frame: Frame::remote_frame(id, 4).unwrap(),
                every_ns: 1,
                for_ns,
            },
            WireAct::Disconnect(drive("127")),
            WireAct::Connect(Participant::Outside),
            WireAct::Break {
                fault: WireFault::Recessive,
                for_ns,
            },
            WireAct::Break {
                fault: WireFault::Dominant,
                for_ns: 0,
            },
        ];
        flips.chain(others).collect()
    }

    #[test]
    fn acts_are_read_as_they_are_written() {
        for act in acts() {
            let text = act.to_string();
            assert_eq!(text.parse(), Ok(act), "{text}");
            // No part of it is an act, and nothing may follow.
            for end in 0..text.len() {
                let part = &text[..end];
                if let Ok(other) = part.parse::<WireAct>() {
                    assert_eq!(other.to_string(), part.trim_end(), "{part}");
                }
            }
            let more = format!("{text} x");
            let error = more.parse::<WireAct>().unwrap_err();
            assert_eq!(error.at, text.len() + 1, "{more}: {error}");
        }
    }

    #[test]
    fn what_is_no_act() {
        for (text, at, what) in [
            ("", 0, "flip, lose-at"),
            ("flop", 0, "flip, lose-at"),
            (
                "flip 160 1/1 from any skip 0 times 1 seen-by all",
                5,
                "0 to 159",
            ),
            (
                "flip eof8 1/1 from any skip 0 times 1 seen-by all",
                5,
                "eof7",
            ),
            (
                "flip 1 181 from any skip 0 times 1 seen-by all",
                7,
                "181/7FF",
            ),
            (
                "flip 1 1/1 for any skip 0 times 1 seen-by all",
                11,
                "'from'",
            ),
            ("flip 1 1/1 from 0 skip 0 times 1 seen-by all", 16, "'any'"),
            (
                "flip 1 1/1 from any skip 0 times 0 seen-by all",
                0,
                "at least once",
            ),
            (
                "lose-at stranger 1/1 from any skip 0 times 1",
                0,
                "babbling",
            ),
            ("hold 1 5", 7, "1000ns"),
            ("flood 181 1ns 1ns", 6, "181#00"),
            ("break open 1ns", 6, "'dominant'"),
        ] {
            let error = text.parse::<WireAct>().unwrap_err();
            assert!(error.expected.contains(what), "{text}: {error}");
            assert_eq!(error.at, at, "{text}: {error}");
        }
    }
}
