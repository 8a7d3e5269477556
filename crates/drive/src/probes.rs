//! Touch probes: 0x60B8 to triggers, captures to 0x60B9 to 0x60BD and 0x60D5 to 0x60D8.

use canopen::Image;
use control::capture::{Latched, Seen, Trigger};
use personalities::ProbeObjects;

use crate::captures::News;
use crate::inputs::FIRST_GENERAL;

/// The touch probe function, 0x60B8, as it is in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Probes {
    function: u16,
    /// Of the triggers set last.
    serials: [u8; 2],
}

/// One probe's half of 0x60B8.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Function(u16);

impl Function {
    fn is_on(self) -> bool {
        self.0 & 1 << 0 != 0
    }

    fn trigger(self, probe: u32, serial: u8) -> Trigger {
        if !self.is_on() {
            return Trigger {
                serial,
                ..Trigger::default()
            };
        }
        // Bits 2 and 3: 0 is the probe's input, 1 the encoder's index. Others are refused.
        let index = self.0 >> 2 & 3 == 1;
        let inputs = if index {
            0
        } else {
            1 << (FIRST_GENERAL + probe)
        };
        let (rising, falling) = (self.0 & 1 << 4 != 0, self.0 & 1 << 5 != 0);
        Trigger {
            inputs,
            rising: rising && !index,
            falling: falling && !index,
            index: index && rising,
            continuous: self.0 & 1 << 1 != 0,
            serial,
        }
    }
}

/// Both halves of 0x60B8, and in which each stands.
fn halves(function: u16) -> [Function; 2] {
    [Function(function & 0xFF), Function(function >> 8)]
}

/// Whether a value of 0x60B8 asks for what there is.
pub(crate) fn is_supported(function: u16) -> bool {
    halves(function)
        .into_iter()
        .all(|half| half.0 >> 2 & 3 <= 1 && half.0 & 0xC0 == 0)
}

impl Probes {
    /// 0x60B8 was written: which triggers are new. A probe whose half has changed begins anew.
    pub(crate) fn write(&mut self, function: u16) -> News {
        let before = halves(core::mem::replace(&mut self.function, function));
        let mut news = News::default();
        for (((half, before), serial), its) in halves(function)
            .into_iter()
            .zip(before)
            .zip(&mut self.serials)
            .zip([News::PROBE_1, News::PROBE_2])
        {
            if half != before {
                *serial = serial.wrapping_add(1);
                news.add(its);
            }
        }
        news
    }

    /// The trigger of a probe, 0 or 1.
    pub(crate) fn trigger(&self, probe: u32) -> Trigger {
        let [first, second] = halves(self.function);
        let [first_serial, second_serial] = self.serials;
        match probe {
            0 => first.trigger(probe, first_serial),
            _ => second.trigger(probe, second_serial),
        }
    }

    /// Writes what the probes show into the image.
    pub(crate) fn publish(&self, image: &mut Image<'_>, objects: &ProbeObjects, seen: &Seen) {
        let [_, first, second] = seen.latches;
        let mut status = 0;
        for (probe, ((half, latched), serial)) in halves(self.function)
            .into_iter()
            .zip([first, second])
            .zip(self.serials)
            .enumerate()
        {
            let latched = match latched.serial == serial {
                true => latched,
                false => Latched::default(),
            };
            // The index pulse counts as a positive edge.
            let by_index = latched.index_count > 0;
            let positive = match by_index {
                true => (latched.index, latched.index_count),
                false => (latched.rising, latched.rising_count),
            };
            let edges = [positive, (latched.falling, latched.falling_count)];
            let shift = 8 * probe;
            status |= u16::from(half.is_on()) << shift;
            for (edge, (position, count)) in edges.into_iter().enumerate() {
                let Some(object) = objects.edges.get(2 * probe + edge) else {
                    continue;
                };
                image.set(object.count, count);
                if count > 0 {
                    status |= 1 << (shift + 1 + edge);
                    image.set(object.position, position);
                }
            }
        }
        image.set(objects.status, status);
    }
}
