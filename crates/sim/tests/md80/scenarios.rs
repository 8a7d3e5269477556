//! What scenarios do to an MD80, by value and time, and what it says of it.

use crate::bench::*;
use canopen::Instant;
use sim::scenario::Scenario;
use sim::{Bus, BusSettings};

/// An MD80 with an encoder on its output, which is configured; the act comes at 300 ms, for 200 ms.
fn played(act: &str) -> Master {
    let text = format!(
        "[drive.5.encoder]\noutput_gear = 0.111111\n\
         [[event]]\nat = \"300 ms\"\ndrive = 5\nfor = \"200 ms\"\n{act}\n"
    );
    let scenario = Scenario::read("md80.toml", &text).unwrap_or_else(|error| panic!("{error}"));
    let mut settings = BusSettings::new(7, vec![md80()]);
    let set_up = scenario.set_up(&mut settings, Instant::NEVER);
    set_up.unwrap_or_else(|error| panic!("{error}"));
    let mut master = Master {
        bus: Bus::new(settings),
        log: Vec::new(),
    };
    master.run_ms(100);
    master.write_u16(NODE, 0x2000, 12, 0);
    master.write_i32(NODE, 0x2005, 1, 1);
    master.write_i32(NODE, 0x2005, 3, 1);
    master.log.clear();
    master
}

#[test]
fn acts_are_found_and_told_within_their_time() {
    for (act, sub, bit, code) in [
        ("do = \"break-encoder\"\nhow = \"no-answer\"", 1, 0, 0x7305),
        ("do = \"move-magnet\"\nto = \"0.2 mm\"", 1, 5, 0x7305),
        ("do = \"break-output-encoder\"", 2, 0, 0x7306),
        ("do = \"move-output-magnet\"\nto = \"3 mm\"", 2, 5, 0x7306),
        ("do = \"cut-gate-driver-link\"", 4, 0, 0x7510),
        ("do = \"gate-supply\"\nto = \"7 V\"", 4, 2, 0x5410),
        (
            "do = \"heat-gate-drivers\"\nto = \"171 degC\"",
            4,
            2,
            0x5410,
        ),
        ("do = \"motor-supply\"\nto = \"58 V\"", 5, 1, 0x3210),
        ("do = \"motor-supply\"\nto = \"8 V\"", 5, 2, 0x3220),
        ("do = \"heat-motor\"\nto = \"85 degC\"", 5, 3, 0x4310),
        ("do = \"heat-amplifier\"\nto = \"105 degC\"", 5, 4, 0x4210),
    ] {
        let mut master = played(act);
        let now_ms = master.now().0 / 1_000_000;
        master.run_ms(290 - now_ms);
        assert!(!status_bit(&mut master, sub, bit), "{act}: before");
        assert!(master.emergencies(NODE).is_empty(), "{act}");
        master.run_ms(120);
        assert!(status_bit(&mut master, sub, bit), "{act}");
        assert_eq!(master.emergency_codes(NODE), [code], "{act}");
        assert_eq!(master.state(NODE), FAULT, "{act}");
        assert_eq!(master.read(NODE, 0x1001, 0), 1);
        // It is over: a fault reset ends all but the critical ones.
        master.run_ms(300);
        master.write_u16(NODE, 0x6040, 0, 0x80);
        master.run_ms(10);
        let is_critical = matches!((sub, bit), (1, 0) | (1, 5) | (4, 0));
        let wanted = if is_critical {
            FAULT
        } else {
            SWITCH_ON_DISABLED
        };
        assert_eq!(master.state(NODE), wanted, "{act}");
        let codes = master.emergency_codes(NODE);
        let told: &[u16] = if is_critical { &[code] } else { &[code, 0] };
        assert_eq!(codes, told, "{act}");
    }
}
