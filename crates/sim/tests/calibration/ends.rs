//! Ends that do not go smoothly: entries that are not saved, writes that get lost, a drive that another
//! master keeps enabled, a fault between two short waits.

use std::cell::Cell;

use can::{Frame, StandardId};
use canopen::Address;
use client::session::{Cause, Left};
use client::{Link, LinkError};

use super::refusals::{is_without_power, objects};
use super::*;

/// What becomes of a frame on its way to the bus.
enum Fate {
    Sent,
    Lost,
    /// Another one goes out.
    Changed(Frame),
    /// Another one goes out before it.
    Behind(Frame),
}

/// A link to a bus on which somebody meddles with what is sent, and looks at what comes.
struct Meddled<'a, S, R> {
    link: VirtualLink<'a>,
    sends: S,
    receives: R,
}

impl<S, R> Link for Meddled<'_, S, R>
where
    S: FnMut(Instant, &Frame) -> Fate,
    R: FnMut(&mut Bus, Instant, &Frame),
{
    fn now(&self) -> Instant {
        self.link.now()
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        match (self.sends)(self.link.now(), &frame) {
            Fate::Sent => self.link.send(frame).await,
            Fate::Lost => Ok(()),
            Fate::Changed(other) => self.link.send(other).await,
            Fate::Behind(other) => {
                self.link.send(other).await?;
                self.link.send(frame).await
            }
        }
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        let received = self.link.receive(until).await?;
        if let Some((at, frame)) = received {
            (self.receives)(self.link.bus(), at, &frame);
        }
        Ok(received)
    }
}

/// The value that an expedited SDO request to the drive writes to this object.
fn written(frame: &Frame, index: u16, sub: u8) -> Option<u32> {
    let [low, high] = index.to_le_bytes();
    match (frame.raw_id(), frame.data()) {
        (0x601, [command, a, b, c, data @ ..])
            if command & 0xE0 == 0x20 && [*a, *b, *c] == [low, high, sub] =>
        {
            let mut bytes = [0; 4];
            bytes[..data.len()].copy_from_slice(data);
            Some(u32::from_le_bytes(bytes))
        }
        _ => None,
    }
}

/// The same request with another value.
fn with_value(frame: &Frame, value: u32) -> Frame {
    let mut data = frame.data().to_vec();
    let bytes = value.to_le_bytes();
    let length = data.len() - 4;
    data[4..].copy_from_slice(&bytes[..length]);
    Frame::data_frame(StandardId::new(0x601).unwrap(), &data).unwrap()
}

fn nothing(_: &mut Bus, _: Instant, _: &Frame) {}

/// A bus with a motor whose data sheet is entered.
fn prepared(personality: &'static Personality) -> Bus {
    let motor = individual(3);
    let mut bus = bus(&motor, personality, 1);
    let mut client = Client::new(VirtualLink::new(&mut bus, 0));
    block_on(enter(&mut client, NODE, &motor.sheet));
    drop(client);
    bus
}

#[test]
fn a_save_that_ends_in_the_middle_says_what_is_saved_and_what_is_not() {
    for (is_lost, text) in [
        (
            false,
            "; saved: 0x3009,1 (current sensor bias, phase A); \
             not saved: 0x3009,2 (current sensor bias, phase B)",
        ),
        (
            true,
            "; saved: 0x3009,1 (current sensor bias, phase A); \
             perhaps saved: 0x3009,2 (current sensor bias, phase B)",
        ),
    ] {
        let mut bus = prepared(&P3);
        let sends = |_: Instant, frame: &Frame| match written(frame, 0x1010, 4) {
            Some(0x300902) if is_lost => Fate::Lost,
            // There is no such entry.
            Some(0x300902) => Fate::Changed(with_value(frame, 0xFFFF_FFFF)),
            _ => Fate::Sent,
        };
        let link = Meddled {
            link: VirtualLink::new(&mut bus, 0),
            sends,
            receives: nothing,
        };
        let mut client = Client::new(link);
        let mut session = Session::new(&mut client, NODE, ());
        block_on(async {
            session.calibrate_current_sensor().await.unwrap();
            let found = session.found().to_vec();
            let error = session.save().await.unwrap_err();
            assert_eq!(error.saved, found[..1]);
            assert_eq!(error.unsaved, found[1..]);
            assert_eq!(error.is_unsure(), is_lost);
            let shown = error.to_string();
            assert!(shown.starts_with("node 1: writing 0x1010,4: "), "{shown}");
            assert!(shown.ends_with(text), "{shown}");
            // What is not saved can still be.
            assert_eq!(session.found(), &found[1..]);
        });
    }
}

