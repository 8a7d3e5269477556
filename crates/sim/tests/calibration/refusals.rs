//! What is not calibrated: rotors that are blocked or carry something, motors with a broken wire,
//! supplies that are off. And what is left behind by every kind of end.

use std::cell::Cell;

use can::Frame;
use canopen::{Address, DataType};
use cia402::State;
use client::axis::Axis;
use client::session::{Cause, Left, Progress, Watch};
use client::{Link, LinkError, Value};

use super::*;

/// What spoils a calibration.
#[derive(Clone, Copy, Debug)]
enum Trouble {
    Blocked,
    Inertia(f64),
    /// Of rated torque.
    Friction(f64),
    Weight(f64),
    WrongPoles(i64),
}

/// The error of a calibration of the electrical zero.
fn spoilt(seed: u64, trouble: Trouble) -> Result<ProcedureError, String> {
    let mut motor = individual(seed);
    let rated = motor.sheet.rated_torque_mnm as f64 * 1e-3;
    match trouble {
        Trouble::Inertia(ratio) => {
            motor.truth.load.inertia_kgm2 = ratio * motor.truth.motor.rotor_inertia_kgm2;
        }
        Trouble::Friction(part) => motor.truth.load.coulomb_friction_nm = part * rated,
        Trouble::WrongPoles(more) => motor.sheet.poles += more,
        Trouble::Blocked | Trouble::Weight(_) => {}
    }
    let mut bus = bus(&motor, personality(seed), seed);
    let plant = bus.drive(NODE).unwrap().plant();
    match trouble {
        Trouble::Blocked => plant.set_blocked(true),
        Trouble::Weight(part) => plant.set_load_torque_nm((part * rated) as f32),
        _ => {}
    }
    let error = {
        let mut client = Client::new(VirtualLink::new(&mut bus, 0));
        block_on(async {
            enter(&mut client, NODE, &motor.sheet).await;
            let mut session = Session::new(&mut client, NODE, ());
            match session.calibrate_current_sensor().await {
                Ok(_) => session.calibrate_electrical_zero(Method::Turn).await.err(),
                Err(error) => Some(error),
            }
        })
    };
    let error = error.ok_or(format!("motor {seed} was calibrated with {trouble:?}"))?;
    match is_without_power(&mut bus) {
        true => Ok(error),
        false => Err(format!("motor {seed} has power with {trouble:?}: {error}")),
    }
}

/// The drive is not in operation enabled, and no current flows but what a turning shaft drives
/// through the diodes.
pub(crate) fn is_without_power(bus: &mut Bus) -> bool {
    bus.run_until(bus.now().plus_ms(50));
    bus.take_traffic();
    let truth = bus.drive(NODE).unwrap().plant().truth();
    let turns = truth.speed_rad_s.abs() > 100.0;
    let flows = truth.phase_current_a.iter().any(|a| a.abs() > 1e-3);
    let mut client = Client::new(VirtualLink::new(bus, 0));
    let word = block_on(Axis::new(NODE).statusword(&mut client)).unwrap();
    word.state() != Some(State::OperationEnabled) && (turns || !flows)
}

#[test]
fn a_loaded_or_blocked_rotor_is_refused_in_every_case() {
    let mut refused = 0;
    for trouble in [
        Trouble::Blocked,
        Trouble::Inertia(1.0),
        Trouble::Inertia(4.0),
        Trouble::Inertia(20.0),
        Trouble::Friction(0.3),
        Trouble::Friction(1.5),
        Trouble::Weight(0.15),
        Trouble::Weight(0.8),
        Trouble::WrongPoles(2),
        Trouble::WrongPoles(8),
    ] {
        let all = for_each(20, |seed| spoilt(seed, trouble));
        for result in all {
            let error = result.unwrap_or_else(|text| panic!("{text}"));
            let text = error.to_string();
            assert!(
                matches!(error.cause, Cause::Implausible(_) | Cause::NotReady(_)),
                "{trouble:?}: {text}"
            );
            assert!(matches!(error.left, Left::Safe | Left::Untouched), "{text}");
            if matches!(trouble, Trouble::WrongPoles(2)) {
                assert!(text.contains("pole count"), "{text}");
            }
            refused += 1;
        }
    }
    println!("{refused} refused");
}

