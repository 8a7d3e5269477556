//! Nothing is gained and nothing lost: what the supply gives is copper loss, diodes, brake, friction
//! and what is stored.

mod support;

use std::f64::consts::TAU;

use plant::{Bridge, Link, Parameters, Phase, Plant, Short, Truth, VIRTUAL_P3};
use support::{Complex, OPEN, SHORTED, current, rpm, step_in_rotor_frame};

/// Where energy has gone, J. From the truth between the periods, with formulas of its own.
#[derive(Clone, Copy, Debug, Default)]
struct Account {
    supply: f64,
    source_ohm: f64,
    bleeder: f64,
    brake: f64,
    copper: f64,
    diodes: f64,
    switching: f64,
    friction: f64,
    load: f64,
    /// What the bridge has taken and given, regardless of the sign.
    exchanged: f64,
}

struct Accountant {
    parameters: Parameters,
    plant: Plant<f32>,
    account: Account,
    start: f64,
    load_nm: f64,
}

impl Accountant {
    fn new(parameters: &Parameters) -> Self {
        parameters.check().expect("possible parameters");
        let plant = Plant::<f32>::new(parameters);
        let mut accountant = Self {
            parameters: *parameters,
            plant,
            account: Account::default(),
            start: 0.0,
            load_nm: 0.0,
        };
        accountant.start = accountant.stored();
        accountant
    }

    /// In the capacitor, the winding and the rotor.
    fn stored(&self) -> f64 {
        let truth = self.plant.truth();
        let bus = f64::from(truth.bus_voltage_v);
        let speed = f64::from(truth.speed_rad_s);
        let square = current(&truth).dot(current(&truth));
        let motor = &self.parameters.motor;
        let inertia = motor.rotor_inertia_kgm2 + self.parameters.load.inertia_kgm2;
        0.5 * self.parameters.link.capacitance_f * bus * bus
            + 0.75 * motor.phase_inductance_h * square
            + 0.5 * inertia * speed * speed
    }

    /// Books the period between two looks, with the part of it in which the current of each phase is
    /// in a diode.
    fn book(&mut self, before: &Truth<f32>, diode_parts: [f64; 3], switching: bool) {
        let after = self.plant.truth();
        let p = &self.parameters;
        let h = p.pwm_period_s;
        let a = &mut self.account;
        let bus = 0.5 * (f64::from(before.bus_voltage_v) + f64::from(after.bus_voltage_v));
        let supply = f64::from(after.supply_current_a);
        a.supply += f64::from(p.supply_v) * supply * h;
        a.source_ohm += supply * supply * p.link.source_ohm * h;
        a.bleeder += bus * bus / p.link.bleeder_ohm * h;
        a.brake += f64::from(after.brake_current_a) * bus * h;
        a.exchanged += (f64::from(after.bridge_current_a) * bus * h).abs();

        // The current within the period follows an exponential; Simpson's rule over its square.
        let resistance = p.motor.phase_resistance_ohm + p.bridge.switch_ohm;
        let left = (-resistance * h / p.motor.phase_inductance_h).exp();
        let (first, last) = (current(before), current(&after));
        let end = last.sub(first.scale(left)).scale(1.0 / (1.0 - left));
        let middle = end.add(first.sub(end).scale(left.sqrt()));
        let square = |i: Complex| i.dot(i);
        let mean = (square(first) + 4.0 * square(middle) + square(last)) / 6.0;
        a.copper += 1.5 * resistance * mean * h;
        let through: f64 = (0..3)
            .map(|k| {
                let sum = f64::from(before.phase_current_a[k] + after.phase_current_a[k]);
                (0.5 * sum).abs() * diode_parts[k]
            })
            .sum();
        a.diodes += f64::from(p.diode_drop_v) * through * h;
        if let (Some(thermal), true) = (&p.thermal, switching) {
            let through: f64 = (0..3)
                .map(|k| f64::from(before.phase_current_a[k] + after.phase_current_a[k]).abs())
                .sum();
            a.switching += 0.5 * through * bus * thermal.amplifier.switching_s;
        }

        let way = (after.position_turns() - before.position_turns()) * TAU;
        let coulomb = p.motor.coulomb_friction_nm + p.load.coulomb_friction_nm;
        let viscous = p.motor.viscous_friction_nms + p.load.viscous_friction_nms;
        a.friction += coulomb * way.abs() + viscous * way / h * way;
        a.load += self.load_nm * way;
    }

