//! What digital inputs, analog inputs, safe torque off and touch probes do to a whole drive.

mod machine;

use machine::{Bench, COUNTS, ENCODER_AT_START, Switches};
use personalities::{p3::P3, p3_extended::P3_EXTENDED};

const INPUT_1: u32 = 1 << 16;
const INPUT_2: u32 = 1 << 17;

const OPERATION_ENABLED: i32 = 0x27;
const SWITCH_ON_DISABLED: i32 = 0x40;

fn bench() -> Bench {
    Bench::new(&P3_EXTENDED, Switches::default())
}

impl Bench {
    fn state(&mut self) -> i32 {
        self.read(0x6041, 0) & 0x6F
    }

    fn velocity(&mut self) -> i32 {
        self.read(0x606C, 0)
    }

    /// Whether it turns with this speed, but for the ripple of the measurement.
    fn is_near(&mut self, speed: i32) -> bool {
        (self.velocity() - speed).abs() < 500 + speed.abs() / 50
    }

    /// Turning in mode 3.
    fn turning(speed: i32) -> Bench {
        let mut bench = bench();
        bench.write(0x6060, 0, 3, 1);
        bench.write(0x60FF, 0, speed, 4);
        bench.write(0x6040, 0, 0x06, 2);
        bench.write(0x6040, 0, 0x0F, 2);
        bench.run_ms(300);
        assert!(bench.is_near(speed), "{}", bench.velocity());
        bench
    }
}

#[test]
fn an_input_stops_quickly_and_letting_go_starts_nothing() {
    let mut bench = Bench::turning(40_000);
    bench.write(0x2431, 2, 1, 1);
    bench.run_ms(10);
    bench.extra_inputs = INPUT_1;
    bench.run_ms(2);
    assert_eq!(bench.state(), 0x07, "quick stop active");
    bench.run_ms(300);
    assert_eq!(bench.state() & 0x4F, SWITCH_ON_DISABLED);
    // While it is active nothing can be enabled.
    for word in [0x06, 0x07, 0x0F] {
        bench.write(0x6040, 0, word, 2);
    }
    assert_ne!(bench.state(), OPERATION_ENABLED);
    bench.extra_inputs = 0;
    bench.run_ms(50);
    assert_ne!(bench.state(), OPERATION_ENABLED);
    bench.write(0x6040, 0, 0x06, 2);
    bench.write(0x6040, 0, 0x0F, 2);
    assert_eq!(bench.state(), OPERATION_ENABLED);
}

#[test]
fn without_the_enabling_input_nothing_is_enabled() {
    let mut bench = Bench::turning(40_000);
    bench.extra_inputs = INPUT_2;
    bench.run_ms(1);
    bench.write(0x2431, 3, 2, 1);
    bench.run_ms(20);
    assert_eq!(bench.state(), OPERATION_ENABLED);
    bench.extra_inputs = 0;
    bench.run_ms(500);
    assert_eq!(bench.state(), 0x23, "switched on");
    bench.write(0x6040, 0, 0x0F, 2);
    assert_eq!(bench.state(), 0x23);
    bench.extra_inputs = INPUT_2;
    bench.run_ms(20);
    assert_eq!(bench.state(), 0x23, "the master must ask again");
    bench.write(0x6040, 0, 0x0F, 2);
    assert_eq!(bench.state(), OPERATION_ENABLED);
}

#[test]
fn an_input_halts_while_it_is_active() {
    let mut bench = Bench::turning(40_000);
    bench.write(0x2431, 5, 4, 1);
    bench.extra_inputs = 1 << 19;
    bench.run_ms(300);
    assert!(bench.velocity().abs() < 700);
    assert_eq!(bench.state(), OPERATION_ENABLED);
    bench.extra_inputs = 0;
    bench.run_ms(300);
    assert!((bench.velocity() - 40_000).abs() < 500);
    // The master reads what it wrote.
    assert_eq!(bench.read(0x6040, 0) & 0xFFFF, 0x0F);
}

