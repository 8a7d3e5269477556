//! Table 9 and table 17: set-points of the modes 1 and -1, by bits 4, 5, 6 and 9, and bit 12.

use personalities::roboteq::ROBOTEQ;

use crate::bench::{Channel, REACHED, near, with_machine};
use crate::master::Master;

const ACKNOWLEDGE: u16 = 1 << 12;

fn counts(master: &mut Master) -> f64 {
    f64::from(master.read(1, 0x2104, 1))
}

/// In mode 1 at 600 RPM, on the way to 20,480 counts, five turns.
fn on_the_way() -> Master {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x6081, 0, 600);
    master.enable_channel(1, 1);
    master.write_i32(1, 0x607A, 0, 20_480);
    master.word(1, 0x1F);
    assert_ne!(master.status_of(1) & ACKNOWLEDGE, 0);
    master.word(1, 0x0F);
    master.run_ms(400);
    near(master.rpm(1), 600.0, 10.0);
    assert_eq!(master.status_of(1) & (ACKNOWLEDGE | REACHED), 0);
    master
}

/// Bit 9 is 0, bit 5 is 0: the first is completed, at rest, before the next one begins.
#[test]
fn one_after_the_other() {
    let mut master = on_the_way();
    master.write_i32(1, 0x607A, 0, 40_960);
    master.word(1, 0x1F);
    // Nothing new can be handed over while one waits.
    assert_ne!(master.status_of(1) & ACKNOWLEDGE, 0);
    master.word(1, 0x0F);
    assert_ne!(master.status_of(1) & ACKNOWLEDGE, 0);
    let (mut slowest, mut waited) = (600.0_f64, 0);
    while counts(&mut master) < 24_000.0 {
        master.run_ms(2);
        waited += 2;
        slowest = slowest.min(master.rpm(1));
        assert!(waited < 3000);
    }
    assert!(slowest < 30.0, "{slowest}");
    assert_eq!(master.status_of(1) & ACKNOWLEDGE, 0, "the next may come");
    master.run_ms(3000);
    near(counts(&mut master), 40_960.0, 20.0);
}

/// Bit 5: at once.
#[test]
fn at_once() {
    let mut master = on_the_way();
    let here = counts(&mut master);
    master.write_i32(1, 0x607A, 0, 0);
    master.word(1, 0x3F);
    master.word(1, 0x2F);
    let mut furthest = here;
    for _ in 0..1500 {
        master.run_ms(1);
        furthest = furthest.max(counts(&mut master));
    }
    assert!(furthest < here + 7000.0, "{furthest}");
    near(counts(&mut master), 0.0, 20.0);
    assert_ne!(master.status_of(1) & REACHED, 0);
}

/// Bit 9: through the first set-point with its velocity, and on.
#[test]
fn through_the_first() {
    let mut master = on_the_way();
    master.write_i32(1, 0x6081, 0, 300);
    master.write_i32(1, 0x607A, 0, 40_960);
    master.word(1, 0x21F);
    master.word(1, 0x20F);
    let (mut slowest, mut at_first) = (600.0_f64, 0.0);
    while counts(&mut master) < 30_000.0 {
        master.run_ms(2);
        slowest = slowest.min(master.rpm(1));
        if counts(&mut master) < 20_000.0 {
            at_first = master.rpm(1);
        }
    }
    near(at_first, 600.0, 12.0);
    assert!(slowest > 280.0, "{slowest}");
    near(master.rpm(1), 300.0, 12.0);
    master.run_ms(3000);
    near(counts(&mut master), 40_960.0, 20.0);
}

/// Bit 6: to the target before, not to where the motor is.
#[test]
fn relative_to_the_target_before() {
    let mut master = on_the_way();
    master.write_i32(1, 0x607A, 0, -4096);
    master.word(1, 0x7F);
    master.word(1, 0x6F);
    master.run_ms(3000);
    near(counts(&mut master), 20_480.0 - 4096.0, 20.0);
    // Mode -1 in its own unit.
    master.mode(1, -1);
    master.word(1, 0x0F);
    master.write_i32(1, 0x607A, 0, 500); // 10,000 counts
    master.word(1, 0x1F);
    master.word(1, 0x0F);
    master.run_ms(2500);
    assert_eq!(master.read(1, 0x6064, 0), 500);
    master.write_i32(1, 0x607A, 0, 100);
    master.word(1, 0x5F);
    master.word(1, 0x4F);
    master.run_ms(2500);
    assert_eq!(master.read(1, 0x6064, 0), 600);
}

/// R18: the speed that there is already, commanded once more.
#[test]
fn the_same_speed_again_does_not_alter_bit_10() {
    for (mode, index) in [(3, 0x60FF), (-3, 0x60FF), (2, 0x6042), (-4, 0x6042)] {
        let mut master = with_machine(&ROBOTEQ);
        master.enable_channel(1, mode);
        master.word(1, 0x7F);
        let write = |master: &mut Master, speed: i16| match index {
            0x6042 => master.write_i16(1, index, 0, speed),
            _ => master.write_i32(1, index, 0, i32::from(speed)),
        };
        write(&mut master, 400);
        assert_eq!(master.status_of(1) & REACHED, 0, "{mode}");
        master.run_ms(1000);
        assert_ne!(master.status_of(1) & REACHED, 0, "{mode}");
        for _ in 0..20 {
            write(&mut master, 400);
            assert_ne!(master.status_of(1) & REACHED, 0, "{mode}");
            master.run_us(300);
        }
        write(&mut master, 500);
        assert_eq!(master.status_of(1) & REACHED, 0, "{mode}");
    }
}
