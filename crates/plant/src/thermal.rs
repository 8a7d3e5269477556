//! The heat of motor and amplifier.

use control::Real;

use crate::exponential::decayed_fraction;
use crate::stops::root;
use crate::{Invalid, Motor};

/// How motor and amplifier warm up and cool down; see [`crate::Parameters::thermal`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermal {
    /// The motor.
    pub motor: MotorThermal,
    /// The amplifier.
    pub amplifier: AmplifierThermal,
}

/// The motor as two bodies: the winding heats the housing, and the housing the air.
///
/// The copper loss heats the winding, 1.5 · resistance · current², and the friction of the motor the
/// housing. The housing's temperature stands for the magnet's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorThermal {
    /// Thermal resistance from winding to housing, K/W.
    pub winding_k_per_w: f64,
    /// Thermal resistance from housing to ambient, K/W.
    pub housing_k_per_w: f64,
    /// Time constant of the winding against a housing that stays as it is, s: its heat capacity
    /// times `winding_k_per_w`.
    pub winding_time_constant_s: f64,
    /// Time constant of the housing, s: its heat capacity times `housing_k_per_w`.
    pub housing_time_constant_s: f64,
    /// Temperature at which resistance and flux are those of [`Motor`], °C.
    pub reference_c: f64,
    /// Part by which the resistance of the winding grows, 1/K; copper 0.00393.
    pub resistance_per_k: f64,
    /// Part by which the flux of the magnet grows, 1/K; neodymium about -0.0011, ferrite -0.002.
    pub flux_per_k: f64,
}

/// The amplifier as one body: switches, board and what carries them off.
///
/// It is heated by the switches' and diodes' resistance ([`crate::Bridge::switch_ohm`]), the forward
/// voltage of diodes that conduct, during dead times too, by each switching, and by what it needs
/// anyway.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmplifierThermal {
    /// Thermal resistance to ambient, K/W.
    pub k_per_w: f64,
    /// Time constant, s: its heat capacity times `k_per_w`.
    pub time_constant_s: f64,
    /// Power that it takes from the logic supply, W.
    pub idle_w: f64,
    /// For how long, per PWM period, a switch carries current and voltage at once, s: rise and fall
    /// together.
    pub switching_s: f64,
}

impl Thermal {
    pub(crate) fn check(&self) -> Result<(), Invalid> {
        let (motor, amplifier) = (&self.motor, &self.amplifier);
        for value in [
            motor.winding_k_per_w,
            motor.housing_k_per_w,
            motor.winding_time_constant_s,
            motor.housing_time_constant_s,
            amplifier.k_per_w,
            amplifier.time_constant_s,
        ] {
            if !(1e-6..=1e9).contains(&value) {
                return Err(Invalid::Thermal(value));
            }
        }
        for (value, most) in [(amplifier.idle_w, 1e3), (amplifier.switching_s, 1e-6)] {
            if !(0.0..=most).contains(&value) {
                return Err(Invalid::Thermal(value));
            }
        }
        for (value, most) in [
            (motor.reference_c, 1e3),
            (motor.resistance_per_k, 0.1),
            (motor.flux_per_k, 0.1),
        ] {
            if !(-most..=most).contains(&value) {
                return Err(Invalid::Thermal(value));
            }
        }
        Ok(())
    }
}

/// The least time of a step, s. Shorter ones would cost more and lose what they add in rounding.
const STEP_S: f64 = 1e-3;

/// A temperature, °C, and what its last bit could not hold (Kahan): an hour's warming is a sum of
/// millions of steps far below that bit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Temperature<R: Real> {
    celsius: R,
    rest: R,
}

impl<R: Real> Temperature<R> {
    fn new(celsius: R) -> Self {
        Self {
            celsius,
            rest: R::splat(0.0),
        }
    }

    fn set(&mut self, celsius: R) {
        let defined = celsius.le(celsius);
        self.celsius = R::select(defined, held(celsius), self.celsius);
        self.rest = R::select(defined, R::splat(0.0), self.rest);
    }

    fn add(&mut self, change: R) {
        let change = change + self.rest;
        let sum = held(self.celsius + change);
        self.rest = (change - (sum - self.celsius)).within(R::splat(1.0));
        self.celsius = sum;
    }
}

/// From absolute zero to where everything has burnt.
fn held<R: Real>(celsius: R) -> R {
    celsius
        .greatest(R::splat(-273.15))
        .least(R::splat(10_000.0))
}

