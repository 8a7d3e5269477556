//! The gate driver of the bridge, asked over its serial interface.

use super::watch::{Bits, one};
use crate::board::GateDriver;

/// Its control register, which the drive leaves as it is.
const CONTROL: u16 = 0x0159;
/// Bits of its status register: a fault, and that it is the current of a short circuit, of which its
/// fault pin tells the loops at once.
const FAULT: u16 = 1 << 10;
const OVERCURRENT: u16 = 1 << 9;
/// Wrong answers in a row.
const WRONG_TICKS: u16 = 5;

/// What is known of it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bridge {
    wrong: u16,
}

impl Bridge {
    /// A millisecond more; `overcurrent` is what the loops know.
    pub(super) fn tick(&mut self, driver: &GateDriver, overcurrent: bool) -> Bits {
        let answers = driver.control == CONTROL;
        self.wrong = if answers {
            0
        } else {
            self.wrong.saturating_add(1)
        };
        let mut bits = 0;
        if self.wrong >= WRONG_TICKS {
            bits |= one(4, 0);
        }
        // Without an answer the pin alone says that there is something, and not what.
        let other = match answers {
            true => driver.status & !(FAULT | OVERCURRENT) != 0,
            false => !overcurrent,
        };
        if driver.fault_pin && other {
            bits |= one(4, 2);
        }
        bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOUND: GateDriver = GateDriver {
        fault_pin: false,
        status: 0,
        control: CONTROL,
    };

    #[test]
    fn five_wrong_answers_are_no_communication() {
        for control in [0xFFFF, 0, CONTROL ^ 1] {
            let mut bridge = Bridge::default();
            let wrong = GateDriver { control, ..SOUND };
            for _ in 0..4 {
                assert_eq!(bridge.tick(&wrong, false), 0);
            }
            assert_eq!(bridge.tick(&SOUND, false), 0, "begins anew");
            for _ in 0..4 {
                assert_eq!(bridge.tick(&wrong, false), 0);
            }
            assert_eq!(bridge.tick(&wrong, false), one(4, 0));
        }
    }

    #[test]
    fn a_short_circuit_is_no_general_fault() {
        let mut bridge = Bridge::default();
        let mut tick = |status, overcurrent| {
            let driver = GateDriver {
                fault_pin: true,
                status,
                ..SOUND
            };
            bridge.tick(&driver, overcurrent)
        };
        assert_eq!(tick(FAULT | OVERCURRENT, true), 0);
        assert_eq!(tick(FAULT | 1 << 7, false), one(4, 2));
        assert_eq!(tick(FAULT | OVERCURRENT | 1 << 6, true), one(4, 2));
    }
}
