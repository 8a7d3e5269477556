//! What only this drive does: system commands, status words, the watchdog of its bus, shorted phases
//! while it does not drive, and calibration.

mod bridge;
mod calibration;
mod closing;
mod correction;
mod direction;
mod electrical;
mod fields;
mod output;
mod turning;
mod watch;

use can::Frame;
use canopen::{Abort, Address, Image, NodeId, Reset, Verdict, store};
use cia402::{Configuration, Demand, Mode, State, Targets};

use self::calibration::{Calibration, Progress};
use self::closing::Closing;
use self::correction::Table;
use self::direction::Direction;
use self::fields::Fields;
use self::output::OutputEncoder;
use self::watch::{Start, Watch, one};
use super::axis::SERVICE;
use super::settings::REAL_RANGES;
use super::status;
use crate::Personality;
use crate::board::{Board, Light, Lights};
use crate::own::{AxisView, Orders, OwnBehaviour};

const FIELDS: Fields = Fields::of(&super::OBJECTS_CONST);

/// Ticks from an acknowledge to the reset that follows it, so that the acknowledge is on its way.
const RESET_TICKS: u8 = 20;
/// Ticks of a start, in which the zeros of the current converters are measured, with the bridge open.
const START_TICKS: u16 = 20;

/// Ticks for which the lights blink (0x2003,1), and how often a second; ours.
const BLINK_TICKS: u16 = 2000;
const BLINKS_PER_S: u8 = 10;

/// What a reset is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Restart {
    No,
    In(u8),
    Now,
}

/// The MD80's own behaviour.
#[derive(Clone, Debug)]
pub struct Behaviour {
    watch: Watch,
    output: OutputEncoder,
    direction: Direction,
    closing: Closing,
    /// By how much the main encoder is off.
    table: Table,
    /// What calibrates, if something does.
    job: Option<Calibration>,
    /// What is stored is that job's.
    job_stores: bool,
    demand: Option<Demand>,
    /// Ticks since the start.
    ticks: u16,
    /// The actual position is to be 0, with this reading of the encoder.
    zero: Option<i32>,
    /// The controlword's bit 7 as last written.
    reset_bit: bool,
    restart: Restart,
    /// Ticks for which both lights blink.
    blinks: u16,
}

impl Behaviour {
    fn command(
        &mut self,
        image: &Image<'_>,
        sub: u8,
        view: &AxisView,
        orders: &mut Orders,
    ) -> Verdict {
        // M4: the page wants "switch on disabled", the maker's own tool "operation enabled".
        let may = matches!(
            view.state,
            State::SwitchOnDisabled | State::OperationEnabled
        ) && view.mode == SERVICE;
        if !may || self.job.is_some() {
            return Verdict::Refuse(Abort::DEVICE_STATE);
        }
        match sub {
            1 => self.blinks = BLINK_TICKS,
            2 => self.restart = Restart::In(RESET_TICKS),
            3 => self.begin(Calibration::full()),
            4 if output::is_calibratable(image) => self.begin(Calibration::output()),
            4 => return Verdict::Refuse(Abort::DEVICE_STATE),
            5 => {
                orders.preset_position = Some(0);
                self.zero = Some(view.encoder);
            }
            6 => self.begin(Calibration::electrical()),
            _ => return Verdict::Refuse(Abort::NO_SUB_INDEX),
        }
        Verdict::Done
    }

    fn begin(&mut self, job: Calibration) {
        // The errors of the last one are over.
        self.watch.forget_calibration();
        self.job = Some(job);
    }

    /// A millisecond of the calibration.
    fn work(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        let Some(job) = &mut self.job else { return };
        let stopped = view.mode != SERVICE
            || view.has_fault
            || !matches!(
                view.state,
                State::SwitchOnDisabled | State::OperationEnabled
            );
        let progress = match stopped {
            true => Progress::Failed(job.stopped()),
            false => job.tick(image, view, self.output.turns()),
        };
        match progress {
            Progress::Demands(demand) => self.demand = Some(demand),
            Progress::Failed(bits) => {
                self.watch.raise(bits);
                self.job = None;
                self.demand = None;
            }
            Progress::Done { keeps } => {
                self.job = None;
                self.demand = None;
                orders.new_parameters = true;
                if keeps {
                    self.job_stores = true;
                    orders.store = Some(store::Request::Application);
                }
            }
        }
        orders.new_demand = true;
    }

