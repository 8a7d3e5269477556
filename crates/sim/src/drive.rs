//! A virtual drive: the drive core, a simulated motor, and the time that both take.

mod board;
mod repeating;
mod settings;
mod starting_over;

use can::{BitRate, Frame};
use canopen::{Instant, NodeId, store};
use control::io::Duty;
use control::{Feedback, Real as _};
use drive::{Drive, Health, PwmTiming};
use personalities::Personality;
use personalities::board::Lights;
use personalities::own::AnyOwn;
use plant::{Parameters, Plant};

use crate::axes::Virtual;
use crate::controller::Controller;
use crate::flash_file::FlashFile;
use crate::latency::Latency;
use crate::lss::Station;
use crate::medium::ErrorCounters;
use crate::notice::NoticeKind;
use crate::place::Place;
use crate::power::Processor;
use crate::serial::SerialLine;

use repeating::Repeating;

pub use settings::DriveSettings;

/// The largest values since they were last reset.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    /// Magnitude of the measured q-axis current, A.
    pub current_a: f32,
    /// Magnitude of the following error, counts.
    pub following_error_counts: f32,
}

impl Extremes {
    fn widen(&mut self, feedback: &Feedback<f32>) {
        self.current_a = self.current_a.greatest(feedback.current_q_a.abs());
        self.following_error_counts = self
            .following_error_counts
            .greatest(feedback.following_error.abs());
    }
}

type Core = Drive<Box<[u8]>, AnyOwn, Virtual>;

/// What is written into the flash when its time has passed.
#[derive(Clone, Copy, Debug)]
enum Storing {
    Save(store::Request),
    Restore(store::Request),
}

/// A drive on a simulated bus.
#[derive(Debug)]
pub struct VirtualDrive {
    place: Place,
    node: Option<NodeId>,
    personality: &'static Personality,
    serial: u32,
    /// `None` while it boots, and while it has no node ID.
    pub(crate) core: Option<Core>,
    pub(crate) processor: Processor,
    /// For each axis; there is one at least.
    pub(crate) plants: Vec<Plant<f32>>,
    /// What they were made of.
    made: Vec<Parameters>,
    /// What their loops go on with.
    repeating: Vec<Repeating>,
    pub(crate) controller: Controller,
    pub(crate) station: Station,
    pub(crate) serial_line: Option<SerialLine>,
    /// LSS has changed its bit rate; until [`VirtualDrive::take_changed_rate`].
    pub(crate) changed_rate: Option<BitRate>,
    pub(crate) latency: Latency,
    pub(crate) store: FlashFile,
    pub(crate) health: Health,
    /// When the next received frame is handled.
    pub(crate) service_at: Instant,
    /// No received frame is handled before.
    stalled_until: Instant,
    pub(crate) boots_at: Instant,
    storing: Option<(Storing, Instant)>,
    timing: PwmTiming,
    control_at: Instant,
    /// What `control_at` leaves out: this over the PWM frequency, ns. So no rounding adds up.
    control_rest: u64,
    extremes: Extremes,
    /// What its lights did when they were last told of.
    lights: Lights,
}

impl VirtualDrive {
    pub(crate) fn new(settings: DriveSettings, seed: u64, bit_rate: BitRate) -> VirtualDrive {
        let (place, personality) = (settings.place, settings.personality);
        let mut latency = Latency::new(seed, place);
        let boots_at = Instant::ZERO.plus_ns(latency.boot_ns());
        let frequency_hz = (1.0 / settings.plant.pwm_period_s).round().max(1.0) as u32;
        let serial = (seed as u32)
            .wrapping_mul(1000)
            .wrapping_add(u32::from(place.number()));
        let made = settings.plants();
        let first = personality.axes.first();
        VirtualDrive {
            place,
            node: place.node(),
            personality,
            serial,
            core: None,
            processor: Processor::Alive,
            plants: made.iter().map(Plant::new).collect(),
            repeating: vec![Repeating::default(); made.len()],
            made,
            controller: Controller::new(bit_rate),
            station: Station::new(personality, serial, place.node(), bit_rate),
            serial_line: SerialLine::of(personality),
            changed_rate: None,
            latency,
            store: settings.store,
            health: Health::default(),
            service_at: Instant::NEVER,
            stalled_until: Instant::ZERO,
            boots_at,
            storing: None,
            timing: PwmTiming::at(
                frequency_hz,
                first.map_or(1, |axis| axis.amplifier.pwm_per_control),
            ),
            control_at: Instant::ZERO,
            control_rest: 0,
            extremes: Extremes::default(),
            lights: Lights::WELL,
        }
    }

