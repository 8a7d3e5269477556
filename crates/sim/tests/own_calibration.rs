//! `client::calibrate`: a drive's own calibration, begun and followed over a virtual bus.

use canopen::{Address, NodeId};
use cia402::Mode;
use client::calibrate::{OwnCalibration, OwnError, StatusWords};
use client::session::{Progress, Watch};
use client::{Client, block_on};
use personalities::md80::MD80;
use sim::{Bus, BusSettings, DriveSettings, VirtualLink};

const NODE: NodeId = NodeId::new(1).unwrap();

/// The drive's calibration of that place in its list, with this much time.
fn own(place: usize, longest_ms: u64) -> OwnCalibration<'static> {
    let offered = &MD80.commissioning.calibrations[place];
    OwnCalibration {
        command: offered.command,
        mode: Mode(offered.mode),
        probe: offered.probe,
        status: offered.status,
        failed: offered.failed,
        restarts: offered.restarts,
        longest_ms,
    }
}

/// Ends it after so many looks.
struct Patience(u32);

impl Watch for Patience {
    fn progress(&mut self, _: &Progress) {}

    fn stop(&mut self) -> bool {
        self.0 = self.0.saturating_sub(1);
        self.0 == 0
    }
}

/// What came of it, and the drive's mode (0x6061) afterwards.
fn run(
    settings: DriveSettings,
    own: &OwnCalibration<'_>,
    mut watch: Patience,
) -> (Result<StatusWords, OwnError>, i64) {
    let mut bus = Bus::new(BusSettings::new(1, vec![settings]));
    let mut client = Client::new(VirtualLink::new(&mut bus, 1));
    block_on(async {
        let started = client.now().plus_ms(100);
        while client.receive(started).await.unwrap().is_some() {}
        let done = client.run_own_calibration(NODE, own, &mut watch).await;
        let mode = client.read(NODE, Address::new(0x6061, 0), canopen::DataType::I8);
        let mode = match mode.await {
            Ok(client::Value::Integer(mode)) => mode,
            other => panic!("{other:?}"),
        };
        (done, mode)
    })
}

const FOR_EVER: Patience = Patience(u32::MAX);

#[test]
fn a_calibration_ends_with_the_start_or_with_a_command_that_is_taken_again() {
    for place in [0, 2] {
        let (done, mode) = run(
            DriveSettings::new(NODE, &MD80),
            &own(place, 120_000),
            FOR_EVER,
        );
        let status = done.unwrap();
        assert!(status.iter().all(|(_, word)| *word == 0), "{status:?}");
        assert_eq!(mode, 0);
    }
}

#[test]
fn a_calibration_that_fails_is_told_with_its_status_words() {
    // Out of the box nothing is set.
    let fresh = DriveSettings::new(NODE, &MD80).factory();
    let (done, mode) = run(fresh, &own(0, 120_000), FOR_EVER);
    let Err(OwnError::Failed { status }) = done else {
        panic!("{done:?}");
    };
    assert_eq!(status[0].0, Address::new(0x2004, 1));
    assert_eq!(status[0].1 >> 4 & 1, 1, "{status:?}");
    let text = OwnError::Failed { status }.to_string();
    assert!(
        text.starts_with("the calibration has failed: 0x2004,1 is 0x"),
        "{text}"
    );
    assert_eq!(mode, 0);
}

#[test]
fn whoever_has_no_patience_takes_the_drive_out_of_the_mode() {
    let drive = || DriveSettings::new(NODE, &MD80);
    let (done, mode) = run(drive(), &own(0, 500), FOR_EVER);
    assert_eq!(done, Err(OwnError::TimedOut { after_ms: 500 }));
    assert_eq!(mode, 0);
    let (done, mode) = run(drive(), &own(0, 120_000), Patience(4));
    assert_eq!(done, Err(OwnError::Stopped));
    assert_eq!(mode, 0);
}

#[test]
fn a_command_that_is_refused_is_told() {
    // No output encoder is there.
    let (done, mode) = run(DriveSettings::new(NODE, &MD80), &own(1, 120_000), FOR_EVER);
    let Err(OwnError::Sdo(error)) = done else {
        panic!("{done:?}");
    };
    assert_eq!(error.abort().map(|abort| abort.0), Some(0x0800_0022));
    assert_eq!(mode, 0);
}