/// What heats, summed over the looks of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sums<R: Real> {
    /// Current squared, A².
    current_square: R,
    /// What switches and diodes turn into heat, W.
    bridge_w: R,
    /// Magnitude of the speed, rad/s, and its square.
    speed: R,
    speed_square: R,
}

/// When the losses are looked at: once in so many PWM periods of so many seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Periods {
    pub(crate) per_look: u8,
    pub(crate) period_s: f64,
}

/// What the step needs, for periods of one length.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Coefficients<R: Real> {
    /// Looks of a step, and one over them.
    looks: u32,
    share: R,
    /// What a step takes of the deviation from the steady state: winding and housing of each.
    winding: [R; 2],
    housing: [R; 2],
    amplifier: R,
    winding_k_per_w: R,
    housing_k_per_w: R,
    amplifier_k_per_w: R,
    /// 1.5 · resistance at the reference, W/A²; and of the switches.
    copper: R,
    switches: R,
    coulomb: R,
    viscous: R,
    idle_w: R,
    reference_c: R,
    resistance_per_k: R,
    flux_per_k: R,
    /// Part of the PWM period in which voltage and current meet in a switch.
    switching_part: R,
}

impl<R: Real> Coefficients<R> {
    fn new(thermal: &Thermal, motor: &Motor, switch_ohm: f64, periods: Periods) -> Self {
        let figures = &thermal.motor;
        let look_s = f64::from(periods.per_look) * periods.period_s;
        let looks = (STEP_S / look_s) as u32;
        let looks = if f64::from(looks) * look_s < STEP_S {
            looks + 1
        } else {
            looks
        };
        let step = f64::from(looks) * look_s;
        // Deviations x from the steady state: x' = A x with A = [[-a, a], [b, -b - c]]. Its
        // eigenvalues -r, -s are real; e^(A h) - 1 = Σ (e^(-r h) - 1) (A + s)/(s - r) + …
        let a = 1.0 / figures.winding_time_constant_s;
        let c = 1.0 / figures.housing_time_constant_s;
        let b = c * figures.housing_k_per_w / figures.winding_k_per_w;
        let sum = a + b + c;
        let difference = root((a - c) * (a - c) + b * b + 2.0 * b * (a + c));
        let fast = 0.5 * (sum + difference);
        let slow = a * c / fast;
        let (decay_slow, decay_fast) =
            (decayed_fraction(slow * step), decayed_fraction(fast * step));
        // Row by row: the part of the slow mode, and of the fast one.
        let mix = |entry: f64, diagonal: f64| {
            let of_slow = (entry + fast * diagonal) / (fast - slow);
            let of_fast = (entry + slow * diagonal) / (slow - fast);
            R::splat((-decay_slow * of_slow - decay_fast * of_fast) as f32)
        };
        let real = |value: f64| R::splat(value as f32);
        Self {
            looks,
            share: real(1.0 / f64::from(looks)),
            winding: [mix(-a, 1.0), mix(a, 0.0)],
            housing: [mix(b, 0.0), mix(-b - c, 1.0)],
            amplifier: real(-decayed_fraction(step / thermal.amplifier.time_constant_s)),
            winding_k_per_w: real(figures.winding_k_per_w),
            housing_k_per_w: real(figures.housing_k_per_w),
            amplifier_k_per_w: real(thermal.amplifier.k_per_w),
            copper: real(1.5 * motor.phase_resistance_ohm),
            switches: real(1.5 * switch_ohm),
            coulomb: real(motor.coulomb_friction_nm),
            viscous: real(motor.viscous_friction_nms),
            idle_w: real(thermal.amplifier.idle_w),
            reference_c: real(figures.reference_c),
            resistance_per_k: real(figures.resistance_per_k),
            flux_per_k: real(figures.flux_per_k),
            switching_part: real(thermal.amplifier.switching_s / periods.period_s),
        }
    }
}

/// The heat at work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Heat<R: Real> {
    /// `None`: temperatures stay as they are set.
    coefficients: Option<Coefficients<R>>,
    ambient: R,
    winding: Temperature<R>,
    housing: Temperature<R>,
    amplifier: Temperature<R>,
    sums: Sums<R>,
    looks: u32,
}

impl<R: Real> Sums<R> {
    fn none() -> Self {
        let zero = R::splat(0.0);
        Self {
            current_square: zero,
            bridge_w: zero,
            speed: zero,
            speed_square: zero,
        }
    }
}

