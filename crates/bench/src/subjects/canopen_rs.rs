//! canopen-rs 0.6.1: a received frame goes in, at most one frame comes back. SYNC is left to the
//! application, which asks for the synchronous TPDOs. There is no clock and no periodic call.

use bench::subject::{
    MAPPED, NMT_COB_ID, NMT_START, NODE_ID, SYNC_COB_ID, Subject, TPDO_COB_IDS, value_of,
};
use canopen_rs::node::MAX_PDO_MAPPING;
use canopen_rs::{
    Address, Entry, LssAddress, MappingEntry, NmtState, Node, NodeId, ObjectDictionary, PdoMapping,
    StandardObjects, TransmissionType, TxFrame, Value,
};

/// A node of `OBJECTS` entries, one for each index and sub-index, in ascending order.
#[derive(Debug)]
pub(crate) struct CanopenRs<const OBJECTS: usize> {
    node: Node<OBJECTS>,
    application_objects: u16,
}

/// A received frame; canopen-rs takes the COB-ID and the data apart.
#[derive(Debug)]
pub(crate) struct Received {
    cob_id: u16,
    data: Vec<u8>,
}

impl<const OBJECTS: usize> CanopenRs<OBJECTS> {
    /// The node, operational.
    pub(crate) fn new() -> Self {
        let (objects, application_objects) = dictionary();
        let node_id = NodeId::new(NODE_ID).expect("a node ID from 1 to 127");
        let mut node = Node::new(node_id, objects);
        for (cob_id, pair) in TPDO_COB_IDS.iter().zip(MAPPED.chunks(2)) {
            let mut mapping = PdoMapping::<MAX_PDO_MAPPING>::new();
            for &index in pair {
                let entry = MappingEntry::new(index, 0, 32);
                mapping.push(entry).expect("two of eight entries");
            }
            node.add_tpdo(*cob_id, mapping, TransmissionType::SynchronousCyclic(1))
                .expect("four of four TPDOs");
        }
        node.boot();
        node.on_frame(NMT_COB_ID, &NMT_START);
        assert_eq!(node.state(), NmtState::Operational);
        Self {
            node,
            application_objects,
        }
    }
}

/// The dictionary, full, and how many objects of it are the application's.
fn dictionary<const OBJECTS: usize>() -> (ObjectDictionary<OBJECTS>, u16) {
    let mut objects = ObjectDictionary::new();
    let identity = LssAddress {
        vendor_id: 1,
        product_code: 2,
        revision_number: 3,
        serial_number: 4,
    };
    StandardObjects::new(0, identity)
        .with_heartbeat(1000)
        .insert_into(&mut objects)
        .expect("room for the standard objects");
    // Sub-indices 0 to 2 of the communication and the mapping parameters.
    for (number, cob_id) in (0..).zip(TPDO_COB_IDS) {
        let mapped = |i: usize| {
            let index = MAPPED[2 * usize::from(number) + i];
            Value::Unsigned32(MappingEntry::new(index, 0, 32).to_u32())
        };
        let parameters = [
            (
                0x1800,
                [
                    Value::Unsigned8(2),
                    Value::Unsigned32(cob_id.into()),
                    Value::Unsigned8(1),
                ],
            ),
            (0x1A00, [Value::Unsigned8(2), mapped(0), mapped(1)]),
        ];
        for (first, values) in parameters {
            for (sub, value) in (0..).zip(values) {
                let address = Address::new(first + number, sub);
                let inserted = objects.insert(address, Entry::rw(value));
                inserted.expect("room for the PDO parameters");
            }
        }
    }
    let mut application_objects = 0;
    loop {
        let index = MAPPED[0] + application_objects;
        let entry = Entry::rw(Value::Unsigned32(value_of(index)));
        if objects.insert(Address::new(index, 0), entry).is_err() {
            return (objects, application_objects);
        }
        application_objects += 1;
    }
}

impl<const OBJECTS: usize> Subject for CanopenRs<OBJECTS> {
    type Received = Received;
    type Sent = TxFrame;

    fn received(cob_id: u16, data: &[u8]) -> Received {
        let data = data.to_vec();
        Received { cob_id, data }
    }

    fn content(sent: &TxFrame) -> (u16, &[u8]) {
        (sent.cob_id, sent.data())
    }

    fn application_objects(&self) -> u16 {
        self.application_objects
    }

    #[inline(always)]
    fn exchange(&mut self, received: &Received, _due: usize, mut taken: impl FnMut(TxFrame)) {
        if received.cob_id == SYNC_COB_ID {
            for frame in self.node.sync_tpdos() {
                taken(frame);
            }
        } else if let Some(frame) = self.node.on_frame(received.cob_id, &received.data) {
            taken(frame);
        }
    }

    #[inline(always)]
    fn publish(&mut self, values: &[u32; 8]) {
        for (&index, &value) in MAPPED.iter().zip(values) {
            let address = Address::new(index, 0);
            // An object that is not there would be missing from its TPDO.
            let _ = self.node.od_mut().set(address, Value::Unsigned32(value));
        }
    }

    fn waiting(&mut self) -> Option<TxFrame> {
        None
    }
}
