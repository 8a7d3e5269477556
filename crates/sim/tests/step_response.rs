//! Step responses of the velocity and the position loop: the table of docs/p3/pid.md, measured on a
//! simulated drive. `WRITE_STEPS=1 cargo test -p servobus-sim --test step_response` writes it there.

mod master;

use std::fmt::Write as _;
use std::path::Path;

use master::*;

const BEGIN: &str = "<!-- steps -->\n";
const END: &str = "<!-- end steps -->\n";
/// Time between two looks, µs.
const LOOK_US: u64 = 100;

struct Response {
    rise_ms: f64,
    overshoot_percent: f64,
    settled_ms: f64,
}

/// Follows a quantity of the shaft after a step from `from` to `to`.
fn follow(master: &mut Master, from: f64, to: f64, look: fn(&mut Master) -> f64) -> Response {
    let mut trace = Vec::new();
    for _ in 0..4_000 {
        master.run_us(LOOK_US);
        trace.push((look(master) - from) / (to - from));
    }
    let at = |part: f64| {
        let n = trace
            .iter()
            .position(|value| *value >= part)
            .expect("it gets there");
        (n + 1) as f64 * LOOK_US as f64 * 1e-3
    };
    let last_outside = trace.iter().rposition(|value| (value - 1.0).abs() > 0.05);
    let peak = trace.iter().copied().fold(0.0, f64::max);
    Response {
        rise_ms: at(0.9) - at(0.1),
        overshoot_percent: 100.0 * (peak - 1.0).max(0.0),
        settled_ms: last_outside.map_or(0.0, |n| (n + 2) as f64 * LOOK_US as f64 * 1e-3),
    }
}

fn speed(master: &mut Master) -> f64 {
    let truth = master.drive(1).plant().truth().speed_rad_s;
    f64::from(truth) / std::f64::consts::TAU * 4096.0
}

fn position(master: &mut Master) -> f64 {
    master.drive(1).plant().truth().position_turns() * 4096.0
}

/// A step of 10,000 counts/s in cyclic synchronous velocity.
fn velocity_step(bandwidth_hz: f64, damping: f64) -> Response {
    let mut master = Master::new(&[1]);
    master.write_u16(1, 0x3019, 10, (10.0 * bandwidth_hz) as u16);
    master.write_u16(1, 0x3019, 11, (256.0 * damping).round() as u16);
    master.enable(1, 9);
    master.run_ms(20);
    let from = speed(&mut master);
    master.write_i32(1, 0x60FF, 0, 10_000);
    follow(&mut master, from, 10_000.0, speed)
}

/// A step of 200 counts in cyclic synchronous position.
fn position_step(bandwidth_hz: f64, damping: f64) -> Response {
    let mut master = Master::new(&[1]);
    master.write_u16(1, 0x3019, 5, (10.0 * bandwidth_hz) as u16);
    master.write_u16(1, 0x3019, 6, (256.0 * damping).round() as u16);
    master.enable(1, 8);
    let target = master.position(1) + 200;
    let from = position(&mut master);
    master.write_i32(1, 0x607A, 0, target);
    follow(&mut master, from, from + 200.0, position)
}

#[test]
fn the_table_of_steps_is_true() {
    let mut table = String::from(
        "| loop | bandwidth, Hz | damping | rise 10 to 90 %, ms | overshoot, % | within 5 % after, ms |\n\
         |---|---:|---:|---:|---:|---:|\n",
    );
    let mut row = |name: &str, bandwidth: f64, damping: &str, response: &Response| {
        writeln!(
            table,
            "| {name} | {bandwidth} | {damping} | {:.1} | {:.0} | {:.1} |",
            response.rise_ms, response.overshoot_percent, response.settled_ms
        )
        .unwrap();
    };
    let mut before = f64::INFINITY;
    for bandwidth in [20.0, 50.0, 100.0] {
        for damping in [0.7, 1.0, 1.5] {
            let response = velocity_step(bandwidth, damping);
            row("velocity", bandwidth, &damping.to_string(), &response);
            if damping == 1.0 {
                assert!(response.rise_ms < before, "a quicker loop rises quicker");
                before = response.rise_ms;
            }
        }
    }
    for (bandwidth, damping) in [
        (5.0, 1.0),
        (10.0, 1.0),
        (20.0, 0.7),
        (20.0, 1.0),
        (20.0, 1.5),
    ] {
        let response = position_step(bandwidth, damping);
        // A first-order loop rises within ln 9/ω; the velocity loop inside adds a little.
        let first_order_ms = 9.0_f64.ln() / (std::f64::consts::TAU * bandwidth) * 1e3;
        let ratio = response.rise_ms / first_order_ms;
        assert!((0.6..1.3).contains(&ratio), "{bandwidth} Hz: {ratio}");
        row("position", bandwidth, &damping.to_string(), &response);
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/p3/pid.md");
    let text = std::fs::read_to_string(&path).expect("docs/p3/pid.md");
    let from = text.find(BEGIN).expect("the table's begin") + BEGIN.len();
    let to = text.find(END).expect("the table's end");
    if text[from..to] == table {
        return;
    }
    assert!(
        std::env::var_os("WRITE_STEPS").is_some(),
        "docs/p3/pid.md is not what was measured:\n{table}\
         write it anew with WRITE_STEPS=1 cargo test -p servobus-sim --test step_response"
    );
    let new = format!("{}{table}{}", &text[..from], &text[to..]);
    std::fs::write(&path, new).expect("docs/p3/pid.md can be written");
}
