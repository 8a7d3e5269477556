//! A frame as a transcript writes it: with wildcards and variables.

use can::Frame;

use super::expression::Values;

/// One element of a frame's data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Element {
    /// A byte, of which the bits in `mask` count.
    Byte { value: u8, mask: u8 },
    /// `bytes` bytes (1 to 4), little-endian.
    Variable { name: String, bytes: u8 },
    /// Any further bytes.
    Rest,
}

impl Element {
    /// How many bytes it stands for; `None` for any number.
    pub(super) fn bytes(&self) -> Option<u8> {
        match self {
            Element::Byte { .. } => Some(1),
            Element::Variable { bytes, .. } => Some(*bytes),
            Element::Rest => None,
        }
    }
}

/// A frame with wildcards.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pattern {
    /// Identifier.
    pub(super) id: u32,
    /// Which bits of the identifier count.
    pub(super) id_mask: u32,
    /// 29-bit identifier.
    pub(super) is_extended: bool,
    /// Data length code; `None` for any.
    pub(super) length: Option<u8>,
    /// Data.
    pub(super) elements: Vec<Element>,
}

/// Why a frame cannot be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct DoesNotFit {
    pub(super) name: String,
    pub(super) value: i64,
    pub(super) bytes: u8,
}

impl Pattern {
    /// The frame, if nothing is left open and every variable fits its place.
    pub(super) fn frame(&self, values: &Values) -> Result<Frame, DoesNotFit> {
        let mut data = Vec::with_capacity(8);
        for element in &self.elements {
            match element {
                Element::Byte { value, .. } => data.push(*value),
                Element::Variable { name, bytes } => {
                    let value = values.get(name).copied().unwrap_or(0);
                    let bits = 8 * u32::from(*bytes);
                    // As UNSIGNED or as INTEGER of that size.
                    if !(-(1_i64 << (bits - 1))..1 << bits).contains(&value) {
                        let name = name.clone();
                        return Err(DoesNotFit {
                            name,
                            value,
                            bytes: *bytes,
                        });
                    }
                    data.extend_from_slice(&value.to_le_bytes()[..usize::from(*bytes)]);
                }
                Element::Rest => {}
            }
        }
        Ok(self.with_data(&data))
    }

    fn with_data(&self, data: &[u8]) -> Frame {
        let data = &data[..data.len().min(8)];
        let extended = can::ExtendedId::new(self.id).filter(|_| self.is_extended);
        let frame = match extended {
            Some(id) => Frame::data_frame(id, data),
            None => {
                let mut bytes = [0; 8];
                bytes[..data.len()].copy_from_slice(data);
                Some(Frame::classic(self.id as u16, bytes, data.len() as u8))
            }
        };
        frame.unwrap_or_else(|| Frame::classic(self.id as u16, [0; 8], 0))
    }

    /// Whether `frame` has the identifier (or one of those) of this pattern.
    pub(super) fn has_id_of(&self, frame: &Frame) -> bool {
        !frame.is_remote()
            && frame.is_extended() == self.is_extended
            && (frame.raw_id() ^ self.id) & self.id_mask == 0
    }

    /// Whether `frame` is one of this pattern; if so, variables without a value take theirs.
    pub(super) fn takes(&self, frame: &Frame, values: &mut Values) -> bool {
        if !self.has_id_of(frame) || self.length.is_some_and(|length| length != frame.len()) {
            return false;
        }
        let mut captured = Values::new();
        let mut rest = frame.data();
        for element in &self.elements {
            let Some(bytes) = element.bytes() else {
                rest = &[];
                break;
            };
            let Some((own, after)) = rest.split_at_checked(usize::from(bytes)) else {
                return false;
            };
            rest = after;
            match element {
                Element::Byte { value, mask } => {
                    if own.iter().any(|byte| (byte ^ value) & mask != 0) {
                        return false;
                    }
                }
                Element::Variable { name, .. } => {
                    let number = little_endian(own);
                    match captured.get(name).or_else(|| values.get(name)) {
                        // The same bits, whether the value was meant signed or not.
                        Some(known) if low_bits(*known, bytes) != number => return false,
                        Some(_) => {}
                        None => {
                            captured.insert(name.clone(), number);
                        }
                    }
                }
                Element::Rest => {}
            }
        }
        if !rest.is_empty() {
            return false;
        }
        values.append(&mut captured);
        true
    }