/// Objects that a procedure may change.
const OBJECTS: [(u16, u8, DataType); 14] = [
    (0x1803, 1, DataType::U32),
    (0x1803, 2, DataType::U8),
    (0x1A03, 0, DataType::U8),
    (0x1403, 1, DataType::U32),
    (0x1603, 0, DataType::U8),
    (0x2406, 0, DataType::U16),
    (0x3009, 1, DataType::U16),
    (0x3011, 1, DataType::I16),
    (0x3011, 2, DataType::I8),
    (0x3013, 5, DataType::U32),
    (0x3019, 10, DataType::U16),
    (0x6071, 0, DataType::I16),
    (0x6080, 0, DataType::I32),
    (0x60B2, 0, DataType::I16),
];

pub(crate) fn objects(bus: &mut Bus) -> Vec<Value> {
    let mut client = Client::new(VirtualLink::new(bus, 0));
    let read = |client: &mut Client<VirtualLink<'_>>, object: (u16, u8, DataType)| {
        let address = Address::new(object.0, object.1);
        block_on(client.read(NODE, address, object.2)).unwrap()
    };
    OBJECTS.map(|object| read(&mut client, object)).to_vec()
}

/// Stops after so many looks.
struct Patience<'a>(&'a Cell<u32>);

impl Watch for Patience<'_> {
    fn progress(&mut self, _: &Progress) {}

    fn stop(&mut self) -> bool {
        self.0.set(self.0.get().saturating_sub(1));
        self.0.get() == 0
    }
}

#[test]
fn whoever_stops_finds_the_motor_without_power_and_the_objects_as_they_were() {
    let motor = individual(3);
    for personality in [&P3, &P3_EXTENDED] {
        for looks in [1, 3, 20, 60, 200, 500, 1_000, 1_500, 2_000, 2_600, 3_200] {
            let mut bus = bus(&motor, personality, 1);
            {
                let mut client = Client::new(VirtualLink::new(&mut bus, 0));
                block_on(enter(&mut client, NODE, &motor.sheet));
            }
            let before = objects(&mut bus);
            let left = Cell::new(looks);
            let ended = {
                let mut client = Client::new(VirtualLink::new(&mut bus, 0));
                let mut session = Session::new(&mut client, NODE, Patience(&left));
                block_on(async {
                    session.calibrate_current_sensor().await?;
                    session.calibrate_electrical_zero(Method::Turn).await?;
                    session.calibrate_encoder_lag().await?;
                    Ok::<(), ProcedureError>(())
                })
            };
            let error = ended.expect_err("it takes longer than that");
            assert_eq!(error.cause, Cause::Stopped, "{looks}");
            assert!(
                matches!(error.left, Left::Safe | Left::Untouched),
                "{looks}: {error}"
            );
            assert!(is_without_power(&mut bus), "{looks}");
            assert_eq!(objects(&mut bus), before, "{looks}");
        }
    }
}

/// Notes the current with which the rotor is led, mA.
struct Notes<'a>(&'a Cell<f64>);

impl Watch for Notes<'_> {
    fn progress(&mut self, progress: &Progress) {
        if let Progress::Measured {
            what: "current of the d axis",
            value,
            ..
        } = progress
        {
            self.0.set(*value);
        }
    }

    fn stop(&mut self) -> bool {
        false
    }
}

