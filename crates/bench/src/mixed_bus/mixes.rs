//! How each drive of the mixed bus is configured, in its own dialect and units.

use core::f64::consts::TAU;

use can::Frame;

/// What a TPDO must show: of its first two bytes those bits that are in `mask` are as in `bits`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Which bits count.
    pub mask: u16,
    /// What they are.
    pub bits: u16,
}

impl Shown {
    /// It may show anything.
    const ANYTHING: Shown = Shown { mask: 0, bits: 0 };
    /// A statusword in operation enabled.
    const ENABLED: Shown = Shown {
        mask: 0x006F,
        bits: 0x0027,
    };
    /// The same, and bit 12: the drive follows its command.
    const FOLLOWING: Shown = Shown {
        mask: 0x106F,
        bits: 0x1027,
    };

    pub(super) fn is_in(self, frame: &Frame) -> bool {
        let [low, high, ..] = frame.bytes();
        u16::from_le_bytes([low, high]) & self.mask == self.bits
    }
}

/// A field of an RPDO.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wave {
    /// Always the same.
    Word(u16),
    /// A sine of this amplitude, 32 bits.
    Sine(f64),
}

/// An RPDO with a set-point.
#[derive(Clone, Copy, Debug)]
pub struct Rpdo {
    /// 1 to 4.
    pub number: u16,
    /// What is mapped; empty if it is mapped as it came.
    pub mapped: &'static [u32],
    /// What the master puts in.
    pub fields: &'static [Wave],
}

impl Rpdo {
    /// Its data at this share of a wave.
    pub(super) fn data(&self, share: f64) -> Vec<u8> {
        let mut data = Vec::new();
        for field in self.fields {
            match field {
                Wave::Word(word) => data.extend(word.to_le_bytes()),
                Wave::Sine(amplitude) => {
                    let value = (amplitude * (TAU * share).sin()).round() as i32;
                    data.extend(value.to_le_bytes());
                }
            }
        }
        data
    }
}

/// A TPDO with actual values.
#[derive(Clone, Copy, Debug)]
pub struct Tpdo {
    /// 1 to 4.
    pub number: u16,
    /// What is mapped; empty if it is mapped as it came.
    pub mapped: &'static [u32],
    /// What it shows while all is well.
    pub shown: Shown,
}