    /// Which drive of its bus.
    pub fn place(&self) -> Place {
        self.place
    }

    /// Its node ID; `None` if it has none. While it boots, the one of before.
    pub fn node(&self) -> Option<NodeId> {
        self.node
    }

    /// Its bit rate. A drive whose bit rate is not [`crate::Bus::bit_rate`] hears nobody outside, and
    /// is not heard there.
    pub fn bit_rate(&self) -> BitRate {
        self.controller.port.bit_rate()
    }

    /// Its serial number.
    pub fn serial(&self) -> u32 {
        self.serial
    }

    /// Whether it boots: it has been switched on or reset, and hears nothing yet.
    pub fn is_booting(&self) -> bool {
        self.boots_at != Instant::NEVER
    }

    /// Which drive it is.
    pub fn personality(&self) -> &'static Personality {
        self.personality
    }

    /// The physical world of the first axis, to act upon (load, block, supply) and to look at.
    pub fn plant(&mut self) -> &mut Plant<f32> {
        &mut self.plants[0]
    }

    /// The worlds of all axes, to act upon and to look at. They have one supply, that of the first.
    pub fn plants(&mut self) -> &mut [Plant<f32>] {
        &mut self.plants
    }

    /// What the world of the first axis was at the start.
    pub fn made(&self) -> &Parameters {
        &self.made[0]
    }

    /// What the world of each axis was at the start.
    pub fn all_made(&self) -> &[Parameters] {
        &self.made
    }

    /// The physical world of the first axis, to look at.
    pub fn world(&self) -> &Plant<f32> {
        &self.plants[0]
    }

    /// The worlds of all axes, to look at.
    pub fn worlds(&self) -> &[Plant<f32>] {
        &self.plants
    }

    /// The drive core; `None` while it boots, and while it has no node ID.
    pub fn core(&self) -> Option<&Core> {
        self.core.as_ref()
    }

    /// What it has stored.
    pub fn stored(&self) -> &[u8] {
        self.store.bytes()
    }

    /// The largest values since the last call.
    pub fn take_extremes(&mut self) -> Extremes {
        core::mem::take(&mut self.extremes)
    }

    /// Its error counters.
    pub fn error_counters(&self) -> ErrorCounters {
        self.controller.port.protocol.counters
    }

    /// How many received frames it has lost since its power came: its FIFO was full.
    pub fn lost_frames(&self) -> u64 {
        self.controller.lost()
    }

    pub(crate) fn next_control(&self) -> Instant {
        self.control_at
    }

    /// One control boundary: the loops see the sensors, then the world moves one control period.
    pub(crate) fn control(&mut self) {
        self.command();
        self.move_on();
    }

    /// Control boundaries of two drives at one instant.
    pub(crate) fn control_both(&mut self, other: &mut VirtualDrive) {
        self.command();
        other.command();
        let periods = self.timing.periods_per_control;
        match (self.plants.as_mut_slice(), other.plants.as_mut_slice()) {
            ([one], [another]) if periods == other.timing.periods_per_control => {
                one.run_both(another, u32::from(periods));
            }
            _ => {
                self.move_on();
                other.move_on();
            }
        }
    }

    /// The world moves one control period.
    fn move_on(&mut self) {
        let periods = self.timing.periods_per_control;
        match self.plants.as_mut_slice() {
            [plant] => plant.run(u32::from(periods)),
            axes => (0..periods).for_each(|_| Plant::step_axes(axes)),
        }
    }

    /// The loops see the sensors and command the bridge, for the control period that begins.
    fn command(&mut self) {
        // The timer of a processor that hangs goes on with what it has.
        if !matches!(self.processor, Processor::Hung { .. }) {
            let worlds = self.plants.iter_mut().zip(&mut self.repeating);
            for (axis, (plant, repeating)) in worlds.enumerate() {
                let duty = match &mut self.core {
                    Some(core) => repeating.period(core, axis, &plant.sample(), &plant.signals()),
                    // A processor in reset opens the bridge.
                    None => Duty {
                        phase: [0.5; 3],
                        enabled: false,
                    },
                };
                plant.load(&duty);
            }
            if let Some(core) = &self.core {
                for feedback in core.feedbacks() {
                    self.extremes.widen(&feedback);
                }
            }
        }
        let hz = u64::from(self.timing.frequency_hz);
        self.control_rest += u64::from(self.timing.periods_per_control) * 1_000_000_000;
        self.control_at = self.control_at.plus_ns(self.control_rest / hz);
        self.control_rest %= hz;
    }

    /// The timer may have been told something else by a write; it counts from the next boundary on.
    fn adopt_timing(&mut self) {
        let Some(timing) = self.core.as_ref().map(Drive::timing) else {
            return;
        };
        if timing == self.timing {
            return;
        }
        let other_rate = timing.frequency_hz != self.timing.frequency_hz;
        if other_rate {
            self.control_rest = 0;
        }
        for plant in &mut self.plants {
            if other_rate {
                plant.set_pwm_period_s(1.0 / f64::from(timing.frequency_hz));
            }
            plant.set_timer_dead_time_s(f64::from(timing.dead_time_ns) * 1e-9);
            plant.set_late_periods(timing.late_periods);
        }
        self.timing = timing;
    }

    /// A frame has arrived at its controller.
    pub(crate) fn hear(&mut self, frame: Frame, now: Instant) {
        if self.is_lifeless() {
            return;
        }
        let idle = !self.controller.has_received();
        if !self.controller.receive(frame) {
            self.report(Health {
                can_overrun: true,
                ..Health::default()
            });
        } else if idle {
            let at = now.plus_ns(self.latency.service_ns());
            self.service_at = at.max(self.stalled_until);
        }
    }

    /// Holds the processor up: frames that come before `until` wait in the receive FIFO. Frames alone
    /// cannot overrun it: a frame takes at least 47 µs on the wire and at most 12 µs to handle. False,
    /// and nothing is done, if it does not work.
    pub fn stall_until(&mut self, until: Instant) -> bool {
        if self.why_idle().is_some() {
            return false;
        }
        self.stalled_until = self.stalled_until.max(until);
        if self.service_at != Instant::NEVER {
            self.service_at = self.service_at.max(until);
        }
        true
    }

    fn report(&mut self, event: Health) {
        if let Some(core) = &mut self.core {
            core.report(event);
        }
    }

    /// When [`VirtualDrive::poll`] must be called next.
    pub(crate) fn next_poll(&self) -> Instant {
        let mut next = self.next_power();
        if self.is_bus_off() {
            next = next.min(self.recovers_at());
        }
        if self.is_lifeless() {
            return next;
        }
        next = next
            .min(self.service_at)
            .min(self.boots_at)
            .min(self.store.next_work())
            .min(self.station.next_deadline());
        if let Some(line) = &self.serial_line {
            next = next.min(line.next_deadline());
        }
        if let Some(core) = &self.core {
            next = next.min(core.next_deadline());
        }
        if let Some((_, at)) = self.storing {
            next = next.min(at);
        }
        next
    }

    /// Does what time asks for, and fills free mailboxes. What people should know of goes to
    /// `notice`.
    pub(crate) fn poll(&mut self, now: Instant, notice: &mut impl FnMut(NoticeKind)) {
        // The control half may be told something.
        self.repeating.iter_mut().for_each(Repeating::stop);
        self.follow_power(now);
        // A controller comes back by itself, also while the processor hangs.
        let is_on = self.processor != Processor::Off;
        if is_on && self.is_bus_off() && now >= self.recovers_at() {
            let bit_ns = self.bit_rate().bit_ns();
            if self.controller.port.protocol.rest(now, bit_ns) {
                self.recovered();
                notice(NoticeKind::BusOn);
            }
        }
        if self.is_lifeless() {
            self.switch_controller(now);
            return;
        }
        if now >= self.boots_at {
            self.boots_at = Instant::NEVER;
            self.boot(now, notice);
        }
        // The core judges what it was told since its last tick.
        if self.controller.port.protocol.counters.is_passive() {
            self.became_passive();
        }
        if now >= self.service_at {
            if let Some(frame) = self.controller.next_received()
                && !self.takes_lss(&frame, now)
                && let Some(core) = &mut self.core
            {
                core.receive(&frame, now, self.store.at(now));
            }
            self.service_at = if self.controller.has_received() {
                now.plus_ns(self.latency.next_ns())
            } else {
                Instant::NEVER
            };
        }
        if self
            .core
            .as_ref()
            .is_some_and(|core| now >= core.next_deadline())
        {
            self.look_at_board();
            if let Some(core) = &mut self.core {
                core.poll(now, self.store.at(now));
            }
            self.watch_lights(notice);
        }
        self.store.work(now);
        if let Some((request, at)) = self.storing
            && now >= at
        {
            self.storing = None;
            self.store(request, now, notice);
        }
        self.poll_lss(now, notice);
        self.poll_serial(now);
        self.obey(now);
        self.adopt_timing();
        self.switch_controller(now);
        self.fill_mailboxes();
    }

    fn is_bus_off(&self) -> bool {
        self.controller.port.protocol.counters.is_bus_off()
    }

    /// When it comes back from bus-off, if the wire stays quiet.
    fn recovers_at(&self) -> Instant {
        let bit_ns = self.bit_rate().bit_ns();
        self.controller.port.protocol.rests_until(bit_ns)
    }

    /// It has come back from bus-off.
    pub(crate) fn recovered(&mut self) {
        self.report(Health {
            bus_off_recovered: true,
            ..Health::default()
        });
    }

    /// Its controller is error passive.
    pub(crate) fn became_passive(&mut self) {
        self.report(Health {
            error_passive: true,
            ..Health::default()
        });
    }

    /// A controller is on while there is a program behind it.
    fn switch_controller(&mut self, now: Instant) {
        let is_on = self.core.is_some() || self.station.is_on();
        let port = &mut self.controller.port;
        if is_on && !port.protocol.is_on() {
            port.protocol.start(now);
        } else if !is_on && port.protocol.is_on() {
            port.stop();
        }
    }

    /// The bit rate that LSS has given it since the last call.
    pub(crate) fn take_changed_rate(&mut self) -> Option<BitRate> {
        self.changed_rate.take()
    }

    /// Moves frames from the node to free mailboxes.
    pub(crate) fn fill_mailboxes(&mut self) {
        if self.is_bus_off() || self.station.is_silent() || self.is_lifeless() {
            return;
        }
        while self.controller.has_free_mailbox() {
            match self.station.next_answer() {
                Some(answer) => self.controller.post(answer),
                None => break,
            }
        }
        let Some(core) = &mut self.core else { return };
        while self.controller.has_free_mailbox() {
            match core.transmit(&mut self.store) {
                Some(frame) => self.controller.post(frame),
                None => break,
            }
        }
        // It may have acknowledged another one.
        let id = core.comms().node().id();
        if self.node != Some(id) {
            self.station.rename(id);
            self.node = Some(id);
        }
    }
}
