//! The LSS procedures against devices, with and without lost frames.

#[path = "support/lss.rs"]
mod support;

use canopen::lss::{BitTiming, Identity, Known, Refusal, Service, State, StoreError};
use canopen::nmt::Command;
use canopen::{Instant, NodeId};
use client::lss::{Assigned, Cause, Found, Progress, Step};
use client::{Client, Link, LinkError, block_on};
use support::{Device, Devices, nth};

fn node(id: u8) -> NodeId {
    NodeId::new(id).unwrap()
}

fn nodes(ids: &[u8]) -> Vec<NodeId> {
    ids.iter().map(|id| node(*id)).collect()
}

#[test]
fn a_device_is_selected_asked_and_configured() {
    let other = Device::new(nth(8), Some(node(8)));
    let mut client = Client::new(Devices::new(vec![
        Device::new(nth(7), Some(node(7))),
        other,
    ]));
    block_on(async {
        let mut lss = client.lss();
        lss.select(nth(8)).await.unwrap();
        // Selecting one sends the other back.
        lss.select(nth(7)).await.unwrap();
        assert_eq!(lss.inquire_identity().await, Ok(nth(7)));
        assert_eq!(lss.inquire_node_id().await, Ok(Some(node(7))));
        lss.set_node_id(Some(node(17))).await.unwrap();
        lss.set_bit_timing(BitTiming::Kbit250).await.unwrap();
        lss.store().await.unwrap();
        lss.switch(State::Waiting).await.unwrap();
        assert_eq!(lss.identify(nth(0), nth(7)).await, Ok(true));
        assert_eq!(lss.identify(nth(0), nth(6)).await, Ok(false));
        assert_eq!(lss.identify_unconfigured().await, Ok(false));
        client
            .nmt(Command::ResetCommunication, Some(node(7)))
            .await
            .unwrap();
        let boot_up = client.receive(client.now().plus_ms(10)).await.unwrap();
        assert_eq!(boot_up.unwrap().1.raw_id(), 0x711);
    });
    let devices = client.into_link();
    assert_eq!(devices.ids(), [Some(17), Some(8)]);
    let stored: Vec<_> = devices.all.iter().map(|device| device.stored).collect();
    assert_eq!(
        stored,
        [
            (Some(node(17)), BitTiming::Kbit250),
            (Some(node(8)), BitTiming::Kbit1000)
        ]
    );
    assert!(devices.all_in(State::Waiting));
}

#[test]
fn bit_timing_is_activated_on_all_in_configuration() {
    let mut client = Client::new(Devices::new(vec![Device::new(nth(7), Some(node(7)))]));
    block_on(async {
        let mut lss = client.lss();
        lss.select(nth(7)).await.unwrap();
        lss.set_bit_timing(BitTiming::Kbit250).await.unwrap();
        lss.activate_bit_timing(20).await.unwrap();
        assert_eq!(
            lss.inquire_node_id().await.map_err(|e| e.is_time_out()),
            Err(true)
        );
    });
    let devices = client.into_link();
    assert_eq!(devices.all[0].slave.bit_timing(), BitTiming::Kbit250);
    // The delays are long over; it was silent through them only.
    assert!(!devices.all[0].slave.is_silent());
}

#[test]
fn failures_name_device_and_reason() {
    let mut client = Client::new(Devices::unconfigured(1));
    block_on(async {
        let mut lss = client.lss();
        let error = lss.select(nth(9)).await.unwrap_err();
        assert_eq!(
            error.to_string(),
            "device 0x00000408:0x00000003:0x00010002:0x00000BC1: selecting it: \
             no answer within 500 ms, asked 2 times"
        );
        assert!(error.is_time_out());
        lss.select(nth(0)).await.unwrap();
        let error = lss.set_bit_timing(BitTiming::Kbit800).await.unwrap_err();
        assert_eq!(
            error.to_string(),
            "device 0x00000408:0x00000003:0x00010002:0x00000BB8: setting its bit rate: \
             refused, bit rate not supported (error 1)"
        );
        lss.switch(State::Waiting).await.unwrap();
        lss.settings.attempts = 1;
        let error = lss.store().await.unwrap_err();
        assert_eq!(
            error.to_string(),
            "the device in LSS configuration: storing its configuration: no answer within 5000 ms"
        );
    });
}

