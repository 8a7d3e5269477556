//! The seam to what only one drive does, with a behaviour that no drive has.

use can::{Frame, StandardId};
use canopen::{Address, Image, Instant, NodeId, Reset, Verdict};
use cia402::{Demand, State};
use drive::{Drive, Hardware, Health, NoHost, Request};
use personalities::Personality;
use personalities::own::{AxisView, Heard, Orders, OwnBehaviour};
use personalities::p3_extended::P3_EXTENDED;

/// Answers every frame with its own until an NMT command comes; then controlword 0x1234 switches the axis
/// on with a voltage of its own, and 0x4321 asks for a save and, when that is done, for a reset.
#[derive(Clone, Debug)]
struct Odd {
    awake: bool,
    answer: Option<Frame>,
    demand: Option<Demand>,
    saves: bool,
    reset: Option<Reset>,
    ticks: u32,
}

impl OwnBehaviour for Odd {
    fn new(_: &'static Personality, _: &Image<'_>) -> Odd {
        Odd {
            awake: false,
            answer: None,
            demand: None,
            saves: false,
            reset: None,
            ticks: 0,
        }
    }

    fn waits(&self) -> bool {
        !self.awake
    }

    fn hear(&mut self, frame: &Frame, _: NodeId, _: &mut Image<'_>, _: &AxisView) -> Heard {
        if frame.key() == 0 {
            self.awake = true;
            return Heard::Boots;
        }
        self.answer = Some(*frame);
        Heard::Nothing
    }

    fn take_frame(&mut self) -> Option<Frame> {
        self.answer.take()
    }

    fn write(
        &mut self,
        _: &Image<'_>,
        object: Address,
        new: &[u8],
        _: &AxisView,
        orders: &mut Orders,
    ) -> Option<Verdict> {
        match (object.index, new) {
            (0x6040, [0x34, 0x12]) => {
                self.demand = Some(Demand::PhaseVoltage {
                    angle: 0,
                    voltage_d: 100,
                    voltage_q: 0,
                });
                orders.enable = Some(true);
                orders.new_demand = true;
                Some(Verdict::Done)
            }
            (0x6040, [0x21, 0x43]) => {
                self.saves = true;
                orders.store = Some(canopen::store::Request::All);
                Some(Verdict::Done)
            }
            _ => None,
        }
    }

    fn tick(&mut self, _: &mut Image<'_>, view: &AxisView, _: &mut Orders) {
        assert_eq!(view.axis, 0);
        self.ticks += 1;
    }

    fn demand(&self, _: u8) -> Option<&Demand> {
        self.demand.as_ref()
    }

    fn store_done(&mut self, stored: bool) {
        if core::mem::take(&mut self.saves) && stored {
            self.reset = Some(Reset::Node);
        }
    }

    fn take_reset(&mut self) -> Option<Reset> {
        self.reset.take()
    }
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::data_frame(StandardId::new(id).expect("an identifier"), data).expect("a frame")
}

fn frames(drive: &mut Drive<Vec<u8>, Odd>) -> Vec<Frame> {
    core::iter::from_fn(|| drive.transmit(&mut NoHost)).collect()
}

#[test]
fn a_drive_waits_answers_demands_and_starts_over_as_its_own_behaviour_says() {
    let hardware = Hardware {
        scales: plant::VIRTUAL_P3.scales,
        duty_margin: 0.0,
    };
    let memory = vec![0; P3_EXTENDED.device.table.image_bytes()];
    let id = NodeId::new(5).expect("a node ID");
    let made = Drive::<_, Odd>::new(
        &P3_EXTENDED,
        hardware,
        memory,
        id,
        1,
        &[],
        Health::default(),
    );
    let (mut drive, _) = made.expect("defaults that make a drive");
    let at = |ms: u64| Instant::ZERO.plus_ns(ms * 1_000_000);

    drive.start(at(0));
    assert_eq!(frames(&mut drive), [], "no boot-up frame yet");
    let question = frame(0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
    drive.receive(&question, at(1), &mut NoHost);
    assert_eq!(
        frames(&mut drive),
        [question],
        "the behaviour's answer, no SDO server's"
    );
    drive.poll(at(2), &mut NoHost);
    assert_eq!(frames(&mut drive), [], "time does not boot it");

    // The NMT command boots it and is obeyed: boot-up frame, and the node is operational.
    drive.receive(&frame(0, &[0x01, 5]), at(3), &mut NoHost);
    assert_eq!(frames(&mut drive)[0], frame(0x705, &[0]));
    drive.receive(&question, at(4), &mut NoHost);
    assert_eq!(
        frames(&mut drive)[0].data()[0],
        0x43,
        "now the SDO server answers"
    );

    let write = |word: [u8; 2]| frame(0x605, &[0x2B, 0x40, 0x60, 0, word[0], word[1], 0, 0]);
    drive.receive(&write([0x34, 0x12]), at(5), &mut NoHost);
    assert_eq!(frames(&mut drive)[0].data()[0], 0x60);
    assert_eq!(drive.comms().axis().state(), State::OperationEnabled);
    let signals = control::io::Signals::QUIET;
    let duty = drive.control_period(
        &plant::Plant::new(&plant::Parameters::default()).sample(),
        &signals,
    );
    assert!(duty.enabled, "its demand is that of the bridge");

    drive.receive(&write([0x21, 0x43]), at(6), &mut NoHost);
    assert_eq!(frames(&mut drive)[0].data()[0], 0x60);
    assert!(matches!(drive.take_request(), Some(Request::Store(_))));
    assert_eq!(drive.take_request(), None, "not before it is stored");
    drive.store_done(Ok(()), at(7));
    assert_eq!(frames(&mut drive), [], "no master waits for an answer");
    assert_eq!(drive.take_request(), Some(Request::Reset(Reset::Node)));
}
