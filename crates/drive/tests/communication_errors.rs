//! Errors of communication that a node notices: what a drive that knows them sends, and one that
//! does not.

use canopen::{Instant, NodeId};
use drive::{CommunicationErrors, Drive, Hardware, Health};
use personalities::{Personality, p3, p3_extended};

type AnyDrive = Drive<Vec<u8>>;

fn drive(personality: &'static Personality) -> AnyDrive {
    let hardware = Hardware {
        scales: plant::VIRTUAL_P3.scales,
        duty_margin: 0.0,
    };
    let memory = vec![0; personality.device.table.image_bytes()];
    let id = NodeId::new(5).expect("a node ID");
    let made = Drive::new(personality, hardware, memory, id, 1, &[], Health::default());
    let (mut drive, _) = made.expect("defaults that make a drive");
    drive.start(Instant::ZERO);
    drive
}

/// The emergencies of the next millisecond: code, error register, code of the ended error.
fn tick(drive: &mut AnyDrive, ms: &mut u64) -> Vec<(u16, u8, u16)> {
    *ms += 1;
    drive.poll(Instant::ZERO.plus_ms(*ms));
    let mut seen = Vec::new();
    while let Some(frame) = drive.transmit() {
        if frame.raw_id() == 0x85 {
            let bytes = frame.bytes();
            let code = u16::from_le_bytes([bytes[0], bytes[1]]);
            seen.push((code, bytes[2], u16::from_le_bytes([bytes[6], bytes[7]])));
        }
    }
    seen
}

const NONE: CommunicationErrors = CommunicationErrors {
    heartbeat_lost: false,
    rpdo_timeout: false,
    error_passive: false,
    pdo_too_short: false,
    pdo_too_long: false,
    sync_length: false,
};

#[test]
fn each_has_its_code_and_is_a_warning_of_communication() {
    // CiA 301 7.2.7.1, table 26; conditions last, events are over with the next millisecond.
    let cases = [
        (
            0x8130,
            true,
            CommunicationErrors {
                heartbeat_lost: true,
                ..NONE
            },
        ),
        (
            0x8250,
            true,
            CommunicationErrors {
                rpdo_timeout: true,
                ..NONE
            },
        ),
        (
            0x8120,
            true,
            CommunicationErrors {
                error_passive: true,
                ..NONE
            },
        ),
        (
            0x8210,
            false,
            CommunicationErrors {
                pdo_too_short: true,
                ..NONE
            },
        ),
        (
            0x8220,
            false,
            CommunicationErrors {
                pdo_too_long: true,
                ..NONE
            },
        ),
        (
            0x8240,
            false,
            CommunicationErrors {
                sync_length: true,
                ..NONE
            },
        ),
    ];
    for (code, lasts, errors) in cases {
        let mut drive = drive(&p3_extended::P3_EXTENDED);
        let mut ms = 0;
        assert_eq!(tick(&mut drive, &mut ms), []);
        drive.report_communication(errors);
        // Generic and communication.
        assert_eq!(tick(&mut drive, &mut ms), [(code, 0x11, 0)]);
        if lasts {
            for _ in 0..10 {
                assert_eq!(tick(&mut drive, &mut ms), [], "0x{code:04X}");
            }
            assert!(drive.comms().axis().statusword().warning());
            drive.report_communication(NONE);
        }
        assert_eq!(tick(&mut drive, &mut ms), [(0, 0, code)], "0x{code:04X}");
        assert_eq!(tick(&mut drive, &mut ms), []);
        let state = drive.comms().axis().state();
        assert_eq!(state, cia402::State::SwitchOnDisabled, "no fault");
    }
}

#[test]
fn an_event_that_is_reported_twice_in_a_millisecond_is_one() {
    let mut drive = drive(&p3_extended::P3_EXTENDED);
    let mut ms = 0;
    let short = CommunicationErrors {
        pdo_too_short: true,
        ..NONE
    };
    drive.report_communication(short);
    // What else is reported in between does not take it away.
    drive.report_communication(NONE);
    drive.report_communication(short);
    assert_eq!(tick(&mut drive, &mut ms), [(0x8210, 0x11, 0)]);
    assert_eq!(tick(&mut drive, &mut ms), [(0, 0, 0x8210)]);
}

#[test]
fn the_faithful_drive_knows_none_of_them() {
    let mut drive = drive(&p3::P3);
    let mut ms = 0;
    drive.report_communication(CommunicationErrors {
        heartbeat_lost: true,
        rpdo_timeout: true,
        error_passive: true,
        pdo_too_short: true,
        pdo_too_long: true,
        sync_length: true,
    });
    for _ in 0..5 {
        assert_eq!(tick(&mut drive, &mut ms), []);
    }
}