#[test]
fn all_devices_without_a_node_id_are_found() {
    for count in [0, 1, 2, 5, 20] {
        let mut devices = Devices::unconfigured(count);
        devices.all.push(Device::new(nth(99), Some(node(9))));
        let mut client = Client::new(devices);
        let mut seen = Vec::new();
        let found = block_on(
            client
                .lss()
                .find_unconfigured(Known::NOTHING, &mut |progress| {
                    if let Progress::Found(identity) = progress {
                        seen.push(identity);
                    }
                }),
        );
        let all: Vec<Identity> = (0..count).map(nth).collect();
        assert_eq!(seen, all, "the lowest first");
        let expected = Found {
            devices: all,
            doubtful: Vec::new(),
        };
        assert_eq!(found, Ok(expected));
        let devices = client.into_link();
        assert!(devices.all_in(State::Waiting));
        assert!(devices.now < Instant(4_000_000_000 * u64::from(count + 1)));
    }
}

/// What is known makes a scan quicker; who has other numbers is not found.
#[test]
fn known_numbers_narrow_a_scan() {
    let mut devices = Devices::unconfigured(2);
    let stranger = Identity {
        vendor: 1,
        ..nth(5)
    };
    devices.all.push(Device::new(stranger, None));
    let mut client = Client::new(devices);
    let find = |client: &mut Client<Devices>, known| {
        let began = client.now();
        let found = block_on(client.lss().find_unconfigured(known, &mut |_| ()));
        (found.unwrap().devices, client.now().since_ns(began))
    };
    let (found, slow) = find(&mut client, Known::NOTHING);
    assert_eq!(found, [stranger, nth(0), nth(1)]);
    let ours = Known {
        vendor: Some(0x408),
        product: Some(3),
        revision: Some(0x0001_0002),
        serial: None,
    };
    let (found, quick) = find(&mut client, ours);
    assert_eq!(found, [nth(0), nth(1)]);
    assert!(quick * 2 < slow, "{quick} ns, {slow} ns");
    let one = Known {
        serial: Some(3_001),
        ..ours
    };
    assert_eq!(find(&mut client, one).0, [nth(1)]);
    let nobody = Known {
        serial: Some(1),
        ..ours
    };
    assert_eq!(find(&mut client, nobody).0, []);
    let nobody = Known {
        vendor: Some(2),
        ..Known::NOTHING
    };
    assert_eq!(find(&mut client, nobody).0, []);
}

#[test]
fn node_ids_are_assigned_in_order_and_stored() {
    let mut client = Client::new(Devices::unconfigured(3));
    let ids = nodes(&[5, 6, 9]);
    let assignment = block_on(client.lss().assign(&ids, Known::NOTHING, true, &mut |_| ()));
    let assignment = assignment.unwrap();
    let expected: Vec<Assigned> = ids
        .iter()
        .zip(0..)
        .map(|(node, n)| Assigned {
            identity: nth(n),
            node: *node,
            booted: true,
        })
        .collect();
    assert_eq!((assignment.assigned, assignment.more), (expected, false));
    let devices = client.into_link();
    assert_eq!(devices.ids(), [Some(5), Some(6), Some(9)]);
    for (device, id) in devices.all.iter().zip(ids) {
        assert_eq!(device.stored.0, Some(id));
    }
}

#[test]
fn more_devices_than_node_ids_and_the_other_way_round() {
    let assign = |count, ids: &[u8]| {
        let mut client = Client::new(Devices::unconfigured(count));
        let ids = nodes(ids);
        let assignment = block_on(
            client
                .lss()
                .assign(&ids, Known::NOTHING, false, &mut |_| ()),
        );
        let assignment = assignment.unwrap();
        let devices = client.into_link();
        assert!(devices.all.iter().all(|device| device.stored.0.is_none()));
        (assignment.assigned.len(), assignment.more, devices.ids())
    };
    assert_eq!(assign(3, &[5]), (1, true, vec![Some(5), None, None]));
    assert_eq!(assign(1, &[5, 6]), (1, false, vec![Some(5)]));
    assert_eq!(assign(0, &[5, 6]), (0, false, vec![]));
    assert_eq!(assign(2, &[]), (0, true, vec![None, None]));
}

/// A device that cannot store its node ID does not get it.
#[test]
fn a_refused_store_leaves_the_device_as_it_was() {
    for (reason, error, text) in [
        (
            StoreError::NotSupported,
            1,
            "storing is not supported (error 1)",
        ),
        (
            StoreError::Access,
            2,
            "the store cannot be written (error 2)",
        ),
        (
            StoreError::Specific(7),
            255,
            "maker's own error 7 (error 255)",
        ),
    ] {
        let mut devices = Devices::unconfigured(2);
        devices.all[1].store = Err(reason);
        let mut client = Client::new(devices);
        let ids = nodes(&[5, 6]);
        let assigned = block_on(client.lss().assign(&ids, Known::NOTHING, true, &mut |_| ()));
        let failure = assigned.unwrap_err();
        assert_eq!(
            (failure.identity, failure.step),
            (Some(nth(1)), Step::Store)
        );
        let refused = matches!(
            failure.cause,
            Cause::Refused(Refusal { service: Service::Store, error: code, .. }) if code == error
        );
        assert!(refused, "{failure}");
        assert!(failure.to_string().ends_with(text), "{failure}");
        let devices = client.into_link();
        assert_eq!(devices.ids(), [Some(5), None]);
        assert!(devices.all_in(State::Waiting));
        assert!(devices.all[1].slave.is_unconfigured());
    }
}

