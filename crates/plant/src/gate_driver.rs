//! The chip between the PWM timer and the switches: what it needs, and what it says over its own wires.

/// Voltage that the gates need, V.
const SUPPLY_V: f32 = 12.0;
/// Below this it lets no switch close any more, and from the other on it does again, V.
const LEAST_V: f32 = 8.0;
const AGAIN_V: f32 = 8.5;
/// From this temperature on it lets no switch close, and below the other it does again, °C.
const SHUTDOWN_C: f32 = 170.0;
const COOL_C: f32 = 150.0;
/// Temperature of a board that does nothing special, °C.
const USUAL_C: f32 = 25.0;

/// What a gate driver says: a pin, and the words that its serial interface gives.
///
/// The words are those of a chip in the manner of TI's DRV8323; bits and thresholds are ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GateDriverWords {
    /// The fault pin is pulled low.
    pub fault_pin: bool,
    /// The status register: [`GateDriverWords::FAULT`] and why.
    pub status: u16,
    /// A control register that nobody writes: [`GateDriverWords::CONTROL`].
    pub control: u16,
}

impl GateDriverWords {
    /// Bit of the status: there is a fault.
    pub const FAULT: u16 = 1 << 10;
    /// Bit of the status: the current of a short circuit.
    pub const OVERCURRENT: u16 = 1 << 9;
    /// Bit of the status: the voltage for the gates is too low.
    pub const UNDERVOLTAGE: u16 = 1 << 7;
    /// Bit of the status: it is too hot.
    pub const TOO_HOT: u16 = 1 << 6;
    /// What the control register reads as.
    pub const CONTROL: u16 = 0x0159;
    /// What any register reads as if nobody drives the wire: its pull-up does.
    pub const NOBODY: u16 = 0xFFFF;
}

/// The gate driver. A batch shares it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GateDriver {
    undervoltage: bool,
    too_hot: bool,
    /// Its serial interface does not answer.
    silent: bool,
}

impl GateDriver {
    pub(crate) const fn sound() -> GateDriver {
        GateDriver {
            undervoltage: false,
            too_hot: false,
            silent: false,
        }
    }

    /// Whether switches close at all.
    #[inline]
    pub(crate) fn drives(&self) -> bool {
        !(self.undervoltage | self.too_hot)
    }

    /// Sets the voltage for the gates; `None` is what it should be. An undefined one changes nothing.
    pub(crate) fn set_supply_v(&mut self, volts: Option<f32>) {
        let volts = volts.unwrap_or(SUPPLY_V);
        let threshold = if self.undervoltage { AGAIN_V } else { LEAST_V };
        if !volts.is_nan() {
            self.undervoltage = volts < threshold;
        }
    }

    /// Sets its temperature; `None` is that of a board that is not hot. An undefined one changes
    /// nothing.
    pub(crate) fn set_temperature_c(&mut self, celsius: Option<f32>) {
        let celsius = celsius.unwrap_or(USUAL_C);
        let threshold = if self.too_hot { COOL_C } else { SHUTDOWN_C };
        if !celsius.is_nan() {
            self.too_hot = celsius >= threshold;
        }
    }

    pub(crate) fn set_silent(&mut self, silent: bool) {
        self.silent = silent;
    }

    /// What it says, having `tripped` by a short circuit or not.
    pub(crate) fn words(&self, tripped: bool) -> GateDriverWords {
        let when = |is: bool, bit: u16| if is { bit } else { 0 };
        let why = when(tripped, GateDriverWords::OVERCURRENT)
            | when(self.undervoltage, GateDriverWords::UNDERVOLTAGE)
            | when(self.too_hot, GateDriverWords::TOO_HOT);
        let status = why | when(why != 0, GateDriverWords::FAULT);
        let heard = |word| {
            if self.silent {
                GateDriverWords::NOBODY
            } else {
                word
            }
        };
        GateDriverWords {
            // A wire of its own.
            fault_pin: why != 0,
            status: heard(status),
            control: heard(GateDriverWords::CONTROL),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{GateDriver, GateDriverWords};

    #[test]
    fn it_says_why_it_does_not_drive() {
        let mut driver = GateDriver::sound();
        let quiet = driver.words(false);
        assert!(driver.drives() && !quiet.fault_pin && quiet.status == 0);
        // Down at 8 V, up again at 8.5 V.
        for (volts, drives) in [(8.0, true), (7.9, false), (8.4, false), (8.5, true)] {
            driver.set_supply_v(Some(volts));
            assert_eq!(driver.drives(), drives, "{volts}");
            let low = driver.words(false).status & GateDriverWords::UNDERVOLTAGE != 0;
            assert_eq!(low, !drives);
        }
        for (celsius, drives) in [(169.0, true), (170.0, false), (151.0, false), (149.0, true)] {
            driver.set_temperature_c(Some(celsius));
            assert_eq!(driver.drives(), drives, "{celsius}");
        }
        driver.set_temperature_c(Some(f32::NAN));
        driver.set_supply_v(Some(0.0));
        assert!(driver.words(false).fault_pin);
        driver.set_supply_v(None);
        assert!(driver.drives());
    }

    #[test]
    fn without_an_answer_all_bits_are_ones_and_it_drives_all_the_same() {
        let mut driver = GateDriver::sound();
        driver.set_silent(true);
        let words = driver.words(true);
        assert_eq!((words.status, words.control), (0xFFFF, 0xFFFF));
        assert!(driver.drives() && words.fault_pin);
        driver.set_silent(false);
        assert_eq!(driver.words(false).control, GateDriverWords::CONTROL);
    }
}