/// 0x3011,11; where that is 0, half of the continuous current. It is raised in steps of a tenth.
#[test]
fn the_calibration_current_is_the_drives() {
    let motor = individual(3);
    let continuous = motor.sheet.continuous_ma;
    for (written, wanted) in [
        (continuous / 4, continuous / 4),
        (continuous * 4 / 5, continuous * 4 / 5),
        (0, continuous / 2),
    ] {
        let mut bus = bus(&motor, &P3, 1);
        let seen = Cell::new(0.0);
        let mut client = Client::new(VirtualLink::new(&mut bus, 0));
        block_on(async {
            enter(&mut client, NODE, &motor.sheet).await;
            let data = Value::Integer(written).encode(DataType::I16).unwrap();
            let object = Address::new(0x3011, 11);
            client.download(NODE, object, data).await.unwrap();
            let mut session = Session::new(&mut client, NODE, Notes(&seen));
            session.calibrate_current_sensor().await.unwrap();
            session.calibrate_phase_order().await.unwrap();
        });
        let part = seen.get() / wanted as f64;
        assert!((0.99..1.25).contains(&part), "{written} mA: {part}");
    }
}

/// A link that breaks after so many frames.
struct Breaking<'a> {
    link: VirtualLink<'a>,
    left: u32,
}

impl Breaking<'_> {
    fn closed() -> LinkError {
        LinkError::Closed {
            door: "test".to_owned(),
        }
    }
}

impl Link for Breaking<'_> {
    fn now(&self) -> Instant {
        self.link.now()
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        self.left = self.left.saturating_sub(1);
        match self.left {
            0 => Err(Breaking::closed()),
            _ => self.link.send(frame).await,
        }
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        match self.left {
            0 => Err(Breaking::closed()),
            _ => self.link.receive(until).await,
        }
    }
}

#[test]
fn a_lost_link_leaves_a_motor_that_loses_its_power_by_itself() {
    let motor = individual(3);
    for personality in [&P3, &P3_EXTENDED] {
        for frames in [120, 300, 500, 800] {
            let mut bus = bus(&motor, personality, 1);
            let mut client = Client::new(VirtualLink::new(&mut bus, 0));
            block_on(enter(&mut client, NODE, &motor.sheet));
            drop(client);
            let error = {
                let link = Breaking {
                    link: VirtualLink::new(&mut bus, 0),
                    left: frames,
                };
                let mut client = Client::new(link);
                let mut session = Session::new(&mut client, NODE, ());
                block_on(session.calibrate_electrical_zero(Method::Turn)).unwrap_err()
            };
            assert_eq!(error.left, Left::Unknown { within_ms: 1_000 }, "{error}");
            let text = error.to_string();
            assert!(text.contains("within 1000 ms"), "{text}");
            assert!(!is_without_power(&mut bus), "{frames}");
            bus.run_until(bus.now().plus_ms(1_100));
            assert!(is_without_power(&mut bus), "{frames}");
        }
    }
}

#[test]
fn what_is_wrong_before_is_told_before_and_a_fault_in_the_middle_with_its_code() {
    let motor = individual(3);
    for (waits_ms, left) in [(400, Left::Untouched), (0, Left::Safe)] {
        let mut bus = bus(&motor, &P3, 1);
        // Too little for the bridge; the drive itself minds after 450 ms.
        bus.drive(NODE).unwrap().plant().set_supply_v(10.0);
        bus.run_until(bus.now().plus_ms(waits_ms));
        let error = {
            let mut client = Client::new(VirtualLink::new(&mut bus, 0));
            let mut session = Session::new(&mut client, NODE, ());
            block_on(session.calibrate_electrical_zero(Method::Turn)).unwrap_err()
        };
        let text = error.to_string();
        assert_eq!(error.left, left, "{text}");
        match left {
            Left::Untouched => assert!(
                text.starts_with("node 1: the motor supply (0x3000,1) is 1")
                    && text.contains("expected 18 to 52 V"),
                "{text}"
            ),
            _ => assert!(text.contains("0x603F is 0x3220"), "{text}"),
        }
        assert!(is_without_power(&mut bus));
    }
}