#[test]
fn an_input_hands_over_the_set_point() {
    let mut bench = bench();
    bench.write(0x2431, 4, 3, 1);
    bench.write(0x6060, 0, 1, 1);
    bench.write(0x6040, 0, 0x06, 2);
    bench.write(0x6040, 0, 0x0F, 2);
    let start = bench.read(0x6064, 0);
    for way in [5_000, -3_000] {
        bench.write(0x607A, 0, start + way, 4);
        bench.run_ms(200);
        assert!((bench.read(0x6064, 0) - start - way).abs() > 1_000);
        bench.extra_inputs = 1 << 18;
        bench.run_ms(5);
        assert!(bench.bits().1, "acknowledged");
        bench.extra_inputs = 0;
        bench.run_ms(300);
        let bits = bench.bits();
        assert_eq!(bits, (true, false, false));
        assert!((bench.read(0x6064, 0) - start - way).abs() < 20);
    }
}

#[test]
fn a_voltage_commands_velocity_and_torque() {
    let mut bench = Bench::turning(0);
    bench.write(0x2432, 3, 100_000, 4);
    bench.write(0x2432, 1, 2, 1);
    // Converter counts, then the velocity by hand: 20 counts are dead, 2048 are 100,000 counts/s.
    for (reading, velocity) in [
        (2_048.0, 0),
        (2_068.0, 0),
        (2_028.0, 0),
        (3_092.0, 50_000),
        (1_004.0, -50_000),
        (4_095.0, 98_974),
    ] {
        bench.auxiliary_adc[0] = reading;
        bench.run_ms(400);
        assert!(bench.is_near(velocity), "{reading}: {}", bench.velocity());
        assert_eq!(bench.read(0x2432, 5), reading as i32);
    }
    // Torque, in the other mode only.
    bench.auxiliary_adc[0] = 2_048.0 + 20.0 + 512.0;
    bench.write(0x2432, 3, 200, 4);
    bench.write(0x2432, 1, 1, 1);
    bench.write(0x60FF, 0, 0, 4);
    bench.run_ms(500);
    assert!(bench.velocity().abs() < 500);
    bench.write(0x6060, 0, 4, 1);
    bench.run_ms(20);
    assert_eq!(bench.read(0x6074, 0) as i16, 50);
}

#[test]
fn safe_torque_off_opens_the_bridge_in_its_control_period() {
    for fault in [false, true] {
        let mut bench = Bench::turning(40_000);
        bench.write(0x2433, 1, i32::from(fault), 1);
        assert_eq!(bench.read(0x2433, 2) & 0xFF, 0);
        assert!(bench.duty.enabled);
        bench.torque_off = true;
        bench.period();
        assert!(!bench.duty.enabled, "in the same period");
        // A pulse of one period is enough.
        bench.torque_off = false;
        for _ in 0..25 {
            bench.period();
            assert!(!bench.duty.enabled);
        }
        bench.run_ms(2);
        if fault {
            assert_eq!(bench.state() & 0x4F, 0x08);
            assert_eq!(bench.read(0x603F, 0) & 0xFFFF, 0x9000);
            bench.write(0x6040, 0, 0, 2);
            bench.write(0x6040, 0, 0x80, 2);
        } else {
            assert_eq!(bench.read(0x603F, 0) & 0xFFFF, 0);
        }
        assert_eq!(bench.state() & 0x4F, SWITCH_ON_DISABLED);
        // While it is active, nothing is enabled, and the statusword says why.
        bench.torque_off = true;
        bench.run_ms(2);
        assert_eq!(bench.read(0x6041, 0) & 0x4000, 0x4000);
        assert_eq!(bench.read(0x2433, 2) & 0xFF, 1);
        for word in [0x06, 0x07, 0x0F] {
            bench.write(0x6040, 0, word, 2);
            assert_eq!(bench.state() & 0x4F, SWITCH_ON_DISABLED);
        }
        bench.torque_off = false;
        bench.run_ms(50);
        assert_eq!(
            bench.state() & 0x4F,
            SWITCH_ON_DISABLED,
            "the master must ask"
        );
        bench.write(0x6040, 0, 0x06, 2);
        bench.write(0x6040, 0, 0x0F, 2);
        assert_eq!(bench.state(), OPERATION_ENABLED);
        assert_eq!(bench.read(0x6041, 0) & 0x4000, 0);
        bench.run_ms(300);
        assert!((bench.velocity() - 40_000).abs() < 500);
    }
}

