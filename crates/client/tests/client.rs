//! The client against real nodes, and against servers that misbehave.

mod support;

use canopen::nmt::Command;
use canopen::{Abort, Address, DataType, NmtState, NodeId};
use client::scan::Scan;
use client::sdo::{Cause, Data};
use client::{
    Client, Link, LinkError, Observed, RequestForm, Settings, Value, WaitError, Way, block_on,
};
use support::{NODE, Nodes, Scripted, frame};

const TORQUE: Address = Address::new(0x6071, 0);
const TWO: NodeId = NodeId::new(2).unwrap();

/// A client of booted nodes.
fn booted(ids: &[NodeId]) -> Client<Nodes> {
    let mut client = Client::new(Nodes::new(ids));
    let booted = block_on(client.receive(client.now().plus_ms(10))).unwrap();
    assert_eq!(booted.unwrap().1, frame("701#00"));
    client
}

#[test]
fn objects_of_a_node_are_written_and_read_back() {
    for form in [RequestForm::Standard, RequestForm::Short] {
        let mut client = booted(&[NODE]);
        client.settings.form = form;
        block_on(async {
            let value = Value::Integer(-100).encode(DataType::I16).unwrap();
            client.download(NODE, TORQUE, value).await.unwrap();
            // The node answers 0x42 with four bytes (P2); the type tells how many count.
            let read = client.read(NODE, TORQUE, DataType::I16).await;
            assert_eq!(read, Ok(Value::Integer(-100)));
            let name = client
                .read(NODE, Address::new(0x1008, 0), DataType::Text)
                .await;
            assert_eq!(name, Ok(Value::Text("P3".into())));
            let data = client.upload(NODE, TORQUE).await.unwrap();
            assert_eq!(
                (data.bytes(), data.is_sized()),
                (&[0x9C, 0xFF, 0, 0][..], false)
            );
        });
    }
}

#[test]
fn refusals_carry_node_object_and_abort() {
    let mut client = booted(&[NODE]);
    let data = Data::sized(&[8]).unwrap();
    let error = block_on(client.download(NODE, Address::new(0x6060, 0), data)).unwrap_err();
    assert_eq!(error.abort(), Some(Abort::DEVICE_STATE));
    assert_eq!(
        error.to_string(),
        "node 1: writing 0x6060,0: refused, 0x08000022: data cannot be transferred or stored \
         because of the present device state"
    );
    let error = block_on(client.upload(NODE, Address::new(0x5000, 0))).unwrap_err();
    assert_eq!(error.abort(), Some(Abort::NO_OBJECT));
}

#[test]
fn silence_times_out_after_all_attempts() {
    let mut client = Client::new(Scripted::new());
    client.settings = Settings {
        answer_ms: 20,
        attempts: 3,
        ..Settings::default()
    };
    let error = block_on(client.upload(NODE, TORQUE)).unwrap_err();
    assert_eq!(
        error.cause,
        Cause::TimedOut {
            answer_ms: 20,
            attempts: 3
        }
    );
    assert_eq!(
        error.to_string(),
        "node 1: reading 0x6071,0: no answer within 20 ms, asked 3 times"
    );
    assert_eq!(client.link().sent, ["601#4071600000000000"; 3]);
    assert_eq!(client.now().0, 60_000_000);
}

#[test]
fn stale_answers_and_emergencies_do_not_disturb_and_are_kept() {
    let stale = "581#4264600001000000";
    let written = "581#6071600000000000";
    let emergency = "081#1032050000000000";
    let answer = "581#4271600064000000";
    let other = "582#4271600063000000";
    let link = Scripted::new().on(
        "601#4071600000000000",
        &[
            (10, stale),
            (20, written),
            (30, emergency),
            (35, other),
            (40, answer),
        ],
    );
    let mut client = Client::new(link);
    let read = block_on(client.read(NODE, TORQUE, DataType::I16));
    assert_eq!(read, Ok(Value::Integer(100)));
    for kept in [stale, written, emergency, other] {
        let received = block_on(client.receive(client.now())).unwrap().unwrap();
        assert_eq!(received.1, frame(kept));
    }
    assert_eq!(block_on(client.receive(client.now())), Ok(None));
    assert_eq!(client.lost(), 0);
}

#[test]
fn an_answer_that_came_before_the_question_is_not_its_answer() {
    let link = Scripted::new()
        .at_us(0, "581#4271600063000000")
        .on("601#4071600000000000", &[(100, "581#4271600064000000")]);
    let mut client = Client::new(link);
    let read = block_on(client.read(NODE, TORQUE, DataType::I16));
    assert_eq!(read, Ok(Value::Integer(100)));
}

#[test]
fn a_segmented_answer_is_aborted_and_reported() {
    let name = Address::new(0x1008, 0);
    let link = Scripted::new().on("601#4008100000000000", &[(10, "581#4108100015000000")]);
    let mut client = Client::new(link);
    let error = block_on(client.upload(NODE, name)).unwrap_err();
    assert_eq!(error.cause, Cause::NotExpedited { bytes: Some(0x15) });
    assert_eq!(client.link().sent[1], "601#8008100005000405");
}