impl<R: Real> Heat<R> {
    /// Everything at the ambient temperature, °C.
    pub(crate) fn new(ambient_c: R) -> Self {
        Self {
            coefficients: None,
            ambient: held(ambient_c),
            winding: Temperature::new(held(ambient_c)),
            housing: Temperature::new(held(ambient_c)),
            amplifier: Temperature::new(held(ambient_c)),
            sums: Sums::none(),
            looks: 0,
        }
    }

    /// Sets how it flows; `None`: it does not. A step that has begun ends
    /// unfinished.
    pub(crate) fn set_figures(
        &mut self,
        thermal: Option<&Thermal>,
        motor: &Motor,
        switch_ohm: f64,
        periods: Periods,
    ) {
        let coefficients = |thermal| Coefficients::new(thermal, motor, switch_ohm, periods);
        self.coefficients = thermal.map(coefficients);
        self.sums = Sums::none();
        self.looks = 0;
    }

    pub(crate) fn is_off(&self) -> bool {
        self.coefficients.is_none()
    }

    pub(crate) fn set_ambient(&mut self, celsius: R) {
        let defined = R::select(celsius.le(celsius), celsius, self.ambient);
        self.ambient = held(defined);
    }

    pub(crate) fn set_motor(&mut self, celsius: R) {
        self.winding.set(celsius);
        self.housing.set(celsius);
    }

    pub(crate) fn set_amplifier(&mut self, celsius: R) {
        self.amplifier.set(celsius);
    }

    pub(crate) fn winding(&self) -> R {
        self.winding.celsius
    }

    pub(crate) fn housing(&self) -> R {
        self.housing.celsius
    }

    pub(crate) fn amplifier(&self) -> R {
        self.amplifier.celsius
    }

    /// Part of the reference's resistance and flux that winding and magnet have now.
    pub(crate) fn factors(&self) -> (R, R) {
        let one = R::splat(1.0);
        let Some(c) = &self.coefficients else {
            return (one, one);
        };
        let least = R::splat(0.05);
        let factor =
            |celsius: R, per_k: R| (one + per_k * (celsius - c.reference_c)).greatest(least);
        (
            factor(self.winding.celsius, c.resistance_per_k),
            factor(self.housing.celsius, c.flux_per_k),
        )
    }

    /// Part of the PWM period in which voltage and current meet in a switch.
    #[inline(always)]
    pub(crate) fn switching_part(&self) -> R {
        let part = |c: &Coefficients<R>| c.switching_part;
        self.coefficients.as_ref().map_or(R::splat(0.0), part)
    }

    /// Counts what a period heats that stands for those since the last look: the current's square, A², what switching and diodes lose, W,
    /// and the speed, rad/s. Returns whether a step has ended and temperatures have changed.
    #[inline(always)]
    pub(crate) fn look(&mut self, current_square: R, bridge_w: R, speed: R) -> bool {
        let sums = &mut self.sums;
        sums.current_square += current_square;
        sums.bridge_w += bridge_w;
        sums.speed += speed.abs();
        sums.speed_square += speed * speed;
        self.looks += 1;
        let due = |c: &Coefficients<R>| self.looks >= c.looks;
        if !self.coefficients.as_ref().is_some_and(due) {
            return false;
        }
        self.step();
        true
    }

    /// One step of all temperatures, exactly, for the mean powers of its looks.
    #[inline(never)]
    fn step(&mut self) {
        let Some(c) = self.coefficients else { return };
        let (resistance, _) = self.factors();
        let square = self.sums.current_square * c.share;
        let copper = square * c.copper * resistance;
        let friction = (self.sums.speed * c.coulomb + self.sums.speed_square * c.viscous) * c.share;
        let bridge = c.idle_w + square * c.switches + self.sums.bridge_w * c.share;
        self.sums = Sums::none();
        self.looks = 0;

        let housing_rise = (copper + friction) * c.housing_k_per_w;
        let winding_rise = housing_rise + copper * c.winding_k_per_w;
        let deviation = |t: &Temperature<R>, rise: R| (t.celsius - self.ambient - rise) + t.rest;
        let winding = deviation(&self.winding, winding_rise);
        let housing = deviation(&self.housing, housing_rise);
        let amplifier = deviation(&self.amplifier, bridge * c.amplifier_k_per_w);
        let of = |[w, h]: [R; 2]| w * winding + h * housing;
        self.winding.add(of(c.winding));
        self.housing.add(of(c.housing));
        self.amplifier.add(c.amplifier * amplifier);
    }
}