/// With one frame in 40 lost, node IDs are given to devices that are there, each another one, or
/// the procedure says why not.
#[test]
fn lost_frames_never_give_a_node_id_twice() {
    let mut whole = 0;
    for count in 1..=8 {
        let mut devices = Devices::unconfigured(count);
        devices.one_lost_in = 40;
        let mut client = Client::new(devices);
        let ids: Vec<NodeId> = (1..=20).map(node).collect();
        let mut lss = client.lss();
        lss.settings.attempts = 4;
        let result = block_on(lss.assign(&ids, Known::NOTHING, true, &mut |_| ()));
        let devices = client.into_link();
        let mut given: Vec<u8> = devices.ids().into_iter().flatten().collect();
        given.sort_unstable();
        let before = given.len();
        given.dedup();
        assert_eq!(given.len(), before, "a node ID was given twice");
        match result {
            Ok(assignment) => {
                for assigned in &assignment.assigned {
                    let device = devices
                        .all
                        .iter()
                        .find(|device| device.slave.identity() == assigned.identity)
                        .unwrap();
                    assert_eq!(device.slave.pending_node_id(), Some(assigned.node));
                }
                whole += u32::from(before == count as usize);
            }
            Err(error) => assert!(matches!(
                error.cause,
                Cause::TimedOut { .. } | Cause::Lost { .. }
            )),
        }
    }
    assert!(whole >= 4, "{whole} of 8 buses were configured in full");
}

/// Devices that answer too late for a scan are not taken for others: it ends and says so.
#[test]
fn devices_that_answer_late_are_reported() {
    let mut client = Client::new(Late {
        devices: Devices::unconfigured(1),
        late: Vec::new(),
    });
    let mut lss = client.lss();
    lss.settings.attempts = 1;
    let found = block_on(lss.find_unconfigured(Known::NOTHING, &mut |_| ()));
    match found {
        Ok(found) => assert_eq!(found.devices, []),
        Err(error) => {
            assert_eq!(error.cause, Cause::Lost { scans: 10 });
            assert_eq!(
                error.to_string(),
                "looking for unconfigured devices: devices answer, but 10 scans in a row found \
                 none of them; allow them more time, and check the numbers that are given as known"
            );
        }
    }
}

/// Delays what devices send by 25 ms.
struct Late {
    devices: Devices,
    late: Vec<(Instant, can::Frame)>,
}

impl Link for Late {
    fn now(&self) -> Instant {
        self.devices.now
    }

    async fn send(&mut self, frame: can::Frame) -> Result<(), LinkError> {
        self.devices.send(frame).await?;
        let now = self.devices.now.plus_us(130);
        while let Some((at, frame)) = self.devices.receive(now).await? {
            self.late.push((at.plus_ms(25), frame));
        }
        Ok(())
    }

    async fn receive(
        &mut self,
        until: Instant,
    ) -> Result<Option<(Instant, can::Frame)>, LinkError> {
        match self.late.first().copied() {
            Some((at, frame)) if at <= until => {
                self.late.remove(0);
                self.devices.receive(at).await?;
                Ok(Some((at, frame)))
            }
            _ => self.devices.receive(until).await,
        }
    }
}

#[test]
fn a_broken_link_is_reported_as_that() {
    struct Broken;
    impl Link for Broken {
        fn now(&self) -> Instant {
            Instant::ZERO
        }
        async fn send(&mut self, _: can::Frame) -> Result<(), LinkError> {
            Err(closed())
        }
        async fn receive(
            &mut self,
            _: Instant,
        ) -> Result<Option<(Instant, can::Frame)>, LinkError> {
            Ok(None)
        }
    }
    fn closed() -> LinkError {
        LinkError::Closed {
            door: "script".into(),
        }
    }
    let mut client = Client::new(Broken);
    let mut lss = client.lss();
    let error = block_on(lss.select(nth(0))).unwrap_err();
    assert_eq!(
        (error.step, error.cause),
        (Step::Select, Cause::Link(closed()))
    );
    let error = block_on(lss.find_unconfigured(Known::NOTHING, &mut |_| ())).unwrap_err();
    assert_eq!(
        (error.step, error.cause),
        (Step::Scan, Cause::Link(closed()))
    );
}
