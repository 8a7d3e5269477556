//! Which test proves what an object of the P3 does. `WRITE_COVERAGE=1 cargo test -p servobus-sim
//! --test coverage` writes the table of docs/coverage-p3.md from here; nothing may be missing.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use personalities::p3::OBJECTS;

/// Objects (index, sub-indices), what is proved, and by which test: a file, and a function in it or
/// the transcript that it plays.
#[rustfmt::skip]
const ROWS: &[(&str, &str, &str)] = &[
    ("0002-0007 0", "take what a PDO brings and do nothing", "crates/canopen/tests/pdo_receive.rs dummies"),
    ("1000 0, 1006 0, 1008 0, 1009 0, 100A 0, 1018 1-4, 1200 1-2, 6502 0", "read as what the drive is", "crates/sim/tests/objects.rs identity_and_constants"),
    ("1001 0, 1002 0, 1003 0, 603F 0", "show the errors of every row of the fault table", "crates/sim/tests/fault_table/main.rs every_row_of_both_tables_is_proved"),
    ("1003 1-8", "the history, newest first", "crates/sim/tests/faults.rs the_history_keeps_the_newest_first"),
    ("1005 0", "the identifier of SYNC", "crates/canopen/tests/sync.rs cob_id"),
    ("1010 1-3", "save all, communication, application", "crates/sim/tests/lifecycle.rs what_is_stored_is_there_after_a_reset"),
    ("1010 4", "saves one entry, and refuses what cannot be stored", "crates/sim/tests/node_id.rs a_single_entry_must_be_one_that_can_be_stored"),
    ("1014 0", "the identifier of emergencies", "crates/canopen/tests/emergency.rs cob_id"),
    ("1015 0", "is kept, without effect", "crates/sim/tests/objects.rs what_is_only_kept_is_kept"),
    ("1017 0", "heartbeats", "transcripts/p3/nmt-and-heartbeats.txt"),
    ("1F80 0", "where the node goes after boot-up", "transcripts/p3/boot-to-pre-operational.txt"),
    ("1400-1403 1-2", "identifiers and types of RPDOs", "crates/canopen/tests/pdo_receive.rs synchronous_types"),
    ("1600-1603 0-4", "mappings of RPDOs", "crates/canopen/tests/pdo_mapping.rs the_p3s_own_procedure"),
    ("1800-1803 1-2", "identifiers and types of TPDOs", "crates/canopen/tests/pdo_transmit.rs types"),
    ("1800-1803 3-5", "are kept, without effect (not implemented, l.830)", "crates/sim/tests/objects.rs what_is_only_kept_is_kept"),
    ("1A00-1A03 0-4", "mappings of TPDOs", "transcripts/p3/pdo-example-1.txt"),
    ("2104 0, 2105 0, 606D 0, 606E 0", "velocity error that warns, and that is a fault", "crates/sim/tests/faults.rs velocity_errors_warn_and_then_stop"),
    ("2110 0, 2111 0", "the user's current limits", "crates/sim/tests/physics.rs a_blocked_shaft_heats_the_motor_until_i2t_limits"),
    ("2112 0, 3011 10", "how long the peak current may last", "crates/sim/tests/objects.rs the_peak_time_sets_when_i2t_limits"),
    ("2120 0, 2121 0, 6065 0, 6066 0", "following error that warns, and that is a fault", "crates/sim/tests/faults.rs following_errors_warn_and_then_stop"),
    ("21B0 0", "another node ID", "crates/sim/tests/node_id.rs an_id_is_usable_at_once_and_the_motion_goes_on"),
    ("220A 0, 2384 9", "temperatures that are faults", "crates/sim/tests/faults.rs heat_is_a_fault_while_enabled"),
    ("2384 6-7", "supply voltages that are faults", "crates/sim/tests/faults.rs too_high_a_supply_is_a_fault_and_a_short_dip_is_none"),
    ("2402 0, 6098 0, 607C 0", "homing on the spot", "transcripts/p3/homing.txt"),
    ("2403 0", "magnet too near or too far: a fault where it is 1", "crates/sim/tests/fault_table/main.rs every_row_of_both_tables_is_proved"),
    ("2404 0", "lost frames: a fault where it is 1", "crates/sim/tests/lifecycle.rs frames_faster_than_the_drive_can_take_them_are_lost_and_may_be_a_fault"),
    ("2405 0", "recovery from bus-off: a fault where it is 1", "crates/sim/tests/lifecycle.rs recovery_from_bus_off_is_a_fault_where_it_is_asked_for"),
    ("2406 0", "the time-out of SYNC", "crates/sim/tests/faults.rs sync_loss_counts_from_when_it_is_switched_on"),
    ("3000 1-2, 3010 3, 3022 1-2", "show supply, temperatures and analog inputs", "crates/sim/tests/objects.rs converters_are_shown"),
    ("3001 1", "PWM frequency and control rate", "crates/sim/tests/physics.rs another_pwm_frequency_is_another_control_rate_and_the_same_motion"),
    ("3001 2", "the timer's dead time and its compensation", "crates/sim/tests/bridge_times.rs under_load_the_fundamental_is_lost_without_a_compensation_and_only_the_diodes_with_one"),
    ("3001 3-4", "by how much the switches are late: the angle, the converters' start, the least dead time", "crates/sim/tests/bridge_times.rs the_drivers_delay_turns_the_field_back_to_the_rotor"),
    ("3001 5-6", "the shortest pulse in which a current can be read", "crates/sim/tests/bridge_times.rs the_pulse_for_the_converters_takes_its_part_of_the_voltage"),
    ("3001 7", "when the timer can take a duty", "crates/sim/tests/bridge_times.rs slow_converters_delay_the_duty_and_the_angle_knows"),
    ("3001 8, 3011 9", "the greatest current", "crates/sim/tests/objects.rs the_current_is_limited_by_amplifier_and_motor"),
    ("3001 9", "the longest voltage vector", "crates/sim/tests/objects.rs the_phase_voltage_limits_the_speed"),
    ("3008 1, 3009 1", "sense of phase A and its bias", "transcripts/p3/calibrate-current-sensor.txt"),
    ("3008 2, 3009 2", "the same of phase B", "crates/sim/tests/calibration/main.rs"),
    ("3010 4, 60EA 0", "voltage and angle of mode 12", "crates/sim/tests/angle_modes.rs mode_12_stalls_the_rotor_under_the_given_angle"),
    ("3010 5", "q-axis voltage: in mode 12 only", "crates/sim/tests/angle_modes.rs angle_and_voltage_are_refused_where_they_are_not_used"),
    ("3010 6", "shows the d-axis current", "crates/sim/tests/angle_modes.rs mode_12_is_limited_as_every_mode"),
    ("3011 1, 3011 3, 3012 1, 3013 1", "make the electrical angle of a reading", "crates/sim/tests/objects.rs zero_poles_and_resolution_make_the_angle"),
    ("3011 2, 607E 0", "the directions", "crates/sim/tests/objects.rs polarities"),
    ("3011 4, 6076 0, 6071 0, 6077 0, 6078 0", "torque and its current", "crates/sim/tests/objects.rs torque_constant_and_rated_torque_make_the_current"),
    ("3011 5-6, 3019 1-4", "the current controllers", "crates/sim/tests/objects.rs a_current_controller_that_cannot_be_is_a_parameter_error"),
    ("3011 7, 3019 10-11", "the velocity controller's bandwidth and damping", "crates/sim/tests/gains.rs bandwidth_and_damping_show_the_gains_that_they_make"),
    ("3011 11", "the current with which `calibrate` leads the rotor", "crates/sim/tests/calibration/refusals.rs the_calibration_current_is_the_drives"),
    ("3011 8", "the continuous current", "crates/sim/tests/i2t.rs the_limit_comes_when_each_rule_says"),
    ("3013 5", "how far the angle looks ahead", "crates/sim/tests/angle_modes.rs the_lag_object_turns_the_field_back_to_the_rotor"),
    ("3019 5, 3019 7-9", "the position controller, by bandwidth and directly", "crates/sim/tests/gains.rs a_position_loop_can_have_an_integral_and_a_derivative_part"),
    ("3019 6", "how stiffly the position is held", "crates/sim/tests/gains.rs a_damping_of_the_position_loop_is_its_stiffness"),
    ("3019 12-13", "the velocity controller's gains, given", "crates/sim/tests/gains.rs given_gains_take_effect_and_show_their_bandwidth_and_damping"),
    ("3019 14, 60B2 0", "its derivative part; the torque offset", "crates/sim/tests/gains.rs a_velocity_derivative_acts_like_inertia"),
    ("3023 1", "shows the torque demand", "crates/sim/tests/physics.rs torque_over_inertia_is_the_acceleration"),
    ("3023 2, 6043 0, 606C 0, 60FF 0", "velocity: target, demand, actual, error", "crates/sim/tests/physics.rs every_mode_moves_the_motor_as_commanded"),
    ("6040 0, 6041 0", "the state machine", "transcripts/p3/state-machine.txt"),
    ("6046 1-2, 60C5 0, 60C6 0", "limits of velocity and acceleration that warn", "crates/sim/tests/faults.rs limits_of_speed_and_acceleration_warn"),
    ("605A 0", "what a quick stop does", "crates/sim/tests/faults.rs quick_stop_frees_or_holds"),
    ("6060 0, 6061 0", "the modes", "transcripts/p3/modes.txt"),
    ("6064 0", "shows the position, and presets it", "crates/sim/tests/physics.rs the_position_can_be_renamed_while_it_is_held"),
    ("6072 0", "the greatest torque", "crates/sim/tests/physics.rs a_lower_torque_limit_slows_the_ramp_in_every_mode"),
    ("607A 0, 6081 0, 6083 0, 6084 0", "a profile and its target", "crates/sim/tests/moves.rs a_profile_position_move_ends_at_its_target"),
    ("607D 1-2, 60B0 0", "position limits; the position offset", "crates/sim/tests/objects.rs a_position_offset_moves_the_target_and_limits_cut_it"),
    ("607F 0, 6080 0", "velocity limits", "crates/sim/tests/physics.rs velocity_limits_hold_and_say_so"),
    ("60B1 0", "the velocity offset", "crates/sim/tests/gains.rs a_position_loop_can_have_an_integral_and_a_derivative_part"),
    ("60C2 1-2", "the time of a cyclic set-point", "crates/sim/tests/objects.rs the_interpolation_period_is_the_time_of_a_set_point"),
    ("60F4 0, 60FC 0", "following error and position demand", "crates/sim/tests/physics.rs the_following_error_is_there_while_moving_and_gone_afterwards"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// `n` or `n-m`.
fn range(text: &str, radix: u32) -> std::ops::RangeInclusive<u32> {
    let number = |text| u32::from_str_radix(text, radix).unwrap_or_else(|_| panic!("{text}"));
    match text.split_once('-') {
        Some((first, last)) => number(first)..=number(last),
        None => number(text)..=number(text),
    }
}

/// The objects of one row.
fn objects(text: &str) -> Vec<(u16, u8)> {
    let mut all = Vec::new();
    for object in text.split(", ") {
        let (indices, subs) = object.split_once(' ').expect("index and sub-index");
        for index in range(indices, 16) {
            all.extend(range(subs, 10).map(|sub| (index as u16, sub as u8)));
        }
    }
    all
}

fn dictionary() -> Vec<(u16, u8, &'static str)> {
    let mut all = Vec::new();
    for row in OBJECTS.table().rows() {
        for step in 0..row.count {
            all.push((row.address.index, row.address.sub + step, row.name));
        }
    }
    all
}

#[test]
fn every_object_has_a_test_and_every_test_is_there() {
    let known = dictionary();
    let mut proved: Vec<(u16, u8)> = ROWS.iter().flat_map(|row| objects(row.0)).collect();
    let missing: Vec<_> = known
        .iter()
        .filter(|object| !proved.contains(&(object.0, object.1)))
        .map(|(index, sub, name)| format!("{index:04X},{sub} {name}"))
        .collect();
    assert!(missing.is_empty(), "no test: {missing:#?}");
    let strange: Vec<_> = proved
        .iter()
        .filter(|object| !known.iter().any(|k| (k.0, k.1) == **object))
        .collect();
    assert!(strange.is_empty(), "no such object: {strange:04X?}");
    let listed = proved.len();
    proved.sort_unstable();
    proved.dedup();
    assert_eq!(proved.len(), listed, "an object stands twice");

    for (of, _, test) in ROWS {
        let (file, name) = test.split_once(' ').unwrap_or((test, ""));
        let text = std::fs::read_to_string(root().join(file))
            .unwrap_or_else(|error| panic!("{file}: {error}"));
        match name {
            // A transcript speaks of each of its objects; low byte first.
            "" if file.ends_with(".txt") => {
                for (index, sub) in objects(of) {
                    let [low, high] = index.to_le_bytes();
                    let is_there = text.contains(&format!("{low:02X} {high:02X}"));
                    assert!(is_there, "{file}: {index:04X},{sub}");
                }
            }
            "" => {}
            name => assert!(text.contains(&format!("fn {name}(")), "{file}: no {name}"),
        }
    }
}

#[test]
fn the_page_is_true() {
    let names = dictionary();
    let mut table = String::from("| object | name | what is proved | test |\n|---|---|---|---|\n");
    let mut lines: Vec<(u16, u8, String)> = Vec::new();
    for (of, what, test) in ROWS {
        for (index, sub) in objects(of) {
            let name = names
                .iter()
                .find(|n| (n.0, n.1) == (index, sub))
                .map_or("", |n| n.2);
            let (file, function) = test.split_once(' ').unwrap_or((test, ""));
            let test = match function {
                "" => format!("`{file}`"),
                function => format!("`{file}`, `{function}`"),
            };
            let line = format!("| 0x{index:04X},{sub} | {name} | {what} | {test} |");
            lines.push((index, sub, line));
        }
    }
    lines.sort();
    for (_, _, line) in &lines {
        writeln!(table, "{line}").unwrap();
    }
    let path = root().join("docs/coverage-p3.md");
    let is = std::fs::read_to_string(&path).expect("docs/coverage-p3.md");
    let (begin, end) = ("<!-- objects -->\n", "<!-- end -->\n");
    let from = is.find(begin).expect("a table") + begin.len();
    let to = is.find(end).expect("the table's end");
    let mut text = is.clone();
    text.replace_range(from..to, &table);
    if is != text {
        assert!(
            std::env::var_os("WRITE_COVERAGE").is_some(),
            "docs/coverage-p3.md is not what the rows say; write it anew with \
             WRITE_COVERAGE=1 cargo test -p servobus-sim --test coverage"
        );
        std::fs::write(&path, text).expect("the page");
    }
}