    /// While it does not drive, the phases are shorted to ground (X11); not in a fault, and not before
    /// the converters' zeros are known.
    fn brake(&mut self, view: &AxisView, orders: &mut Orders) {
        let rests = match view.state {
            State::OperationEnabled => matches!(view.mode, Mode::IDLE | SERVICE),
            State::QuickStopActive | State::FaultReactionActive | State::Fault => false,
            _ => true,
        };
        let shorted = rests && self.ticks >= START_TICKS && !view.has_fault;
        let demand = shorted.then_some(Demand::Shorted);
        if demand != self.demand {
            self.demand = demand;
            orders.new_demand = true;
        }
    }

    /// Whether both encoders count the way that their calibrations have found.
    fn watch_directions(&mut self, image: &Image<'_>, view: &AxisView) {
        let calibrated = image.number(FIELDS.is_calibrated) != 0;
        let shorted = self.demand == Some(Demand::Shorted);
        if calibrated && self.job.is_none() && (shorted || watch::moves(view)) {
            if self.direction.tick(image, view, shorted) {
                self.watch.raise(one(1, 1));
            }
        } else {
            self.direction = Direction::default();
        }
        let looks = self.job.is_none() && !self.watch.is_turned();
        if self.output.is_turned(image, view, looks) {
            self.watch.raise(one(2, 1));
        }
    }

    fn start(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        if self.ticks == 0 {
            let zero = image.number(FIELDS.zero) as i32;
            let from_zero = view.encoder.wrapping_sub(zero);
            orders.preset_position = Some(
                self.output
                    .start_position(image, view)
                    .unwrap_or(within_half_turn(from_zero, view.counts_per_turn)),
            );
        }
        self.ticks = self.ticks.saturating_add(1);
        if self.ticks == START_TICKS {
            let [a, b] = view.phase_adc;
            image.set_raw(FIELDS.current_zero_a, a.to_bits());
            image.set_raw(FIELDS.current_zero_b, b.to_bits());
            orders.new_parameters = true;
        }
    }
}

/// A difference within a turn, half a turn on either side.
fn within_half_turn(difference: i32, counts_per_turn: u32) -> i32 {
    let turn = counts_per_turn.max(1) as i32;
    let within = difference.rem_euclid(turn);
    if within >= turn / 2 {
        within - turn
    } else {
        within
    }
}

/// A REAL32 that keeps to its range.
fn real_in_range(object: Address, new: &[u8]) -> Option<Verdict> {
    let range = REAL_RANGES.iter().find(|range| range.object == object)?;
    let bytes = new.first_chunk()?;
    let value = f32::from_le_bytes(*bytes);
    Some(if value.is_nan() {
        Verdict::Refuse(Abort::INVALID_VALUE)
    } else if value > range.greatest {
        Verdict::Refuse(Abort::VALUE_TOO_HIGH)
    } else if value < range.least {
        Verdict::Refuse(Abort::VALUE_TOO_LOW)
    } else {
        Verdict::Accept
    })
}

impl OwnBehaviour for Behaviour {
    fn new(_: &'static Personality, image: &Image<'_>) -> Behaviour {
        Behaviour {
            watch: Watch::new(),
            output: OutputEncoder::new(image),
            direction: Direction::default(),
            closing: Closing::default(),
            table: Table::stored(image, &FIELDS.correction),
            job: None,
            job_stores: false,
            demand: None,
            ticks: 0,
            zero: None,
            reset_bit: false,
            restart: Restart::No,
            blinks: 0,
        }
    }

    fn heard(&mut self, frame: &Frame, id: NodeId) {
        let key = frame.key();
        let node = u32::from(id.get());
        let is_ours = match key {
            0 | 0x80 => true,
            0x200..=0x67F => key & 0x7F == node,
            _ => false,
        };
        if is_ours {
            self.watch.fed();
        }
    }

