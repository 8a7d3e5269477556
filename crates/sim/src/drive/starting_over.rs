//! What ends and begins a program: resets, the boot, and what is stored between them.

use canopen::nmt::Reset;
use canopen::{Abort, Instant, store};
use drive::{Drive, Hardware, Host as _, Request};

use super::{Storing, VirtualDrive};
use crate::notice::NoticeKind;

impl VirtualDrive {
    /// What the core asks of its host.
    pub(super) fn obey(&mut self, now: Instant) {
        while let Some(request) = self.core.as_mut().and_then(Drive::take_request) {
            match request {
                Request::Store(request) => {
                    let done = now.plus_ns(self.latency.store_ns());
                    self.storing = Some((Storing::Save(request), done));
                }
                Request::Restore(request) => {
                    let done = now.plus_ns(self.latency.store_ns());
                    self.storing = Some((Storing::Restore(request), done));
                }
                Request::Reset(Reset::Communication) => {
                    self.controller.clear();
                    self.service_at = Instant::NEVER;
                    self.node = self.station.reset_communication();
                    self.store.abort_program();
                    match (self.node, &mut self.core) {
                        (Some(node), Some(core)) => {
                            core.reset_communication(self.store.bytes(), node, now);
                        }
                        // LSS has taken its node ID away: it answers nothing else any more.
                        _ => {
                            self.core = None;
                            self.storing = None;
                        }
                    }
                }
                Request::Reset(Reset::Node) => {
                    self.lose_program();
                    self.boots_at = now.plus_ns(self.latency.boot_ns());
                }
            }
        }
    }

    /// Everything that does not survive a reset of the processor.
    pub(crate) fn lose_program(&mut self) {
        self.core = None;
        self.station.power_off();
        if let Some(line) = &mut self.serial_line {
            line.stop();
        }
        self.controller.silence(false);
        self.controller.clear();
        self.service_at = Instant::NEVER;
        self.stalled_until = Instant::ZERO;
        self.storing = None;
    }

    pub(super) fn boot(&mut self, now: Instant, notice: &mut impl FnMut(NoticeKind)) {
        let hardware = Hardware {
            scales: self.plants[0].parameters().scales,
            duty_margin: 0.0,
        };
        if self.store.fell_back() {
            let kept = self.store.set_aside();
            notice(NoticeKind::StoreFellBack { kept });
        }
        if !self.station.is_on() {
            let bit_rate = self.station.power_on(self.personality, self.store.bytes());
            self.controller.tune(bit_rate, now);
        }
        self.node = self.station.node();
        let Some(node) = self.node else {
            self.look_at_store(notice);
            return;
        };
        let memory = vec![0; self.personality.device.table.image_bytes()].into_boxed_slice();
        let health = core::mem::take(&mut self.health);
        if let Err(error) = self.store.start_programs(self.personality) {
            notice(NoticeKind::CannotStore(error));
        }
        let made = Drive::build(
            self.personality,
            hardware,
            memory,
            node,
            self.serial,
            self.store.bytes(),
            health,
        );
        match made {
            Ok((mut core, damage)) => {
                if let Some(damage) = damage {
                    let kept = self.store.set_aside();
                    notice(NoticeKind::StoreDamaged { damage, kept });
                }
                core.start(now);
                self.core = Some(core);
                if let Some(line) = &mut self.serial_line {
                    line.start();
                }
                self.adopt_timing();
            }
            Err(error) => notice(NoticeKind::CannotStart(error)),
        }
    }

    /// What a core would say of damaged parameters, where there is none.
    fn look_at_store(&mut self, notice: &mut impl FnMut(NoticeKind)) {
        let records = store::records(self.store.bytes());
        if let Some(damage) = records.err() {
            let kept = self.store.set_aside();
            self.health.store_damaged = true;
            notice(NoticeKind::StoreDamaged { damage, kept });
        }
    }

    pub(super) fn store(
        &mut self,
        request: Storing,
        now: Instant,
        notice: &mut impl FnMut(NoticeKind),
    ) {
        let Some(core) = &mut self.core else { return };
        let mut bytes = vec![0; self.store.capacity()];
        let old = self.store.bytes();
        let made = match request {
            Storing::Save(request) => core.stored(request, old, &mut bytes),
            Storing::Restore(request) => core.restored(request, old, &mut bytes),
        };
        let result = match made {
            Ok(used) => {
                bytes.truncate(used);
                let Some(replaced) = self.replace_stored(bytes, now, notice) else {
                    return;
                };
                replaced.map_err(|error| {
                    notice(NoticeKind::CannotStore(error));
                    Abort::HARDWARE
                })
            }
            Err(_) => Err(Abort::OUT_OF_MEMORY),
        };
        if let Some(line) = &mut self.serial_line {
            line.stored(result.is_ok());
        }
        if let Some(core) = &mut self.core {
            core.store_done(result, now);
        }
    }
}