#[test]
fn pdos_get_their_old_values_again_though_a_write_gets_lost() {
    // Off, on, and again while the recording ends.
    for number in [3, 4] {
        let mut bus = prepared(&P3);
        let before = objects(&mut bus);
        let seen = Cell::new(0);
        let sends = |_: Instant, frame: &Frame| {
            let is_parameter = written(frame, 0x1803, 1).is_some();
            seen.set(seen.get() + u32::from(is_parameter));
            match is_parameter && seen.get() == number {
                true => Fate::Lost,
                false => Fate::Sent,
            }
        };
        let error = {
            let mut client = Client::new(Meddled {
                link: VirtualLink::new(&mut bus, 0),
                sends,
                receives: nothing,
            });
            let mut session = Session::new(&mut client, NODE, ());
            block_on(session.calibrate_electrical_zero(Method::Turn)).unwrap_err()
        };
        assert!(seen.get() > number, "{number}");
        assert_eq!(error.left, Left::Safe, "{error}");
        assert_eq!(objects(&mut bus), before, "{error}");
        assert!(is_without_power(&mut bus));
    }
}

/// The error of a calibration beside a master that enables the drive whenever it is disabled; also
/// whether that master sends SYNC.
fn fought_over(bus: &mut Bus, sends_sync: bool) -> ProcedureError {
    let sync = Frame::data_frame(StandardId::new(0x80).unwrap(), &[]).unwrap();
    let sends = |_: Instant, frame: &Frame| match written(frame, 0x6040, 0) {
        // As if the other one were quicker.
        Some(0) => Fate::Changed(with_value(frame, 0x000F)),
        _ if sends_sync => Fate::Behind(sync),
        _ => Fate::Sent,
    };
    let last = Cell::new(Instant::ZERO);
    let receives = |bus: &mut Bus, at: Instant, _: &Frame| {
        if sends_sync && at.since_ns(last.get()) > 100_000_000 {
            last.set(at);
            bus.send(2, sync);
        }
    };
    let mut client = Client::new(Meddled {
        link: VirtualLink::new(bus, 0),
        sends,
        receives,
    });
    let mut session = Session::new(&mut client, NODE, ());
    block_on(session.calibrate_electrical_zero(Method::Turn)).unwrap_err()
}

#[test]
fn a_drive_that_keeps_the_power_is_left_without_sync_until_it_takes_it_away() {
    for personality in [&P3, &P3_EXTENDED] {
        let mut bus = prepared(personality);
        let before = objects(&mut bus);
        let error = fought_over(&mut bus, false);
        let is_told = matches!(
            error.cause,
            Cause::Unreached {
                wanted: cia402::State::SwitchOnDisabled,
                ..
            }
        );
        assert!(is_told, "{error}");
        assert_eq!(error.left, Left::Safe, "{error}");
        assert!(is_without_power(&mut bus));
        assert_eq!(objects(&mut bus), before, "{error}");
    }
}

