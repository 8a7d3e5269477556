//! The axes of one drive on one supply.

mod support;

use control::Real;
use control::io::Duty;
use plant::{Link, Parameters, Plant, VIRTUAL_P3};
use support::OPEN;

const DRIVING: Duty<f32> = Duty {
    phase: [0.75, 0.4, 0.35],
    enabled: true,
};

fn with(link: Link) -> Parameters {
    let mut parameters = VIRTUAL_P3;
    parameters.link = link;
    parameters.thermal = None;
    parameters.load.inertia_kgm2 = 1e-4;
    parameters.bridge.overcurrent_a = f32::INFINITY;
    parameters
}

const BRAKED: Link = Link {
    capacitance_f: 400e-6,
    source_ohm: 1.0,
    bleeder_ohm: 5e3,
    brake_ohm: 8.0,
    brake_on_v: 56.0,
    brake_off_v: 54.0,
};

/// Two bridges that take the same of one link see what one sees of half the link.
#[test]
fn two_of_a_kind_on_one_link_are_one_on_half_of_it() {
    let half = Link {
        capacitance_f: BRAKED.capacitance_f / 2.0,
        source_ohm: BRAKED.source_ohm * 2.0,
        bleeder_ohm: BRAKED.bleeder_ohm * 2.0,
        brake_ohm: BRAKED.brake_ohm * 2.0,
        ..BRAKED
    };
    let mut axes = [Plant::<f32>::new(&with(BRAKED)); 2];
    let mut alone = Plant::<f32>::new(&with(half));
    let (mut lowest, mut highest, mut braked) = (100.0_f32, 0.0_f32, 0);
    for period in 0..6_000 {
        // Driven hard, then turned by the load so fast that the diodes feed the link.
        let duty = if period < 3_000 { DRIVING } else { OPEN };
        if period == 3_000 {
            for plant in axes.iter_mut().chain([&mut alone]) {
                plant.set_motion(0, 2500.0);
            }
        }
        for plant in axes.iter_mut().chain([&mut alone]) {
            plant.load(&duty);
        }
        Plant::step_axes(&mut axes);
        alone.step();
        let wanted = alone.truth();
        for axis in &axes {
            let truth = axis.truth();
            assert_eq!(truth.bus_voltage_v, axes[0].truth().bus_voltage_v);
            let off = truth.bus_voltage_v - wanted.bus_voltage_v;
            assert!(off.abs() < 0.01, "{period}: {off}");
            let off = truth.speed_rad_s - wanted.speed_rad_s;
            assert!(off.abs() < 0.1, "{period}: {off}");
        }
        lowest = lowest.least(wanted.bus_voltage_v);
        highest = highest.greatest(wanted.bus_voltage_v);
        braked += u32::from(wanted.brake_current_a > 0.0);
    }
    assert!(lowest < 47.0, "{lowest}");
    assert!(highest > 55.9, "{highest}");
    assert!(braked > 10, "{braked}");
}

/// What one brakes, the other one drives with; nothing of it comes from the supply.
#[test]
fn what_one_axis_gives_back_another_takes() {
    let mut axes = [Plant::<f32>::new(&with(BRAKED)); 3];
    axes[0].set_motion(0, 1500.0);
    let mut given = 0.0;
    let mut highest = 0.0_f32;
    for _ in 0..200 {
        for axis in &mut axes {
            axis.load(&OPEN);
        }
        // Shorted for most of the time and open for the rest: the first one feeds the link.
        axes[0].load(&Duty {
            phase: [0.5; 3],
            enabled: true,
        });
        Plant::step_axes(&mut axes);
    }
    for _ in 0..40 {
        axes[0].load(&OPEN);
        axes[1].load(&OPEN);
        Plant::step_axes(&mut axes);
        let truth = axes[0].truth();
        given -= truth.bridge_current_a;
        highest = highest.greatest(axes[2].truth().bus_voltage_v);
    }
    assert!(given > 1.0, "{given}");
    assert!(highest > 48.5, "{highest}");
    let before = axes[2].truth().bus_voltage_v;
    axes[1].load(&DRIVING);
    for _ in 0..20 {
        Plant::step_axes(&mut axes);
        assert_eq!(axes[1].truth().supply_current_a, 0.0);
    }
    assert!(axes[2].truth().bus_voltage_v < before);
    assert!(axes[1].truth().torque_nm > 0.0);
}

/// An ideal supply lets the axes be as if each had its own; the first one's voltage is that of all.
#[test]
fn on_an_ideal_supply_they_do_not_feel_each_other() {
    let parameters = with(Link::IDEAL);
    let mut axes = [Plant::<f32>::new(&parameters); 2];
    let mut alone = [Plant::<f32>::new(&parameters); 2];
    for _ in 0..500 {
        axes[0].load(&DRIVING);
        alone[0].load(&DRIVING);
        Plant::step_axes(&mut axes);
        for plant in &mut alone {
            plant.step();
        }
    }
    assert_eq!(axes, alone);
    axes[0].set_supply_v(20.0);
    axes[1].set_supply_v(90.0);
    Plant::step_axes(&mut axes);
    for axis in &axes {
        assert_eq!(axis.truth().bus_voltage_v, 20.0);
    }
    // And its kind.
    axes[0].set_link(&BRAKED);
    Plant::step_axes(&mut axes);
    axes[0].load(&DRIVING);
    for _ in 0..200 {
        Plant::step_axes(&mut axes);
    }
    let volts = axes[0].truth().bus_voltage_v;
    assert!(volts < 19.9, "{volts}");
    assert_eq!(axes[1].truth().bus_voltage_v, volts);
}
