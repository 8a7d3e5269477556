//! Bytes as doings: each begins with one byte that says what it is.

use can::{ExtendedId, Frame, StandardId};

use super::model::Parameter;

/// One thing that happens to the node.
#[derive(Clone, Copy, Debug)]
pub enum Doing {
    /// A parameter of PDO 0 to 7 is written.
    Write(usize, Parameter, u32),
    /// A PDO is mapped anew by the whole procedure: COB-ID, type, objects of [`OBJECTS`].
    Remap(usize, u32, u8, [u8; 8], u8),
    /// A parameter of another service is written.
    Parameter(u16, u8, u32),
    /// An NMT command.
    Command(u8),
    /// Any frame comes in.
    Receive(Frame),
    /// A frame for RPDO 0 to 3.
    Rpdo(usize, u8, [u8; 8]),
    /// A remote request for TPDO 0 to 3.
    Request(usize),
    /// Time passes, and the host polls at each deadline.
    Wait(u64),
    /// Time passes for a host that is busy, then it polls once.
    Sleep(u64),
    /// A call too many.
    Poll,
    /// The application sets an object of [`OBJECTS`].
    Set(u8, u64),
    /// The application looks for changed values.
    Detect,
    /// The application has an event for a TPDO.
    Trigger(usize),
    /// The application announces an error.
    Announce(u16),
    /// The application sends its time.
    Time(u32),
    /// Frames are taken, one or all.
    Take(bool),
    /// Communication starts over.
    Restart,
}

/// What a script maps most: entries of every width, way and kind.
pub const OBJECTS: [u32; 32] = [
    0x2030_0101,
    0x2030_0201,
    0x2030_0301,
    0x2030_0401,
    0x2030_0501,
    0x2030_4001,
    0x2000_0801,
    0x2000_0108,
    0x2000_0408,
    0x200A_0108,
    0x200A_6408,
    0x2006_0008,
    0x2000_0210,
    0x2000_0510,
    0x2005_0010,
    0x2004_0110,
    0x2001_0010,
    0x2002_0010,
    0x2000_0320,
    0x2000_0620,
    0x2000_0720,
    0x2007_0020,
    0x2008_0020,
    0x2009_0020,
    0x2000_0940,
    0x2000_0A40,
    0x2000_0B40,
    0x2015_0040,
    0x0001_0001,
    0x0005_0008,
    0x200B_0008,
    0x2FFF_0008,
];

/// Parameters of the other services, and values that mean something to them.
const PARAMETERS: [(u16, u8, [u32; 4]); 17] = [
    (0x1005, 0, [0x80, 0x4000_0080, 0x2000_0080, 0x81]),
    (0x1006, 0, [0, 100, 1000, 20_000]),
    (0x1007, 0, [0, 50, 500, 100_000]),
    (0x1019, 0, [0, 2, 10, 240]),
    (0x100C, 0, [0, 1, 10, 1000]),
    (0x100D, 0, [0, 1, 3, 255]),
    (0x1012, 0, [0x100, 0xC000_0100, 0x4000_0100, 0xE000_0100]),
    (0x1014, 0, [0x85, 0x8000_0085, 0x2000_0085, 0x86]),
    (0x1015, 0, [0, 1, 10, 1000]),
    (0x1016, 1, [0, 0x0007_000A, 0x0008_0064, 0x0007_FFFF]),
    (0x1016, 2, [0, 0x0007_0001, 0x0009_0001, 0x0008_0003]),
    (0x1017, 0, [0, 1, 10, 1000]),
    (0x1028, 7, [0x87, 0x8000_0087, 0x2000_0087, 0x205]),
    (0x1029, 1, [0, 1, 2, 3]),
    (0x1003, 0, [0, 0, 0, 1]),
    (0x2000, 1, [0, 1, 0x80, 0xFF]),
    (0x2030, 1, [0, 1, 0, 1]),
];

fn take<const N: usize>(input: &mut &[u8]) -> Option<[u8; N]> {
    let (bytes, rest) = input.split_first_chunk::<N>()?;
    *input = rest;
    Some(*bytes)
}

fn cob_id(n: usize, choice: u8, input: &mut &[u8]) -> Option<u32> {
    let own = [0x205, 0x305, 0x405, 0x505, 0x185, 0x285, 0x385, 0x485][n & 7];
    let high = u32::from(choice >> 4);
    Some(match choice & 0x0F {
        0 | 1 => own,
        2 | 3 => own | 1 << 31,
        4 => own | 1 << 30,
        5 => 1 << 31,
        6 => 0x1A0 + high,
        7 => (0x1A0 + high) | 1 << 31,
        8 => high | 1 << 29,
        9 => high | 1 << 29 | 1 << 31,
        10 => 0x3FFF_FFFF,
        11 => 0x80 + high,
        12 => 0x600 + high,
        13 => 0x205,
        _ => u32::from_le_bytes(take(input)?),
    })
}