#[test]
fn the_faithful_p3_has_no_safe_torque_off() {
    let mut bench = Bench::new(&P3, Switches::default());
    bench.write(0x6040, 0, 0x06, 2);
    bench.write(0x6040, 0, 0x0F, 2);
    bench.write(0x6060, 0, 3, 1);
    bench.torque_off = true;
    bench.extra_inputs = u32::MAX;
    bench.run_ms(5);
    assert_eq!(bench.state(), OPERATION_ENABLED);
    assert!(bench.duty.enabled);
}

/// The position that belongs to a place of the shaft.
fn position(place: f64) -> f64 {
    place + ENCODER_AT_START
}

#[test]
fn touch_probes_capture_to_the_period() {
    let mut bench = Bench::turning(200_000);
    // Probe 1 on general input 1, both edges, once; probe 2 at the index, continuous.
    bench.write(0x60B8, 0, 0x0031 | 0x1700, 2);
    assert_eq!(bench.read(0x60B9, 0), 0x0101, "on");
    bench.run_ms(1);
    // A flag of 100 counts, which passes ten times per turn.
    let pass = |bench: &mut Bench, from: f64, to: f64| {
        while bench.place() < to + 3_000.0 {
            let inside = (from..to).contains(&bench.place());
            bench.extra_inputs = if inside { INPUT_1 } else { 0 };
            bench.period();
        }
    };
    let from = bench.place() + 5_000.3;
    pass(&mut bench, from, from + 777.0);
    assert_eq!(bench.read(0x60B9, 0) & 0xFF, 0x07, "both edges");
    // 200,000 counts/s are ten counts in a period.
    let late = |captured: i32, edge: f64| {
        let late = f64::from(captured) - position(edge);
        assert!((-1.0..=11.0).contains(&late), "{late}");
    };
    let (rising, falling) = (bench.read(0x60BA, 0), bench.read(0x60BB, 0));
    late(rising, from);
    late(falling, from + 777.0);
    assert_eq!((bench.read(0x60D5, 0), bench.read(0x60D6, 0)), (1, 1));
    // The first stays.
    let next = bench.place() + 100.0;
    pass(&mut bench, next, next + 300.0);
    assert_eq!(bench.read(0x60BA, 0), rising);
    // Until the probe is switched on again.
    bench.write(0x60B8, 0, 0x1700, 2);
    assert_eq!(bench.read(0x60B9, 0) & 0xFF, 0);
    bench.write(0x60B8, 0, 0x1711, 2);
    let next = bench.place() + 100.0;
    pass(&mut bench, next, next + 300.0);
    assert_eq!(
        bench.read(0x60B9, 0) & 0xFF,
        0x03,
        "the positive edge alone"
    );
    late(bench.read(0x60BA, 0), next);
    // The index, exact at any speed.
    assert_eq!(bench.read(0x60B9, 0) >> 8, 0x03);
    let index = bench.read(0x60BC, 0);
    let turns = f64::from(index) / COUNTS;
    assert_eq!(turns, turns.round(), "{index}");
    assert!(bench.read(0x6064, 0) - index <= 4_096 + 20);
    assert!(bench.read(0x60D7, 0) >= 3);
    // Sources that there are not.
    for function in [0x0009, 0x0041, 0x0900] {
        assert_eq!(bench.try_write(0x60B8, 0, function, 2), Err(0x0609_0030));
    }
}

#[test]
fn outputs_and_terminating_resistor_are_what_the_objects_say() {
    let mut bench = bench();
    bench.write(0x60FE, 1, 0x0003_0001, 4);
    assert_eq!(bench.drive.outputs(), 0, "masked");
    bench.write(0x60FE, 2, 0x0001_0001, 4);
    assert_eq!(bench.drive.outputs(), 0x0001_0001);
    assert!(!bench.drive.is_terminated());
    bench.write(0x21B2, 0, 1, 1);
    assert!(bench.drive.is_terminated());
    let mut faithful = Bench::new(&P3, Switches::default());
    assert_eq!(faithful.drive.outputs(), 0);
    assert!(!faithful.drive.is_terminated());
}
