//! Gathering a line.

/// The longest line that is taken, its end not counted.
pub(crate) const LONGEST: usize = 64;

/// What a byte did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    /// It belongs to the line.
    Character,
    /// It ends the line.
    End,
    /// Nothing.
    Passed,
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

    /// Takes a byte. A line ends with a carriage return or an underscore; a line feed is passed over.
    pub(crate) fn push(&mut self, byte: u8) -> Taken {
        match byte {
            b'\r' | b'_' => Taken::End,
            b'\n' => Taken::Passed,
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