/// The next doing; `None` where the bytes end.
pub fn doing(input: &mut &[u8]) -> Option<Doing> {
    let [what] = take(input)?;
    let high = what >> 4;
    Some(match what & 0x0F {
        0..=2 => {
            let [place, value] = take(input)?;
            let n = usize::from(place & 7);
            let (parameter, value) = match place >> 3 & 7 {
                0 | 1 => (Parameter::CobId, cob_id(n, value, input)?),
                2 => (Parameter::Type, value.into()),
                3 => (
                    Parameter::Inhibit,
                    u32::from(value) << (high & 3) << (high & 3),
                ),
                4 => (
                    Parameter::Timer,
                    u32::from(value) << (high & 3) << (high & 3),
                ),
                5 => (Parameter::SyncStart, value.into()),
                6 => (
                    Parameter::Count,
                    if high & 1 == 0 { value & 7 } else { value }.into(),
                ),
                _ => {
                    let [sub] = take(input)?;
                    let entry = match high {
                        0 => u32::from_le_bytes(take(input)?),
                        1 => 0,
                        _ => OBJECTS[usize::from(value & 31)],
                    };
                    (Parameter::Entry(sub % 64 + 1), entry)
                }
            };
            Doing::Write(n, parameter, value)
        }
        3 | 4 => {
            let [place, transmission_type, choice] = take(input)?;
            let n = usize::from(place & 7);
            Doing::Remap(
                n,
                cob_id(n, choice, input)?,
                transmission_type,
                take(input)?,
                high & 7,
            )
        }
        5 => {
            let [place] = take(input)?;
            let (index, sub, values) = PARAMETERS[usize::from(place) % PARAMETERS.len()];
            let value = match high {
                0 => u32::from_le_bytes(take(input)?),
                _ => values[usize::from(high & 3)],
            };
            Doing::Parameter(index, sub, value)
        }
        6 => {
            let [counter] = take(input)?;
            Doing::Receive(Frame::classic(
                0x80,
                [counter; 8],
                (high & 3).saturating_sub(2),
            ))
        }
        7 => Doing::Rpdo(
            usize::from(high & 3),
            take::<1>(input)?[0] % 9,
            take(input)?,
        ),
        8 if high & 4 != 0 => Doing::Receive(Frame::remote_frame(StandardId::new(0x705)?, 1)?),
        8 => Doing::Request(usize::from(high & 3)),
        9 => Doing::Command([0x01, 0x01, 0x80, 0x02][usize::from(high & 3)]),
        10 => {
            let [low, middle] = take(input)?;
            let count = u64::from(u16::from_le_bytes([low, middle]));
            let ns = count << [0, 10, 20, 36][usize::from(high & 3)];
            if high & 4 == 0 {
                Doing::Wait(ns)
            } else {
                Doing::Sleep(ns)
            }
        }
        11 => {
            let [object] = take(input)?;
            Doing::Set(object, u64::from_le_bytes(take(input)?))
        }
        12 => match high {
            0..=3 => Doing::Detect,
            4..=7 => Doing::Trigger(usize::from(high & 3)),
            8..=11 => Doing::Announce(u16::from_le_bytes(take(input)?)),
            _ => Doing::Time(u32::from_le_bytes(take(input)?)),
        },
        13 => {
            let [a, b, c, d, data @ ..] = take::<12>(input)?;
            let raw = u32::from_le_bytes([a, b, c, d]);
            let data = &data[..usize::from(high % 9)];
            Doing::Receive(match raw >> 30 {
                0 => Frame::data_frame(ExtendedId::new(raw & 0x1FFF_FFFF)?, data)?,
                1 => Frame::remote_frame(ExtendedId::new(raw & 0x1FFF_FFFF)?, high % 9)?,
                2 => Frame::remote_frame(StandardId::new(raw as u16 & 0x7FF)?, high % 9)?,
                _ => Frame::data_frame(StandardId::new(raw as u16 & 0x7FF)?, data)?,
            })
        }
        14 => {
            let [byte] = take(input)?;
            let other = u16::from(high & 3) + 7;
            match high & 4 {
                0 => Doing::Receive(Frame::classic(0x700 + other, [byte; 8], 1)),
                _ => Doing::Receive(Frame::classic(0x80 + other, [byte; 8], 8)),
            }
        }
        _ => match high {
            0..=3 => Doing::Poll,
            4..=7 => Doing::Take(false),
            8..=14 => Doing::Take(true),
            // Costly and rarely needed, so not what any byte means.
            _ => match take(input)? {
                [0x5A] => Doing::Restart,
                _ => Doing::Poll,
            },
        },
    })
}