#[test]
fn a_drive_that_keeps_the_power_for_ever_is_told_to_do_so() {
    let mut bus = prepared(&P3);
    let zero = |bus: &mut Bus| {
        let mut client = Client::new(VirtualLink::new(bus, 0));
        block_on(client.read(NODE, Address::new(0x3011, 1), canopen::DataType::I16)).unwrap()
    };
    let before = zero(&mut bus);
    // The other master's clock.
    write(&mut bus, 0x1017, 50);
    let error = fought_over(&mut bus, true);
    let Left::Powered {
        statusword,
        restored,
    } = error.left
    else {
        panic!("{error}");
    };
    assert_eq!(statusword & 0x6F, 0x27, "{error}");
    assert!(restored, "{error}");
    let text = error.to_string();
    assert!(
        text.contains("the drive does not go to switch on disabled, statusword 0x")
            && text.contains("switch its motor supply off"),
        "{text}"
    );
    assert!(!text.contains("does not answer"), "{text}");
    assert!(!is_without_power(&mut bus));
    assert_eq!(zero(&mut bus), before);
}

/// Writes a 16-bit object.
fn write(bus: &mut Bus, index: u16, value: i64) {
    let mut client = Client::new(VirtualLink::new(bus, 0));
    let data = client::Value::Integer(value)
        .encode(canopen::DataType::U16)
        .unwrap();
    block_on(client.download(NODE, Address::new(index, 0), data)).unwrap();
}

/// The end of a procedure whose drive loses its supply after so many readings or angles: the error,
/// and how long after the drive's emergency the power was taken away, ms.
fn ended_by_a_fault(
    personality: &'static Personality,
    after: u32,
    work: impl AsyncFnOnce(&mut Session<'_, DynLink<'_>, ()>) -> ProcedureError,
) -> (ProcedureError, f64) {
    let mut bus = prepared(personality);
    let (steps, fault, off) = (Cell::new(0), Cell::new(None), Cell::new(None));
    let mut sends = |now: Instant, frame: &Frame| {
        let is_reading = matches!(frame.data(), [0x40, 0x08, 0x30, ..]);
        if is_reading || written(frame, 0x60EA, 0).is_some() {
            steps.set(steps.get() + 1);
        }
        if written(frame, 0x6040, 0) == Some(0) && off.get().is_none() {
            off.set(Some(now));
        }
        Fate::Sent
    };
    let mut receives = |bus: &mut Bus, at: Instant, frame: &Frame| {
        // The drive says so a while after.
        if steps.get() == after {
            bus.drive(NODE).unwrap().plant().set_supply_v(8.0);
        }
        if frame.raw_id() == 0x81 && fault.get().is_none() {
            fault.set(Some(at));
        }
    };
    let error = {
        let link: DynLink<'_> = Meddled {
            link: VirtualLink::new(&mut bus, 0),
            sends: &mut sends,
            receives: &mut receives,
        };
        let mut client = Client::new(link);
        let mut session = Session::new(&mut client, NODE, ());
        block_on(work(&mut session))
    };
    assert!(is_without_power(&mut bus));
    let (fault, off) = (fault.get().unwrap(), off.get().unwrap());
    (error, off.since_ns(fault) as f64 * 1e-6)
}

type DynLink<'a> = Meddled<
    'a,
    &'a mut dyn FnMut(Instant, &Frame) -> Fate,
    &'a mut dyn FnMut(&mut Bus, Instant, &Frame),
>;

#[test]
fn a_fault_between_short_waits_is_seen_within_fifty_milliseconds() {
    for personality in [&P3, &P3_EXTENDED] {
        // Readings every 25 ms; then angles every few milliseconds.
        let (sensor, late_ms) = ended_by_a_fault(personality, 4, async |session| {
            session.calibrate_current_sensor().await.unwrap_err()
        });
        assert!(late_ms < 60.0, "{late_ms} ms: {sensor}");
        let (zero, late_ms) = ended_by_a_fault(personality, 40, async |session| {
            let zero = session.calibrate_electrical_zero(Method::Turn).await;
            zero.unwrap_err()
        });
        assert!(late_ms < 60.0, "{late_ms} ms: {zero}");
        for error in [sensor, zero] {
            assert_eq!(error.cause, Cause::Fault { code: Some(0x3220) }, "{error}");
            assert_eq!(error.left, Left::Safe, "{error}");
        }
    }
}
