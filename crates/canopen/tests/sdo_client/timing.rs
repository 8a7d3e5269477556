//! Time and turns: deadlines, spurious calls, other identifiers, frames that are not the server's.

use can::{ExtendedId, Frame, StandardId};
use canopen::sdo_client::{Channel, Method, NoData, Progress, SdoClient, Settings, Stage};
use canopen::{CobId, Instant, NodeId};

use crate::dialogue::{OBJECT, answer, client, done};

#[test]
fn the_deadline_counts_from_sending() {
    let mut client = client(Settings {
        answer_ns: 7,
        ..Settings::DEFAULT
    });
    assert_eq!((client.stage(), client.outcome()), (None, None));
    client.upload(OBJECT, Method::Segmented).unwrap();
    client.poll(Instant(1_000_000));
    assert_eq!(client.next_deadline(), Instant::NEVER);
    assert!(client.transmit(Instant(2_000_000), &mut NoData).is_some());
    assert_eq!(client.next_deadline(), Instant(2_000_007));
    client.poll(Instant(2_000_006));
    assert_eq!(client.stage(), Some(Stage::Initiate));
    client.poll(Instant(2_000_007));
    assert_eq!(client.stage(), None);
    client.poll(Instant::NEVER);
}

#[test]
fn a_client_without_transfer_takes_and_sends_nothing() {
    let mut client = client(Settings::DEFAULT);
    for text in ["43 452306 01020304", "80 452306 00000206"] {
        assert!(!client.receive(&answer(text), Instant(1), &mut NoData));
    }
    client.cancel(canopen::Abort::GENERAL);
    assert_eq!(client.transmit(Instant(1), &mut NoData), None);
    assert_eq!(client.outcome(), None);
    assert_eq!(client.progress(), Progress::default());
}

/// One identifier of 11 and one of 29 bits, by COB-ID and directly.
#[test]
fn a_connection_has_any_two_identifiers() {
    let request = ExtendedId::new(0x0123_4567).unwrap();
    let reply = StandardId::new(0x6F0).unwrap();
    let by_cob_id = Channel::from_cob_ids(CobId(0x2123_4567), CobId(0x6F0)).unwrap();
    assert_eq!(by_cob_id, Channel::new(request, reply));
    for (channel, sent, data) in [
        (by_cob_id, "01234567#4045230600000000", "6F0"),
        (
            Channel::new(reply, request),
            "6F0#4045230600000000",
            "01234567",
        ),
        (
            Channel::of(NodeId::new(127).unwrap()),
            "67F#4045230600000000",
            "5FF",
        ),
    ] {
        let mut client = SdoClient::new(channel, Settings::DEFAULT);
        client.upload(OBJECT, Method::Segmented).unwrap();
        let request = client.transmit(Instant(1), &mut NoData).unwrap();
        assert_eq!(request.to_string(), sent);
        let bytes = [0x4F, 0x45, 0x23, 6, 1, 0, 0, 0];
        let raw = u32::from_str_radix(data, 16).unwrap();
        // The same number with the other length of identifier is another frame, and so is a
        // remote request.
        let standard = StandardId::new((raw & 0x7FF) as u16).unwrap();
        let extended = ExtendedId::new(raw).unwrap();
        let standard = Frame::data_frame(standard, &bytes).unwrap();
        let extended = Frame::data_frame(extended, &bytes).unwrap();
        let (own, other) = match data.len() {
            8 => (extended, standard),
            _ => (standard, extended),
        };
        assert!(!client.receive(&other, Instant(2), &mut NoData), "{other}");
        let remote = Frame::remote_frame(own.id(), 8).unwrap();
        assert!(!client.receive(&remote, Instant(2), &mut NoData));
        let empty = Frame::data_frame(own.id(), &[]).unwrap();
        assert!(!client.receive(&empty, Instant(2), &mut NoData));
        let mut sink = |_: u32, _: &[u8]| Ok(());
        assert!(client.receive(&own, Instant(2), &mut sink));
        assert_eq!(client.outcome(), Some(done(1)));
    }
    let off = CobId(0x8000_0600);
    assert_eq!(Channel::from_cob_ids(off, CobId(0x580)), None);
    assert_eq!(Channel::from_cob_ids(CobId(0x600), off), None);
}

/// An answer to what has not been asked yet is nobody's.
#[test]
fn no_answer_is_taken_before_its_request_was_sent() {
    let mut client = client(Settings::DEFAULT);
    client.upload(OBJECT, Method::Segmented).unwrap();
    let early = answer("43 452306 01020304");
    assert!(!client.receive(&early, Instant(1), &mut NoData));
    assert_eq!(client.stage(), Some(Stage::Initiate));
    assert!(client.transmit(Instant(1), &mut NoData).is_some());
    let begin = answer("41 452306 07000000");
    assert!(client.receive(&begin, Instant(1), &mut NoData));
    let early = answer("01 00010203040506");
    assert!(!client.receive(&early, Instant(1), &mut NoData));
    assert_eq!(client.stage(), Some(Stage::Segment));
}
