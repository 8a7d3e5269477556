//! A stack that answers wrongly, twice, or not at all is not measured.

use bench::subject::{
    MAPPED, Polled, SDO_RESPONSE_COB_ID, SYNC_COB_ID, Subject, TPDO_COB_IDS, Wrong, run_poll,
    run_sync, run_upload, value_of,
};

type Frame = (u16, Vec<u8>);

/// A device written for these tests, with a fault to choose.
#[derive(Debug, Default)]
struct Device {
    published: [u32; 8],
    exchanges: u64,
    fault: Fault,
    waiting: Option<Frame>,
}

#[derive(Debug, Default, PartialEq)]
enum Fault {
    #[default]
    None,
    /// Answers an upload of the last object with a value one too high.
    WrongValue,
    /// Leaves out TPDO 3.
    MissingTpdo,
    /// Sends TPDO data of the SYNC before.
    OldData,
    /// Is silent in one exchange of the measured loop.
    OneSilence,
    /// Has one frame more to send after each exchange.
    ExtraFrame,
    /// Sends from the periodic call.
    Restless,
}

const OBJECTS: u16 = 20;

impl Subject for Device {
    type Received = Frame;
    type Sent = Frame;

    fn received(cob_id: u16, data: &[u8]) -> Frame {
        (cob_id, data.to_vec())
    }

    fn content(sent: &Frame) -> (u16, &[u8]) {
        (sent.0, &sent.1)
    }

    fn application_objects(&self) -> u16 {
        OBJECTS
    }

    fn exchange(&mut self, (cob_id, data): &Frame, _due: usize, mut taken: impl FnMut(Frame)) {
        self.exchanges += 1;
        if self.fault == Fault::OneSilence && self.exchanges == 20 {
            return;
        }
        if self.fault == Fault::ExtraFrame {
            self.waiting = Some((0x705, vec![5]));
        }
        if *cob_id == SYNC_COB_ID {
            for (i, cob_id) in TPDO_COB_IDS.into_iter().enumerate() {
                if self.fault == Fault::MissingTpdo && i == 2 {
                    continue;
                }
                let values = &self.published[2 * i..2 * i + 2];
                let data = values.iter().flat_map(|value| value.to_le_bytes());
                taken((cob_id, data.collect()));
            }
        } else {
            let index = u16::from_le_bytes([data[1], data[2]]);
            let last = index == MAPPED[0] + OBJECTS - 1;
            let error = u32::from(self.fault == Fault::WrongValue && last);
            let mut answer = vec![0x43, data[1], data[2], 0];
            answer.extend((value_of(index) + error).to_le_bytes());
            taken((SDO_RESPONSE_COB_ID, answer));
        }
    }

    fn publish(&mut self, values: &[u32; 8]) {
        if self.fault != Fault::OldData {
            self.published = *values;
        }
    }

    fn waiting(&mut self) -> Option<Frame> {
        self.waiting.take()
    }
}

impl Polled for Device {
    fn poll(&mut self) {
        if self.fault == Fault::Restless {
            self.waiting = Some((0x705, vec![5]));
        }
    }
}

fn device(fault: Fault) -> Device {
    Device {
        fault,
        ..Device::default()
    }
}

#[test]
fn a_right_device_passes_all_cases() {
    assert_eq!(run_upload(&mut device(Fault::None), 100), Ok(()));
    assert_eq!(run_sync(&mut device(Fault::None), 100), Ok(()));
    assert_eq!(run_poll(&mut device(Fault::None), 100), Ok(()));
}

#[test]
fn a_wrong_value_is_seen() {
    let wrong = run_upload(&mut device(Fault::WrongValue), 100);
    let answer = |low| (0x585, vec![0x43, 0x13, 0x20, 0, low, 0x20, 0x13, 0x20]);
    let expected = Wrong::Frame {
        what: "upload of 2013h".to_owned(),
        expected: Some(answer(0x13)),
        got: Some(answer(0x14)),
    };
    assert_eq!(wrong, Err(expected));
}

#[test]
fn a_missing_tpdo_and_old_data_are_seen() {
    for fault in [Fault::MissingTpdo, Fault::OldData] {
        let wrong = run_sync(&mut device(fault), 100);
        assert!(matches!(wrong, Err(Wrong::Frame { .. })), "{wrong:?}");
    }
}

#[test]
fn one_silence_in_the_loop_is_seen() {
    let upload = run_upload(&mut device(Fault::OneSilence), 100);
    let (expected, got) = (100, 99);
    assert_eq!(upload, Err(Wrong::Count { expected, got }));
    let sync = run_sync(&mut device(Fault::OneSilence), 100);
    let (expected, got) = (400, 396);
    assert_eq!(sync, Err(Wrong::Count { expected, got }));
}

#[test]
fn a_frame_too_many_is_seen() {
    let extra = Some((0x705, vec![5]));
    let wrong = |after: &str| {
        Err(Wrong::Frame {
            what: format!("after {after}"),
            expected: None,
            got: extra.clone(),
        })
    };
    let upload = run_upload(&mut device(Fault::ExtraFrame), 100);
    assert_eq!(upload, wrong("upload of 2000h"));
    let poll = run_poll(&mut device(Fault::Restless), 100);
    assert_eq!(poll, wrong("idle poll"));
}
