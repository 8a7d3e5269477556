//! Gathering a line.

/// The longest line that is taken, its end not counted.
pub(crate) const LONGEST: usize = 64;

/// ENQ.
const ENQUIRY: u8 = 0x05;

/// What a byte did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    /// It belongs to the line.
    Character,
    /// It ends the line.
    End,
    /// Nothing.
    Passed,
    /// It asks whether anybody is there.
    Enquiry,
    /// It has spoilt the line.
    Spoilt,
}

/// A line that is being gathered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    bytes: [u8; LONGEST],
    length: u8,
    /// It had something that is no text, or was too long.
    spoilt: bool,
}

impl Line {
    pub(crate) const EMPTY: Line = Line {
        bytes: [0; LONGEST],
        length: 0,
        spoilt: false,
    };

    /// Takes a byte. A line ends with a carriage return or an underscore; other control characters are
    /// passed over, and ENQ asks whether anybody is there, whatever line it stands in.
    pub(crate) fn push(&mut self, byte: u8) -> Taken {
        match byte {
            b'\r' | b'_' => Taken::End,
            ENQUIRY => Taken::Enquiry,
            0..b' ' => Taken::Passed,
            b' '..=b'~' => match self.bytes.get_mut(usize::from(self.length)) {
                Some(place) if !self.spoilt => {
                    *place = byte;
                    self.length += 1;
                    Taken::Character
                }
                _ => {
                    self.spoilt = true;
                    Taken::Spoilt
                }
            },
            _ => {
                self.spoilt = true;
                Taken::Spoilt
            }
        }
    }

    /// The text without spaces at its ends; `None` if it was spoilt.
    pub(crate) fn text(&self) -> Option<&[u8]> {
        let text = self.bytes.get(..usize::from(self.length)).unwrap_or(&[]);
        (!self.spoilt).then(|| text.trim_ascii())
    }
}