#[test]
fn a_value_of_the_wrong_size_is_no_value() {
    let link = Scripted::new().on("601#4071600000000000", &[(10, "581#4F71600005000000")]);
    let mut client = Client::new(link);
    let error = block_on(client.read(NODE, TORQUE, DataType::I16)).unwrap_err();
    assert!(matches!(error.cause, Cause::WrongType { .. }), "{error}");
}

#[test]
fn a_broken_link_is_reported_as_that() {
    let mut client = Client::new(Scripted {
        broken: true,
        ..Scripted::new()
    });
    let error = block_on(client.upload(NODE, TORQUE)).unwrap_err();
    let closed = LinkError::Closed {
        door: "script".into(),
    };
    assert_eq!(error.cause, Cause::Link(closed.clone()));
    assert_eq!(block_on(client.scan(&Scan::default())), Err(closed));
}

#[test]
fn nodes_are_reset_and_waited_for() {
    let mut client = booted(&[NODE, TWO]);
    block_on(async {
        client.reset_and_wait(&[TWO, NODE], 100).await.unwrap();
        let booted = client.reset(None, 100).await.unwrap();
        assert_eq!(
            booted
                .iter()
                .map(|boot| boot.node.get())
                .collect::<Vec<_>>(),
            [1, 2]
        );
        let missing = NodeId::new(9).unwrap();
        let error = client.reset_and_wait(&[missing], 100).await.unwrap_err();
        assert_eq!(error.to_string(), "node 9: no boot-up within 100 ms");
    });
}

#[test]
fn states_are_known_from_heartbeats() {
    let mut client = booted(&[NODE]);
    block_on(async {
        let error = client
            .wait_for_state(NODE, NmtState::Operational, 50)
            .await
            .unwrap_err();
        assert!(matches!(error, WaitError::TimedOut { .. }));
        let period = Value::Integer(10).encode(DataType::U16).unwrap();
        client
            .download(NODE, Address::new(0x1017, 0), period)
            .await
            .unwrap();
        client
            .wait_for_state(NODE, NmtState::Operational, 50)
            .await
            .unwrap();
        client.nmt(Command::Stop, Some(NODE)).await.unwrap();
        client
            .wait_for_state(NODE, NmtState::Stopped, 50)
            .await
            .unwrap();
        let found = client
            .scan(&Scan {
                listen_ms: 30,
                ..Scan::default()
            })
            .await
            .unwrap();
        let [stopped] = found.as_slice() else {
            panic!("{found:?}")
        };
        assert_eq!(
            (stopped.state, stopped.answers_sdo),
            (Some(NmtState::Stopped), false)
        );
        assert_eq!(
            stopped.to_string(),
            "node 1, stopped, does not answer SDO requests"
        );
    });
}

#[test]
fn a_scan_finds_every_node_in_the_time_it_promises() {
    let ids: Vec<NodeId> = [1, 2, 16, 17, 127]
        .into_iter()
        .filter_map(NodeId::new)
        .collect();
    let mut client = booted(&ids);
    let begin = client.now();
    let scan = Scan::default();
    let found = block_on(client.scan(&scan)).unwrap();
    assert_eq!(
        found.iter().map(|f| f.node).collect::<Vec<_>>(),
        [1, 2, 16, 17, 127]
    );
    for node in &found {
        assert_eq!(node.profile(), Some(402));
        assert_eq!(
            (node.vendor, node.name.as_deref()),
            (Some(0x408), Some("P3"))
        );
        assert!(node.serial.is_some() && node.software.is_some());
    }
    // 8 groups of 16, plus 127 requests and the questions of identity at 100 us a frame.
    let taken_ms = client.now().since_ns(begin) / 1_000_000;
    let promised = 8 * scan.answer_ms + 5 * 8 * scan.answer_ms;
    assert!(taken_ms <= promised && taken_ms >= 400, "{taken_ms} ms");
    let json = serde_json::to_value(&found[0]).unwrap();
    assert_eq!(
        (&json["node"], &json["product"]),
        (&1.into(), &0x5033.into())
    );
}

#[test]
fn an_observer_sees_both_ways() {
    let mut seen = Vec::new();
    let link = Scripted::new().on("601#4071600000000000", &[(10, "581#4271600064000000")]);
    let observed = Observed::new(link, |s| seen.push((s.way, s.frame.to_string())));
    block_on(Client::new(observed).upload(NODE, TORQUE)).unwrap();
    assert_eq!(
        seen,
        [
            (Way::Sent, "601#4071600000000000".to_owned()),
            (Way::Received, "581#4271600064000000".to_owned()),
        ]
    );
}

#[test]
fn a_borrowed_link_is_a_link() {
    let mut link = Scripted::new();
    let mut borrowed = &mut link;
    block_on(Link::send(&mut borrowed, frame("080#"))).unwrap();
    assert_eq!(link.sent, ["080#"]);
}
