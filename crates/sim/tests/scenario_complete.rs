//! Every field of a world is a parameter of scenarios, and no text makes the reader panic.

use canopen::{Instant, NodeId};
use personalities::p3::P3;
use plant::{
    AmplifierThermal, Bridge, Cogging, Coupling, CurrentSensors, Encoder, Link, Load, LogicSupply,
    Motor, MotorThermal, OutputEncoder, Parameters, Pendulum, Stops, Switch, Switches, Thermal,
};
use proptest::prelude::*;
use sim::scenario::{PARAMETERS, Scenario, parameters_template};
use sim::{BusSettings, DriveSettings};

/// Names each field once: a field more does not compile until it is here, and its path must be
/// that of a row.
macro_rules! paths {
    ($($kind:ident { $($field:ident => $path:expr),* $(,)? })*) => {{
        $(
            #[allow(dead_code, reason = "only compiled, so that no field is forgotten")]
            fn $kind(whole: &$kind) {
                let $kind { $($field: _),* } = whole;
            }
        )*
        let all: Vec<&[&str]> = vec![$($(&$path),*),*];
        all.concat()
    }};
}

#[test]
#[allow(non_snake_case, reason = "a function for each type, of its name")]
fn every_field_of_a_world_is_a_parameter() {
    const ELSEWHERE: [&str; 0] = [];
    let named = paths! {
        Parameters {
            motor => ELSEWHERE, load => ELSEWHERE, switches => ELSEWHERE, bridge => ELSEWHERE,
            link => ELSEWHERE, logic => ELSEWHERE, encoder => ELSEWHERE,
            output_encoder => ELSEWHERE, current_sensors => ELSEWHERE, thermal => ELSEWHERE,
            start_turns => ["load.start"],
            pwm_period_s => ["inverter.pwm_period"],
            load_delay_periods => ["inverter.delay_periods"],
            supply_v => ["supply.motor_voltage"],
            diode_drop_v => ["inverter.diode_drop"],
            scales => [
                "sensors.current_step", "sensors.voltage_step", "sensors.temperature_step",
                "sensors.temperature_zero", "sensors.motor_temperature_step",
                "sensors.motor_temperature_zero",
            ],
            current_zero_counts => ["sensors.current_zero_a", "sensors.current_zero_b"],
            noise_seed => ["sensors.noise_seed"],
            ambient_c => ["thermal.ambient"],
        }
        Motor {
            pole_pairs => ["motor.pole_pairs"],
            phase_resistance_ohm => ["motor.phase_resistance"],
            phase_inductance_h => ["motor.phase_inductance"],
            flux_wb => ["motor.flux"],
            rotor_inertia_kgm2 => ["motor.rotor_inertia"],
            coulomb_friction_nm => ["motor.coulomb_friction"],
            static_friction_nm => ["motor.static_friction"],
            viscous_friction_nms => ["motor.viscous_friction"],
            cogging => ELSEWHERE,
            wires_swapped => ["motor.wires_swapped"],
        }
        Cogging {
            torque_nm => ["motor.cogging"],
            periods_per_turn => ["motor.cogging_periods"],
            rest_turns => ["motor.cogging_rest"],
        }
        Load {
            inertia_kgm2 => ["load.inertia"],
            coulomb_friction_nm => ["load.coulomb_friction"],
            viscous_friction_nms => ["load.viscous_friction"],
            coupling => ELSEWHERE, pendulum => ELSEWHERE, stops => ELSEWHERE,
        }
        Coupling {
            stiffness_nm_per_rad => ["load.coupling_stiffness"],
            damping_nms => ["load.coupling_damping"],
            backlash_rad => ["load.backlash"],
        }
        Pendulum { torque_nm => ["load.pendulum"], hanging_turns => ["load.hanging"] }
        Stops {
            lowest_turns => ["load.lowest_stop"],
            highest_turns => ["load.highest_stop"],
            stiffness_nm_per_rad => ["load.stop_stiffness"],
            damping_ratio => ["load.stop_damping"],
        }
        Switches {
            negative_limit => ["switches.negative_limit"],
            positive_limit => ["switches.positive_limit"],
            home => ELSEWHERE,
        }
        Switch {
            from_turns => ["switches.home_from"],
            to_turns => ["switches.home_to"],
            hysteresis_turns => ["switches.hysteresis"],
            active_low => ["switches.active_low"],
            bounce_s => ["switches.bounce"],
        }
        Bridge {
            dead_time_s => ["inverter.dead_time"],
            switch_ohm => ["inverter.switch_resistance"],
            overcurrent_a => ["inverter.overcurrent"],
            blanking_s => ["inverter.blanking"],
        }
        Link {
            capacitance_f => ["supply.capacitance"],
            source_ohm => ["supply.resistance"],
            bleeder_ohm => ["supply.bleeder"],
            brake_ohm => ["supply.brake"],
            brake_on_v => ["supply.brake_on"],
            brake_off_v => ["supply.brake_off"],
        }
        LogicSupply {
            supply_v => ["supply.logic_voltage"],
            source_ohm => ["supply.logic_resistance"],
            current_a => ["supply.logic_current"],
            least_v => ["supply.logic_least"],
        }
        Encoder {
            counts_per_turn => ["encoder.counts_per_turn"],
            zero_counts => ["encoder.zero"],
            reversed => ["encoder.reversed"],
            eccentricity_counts => ["encoder.eccentricity"],
            eccentricity_phase_rad => ["encoder.eccentricity_phase"],
            lag_s => ["encoder.lag"],
            noise_counts => ["encoder.noise"],
            magnet_mm => ["encoder.magnet_distance"],
            bad_answers => ["encoder.bad_answers"],
        }
        OutputEncoder {
            gear => ["encoder.output_gear"],
            counts_per_turn => ["encoder.output_counts"],
            zero_turns => ["encoder.output_zero"],
            reversed => ["encoder.output_reversed"],
            eccentricity_turns => ["encoder.output_eccentricity"],
            silent => ["encoder.output_silent"],
            magnet_mm => ["encoder.output_magnet_distance"],
        }
        CurrentSensors {
            gain => ["sensors.current_gain_a", "sensors.current_gain_b"],
            noise_counts => ["sensors.current_noise"],
            time_constant_s => ["sensors.current_time_constant"],
        }
        Thermal { motor => ELSEWHERE, amplifier => ELSEWHERE }
        MotorThermal {
            winding_k_per_w => ["thermal.winding_resistance"],
            housing_k_per_w => ["thermal.housing_resistance"],
            winding_time_constant_s => ["thermal.winding_time_constant"],
            housing_time_constant_s => ["thermal.housing_time_constant"],
            reference_c => ["thermal.reference"],
            resistance_per_k => ["thermal.resistance_change"],
            flux_per_k => ["thermal.flux_change"],
        }
        AmplifierThermal {
            k_per_w => ["thermal.amplifier_resistance"],
            time_constant_s => ["thermal.amplifier_time_constant"],
            idle_w => ["thermal.amplifier_idle"],
            switching_s => ["thermal.amplifier_switching"],
        }
    };
    let rows: Vec<&str> = PARAMETERS.iter().map(|parameter| parameter.path).collect();
    for path in &named {
        assert!(rows.contains(path), "no row is called {path}");
    }
    for path in &rows {
        let count = named.iter().filter(|other| *other == path).count();
        assert_eq!(count, 1, "{path} is the row of no field here");
    }
}