    /// A switching phase is in its diodes for twice the dead time.
    fn switching(&self) -> [f64; 3] {
        [2.0 * self.parameters.bridge.dead_time_s / self.parameters.pwm_period_s; 3]
    }

    fn drive(&mut self, periods: usize, mut volts: impl FnMut(usize) -> Complex) {
        for n in 0..periods {
            let before = self.plant.truth();
            let mut scaled = self.parameters;
            scaled.supply_v = before.bus_voltage_v;
            step_in_rotor_frame(&mut self.plant, &scaled, volts(n));
            self.book(&before, self.switching(), true);
        }
    }

    fn coast(&mut self, periods: usize) {
        self.coast_with_diodes(periods, [1.0; 3]);
    }

    fn coast_with_diodes(&mut self, periods: usize, diode_parts: [f64; 3]) {
        self.plant.load(&OPEN);
        for _ in 0..periods {
            let before = self.plant.truth();
            self.plant.step();
            self.book(&before, diode_parts, false);
        }
    }

    /// What is missing, as a part of what was exchanged.
    fn missing(&self, name: &str) -> f64 {
        let a = &self.account;
        let lost = a.source_ohm
            + a.bleeder
            + a.brake
            + a.copper
            + a.diodes
            + a.switching
            + a.friction
            + a.load;
        let gained = self.stored() - self.start;
        // What moved: through the bridge, or out of the store.
        let exchanged = if a.exchanged > gained.abs() {
            a.exchanged
        } else {
            gained.abs()
        };
        let missing = (a.supply - lost - gained) / exchanged;
        println!(
            "{name}: exchanged {:.3} mJ, missing {:.4} %; {a:.3?}",
            exchanged * 1e3,
            missing * 100.0
        );
        missing
    }
}

fn with_link() -> Parameters {
    Parameters {
        load_delay_periods: 0,
        link: Link::SMALL,
        thermal: None,
        ..VIRTUAL_P3
    }
}

fn with_everything() -> Parameters {
    Parameters {
        bridge: Bridge {
            dead_time_s: 200e-9,
            switch_ohm: 0.05,
            ..Bridge::IDEAL
        },
        link: Link {
            brake_ohm: 22.0,
            brake_on_v: 52.0,
            brake_off_v: 50.0,
            ..Link::SMALL
        },
        // Losses of switching; the resistance is that of the account.
        thermal: VIRTUAL_P3.thermal.map(|mut thermal| {
            thermal.motor.resistance_per_k = 0.0;
            thermal.motor.flux_per_k = 0.0;
            thermal
        }),
        ..with_link()
    }
}

#[test]
fn acceleration() {
    for parameters in [with_link(), with_everything()] {
        let mut world = Accountant::new(&parameters);
        // 20 V ahead of the magnet, from rest to 9,000 rpm.
        world.drive(3_000, |_| Complex(0.0, 20.0));
        assert!(world.plant.truth().speed_rad_s > 800.0);
        let missing = world.missing("acceleration");
        assert!(missing.abs() < 1e-3, "{missing}");
    }
}

