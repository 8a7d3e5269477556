//! Every parameter of a drive's world: one row each, from which files are read and documents made.

use plant::{Coupling, OutputEncoder, Parameters, Pendulum, Stops, Switch, Thermal, VIRTUAL_P3};

use super::parameters::Parameter;
use super::quantity::Quantity;

/// A number that a field may be.
trait Cell: Copy {
    fn get(self) -> f64;
    fn put(value: f64) -> Self;
}

macro_rules! cells {
    ($($kind:ty),*) => {$(
        impl Cell for $kind {
            fn get(self) -> f64 {
                f64::from(self)
            }
            fn put(value: f64) -> $kind {
                value as $kind
            }
        }
    )*};
}
cells!(f64, f32, u8, u16, u32);

impl Cell for bool {
    fn get(self) -> f64 {
        f64::from(u8::from(self))
    }
    fn put(value: f64) -> bool {
        value != 0.0
    }
}

/// A row: path in the file, quantity, smallest and largest value, field of [`Parameters`], what it
/// is. The field is in the quantity's first unit; or in `* factor` of it. In place of a field there
/// may be two functions, of which the first reads and the second writes.
macro_rules! row {
    ($path:literal, $quantity:ident, $least:expr, $most:expr,
     ($get:expr, $set:expr), $what:literal) => {
        Parameter {
            path: $path,
            quantity: Quantity::$quantity,
            least: $least,
            most: $most,
            what: $what,
            get: $get,
            set: $set,
        }
    };
    ($path:literal, $quantity:ident, $least:expr, $most:expr,
     $field:ident $(. $more:ident)* $([$index:literal])? $(* $factor:expr)?, $what:literal) => {
        Parameter {
            path: $path,
            quantity: Quantity::$quantity,
            least: $least,
            most: $most,
            what: $what,
            get: |world| Cell::get(world.$field $(.$more)* $([$index])?) $(* $factor)?,
            set: |world, value| {
                world.$field $(.$more)* $([$index])? = Cell::put(value $(/ $factor)?);
            },
        }
    };
}

/// A row of the thermal model.
macro_rules! heat {
    ($path:literal, $quantity:ident, $least:expr, $most:expr,
     $body:ident . $field:ident, $what:literal) => {
        row!(
            $path,
            $quantity,
            $least,
            $most,
            (
                |world| thermal(world).$body.$field,
                |world, value| {
                    world.thermal = Some(Thermal { ..thermal(world) });
                    if let Some(thermal) = &mut world.thermal {
                        thermal.$body.$field = value;
                    }
                }
            ),
            $what
        )
    };
}

/// A row of a switch, which is connected by it.
macro_rules! switch {
    ($path:literal, $which:ident, $end:ident, $none:expr, $fresh:expr, $what:literal) => {
        row!(
            $path,
            Position,
            -1e6,
            1e6,
            (
                |world| world.switches.$which.map_or($none, |switch| switch.$end),
                |world, value| {
                    world.switches.$which.get_or_insert($fresh).$end = value;
                }
            ),
            $what
        )
    };
}

/// A row of the output's encoder, which is there by it.
macro_rules! output {
    ($path:literal, $quantity:ident, $least:expr, $most:expr, $field:ident, $what:literal) => {
        row!(
            $path,
            $quantity,
            $least,
            $most,
            (
                |world| output(world).$field,
                |world, value| {
                    if value != 0.0 || world.output_encoder.is_some() {
                        world.output_encoder = Some(OutputEncoder {
                            $field: value,
                            ..output(world)
                        });
                    }
                }
            ),
            $what
        )
    };
}

const LIMIT_BELOW: Switch = Switch::below(f64::NEG_INFINITY);
const LIMIT_ABOVE: Switch = Switch::above(f64::INFINITY);
const NOWHERE: Switch = Switch::between(f64::INFINITY, f64::INFINITY);

fn thermal(world: &Parameters) -> Thermal {
    world
        .thermal
        .or(VIRTUAL_P3.thermal)
        .expect("the usual drive warms up")
}

fn stops(world: &Parameters) -> Stops {
    let none = Stops::between(f64::NEG_INFINITY, f64::INFINITY);
    world.load.stops.unwrap_or(none)
}

/// Rigid, unless there is one.
fn coupling(world: &Parameters) -> Coupling {
    world.load.coupling.unwrap_or(Coupling {
        stiffness_nm_per_rad: f64::INFINITY,
        damping_nms: 0.0,
        backlash_rad: 0.0,
    })
}

