//! Acts upon encoders, gate drivers, switches and inputs.

use crate::bench::*;
use control::io::Magnet;
use plant::{GateDriverWords, OutputEncoder};
use sim::VirtualDrive;

#[test]
fn an_encoder_breaks_in_three_ways() {
    for (how, valid) in [
        ("stuck", true),
        ("no-answer", false),
        ("wrong-parity", false),
    ] {
        let mut master = event("break-encoder", &format!("how = \"{how}\""));
        let mut angle = 0;
        let readings = looks(&mut master, |drive| {
            // The shaft has been turned since the last look.
            angle += 1 << 28;
            drive.plant().set_motion(angle, 0.0);
            let sample = drive.plant().sample();
            (sample.encoder_valid, sample.encoder)
        });
        assert_eq!(
            readings.map(|(valid, _)| valid),
            [true, valid, true],
            "{how}"
        );
        assert_ne!(readings[1].1, readings[2].1, "{how}");
        if how == "stuck" {
            assert_eq!(readings[0].1, readings[1].1);
        }
    }
    let mut master = event("bad-encoder-answers", "share = \"25 %\"");
    let bad = |master: &mut Master| {
        (0..1000)
            .filter(|_| {
                master.run_us(50);
                !master.drive(1).plant().sample().encoder_valid
            })
            .count()
    };
    assert_eq!(bad(&mut master), 0);
    let some = bad(&mut master);
    // Four standard deviations.
    assert!((195..=305).contains(&some), "{some}");
    master.run_ms(200);
    assert_eq!(bad(&mut master), 0);
}

#[test]
fn the_magnet_moves_and_slips() {
    let magnet = |drive: &mut VirtualDrive| drive.plant().signals().magnet;
    let mut master = event("move-magnet", "to = \"2.5 mm\"");
    let good = Magnet::Good;
    assert_eq!(looks(&mut master, magnet), [good, Magnet::TooWeak, good]);
    let mut master = event("move-magnet", "to = \"0.1 mm\"");
    assert_eq!(looks(&mut master, magnet), [good, Magnet::TooStrong, good]);
    let mut master = event("slip-magnet", "by = \"-45 deg\"");
    let readings = looks(&mut master, |drive| drive.plant().sample().encoder);
    assert_eq!(readings, [0x0DF8, 0x0DF8 - 512, 0x0DF8 - 512]);
}

#[test]
fn switches_and_inputs_have_the_levels_that_are_asked_for() {
    let inputs = |drive: &mut VirtualDrive| drive.plant().signals().inputs;
    let on_the_way = "[drive.1.switches]\nnegative_limit = \"-3 turns\"\nhome_from = \"-1 turn\"\n\
                      home_to = \"1 turn\"\n";
    for (act, switch, levels) in [
        ("press-switch", "negative-limit", [0b100, 0b101, 0b100]),
        ("release-switch", "home", [0b100, 0b000, 0b100]),
    ] {
        let mut master = play(&format!(
            "{on_the_way}[[event]]\nat = \"100 ms\"\ndo = \"{act}\"\ndrive = 1\n\
             switch = \"{switch}\"\nfor = \"200 ms\"\n"
        ));
        assert_eq!(looks(&mut master, inputs), levels, "{act}");
    }
    let mut master = play(
        "[[event]]\nat = \"100 ms\"\ndo = \"set-input\"\ndrive = 1\ninput = 2\nlevel = \"high\"\n\
         [[event]]\nat = \"150 ms\"\ndo = \"set-input\"\ndrive = 1\ninput = \"interlock\"\n\
         level = \"high\"\n[[event]]\nat = \"300 ms\"\ndo = \"set-input\"\ndrive = 1\ninput = 2\n\
         level = \"low\"\n",
    );
    assert_eq!(looks(&mut master, inputs), [0, 1 << 17 | 1 << 3, 1 << 3]);
    let mut master = play(
        "[[event]]\nat = \"100 ms\"\ndo = \"analog-input\"\ndrive = 1\ninput = 1\nto = \"3.3 V\"\n\
         [[event]]\nat = \"300 ms\"\ndo = \"analog-input\"\ndrive = 1\ninput = 2\nto = \"1.1 V\"\n",
    );
    let analog = looks(&mut master, |drive| drive.plant().signals().auxiliary_adc);
    assert_eq!(analog, [[0.0, 0.0], [4095.0, 0.0], [4095.0, 1365.0]]);
    let mut master = event("torque-off", "");
    let asked = looks(&mut master, |drive| drive.plant().signals().torque_off);
    assert_eq!(asked, [false, true, false]);
}