#[test]
fn reversal_with_regeneration() {
    for parameters in [with_link(), with_everything()] {
        let mut world = Accountant::new(&parameters);
        world.drive(3_000, |_| Complex(0.0, 20.0));
        let top = world.plant.truth().speed_rad_s;
        // Braking that leaves more than it burns: the voltage falls with the speed.
        let flux = f64::from(top) * parameters.motor.emf_constant_vs();
        let mut highest = 0.0_f32;
        for n in 0..40 {
            world.drive(100, |_| {
                let part = 1.0 - (f64::from(n) + 0.5) / 20.0;
                Complex(0.0, 0.8 * flux * part - 0.5)
            });
            let bus = world.plant.truth().bus_voltage_v;
            highest = if bus > highest { bus } else { highest };
        }
        println!("bus up to {highest:.2} V");
        assert!(highest > 50.0, "{highest}");
        assert!(world.plant.truth().speed_rad_s < -0.3 * top);
        let missing = world.missing("reversal");
        assert!(missing.abs() < 1e-3, "{missing}");
    }
}

#[test]
fn coasting_with_diodes() {
    for parameters in [with_link(), with_everything()] {
        let mut parameters = parameters;
        // A low bus, so that the diodes rectify for a while: 30 V are reached at 8,300 rpm.
        parameters.supply_v = 30.0;
        let mut world = Accountant::new(&parameters);
        world.plant.set_motion(0, rpm(16_000.0) as f32);
        world.start = world.stored();
        world.coast(30_000);
        assert!(world.account.diodes > 0.0);
        let missing = world.missing("coasting");
        assert!(missing.abs() < 1e-3, "{missing}");
    }
}

#[test]
fn an_opened_bridge_gives_the_winding_s_energy_to_the_bus() {
    let mut world = Accountant::new(&with_link());
    world.plant.set_blocked(true);
    for _ in 0..20 {
        world.drive(100, |_| Complex(0.0, 13.0));
        world.coast(20);
    }
    let missing = world.missing("opening");
    assert!(missing.abs() < 1e-3, "{missing}");
}

#[test]
fn short_circuits() {
    // A spinning motor whose wires are shorted while the bridge is open brakes itself.
    for (short, diode_parts) in [
        // What B carries goes through a diode of B and one of the others; theirs needs none.
        (Short::BesidePhase(Phase::B), [0.0, 2.0, 0.0]),
        (Short::ToNegative(Phase::A), [0.0, 1.0, 1.0]),
        (Short::ToPositive(Phase::C), [1.0, 1.0, 0.0]),
    ] {
        for parameters in [with_link(), with_everything()] {
            let mut world = Accountant::new(&parameters);
            world.plant.set_short(Some(short));
            world.plant.set_motion(0, rpm(9_000.0) as f32);
            world.start = world.stored();
            world.coast_with_diodes(10_000, diode_parts);
            assert!(world.account.copper > 0.0);
            let missing = world.missing(&format!("{short:?}"));
            assert!(missing.abs() < 1e-3, "{missing}");
        }
    }
    // All three shorted by the bridge.
    let mut world = Accountant::new(&with_everything());
    world.plant.set_motion(0, rpm(9_000.0) as f32);
    world.start = world.stored();
    world.plant.load(&SHORTED);
    for _ in 0..2_000 {
        let before = world.plant.truth();
        world.plant.step();
        world.book(&before, world.switching(), true);
    }
    let missing = world.missing("braking by the bridge");
    assert!(missing.abs() < 1e-3, "{missing}");
}

#[test]
fn a_missing_phase_and_a_hoisted_load() {
    let mut world = Accountant::new(&with_everything());
    world.plant.set_open_phase(Phase::C, true);
    world.plant.set_load_torque_nm(3e-3);
    world.load_nm = 3e-3;
    world.drive(5_000, |n| Complex(0.0, if n < 2_500 { 20.0 } else { -6.0 }));
    let [_, _, c] = world.plant.truth().phase_current_a;
    assert!(c.abs() < 1e-5);
    let missing = world.missing("two phases");
    assert!(missing.abs() < 1e-3, "{missing}");
}
