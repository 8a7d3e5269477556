//! A slave in bytes, written from CiA 305 without any type of the crate.

/// A slave as CiA 305 describes it.
#[derive(Clone, Debug)]
pub struct Model {
    /// Vendor, product, revision, serial.
    pub address: [u32; 4],
    /// Indices of table 0 that the device can do.
    pub rates: Vec<u8>,
    /// Mode of "switch state global": 0 waiting, 1 configuration.
    pub mode: u8,
    /// 1 to 127 or 0xFF.
    pub active: u8,
    /// 1 to 127 or 0xFF.
    pub pending: u8,
    /// Pending index of table 0.
    pub rate: u8,
    /// Numbers of "switch state selective" that agreed so far, without repetitions.
    selective: Vec<u8>,
    /// The same of "identify remote slave".
    identify: Vec<u8>,
    /// LSSPos.
    position: u8,
    /// A store is under way.
    pub storing: bool,
    /// Two delays run.
    pub silent: bool,
}

/// What the model expects of a slave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Expected {
    Silence,
    Answer([u8; 8]),
    Store(u8, u8),
    Boot(u8),
    Delays(u16),
}

fn answer(command: u8, number: u32) -> Expected {
    let [a, b, c, d] = number.to_le_bytes();
    Expected::Answer([command, a, b, c, d, 0, 0, 0])
}

impl Model {
    pub fn new(address: [u32; 4], active: u8, rate: u8, rates: Vec<u8>) -> Model {
        Model {
            address,
            rates,
            mode: 0,
            active,
            pending: active,
            rate,
            selective: Vec::new(),
            identify: Vec::new(),
            position: 0,
            storing: false,
            silent: false,
        }
    }

    pub fn unconfigured(&self) -> bool {
        self.active == 0xFF && self.pending == 0xFF
    }

    fn enter_mode(&mut self, mode: u8) {
        if mode == 0 {
            self.identify.clear();
            self.storing = false;
        }
        if mode == 0 || self.mode == 0 {
            self.selective.clear();
            self.position = 0;
        }
        self.mode = mode;
    }

    pub fn reset_communication(&mut self) {
        self.enter_mode(0);
        self.active = self.pending;
    }

    /// What comes of eight bytes on 0x7E5.
    pub fn receive(&mut self, data: [u8; 8]) -> Expected {
        let number = u32::from_le_bytes([data[1], data[2], data[3], data[4]]);
        let [vendor, product, revision, serial] = self.address;
        if self.silent {
            return Expected::Silence;
        }
        match (self.mode, data[0]) {
            (mode, 4) if data[1] <= 1 => {
                self.enter_mode(data[1]);
                if mode == 1 && data[1] == 0 && self.active == 0xFF && self.pending != 0xFF {
                    self.active = self.pending;
                    return Expected::Boot(self.active);
                }
                Expected::Silence
            }
            (0, command @ 64..=67) => {
                let agrees = number == self.address[usize::from(command - 64)];
                if row(&mut self.selective, command, 64, agrees) == [64, 65, 66, 67] {
                    self.enter_mode(1);
                    return answer(68, 0);
                }
                Expected::Silence
            }
            (_, command @ 70..=75) => {
                let agrees = [
                    number == vendor,
                    number == product,
                    number <= revision,
                    number >= revision,
                    number <= serial,
                    number >= serial,
                ][usize::from(command - 70)];
                if row(&mut self.identify, command, 70, agrees).len() == 6 {
                    self.identify.clear();
                    return answer(79, 0);
                }
                Expected::Silence
            }
            (_, 76) if self.unconfigured() => answer(80, 0),
            (0, 81) if self.unconfigured() && data[6] < 4 && data[7] < 4 => {
                let [.., bit, sub, next] = data;
                let counts = match bit {
                    128 => {
                        self.position = 0;
                        return answer(79, 0);
                    }
                    0..=31 => u32::MAX << bit,
                    _ => return Expected::Silence,
                };
                let own = self.address[usize::from(sub)];
                if sub != self.position || own & counts != number & counts {
                    return Expected::Silence;
                }
                self.position = next;
                if bit == 0 && next < sub {
                    self.enter_mode(1);
                }
                answer(79, 0)
            }
            (1, 17) => {
                let valid = matches!(data[1], 1..=127 | 255);
                if valid {
                    self.pending = data[1];
                }
                answer(17, if valid { 0 } else { 1 })
            }
            (1, 19) => {
                let valid = data[1] == 0 && self.rates.contains(&data[2]);
                if valid {
                    self.rate = data[2];
                }
                answer(19, if valid { 0 } else { 1 })
            }
            (1, 21) if !self.rates.is_empty() => {
                self.silent = true;
                Expected::Delays(u16::from_le_bytes([data[1], data[2]]))
            }
            (1, 23) if !self.storing => {
                self.storing = true;
                Expected::Store(self.pending, self.rate)
            }
            (1, command @ 90..=93) => answer(command, self.address[usize::from(command - 90)]),
            (1, 94) => answer(94, self.active.into()),
            _ => Expected::Silence,
        }
    }
}

/// Adds to the numbers that agreed in a row; one that comes twice counts once.
fn row(so_far: &mut Vec<u8>, command: u8, first: u8, agrees: bool) -> &[u8] {
    let next = so_far.last().map_or(first, |last| last + 1);
    if !agrees {
        so_far.clear();
    } else if command == first {
        *so_far = vec![first];
    } else if command == next {
        so_far.push(command);
    } else if so_far.last() != Some(&command) {
        so_far.clear();
    }
    so_far
}