/// A drive with a second encoder on the output of a gear of 1:1, that reads a quarter turn.
fn with_output(act: &str, arguments: &str) -> Master {
    let mut drive = p3(1);
    drive.plant.output_encoder = Some(OutputEncoder {
        zero_turns: 0.25,
        ..OutputEncoder::ideal(1.0)
    });
    play_upon(&one(act, arguments), vec![drive])
}

#[test]
fn an_encoder_is_turned_round() {
    let mut master = event("reverse-encoder", "");
    let readings = looks(&mut master, |drive| drive.plant().sample().encoder);
    assert_eq!(readings, [0x0DF8, 4096 - 0x0DF8, 0x0DF8]);
}

#[test]
fn the_output_encoder_breaks_is_turned_and_loses_its_magnet() {
    let reading = |drive: &mut VirtualDrive| drive.plant().signals().output_encoder;
    let quarter = Some(0.25);
    let mut master = with_output("break-output-encoder", "");
    assert_eq!(looks(&mut master, reading), [quarter, None, quarter]);
    let mut master = with_output("reverse-output-encoder", "");
    assert_eq!(looks(&mut master, reading), [quarter, Some(0.75), quarter]);
    let magnet = |drive: &mut VirtualDrive| drive.plant().output_magnet();
    let good = Some(Magnet::Good);
    let mut master = with_output("move-output-magnet", "to = \"2.5 mm\"");
    let weak = Some(Magnet::TooWeak);
    assert_eq!(looks(&mut master, magnet), [good, weak, good]);
    let mut master = with_output("move-output-magnet", "to = \"0.1 mm\"");
    let strong = Some(Magnet::TooStrong);
    assert_eq!(looks(&mut master, magnet), [good, strong, good]);
}

#[test]
fn gate_drivers_say_what_is_wrong_with_them() {
    let words = |drive: &mut VirtualDrive| {
        let words = drive.plant().gate_driver();
        (words.fault_pin, words.status)
    };
    let fine = (false, 0);
    for (act, arguments, bit) in [
        ("gate-supply", "to = \"6 V\"", GateDriverWords::UNDERVOLTAGE),
        (
            "heat-gate-drivers",
            "to = \"175 degC\"",
            GateDriverWords::TOO_HOT,
        ),
    ] {
        let mut master = event(act, arguments);
        let wrong = (true, GateDriverWords::FAULT | bit);
        assert_eq!(looks(&mut master, words), [fine, wrong, fine], "{act}");
    }
    let mut master = event("cut-gate-driver-link", "");
    let nobody = (false, 0xFFFF);
    assert_eq!(looks(&mut master, words), [fine, nobody, fine]);
}

#[test]
fn gate_drivers_without_their_supply_open_the_bridge() {
    let mut master =
        play("[[event]]\nat = \"300 ms\"\ndo = \"gate-supply\"\ndrive = 1\nto = \"5 V\"\n");
    master.enable(1, 3);
    master.write_i32(1, 0x60FF, 0, 100_000);
    master.run_ms(200);
    let flows = |master: &mut Master| {
        let amperes = master.drive(1).plant().truth().phase_current_a;
        amperes.iter().any(|a| a.abs() > 1e-3)
    };
    assert!(flows(&mut master));
    master.run_ms(100);
    assert!(!flows(&mut master));
}