/// A scenario with something of everything.
const TEXT: &str = "seed = 7\nnodes = [1, 2]\n[drive.all]\nhidden_truth = true\n\
    [drive.1.motor]\nflux = \"20 mWb\"\n[drive.1.spread]\nmotor.flux = \"5 %\"\n\
    [drive.1.stored]\n\"0x6065\" = 100\n\"0x1018,4\" = -1\n[[event]]\nname = \"a\"\n\
    at = \"1 s\"\nevery = \"10 ms\"\ntimes = 3\ndo = \"motor-supply\"\ndrive = 1\n\
    to = \"20 V\"\nfor = \"5 ms\"\n[[event]]\nafter = \"a\"\ndo = \"flip-bit\"\n\
    frames = { id = 0x181, mask = 0x7F0, from = 2 }\nbit = \"eof7\"\nseen_by = \"outside\"\n\
    [[event]]\nwhen = { frame = { data = \"27 ??\" }, nth = 2 }\ndo = \"flood\"\nid = 0x7FF\n\
    data = \"00 FF\"\nfor = \"1 s\"\n";

/// Reads and sets up whatever it is.
fn survive(text: &str) {
    if let Ok(scenario) = Scenario::read("noise.toml", text) {
        let node = |id| DriveSettings::new(NodeId::new(id).unwrap(), &P3);
        let mut settings = BusSettings::new(1, vec![node(1), node(2)]);
        let set_up = scenario.set_up(&mut settings, Instant::ZERO.plus_ms(10_000));
        if let Err(problems) = set_up {
            assert!(!problems.to_string().is_empty());
        }
    }
}

proptest! {
    #[test]
    fn noise_is_survived(noise in "(?s).{0,80}", toml in "[a-z0-9\\[\\]{}=\".,\n -]{0,80}") {
        survive(&noise);
        survive(&toml);
    }

    /// Values of every type in every place.
    #[test]
    fn strange_values_are_survived(
        line in 0_usize..40,
        value in prop_oneof![
            Just("1979-05-27"), Just("nan"), Just("-inf"), Just("[]"), Just("{}"), Just("[[1]]"),
            Just("true"), Just("-1"), Just("18446744073709551616"), Just("1e400"), Just("''"),
            Just("\"1e400 V\""), Just("\"-1e308 s\""), Just("0x_1"), Just("{ a = { b = [1] } }"),
            Just("\"\u{1F600}\""), Just("\"all\""), Just("\"outside\""), Just("0"),
        ],
    ) {
        let changed: Vec<String> = TEXT
            .lines()
            .enumerate()
            .map(|(n, text)| match text.split_once(" = ") {
                Some((key, _)) if n == line => format!("{key} = {value}"),
                _ => text.to_owned(),
            })
            .collect();
        survive(&changed.join("\n"));
    }

    /// A text that was cut, or of which a part is missing.
    #[test]
    fn missing_parts_are_survived(from in 0_usize..900, length in 0_usize..40) {
        let text = format!("{TEXT}{}", parameters_template(&P3));
        let kept = text.chars().enumerate();
        let kept = kept.filter(|(n, _)| !(from..from + length).contains(n));
        survive(&kept.map(|(_, c)| c).collect::<String>());
    }
}

/// The strange one that is right is played.
#[test]
fn the_text_of_these_tests_is_nearly_right() {
    let problems = Scenario::read("t", TEXT).unwrap();
    let node = |id| DriveSettings::new(NodeId::new(id).unwrap(), &P3);
    let mut settings = BusSettings::new(1, vec![node(1), node(2)]);
    let end = Instant::ZERO.plus_ms(10_000);
    let told = problems.set_up(&mut settings, end).unwrap_err();
    let told: Vec<&str> = told
        .list
        .iter()
        .map(|problem| problem.what.as_str())
        .collect();
    assert_eq!(told, ["0x1018,4 cannot be stored"]);
}