    /// In the notation of transcripts, with the values that variables have.
    pub(super) fn notation(&self, values: &Values) -> String {
        let mut text = id_text(self.id, self.is_extended);
        match self.length {
            Some(length) => text.push_str(&format!(" {length}")),
            None => text.push_str(" ?"),
        }
        for element in &self.elements {
            match element {
                Element::Byte { value, mask: 0xFF } => text.push_str(&format!(" {value:02X}")),
                Element::Byte { mask: 0, .. } => text.push_str(" ??"),
                Element::Byte { value, mask } => {
                    text.push_str(&format!(" {value:02X}/{mask:02X}"));
                }
                Element::Variable { name, bytes } => match values.get(name) {
                    Some(value) => {
                        let bytes = &value.to_le_bytes()[..usize::from(*bytes)];
                        bytes
                            .iter()
                            .for_each(|byte| text.push_str(&format!(" {byte:02X}")));
                    }
                    None if *bytes == 1 => text.push_str(&format!(" ${name}")),
                    None => text.push_str(&format!(" ${name}:{bytes}")),
                },
                Element::Rest => text.push_str(" .."),
            }
        }
        text
    }

    /// A frame of this pattern to put into words: what is left open is taken from `like`, or is 0.
    /// Also whether anything was left open.
    pub(super) fn example(&self, values: &Values, like: Option<&Frame>) -> (Frame, bool) {
        let like = like
            .filter(|frame| self.has_id_of(frame))
            .map_or(&[][..], Frame::data);
        let mut data: Vec<u8> = Vec::with_capacity(8);
        let mut open = false;
        for element in &self.elements {
            let given = |at: usize| like.get(at).copied().unwrap_or(0);
            match element {
                Element::Byte { value, mask } => {
                    open |= *mask != 0xFF;
                    data.push(value & mask | given(data.len()) & !mask);
                }
                Element::Variable { name, bytes } => {
                    let known = values.get(name);
                    open |= known.is_none();
                    for n in 0..usize::from(*bytes) {
                        let byte = known.map(|value| value.to_le_bytes()[n]);
                        data.push(byte.unwrap_or_else(|| given(data.len())));
                    }
                }
                Element::Rest => {
                    open = true;
                    while data.len() < usize::from(self.length.unwrap_or(8)) {
                        data.push(given(data.len()));
                    }
                }
            }
        }
        (self.with_data(&data), open)
    }

    /// Where `frame`, which has this identifier, departs from this pattern, in words.
    pub(super) fn differences(&self, frame: &Frame, values: &Values) -> Vec<String> {
        let mut found = Vec::new();
        if let Some(length) = self.length.filter(|length| *length != frame.len()) {
            found.push(format!(
                "length {length} expected, {} received",
                frame.len()
            ));
        }
        let data = frame.data();
        let mut at = 0;
        for element in &self.elements {
            let Some(bytes) = element.bytes() else {
                return found;
            };
            for n in 0..usize::from(bytes) {
                let (value, mask) = match element {
                    Element::Byte { value, mask } => (*value, *mask),
                    Element::Variable { name, .. } => match values.get(name) {
                        Some(value) => (value.to_le_bytes()[n], 0xFF),
                        None => (0, 0),
                    },
                    Element::Rest => (0, 0),
                };
                match data.get(at) {
                    Some(byte) if (byte ^ value) & mask != 0 && mask == 0xFF => {
                        found.push(format!("byte {at}: {value:02X} expected, {byte:02X} received"));
                    }
                    Some(byte) if (byte ^ value) & mask != 0 => found.push(format!(
                        "byte {at}: {value:02X} expected in the bits {mask:02X}, {byte:02X} received"
                    )),
                    _ => {}
                }
                at += 1;
            }
        }
        found
    }

    /// Whether a master sends this identifier, by the predefined connection set (CiA 301 7.3.3):
    /// NMT, SYNC, TIME, RPDOs, SDO requests and LSS.
    pub(super) fn is_masters(&self) -> bool {
        !self.is_extended
            && matches!(
                self.id,
                0x000 | 0x080 | 0x100
                    | 0x200..=0x27F
                    | 0x300..=0x37F
                    | 0x400..=0x47F
                    | 0x500..=0x57F
                    | 0x600..=0x67F
                    | 0x7E5
            )
    }
}

fn little_endian(bytes: &[u8]) -> i64 {
    bytes
        .iter()
        .rev()
        .fold(0, |number, byte| number << 8 | i64::from(*byte))
}

fn low_bits(value: i64, bytes: u8) -> i64 {
    value & ((1_i64 << (8 * u32::from(bytes))) - 1)
}

fn id_text(id: u32, is_extended: bool) -> String {
    if is_extended {
        format!("0x{id:08X}")
    } else {
        format!("0x{id:03X}")
    }
}

/// A frame in the notation of transcripts.
pub(super) fn notation(frame: &Frame) -> String {
    let mut text = id_text(frame.raw_id(), frame.is_extended());
    text.push_str(&format!(" {}", frame.len()));
    if frame.is_remote() {
        text.push_str(" remote");
    }
    frame
        .data()
        .iter()
        .for_each(|byte| text.push_str(&format!(" {byte:02X}")));
    text
}