/// Index, sub-index and little-endian bytes.
pub type Write = (u16, u8, &'static [u8]);

/// One drive of the bus.
#[derive(Debug)]
pub struct Mix {
    /// Its name on the command line.
    pub drive: &'static str,
    /// Written before its PDOs are mapped.
    pub configure: &'static [Write],
    /// Its set-points.
    pub rpdos: &'static [Rpdo],
    /// Its actual values.
    pub tpdos: &'static [Tpdo],
    /// Written in operational, after all drives are configured.
    pub enable: &'static [Write],
}

/// Cyclic position as the P3s have it: a turn to and fro, a set-point each 4 ms.
const FOLLOW: Rpdo = Rpdo {
    number: 1,
    mapped: &[0x607A_0020],
    fields: &[Wave::Sine(4096.0)],
};
const STATUS_AND_POSITION: &[u32] = &[0x6041_0010, 0x6064_0020];
const VELOCITY: Tpdo = Tpdo {
    number: 2,
    mapped: &[0x606C_0020],
    shown: Shown::ANYTHING,
};
const EACH_4_MS: [Write; 2] = [(0x60C2, 1, &[4]), (0x60C2, 2, &[0xFD])];

/// One of each documented drive.
pub static MIXES: &[Mix] = &[
    Mix {
        drive: "p3",
        configure: &EACH_4_MS,
        rpdos: &[FOLLOW],
        tpdos: &[
            Tpdo {
                number: 1,
                mapped: STATUS_AND_POSITION,
                shown: Shown::FOLLOWING,
            },
            VELOCITY,
        ],
        // Reset and shutdown in one, then on; modes in operation enabled only (P8, P9, P10).
        enable: &[
            (0x6040, 0, &[0x86, 0]),
            (0x6040, 0, &[0x0F, 0]),
            (0x6060, 0, &[8]),
        ],
    },
    Mix {
        drive: "p3-extended",
        configure: &EACH_4_MS,
        rpdos: &[FOLLOW],
        tpdos: &[
            Tpdo {
                number: 1,
                mapped: STATUS_AND_POSITION,
                shown: Shown::FOLLOWING,
            },
            VELOCITY,
        ],
        enable: &[
            (0x6060, 0, &[8]),
            (0x6040, 0, &[0x06, 0]),
            (0x6040, 0, &[0x07, 0]),
            (0x6040, 0, &[0x0F, 0]),
        ],
    },
    Mix {
        // No state machine: mode 1 follows the target (J14).
        drive: "p3-jpl",
        configure: &[],
        rpdos: &[FOLLOW],
        tpdos: &[
            Tpdo {
                number: 1,
                mapped: &[0x6061_0008, 0x6064_0020],
                shown: Shown {
                    mask: 0x00FF,
                    bits: 1,
                },
            },
            VELOCITY,
        ],
        enable: &[(0x6060, 0, &[1])],
    },
    Mix {
        // Three channels, each in mode 3 up to 200 RPM; with its state machine on (R24).
        drive: "roboteq-3",
        configure: &[(0x30F1, 0, &[1])],
        rpdos: &[
            Rpdo {
                number: 1,
                mapped: &[0x60FF_0020, 0x68FF_0020],
                fields: &[Wave::Sine(200.0), Wave::Sine(-150.0)],
            },
            Rpdo {
                number: 2,
                mapped: &[0x70FF_0020],
                fields: &[Wave::Sine(100.0)],
            },
        ],
        tpdos: &[
            Tpdo {
                number: 1,
                mapped: &[0x6041_0010, 0x6064_0020],
                shown: Shown::ENABLED,
            },
            Tpdo {
                number: 2,
                mapped: &[0x6841_0010, 0x6864_0020],
                shown: Shown::ENABLED,
            },
            Tpdo {
                number: 3,
                mapped: &[0x7041_0010, 0x7064_0020],
                shown: Shown::ENABLED,
            },
            Tpdo {
                number: 4,
                mapped: &[0x606C_0020, 0x686C_0020],
                shown: Shown::ANYTHING,
            },
        ],
        enable: &[
            (0x6060, 0, &[3]),
            (0x6040, 0, &[0x06, 0]),
            (0x6040, 0, &[0x07, 0]),
            (0x6040, 0, &[0x0F, 0]),
            (0x6860, 0, &[3]),
            (0x6840, 0, &[0x06, 0]),
            (0x6840, 0, &[0x07, 0]),
            (0x6840, 0, &[0x0F, 0]),
            (0x7060, 0, &[3]),
            (0x7040, 0, &[0x06, 0]),
            (0x7040, 0, &[0x07, 0]),
            (0x7040, 0, &[0x0F, 0]),
        ],
    },
    Mix {
        // Its PDOs as they come, mapped by the page; half a turn to and fro.
        drive: "md80",
        configure: &[],
        rpdos: &[Rpdo {
            number: 3,
            mapped: &[],
            fields: &[Wave::Word(0x0F), Wave::Sine(8192.0)],
        }],
        tpdos: &[
            Tpdo {
                number: 1,
                mapped: &[],
                shown: Shown::ENABLED,
            },
            Tpdo {
                number: 2,
                mapped: &[],
                shown: Shown::ENABLED,
            },
            Tpdo {
                number: 3,
                mapped: &[],
                shown: Shown::ENABLED,
            },
        ],
        enable: &[
            (0x6060, 0, &[8]),
            (0x6040, 0, &[0x06, 0]),
            (0x6040, 0, &[0x07, 0]),
            (0x6040, 0, &[0x0F, 0]),
        ],
    },
];