    fn write(
        &mut self,
        image: &Image<'_>,
        object: Address,
        new: &[u8],
        view: &AxisView,
        orders: &mut Orders,
    ) -> Option<Verdict> {
        let low = new.first().copied().unwrap_or(0);
        match (object.index, object.sub) {
            (0x6040, 0) => {
                let bit = low & 0x80 != 0;
                if bit && !self.reset_bit {
                    self.watch.reset();
                }
                self.reset_bit = bit;
                None
            }
            // M3: the guide and the maker's tool write −2, and read back −2 here and −1 in 0x6061.
            (0x6060, 0) if low as i8 == -2 => {
                orders.mode = Some(-1);
                Some(Verdict::Accept)
            }
            // The maker's tool writes the shutdown command into this object before it saves.
            (0x6060, 0) if low == 6 => Some(Verdict::Accept),
            // M20.
            (0x1010, 1) if view.state != State::SwitchOnDisabled || self.job.is_some() => {
                Some(Verdict::Refuse(Abort::DEVICE_STATE))
            }
            (0x2003, sub) if low != 0 => Some(self.command(image, sub, view, orders)),
            (0x2003, _) => Some(Verdict::Done),
            // M16.
            (status::STATUS, _) if new.iter().all(|byte| *byte == 0) => Some(Verdict::Done),
            (status::STATUS, _) => Some(Verdict::Refuse(Abort::INVALID_VALUE)),
            _ => real_in_range(object, new),
        }
    }

    fn tick(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        let start = if self.ticks < START_TICKS {
            self.start(image, view, orders);
            match self.ticks {
                START_TICKS => Start::Ends,
                _ => Start::Begun,
            }
        } else {
            Start::Over
        };
        if let Some(reading) = self.zero.take() {
            image.set_number(FIELDS.zero, i64::from(reading));
            self.output.set_zero(image);
            self.closing.set_zero();
        }
        let calibrating = self.job.as_ref().is_some_and(Calibration::is_of_output);
        self.output.tick(image, view, calibrating);
        let rests = self.job.is_some() || start != Start::Over;
        self.closing.tick(image, view, &self.output, rests, orders);
        let offset = self.closing.offset();
        self.watch.tick(image, view, &self.output, offset, start);
        self.watch_directions(image, view);
        self.blinks = self.blinks.saturating_sub(1);
        if self.watch.take_silence() {
            // The quick stop's ramp, and from there "switch on disabled".
            orders.controlword = Some(0x0002);
        }
        match self.job {
            Some(_) => self.work(image, view, orders),
            None => self.brake(view, orders),
        }
        self.restart = match self.restart {
            Restart::In(0) => Restart::Now,
            Restart::In(ticks) => Restart::In(ticks - 1),
            other => other,
        };
    }

    fn publish(&self, image: &mut Image<'_>, view: &AxisView) {
        self.watch.publish(image, view);
        self.output.publish(image);
        self.closing.publish(image, view, &self.output);
        image.set_raw(FIELDS.motor_temperature, view.motor_temperature_c.to_bits());
        let amplifier = view.amplifier_temperature_c;
        image.set_raw(FIELDS.mosfet_temperature, amplifier.to_bits());
    }

    #[inline]
    fn reading(&self, _: u8, raw: i32) -> i32 {
        match &self.job {
            Some(job) if job.is_of_main_encoder() => raw,
            _ => self.table.right(raw),
        }
    }

    fn look_at(&mut self, _: u8, board: &Board) {
        self.watch.look_at(board);
    }

    /// The maker's guide: a green light that blinks once a second, and beside it a red one if there is an
    /// error.
    fn lights(&self) -> Option<Lights> {
        if self.blinks > 0 {
            let blinks = Light::Blinks {
                per_s: BLINKS_PER_S,
            };
            return Some(Lights {
                green: blinks,
                red: blinks,
            });
        }
        let red = match self.watch.has_error() {
            true => Light::On,
            false => Light::Off,
        };
        Some(Lights {
            red,
            ..Lights::WELL
        })
    }

    fn targets(&self, _: u8, _: &Image<'_>, targets: &mut Targets) {
        self.closing.targets(targets);
    }

    fn configuration(&self, _: u8, _: &Image<'_>, configuration: &mut Configuration) {
        self.closing.configuration(configuration);
    }

    fn demand(&self, _: u8) -> Option<&Demand> {
        self.demand.as_ref()
    }

    fn current_limit_a(&self, _: u8) -> Option<f32> {
        self.job.as_ref().map(Calibration::current_limit_a)
    }

    fn store_done(&mut self, stored: bool) {
        let was_job = core::mem::take(&mut self.job_stores);
        if stored {
            // M20: save and calibration end in a reset.
            self.restart = Restart::In(RESET_TICKS);
        } else if was_job {
            self.watch.raise(calibration::FAILED);
        }
    }

    fn take_reset(&mut self) -> Option<Reset> {
        if self.restart == Restart::Now {
            self.restart = Restart::No;
            return Some(Reset::Node);
        }
        None
    }

    fn causes(&self) -> u32 {
        self.watch.causes()
    }
}