fn output(world: &Parameters) -> OutputEncoder {
    world.output_encoder.unwrap_or(OutputEncoder::ideal(0.0))
}

fn pendulum(world: &Parameters) -> Pendulum {
    world.load.pendulum.unwrap_or(Pendulum {
        torque_nm: 0.0,
        hanging_turns: 0.0,
    })
}

/// Something that all switches have.
fn of_switches(world: &Parameters, get: fn(&Switch) -> f64) -> f64 {
    let switches = &world.switches;
    let all = [
        switches.negative_limit,
        switches.positive_limit,
        switches.home,
    ];
    all.iter().flatten().next().map_or(0.0, get)
}

fn for_switches(world: &mut Parameters, set: impl Fn(&mut Switch)) {
    let switches = &mut world.switches;
    let all = [
        &mut switches.negative_limit,
        &mut switches.positive_limit,
        &mut switches.home,
    ];
    all.into_iter().flatten().for_each(set);
}

const INFINITE: f64 = f64::INFINITY;

/// All of them, in the order of their sections. What speaks of all switches comes behind each.
#[rustfmt::skip]
pub const PARAMETERS: &[Parameter] = &[
    row!("motor.pole_pairs", Whole, 1.0, 255.0, motor.pole_pairs, "Magnetic pole pairs."),
    row!("motor.phase_resistance", Resistance, 1e-4, 1e4, motor.phase_resistance_ohm,
        "Resistance of one phase: half of what is measured between two terminals."),
    row!("motor.phase_inductance", Inductance, 1e-7, 10.0, motor.phase_inductance_h,
        "Inductance of one phase: half of what is measured between two terminals."),
    row!("motor.flux", Flux, 1e-6, 100.0, motor.flux_wb,
        "Peak flux linkage of one phase with the magnet. Torque per ampere of peak phase current is 1.5 times pole pairs times it."),
    row!("motor.rotor_inertia", Inertia, 0.0, 1e3, motor.rotor_inertia_kgm2, "Inertia of the rotor."),
    row!("motor.coulomb_friction", Torque, 0.0, 1e4, motor.coulomb_friction_nm,
        "Friction that does not depend on speed."),
    row!("motor.static_friction", Torque, 0.0, 1e4, motor.static_friction_nm,
        "Torque needed to break away from standstill; not below the Coulomb friction."),
    row!("motor.viscous_friction", ViscousFriction, 0.0, 1e3, motor.viscous_friction_nms,
        "Friction per speed."),
    row!("motor.cogging", Torque, 0.0, 1e4, motor.cogging.torque_nm,
        "Greatest torque of the cogging."),
    row!("motor.cogging_periods", Whole, 1.0, 65_535.0, motor.cogging.periods_per_turn,
        "How often in a turn the cogging repeats itself."),
    row!("motor.cogging_rest", Position, -1e6, 1e6, motor.cogging.rest_turns,
        "A position to which the cogging pulls."),
    row!("motor.wires_swapped", Flag, 0.0, 1.0, motor.wires_swapped, "Wires B and C are exchanged."),

    row!("load.inertia", Inertia, 0.0, 1e3, load.inertia_kgm2, "Inertia of what the motor drives."),
    row!("load.coulomb_friction", Torque, 0.0, 1e4, load.coulomb_friction_nm,
        "The load's friction that does not depend on speed."),
    row!("load.viscous_friction", ViscousFriction, 0.0, 1e3, load.viscous_friction_nms,
        "The load's friction per speed."),
    row!("load.coupling_stiffness", Stiffness, 1e-6, 1e6,
        (|world| coupling(world).stiffness_nm_per_rad, |world, value| {
            let coupling = Coupling { stiffness_nm_per_rad: value, ..coupling(world) };
            world.load.coupling = value.is_finite().then_some(coupling);
        }), "Torque per twist of the shaft between motor and load; without it, the load is part of the rotor."),
    row!("load.coupling_damping", ViscousFriction, 0.0, 1e3,
        (|world| coupling(world).damping_nms, |world, value| {
            if value != 0.0 || world.load.coupling.is_some() {
                world.load.coupling = Some(Coupling { damping_nms: value, ..coupling(world) });
            }
        }), "Torque per difference of speed between motor and load, beside the stiffness."),
    row!("load.backlash", Angle, 0.0, 1e3,
        (|world| coupling(world).backlash_rad, |world, value| {
            if value != 0.0 || world.load.coupling.is_some() {
                world.load.coupling = Some(Coupling { backlash_rad: value, ..coupling(world) });
            }
        }), "Play of the coupling, from one flank to the other."),
    row!("load.pendulum", Torque, -1e4, 1e4,
        (|world| pendulum(world).torque_nm, |world, value| {
            world.load.pendulum = Some(Pendulum { torque_nm: value, ..pendulum(world) });
        }), "Torque of the load's weight when it is horizontal."),
    row!("load.hanging", Position, -1e6, 1e6,
        (|world| pendulum(world).hanging_turns, |world, value| {
            world.load.pendulum = Some(Pendulum { hanging_turns: value, ..pendulum(world) });
        }), "Position at which the weight hangs straight down."),
    row!("load.start", Position, -1e6, 1e6, start_turns,
        "Position of the shaft at the start; at 0 the rotor is aligned with phase A."),
    row!("load.lowest_stop", Position, -1e6, 1e6,
        (|world| stops(world).lowest_turns, |world, value| {
            world.load.stops = Some(Stops { lowest_turns: value, ..stops(world) });
        }), "Where the lower hard stop is touched."),
    row!("load.highest_stop", Position, -1e6, 1e6,
        (|world| stops(world).highest_turns, |world, value| {
            world.load.stops = Some(Stops { highest_turns: value, ..stops(world) });
        }), "Where the upper hard stop is touched."),
    row!("load.stop_stiffness", Stiffness, 1e-6, 1e6,
        (|world| stops(world).stiffness_nm_per_rad, |world, value| {
            world.load.stops = Some(Stops { stiffness_nm_per_rad: value, ..stops(world) });
        }), "Torque per way into a stop."),
    row!("load.stop_damping", Number, 0.0, 100.0,
        (|world| stops(world).damping_ratio, |world, value| {
            world.load.stops = Some(Stops { damping_ratio: value, ..stops(world) });
        }), "Damping of the stops, in parts of the critical damping of what strikes them."),

    switch!("switches.negative_limit", negative_limit, to_turns, -INFINITE, LIMIT_BELOW,
        "The negative limit switch is pressed up to here."),
    switch!("switches.positive_limit", positive_limit, from_turns, INFINITE, LIMIT_ABOVE,
        "The positive limit switch is pressed from here on."),
    switch!("switches.home_from", home, from_turns, INFINITE, Switch::above(INFINITE),
        "The home switch is pressed from here on."),
    switch!("switches.home_to", home, to_turns, INFINITE, NOWHERE, "And up to here."),
    row!("switches.hysteresis", Position, 0.0, 1e3,
        (|world| of_switches(world, |switch| switch.hysteresis_turns), |world, value| {
            for_switches(world, |switch| switch.hysteresis_turns = value);
        }), "So far outside its region a switch opens again."),
    row!("switches.bounce", Time, 0.0, 10.0,
        (|world| of_switches(world, |switch| switch.bounce_s), |world, value| {
            for_switches(world, |switch| switch.bounce_s = value);
        }), "So long a contact bounces."),
    row!("switches.active_low", Flag, 0.0, 1.0,
        (|world| of_switches(world, |switch| f64::from(u8::from(switch.active_low))), |world, value| {
            for_switches(world, |switch| switch.active_low = value != 0.0);
        }), "The input is low while its switch is pressed."),

    row!("inverter.pwm_period", Time, 1e-6, 1e-3, pwm_period_s,
        "PWM period at power-on; a P3's 0x3001,1 changes it."),
    row!("inverter.delay_periods", Whole, 0.0, 4.0, load_delay_periods,
        "PWM periods between the command of a duty and its effect; slow converters (a P3's 0x3001,7) add to them."),
    row!("inverter.dead_time", Time, 0.0, 1e-4, bridge.dead_time_s,
        "What drivers and switches add to the dead time that the drive sets (a P3 by 0x3001,2); below a tenth of the PWM period."),
    row!("inverter.switch_resistance", Resistance, 0.0, 1e3, bridge.switch_ohm, "Resistance of a closed switch."),
    row!("inverter.diode_drop", Voltage, 0.0, 100.0, diode_drop_v,
        "Forward voltage of one free-wheeling diode."),
    row!("inverter.overcurrent", Current, 0.0, 1e6, bridge.overcurrent_a,
        "Current of a phase at which the gate drivers open the bridge by themselves."),
    row!("inverter.blanking", Time, 0.0, 1e-3, bridge.blanking_s,
        "For so long after a switching the gate drivers see no overcurrent."),

    row!("supply.motor_voltage", Voltage, 0.0, 1e3, supply_v, "Open-circuit voltage of the motor supply; 0 V is off."),
    row!("supply.capacitance", Capacitance, 0.0, 1.0, link.capacitance_f,
        "Capacitance at the bridge. With 0 F the supply is ideal, and the four parameters below do not count."),
    row!("supply.resistance", Resistance, 0.0, 1e6, link.source_ohm,
        "Internal resistance of the motor supply and its cable; above 0 with a capacitance."),
    row!("supply.bleeder", Resistance, 1e-3, 1e9, link.bleeder_ohm, "What discharges the capacitor."),
    row!("supply.brake", Resistance, 1e-3, 1e9, link.brake_ohm, "The braking resistor."),
    row!("supply.brake_on", Voltage, 0.0, 1e3, link.brake_on_v, "Voltage at which the brake is switched on."),
    row!("supply.brake_off", Voltage, 0.0, 1e3, link.brake_off_v, "Voltage at which it is switched off again."),
    row!("supply.logic_voltage", Voltage, 0.0, 1e3, logic.supply_v,
        "Open-circuit voltage of the supply of processor and sensors."),
    row!("supply.logic_resistance", Resistance, 0.0, 1e6, logic.source_ohm, "Its internal resistance."),
    row!("supply.logic_current", Current, 0.0, 1e3, logic.current_a, "What the logic takes."),
    row!("supply.logic_least", Voltage, 0.0, 1e3, logic.least_v, "The least voltage at which the logic works."),

    row!("encoder.counts_per_turn", Whole, 1.0, 1_048_576.0, encoder.counts_per_turn, "Counts of one turn."),
    row!("encoder.zero", Whole, 0.0, 1_048_575.0, encoder.zero_counts,
        "Reading with the rotor aligned with phase A, counts."),
    row!("encoder.reversed", Flag, 0.0, 1.0, encoder.reversed,
        "The reading falls when the shaft turns in its positive direction."),
    row!("encoder.eccentricity", Number, -262_144.0, 262_144.0, encoder.eccentricity_counts,
        "Amplitude of the error that repeats once a turn, counts; up to a quarter turn."),
    row!("encoder.eccentricity_phase", Angle, -1e4, 1e4, encoder.eccentricity_phase_rad,
        "Where in the turn that error is."),
    row!("encoder.lag", Time, 0.0, 1e-3, encoder.lag_s, "Age of a reading when the loops get it."),
    row!("encoder.noise", Number, 0.0, 262_144.0, encoder.noise_counts,
        "Standard deviation of a reading, counts; it grows as the magnet's field falls."),
    row!("encoder.magnet_distance", Length, 0.0, 1.0, encoder.magnet_mm * 1e-3,
        "Distance of the magnet from its sensor; 1 mm is best."),
    row!("encoder.bad_answers", Share, 0.0, 100.0, encoder.bad_answers * 100.0,
        "So many of the answers have a wrong check sum."),
    output!("encoder.output_gear", Number, -1e6, 1e6, gear,
        "Turns of a second encoder, on the output of a gear, for one turn of the load's shaft; 0 is none."),
    output!("encoder.output_zero", Number, -1e6, 1e6, zero_turns,
        "Reading of the second encoder with the shaft at 0, turns."),
    output!("encoder.output_eccentricity", Number, -0.25, 0.25, eccentricity_turns,
        "Amplitude of the second encoder's error that repeats once a turn, turns."),
    row!("encoder.output_counts", Whole, 1.0, 1_048_576.0,
        (|world| f64::from(output(world).counts_per_turn), |world, value| {
            if value != f64::from(output(world).counts_per_turn) {
                let counts_per_turn = value as u32;
                world.output_encoder = Some(OutputEncoder { counts_per_turn, ..output(world) });
            }
        }), "Counts of one turn of the second encoder."),
    row!("encoder.output_reversed", Flag, 0.0, 1.0,
        (|world| f64::from(u8::from(output(world).reversed)), |world, value| {
            if value != 0.0 || world.output_encoder.is_some() {
                let reversed = value != 0.0;
                world.output_encoder = Some(OutputEncoder { reversed, ..output(world) });
            }
        }), "The second encoder's reading falls when the output turns in its positive direction."),
    row!("encoder.output_magnet_distance", Length, 0.0, 1.0,
        (|world| f64::from(output(world).magnet_mm) * 1e-3, |world, value| {
            let magnet_mm = (value * 1e3) as f32;
            if magnet_mm != output(world).magnet_mm {
                world.output_encoder = Some(OutputEncoder { magnet_mm, ..output(world) });
            }
        }), "Distance of the second encoder's magnet from its sensor; 1 mm is best."),
    row!("encoder.output_silent", Flag, 0.0, 1.0,
        (|world| f64::from(u8::from(output(world).silent)), |world, value| {
            if value != 0.0 || world.output_encoder.is_some() {
                let silent = value != 0.0;
                world.output_encoder = Some(OutputEncoder { silent, ..output(world) });
            }
        }), "The second encoder's cable is off."),

    row!("sensors.current_step", CurrentStep, 1e-6, 100.0, scales.current_a, "Current of one converter count."),
    row!("sensors.current_zero_a", Number, 0.0, 4095.0, current_zero_counts[0],
        "Reading of phase A's converter at no current, counts."),
    row!("sensors.current_zero_b", Number, 0.0, 4095.0, current_zero_counts[1],
        "Reading of phase B's converter at no current, counts."),
    row!("sensors.current_gain_a", Number, 0.0, 10.0, current_sensors.gain[0],
        "What phase A's sensor reads of a current, as a part of what it should."),
    row!("sensors.current_gain_b", Number, 0.0, 10.0, current_sensors.gain[1], "The same of phase B."),
    row!("sensors.current_noise", Number, 0.0, 4095.0, current_sensors.noise_counts,
        "Standard deviation of a reading of current, counts."),
    row!("sensors.current_time_constant", Time, 0.0, 1.0, current_sensors.time_constant_s,
        "Time constant of the current sensors' low-pass filter."),
    row!("sensors.voltage_step", VoltageStep, 1e-6, 100.0, scales.voltage_v,
        "Supply voltage of one converter count."),
    row!("sensors.temperature_step", TemperatureStepPerCount, 1e-6, 100.0, scales.temperature_k,
        "Amplifier temperature of one converter count."),
    row!("sensors.temperature_zero", Temperature, -273.15, 1e3, scales.temperature_zero_c,
        "Amplifier temperature at which its converter reads 0."),
    row!("sensors.motor_temperature_step", TemperatureStepPerCount, 1e-6, 100.0, scales.motor_temperature_k,
        "Motor temperature of one converter count."),
    row!("sensors.motor_temperature_zero", Temperature, -273.15, 1e3, scales.motor_temperature_zero_c,
        "Motor temperature at which its converter reads 0."),
    row!("sensors.noise_seed", Whole, 0.0, 4_294_967_295.0, noise_seed,
        "Where the noise of encoder and current sensors starts; it follows from the seed and the drive's place if a scenario does not say."),

    row!("thermal.ambient", Temperature, -273.15, 1e3, ambient_c,
        "Temperature of the surroundings, and of everything at the start."),
    heat!("thermal.winding_resistance", ThermalResistance, 1e-6, 1e9, motor.winding_k_per_w,
        "From the motor's winding to its housing."),
    heat!("thermal.winding_time_constant", Time, 1e-6, 1e9, motor.winding_time_constant_s,
        "Of the winding against a housing that stays as it is."),
    heat!("thermal.housing_resistance", ThermalResistance, 1e-6, 1e9, motor.housing_k_per_w,
        "From the motor's housing to the surroundings."),
    heat!("thermal.housing_time_constant", Time, 1e-6, 1e9, motor.housing_time_constant_s, "Of the housing."),
    heat!("thermal.reference", Temperature, -273.15, 1e3, motor.reference_c,
        "Temperature at which resistance and flux are those of the motor's table."),
    heat!("thermal.resistance_change", PerKelvin, -0.1, 0.1, motor.resistance_per_k,
        "So the winding's resistance grows; copper 0.393 %/K."),
    heat!("thermal.flux_change", PerKelvin, -0.1, 0.1, motor.flux_per_k,
        "So the magnet's flux grows; neodymium -0.11 %/K."),
    heat!("thermal.amplifier_resistance", ThermalResistance, 1e-6, 1e9, amplifier.k_per_w,
        "From the amplifier to the surroundings."),
    heat!("thermal.amplifier_time_constant", Time, 1e-6, 1e9, amplifier.time_constant_s, "Of the amplifier."),
    heat!("thermal.amplifier_idle", Power, 0.0, 1e3, amplifier.idle_w,
        "What the amplifier turns into heat while it does nothing."),
    heat!("thermal.amplifier_switching", Time, 0.0, 1e-6, amplifier.switching_s,
        "For so long in a PWM period a switch carries current and voltage at once."),
];
