//! A transmit PDO.

use crate::outbox::Slot;
use crate::pdo::Mapping;
use crate::{Dialect, Image, Instant, Node, NodeMemory, Owner};

/// One transmit PDO: its parameters and its last sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tpdo {
    /// Sent with every nth SYNC; 0: with none.
    every: u8,
    /// SYNCs still to come until then.
    left: u8,
    /// The SYNC counter it waits for; 0: none.
    starts_at: u8,
    pub(crate) kind: Kind,
    pub(crate) parameters: TpdoParameters,
    /// `data` are what was last sent, and no news any more.
    pub(crate) is_known: bool,
    /// An event waits for its SYNC or for the end of the inhibit time.
    pub(crate) has_event: bool,
    pub(crate) data: u64,
    /// The inhibit time lasts until then.
    pub(crate) free_at: Instant,
    /// When the event timer elapses.
    pub(crate) timer_due: Instant,
    pub(crate) mapping: Mapping,
}

/// What makes a transmit PDO be sent (CiA 301 table 72).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Nothing: it is off or empty, or its type has no effect on this device.
    Off,
    /// 1 to 240: SYNC.
    Cyclic,
    /// 0: the SYNC after an event.
    Acyclic,
    /// 252: sampled with SYNC, sent on request.
    SyncRequest,
    /// 253: sent on request.
    Request,
    /// 254 and 255: an event, the event timer, or a request.
    Event,
    /// 254 where its maker says so: the event timer or a request.
    Timer,
}

/// What 0x1800 says beside the identifier.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TpdoParameters {
    pub(crate) transmission_type: u8,
    /// Shortest time from one frame to the next, 100 µs.
    pub(crate) inhibit: u16,
    /// Longest time from one frame to the next; 0: any.
    pub(crate) event_timer_ms: u16,
    /// The SYNC counter it begins with; 0: any.
    pub(crate) sync_start: u8,
    /// Bit 30 of the COB-ID is clear: it may be requested.
    pub(crate) on_request: bool,
}

impl Tpdo {
    pub(crate) const OFF: Tpdo = Tpdo {
        every: 0,
        left: 0,
        starts_at: 0,
        kind: Kind::Off,
        parameters: TpdoParameters {
            transmission_type: 255,
            inhibit: 0,
            event_timer_ms: 0,
            sync_start: 0,
            on_request: false,
        },
        is_known: false,
        has_event: false,
        data: 0,
        free_at: Instant::ZERO,
        timer_due: Instant::NEVER,
        mapping: Mapping::EMPTY,
    };

    /// A PDO that has sent nothing yet and counts no SYNCs. `exists`: its COB-ID is valid.
    pub(crate) fn new(
        exists: bool,
        parameters: TpdoParameters,
        mapping: Mapping,
        dialect: &Dialect,
    ) -> Tpdo {
        let kind = match parameters.transmission_type {
            _ if !exists || mapping.bytes() == 0 => Kind::Off,
            0 if dialect.tpdo_type_0_is_cyclic => Kind::Cyclic,
            1..=240 => Kind::Cyclic,
            _ if !dialect.pdo_events => Kind::Off,
            0 => Kind::Acyclic,
            252 => Kind::SyncRequest,
            253 => Kind::Request,
            254 if dialect.type_254_by_timer => Kind::Timer,
            254 | 255 => Kind::Event,
            _ => Kind::Off,
        };
        Tpdo {
            kind,
            parameters,
            mapping,
            ..Tpdo::OFF
        }
    }

    /// Whether events have something to do with it.
    pub(crate) fn is_sent_by_events(&self) -> bool {
        matches!(self.kind, Kind::Event | Kind::Acyclic | Kind::Timer)
    }

    fn period(&self) -> u8 {
        match self.kind {
            Kind::Cyclic => self.parameters.transmission_type.max(1),
            _ => 0,
        }
    }

    /// Counts a SYNC; whether this PDO is to be sent with it.
    #[inline]
    pub(crate) fn sync(&mut self) -> bool {
        if self.left > 1 {
            self.left -= 1;
            return false;
        }
        self.left = self.every;
        self.every != 0
    }

    /// The counter of the SYNC that is about to be counted: a PDO may begin with it (CiA 301
    /// 7.5.2.37, SYNC start value).
    pub(crate) fn sync_counter(&mut self, counter: u8) {
        if self.starts_at != 0 && self.starts_at == counter {
            self.starts_at = 0;
            self.every = self.period();
            self.left = self.every;
        }
    }

    /// Starts counting SYNCs anew; with a counter in them, from the one with the start value.
    pub(crate) fn count_anew(&mut self, with_counter: bool) {
        let waits = with_counter && self.kind == Kind::Cyclic && self.parameters.sync_start != 0;
        (self.starts_at, self.every) = match waits {
            true => (self.parameters.sync_start, 0),
            false => (0, self.period()),
        };
        self.left = self.every;
    }

    /// Forgets what was sent.
    pub(crate) fn forget(&mut self) {
        self.is_known = false;
        self.has_event = false;
        self.timer_due = Instant::NEVER;
    }
}

impl<M: NodeMemory> Node<M> {
    /// The transmit PDOs that a SYNC makes due: sampled, and to be sent.
    #[inline]
    pub(crate) fn sample_with_sync<O: Owner>(&mut self, owner: &mut O) {
        let mut published = false;
        let mut rare = 0u8;
        for (n, tpdo) in self.tpdo.iter_mut().enumerate() {
            if !tpdo.sync() {
                if matches!(tpdo.kind, Kind::Acyclic | Kind::SyncRequest) {
                    rare |= 1 << n;
                }
                continue;
            }
            if tpdo.mapping.is_live() && !published {
                owner.publish(&mut Image::new(self.memory.as_mut()));
                published = true;
            }
            if tpdo.mapping.is_walked() {
                rare |= 1 << n;
                continue;
            }
            tpdo.data = tpdo.mapping.sample(self.memory.as_ref());
            self.outbox.post(Slot::Tpdo(n as u8));
        }
        if rare != 0 {
            self.sample_rare(rare, published, owner);
        }
    }

    /// What few PDOs are at a SYNC: sent after an event, sampled for a later request, or walked.
    #[cold]
    fn sample_rare<O: Owner>(&mut self, rare: u8, mut published: bool, owner: &mut O) {
        for n in 0..crate::PDOS {
            let Some(tpdo) = self.tpdo.get_mut(n) else {
                return;
            };
            if rare & 1 << n == 0 || (tpdo.kind == Kind::Acyclic && !tpdo.has_event) {
                continue;
            }
            tpdo.has_event = false;
            if tpdo.mapping.is_live() && !published {
                owner.publish(&mut Image::new(self.memory.as_mut()));
                published = true;
            }
            let data = self.sample_of(n);
            let Some(tpdo) = self.tpdo.get_mut(n) else {
                return;
            };
            tpdo.data = data;
            tpdo.is_known = true;
            // A requested one is sent when it is asked for.
            if tpdo.kind != Kind::SyncRequest {
                self.outbox.post(Slot::Tpdo(n as u8));
            }
        }
    }
}
