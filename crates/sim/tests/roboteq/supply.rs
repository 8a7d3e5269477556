//! One supply, of all channels.

use personalities::roboteq::ROBOTEQ_3;
use plant::Link;
use sim::DriveSettings;

use crate::bench::{Channel, near};
use crate::master::{Master, id};

/// A weak supply that takes nothing back.
const WEAK: Link = Link {
    capacitance_f: 4.7e-3,
    source_ohm: 2.0,
    bleeder_ohm: 10e3,
    ..Link::IDEAL
};

fn on(link: Link, inertia_kgm2: f64) -> Master {
    let mut settings = DriveSettings::new(id(1), &ROBOTEQ_3);
    settings.plant.link = link;
    settings.plant.load.inertia_kgm2 = inertia_kgm2;
    let mut master = Master::with(vec![settings]);
    master.write_u16(1, 0x3008, 0, 0);
    // Without the state machine: open loop, in which the voltage is all that there is.
    for channel in 1..=3 {
        master.write_i32(1, 0x3033, channel, 0);
        master.write_i32(1, 0x3034, channel, 0);
    }
    master.write(1, 0x2017, 0, &[1]);
    master.run_ms(500);
    master.send(0, &[0x81, 1]);
    master.run_ms(200);
    master
}

/// What each channel's converter sees, V, and what the controller tells of it.
fn volts(master: &mut Master) -> f64 {
    let worlds = master.drive(1).worlds();
    let bus: Vec<f32> = worlds.iter().map(|w| w.truth().bus_voltage_v).collect();
    assert_eq!(bus, [bus[0]; 3]);
    let told = f64::from(master.read(1, 0x210D, 2) as u16) * 0.1;
    near(told, f64::from(bus[0]), 0.3);
    f64::from(bus[0])
}

#[test]
fn the_load_of_one_channel_sags_the_voltage_of_all() {
    let mut master = on(WEAK, 0.0);
    master.write_i32(1, 0x2000, 2, 1000);
    master.run_ms(1500);
    let (before, speed) = (volts(&mut master), master.rpm(2));
    near(before, 24.0, 0.5);
    // 3 A through a winding that is held: 33 W, and the more the lower the voltage.
    master.drive(1).plants()[0].set_blocked(true);
    master.mode(1, 4);
    master.write_i32(1, 0x6087, 0, 0);
    master.write_i16(1, 0x6071, 0, 30);
    master.run_ms(1500);
    near(f64::from(master.read_i16(1, 0x6077, 0)), 30.0, 1.0);
    let sagged = volts(&mut master);
    assert!(sagged < before - 2.0, "{sagged}");
    // The second channel's motor has the full duty of less, the third one's converters see it too.
    near(master.rpm(2) / speed, sagged / before, 0.01);
    assert!(f64::from(master.read(1, 0x210D, 2) as u16) * 0.1 < before - 1.8);
    // What the supply gives is what the bridges take.
    let worlds = master.drive(1).worlds();
    let taken: f32 = worlds.iter().map(|w| w.truth().bridge_current_a).sum();
    near(
        f64::from(worlds[2].truth().supply_current_a),
        f64::from(taken),
        0.1,
    );
}

#[test]
fn what_one_channel_brakes_is_the_over_voltage_of_all() {
    let codes = |master: &Master| -> Vec<u16> {
        let emergencies = master.log.iter().filter(|t| t.frame.raw_id() == 0x81);
        let codes = emergencies.map(|t| u16::from_le_bytes([t.frame.data()[0], t.frame.data()[1]]));
        codes.collect()
    };
    let braked = |link: Link| {
        let mut master = on(link, 3e-4);
        master.write(1, 0x30F1, 0, &[1]);
        // A brake needs a limit above it; the faults of the supply are all channels'.
        master.write_u16(1, 0x30F4, 1, 320);
        master.write(1, 0x3038, 1, &[0]);
        // With no more current than the speed gives back.
        master.write_i32(1, 0x6083, 0, 12_000);
        master.write_i32(1, 0x6084, 0, 12_000);
        for channel in 1..=3 {
            master.enable_channel(channel, 3);
        }
        master.write_i32(1, 0x60FF, 0, 2500);
        master.run_ms(5000);
        near(master.rpm(1), 2500.0, 30.0);
        assert!(codes(&master).is_empty());
        master.log.clear();
        master.write_i32(1, 0x60FF, 0, 0);
        let mut highest = 0.0_f64;
        for _ in 0..600 {
            master.run_ms(1);
            let worlds = master.drive(1).worlds();
            highest = highest.max(f64::from(worlds[2].truth().bus_voltage_v));
        }
        (highest, master)
    };
    let (highest, mut master) = braked(WEAK);
    assert!(highest > 32.0, "{highest}");
    assert_eq!(codes(&master), [0x3210]);
    for channel in 1..=3 {
        assert_eq!(master.status_of(channel), 0x0218, "channel {channel}");
    }
    // One brake is enough for all.
    let (highest, mut master) = braked(Link {
        brake_ohm: 10.0,
        brake_on_v: 29.0,
        brake_off_v: 27.0,
        ..WEAK
    });
    assert!((28.9..30.0).contains(&highest), "{highest}");
    assert!(codes(&master).is_empty());
    assert_eq!(master.status_of(3) & 0x6F, 0x27);
}
