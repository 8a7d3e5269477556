//! Finding the nodes of a bus, in a bounded time.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::RangeInclusive;

use canopen::{Address, DataType, NmtState, NodeId};
use serde::Serialize;

use crate::sdo::{Answer, Cause, Method, Request, SdoError};
use crate::{Client, Link, LinkError, RequestForm, Settings, Value, nmt};

/// How a scan goes about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scan {
    /// Which node IDs are asked.
    pub nodes: RangeInclusive<u8>,
    /// How long to listen for heartbeats and boot-ups first, in milliseconds. States are known only
    /// of nodes that send a heartbeat in that time.
    pub listen_ms: u64,
    /// How long a node may take to answer, in milliseconds.
    pub answer_ms: u64,
    /// How many nodes are asked at once.
    pub at_once: u8,
}

impl Default for Scan {
    /// Nodes 1 to 127, 16 at once, 50 ms for an answer, no listening: an empty bus takes 400 ms.
    fn default() -> Scan {
        Scan {
            nodes: 1..=127,
            listen_ms: 0,
            answer_ms: 50,
            at_once: 16,
        }
    }
}

/// What a node was found to be. A field is `None` if the node did not tell.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Found {
    /// Node ID.
    pub node: u8,
    /// NMT state of its last heartbeat or boot-up.
    #[serde(serialize_with = "state_name")]
    pub state: Option<NmtState>,
    /// Whether it answers SDO requests; a stopped node does not.
    pub answers_sdo: bool,
    /// 0x1000.
    pub device_type: Option<u32>,
    /// 0x1018,1.
    pub vendor: Option<u32>,
    /// 0x1018,2.
    pub product: Option<u32>,
    /// 0x1018,3.
    pub revision: Option<u32>,
    /// 0x1018,4.
    pub serial: Option<u32>,
    /// 0x1008.
    pub name: Option<String>,
    /// 0x1009.
    pub hardware: Option<String>,
    /// 0x100A.
    pub software: Option<String>,
}

fn state_name<S: serde::Serializer>(
    state: &Option<NmtState>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match state {
        Some(state) => serializer.collect_str(state),
        None => serializer.serialize_none(),
    }
}

impl Found {
    /// A node of which nothing is known yet.
    pub fn new(node: NodeId) -> Found {
        Found {
            node: node.get(),
            state: None,
            answers_sdo: false,
            device_type: None,
            vendor: None,
            product: None,
            revision: None,
            serial: None,
            name: None,
            hardware: None,
            software: None,
        }
    }

    /// The device profile in the low half of 0x1000: 402 for a drive.
    pub fn profile(&self) -> Option<u16> {
        self.device_type.map(|device_type| device_type as u16)
    }
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "node {}", self.node)?;
        if let Some(name) = &self.name {
            write!(f, " \"{}\"", name.escape_default())?;
        }
        if let Some(profile) = self.profile() {
            write!(f, ", profile {profile}")?;
        }
        for (name, number) in [
            ("vendor", self.vendor),
            ("product", self.product),
            ("revision", self.revision),
            ("serial", self.serial),
        ] {
            if let Some(number) = number {
                write!(f, ", {name} 0x{number:08X}")?;
            }
        }
        if let Some(state) = self.state {
            write!(f, ", {state}")?;
        }
        if !self.answers_sdo {
            f.write_str(", does not answer SDO requests")?;
        }
        Ok(())
    }
}

const DEVICE_TYPE: Address = Address::new(0x1000, 0);

impl<L: Link> Client<L> {
    /// Finds the nodes of the bus: listens for error control frames, asks every node ID for 0x1000,
    /// then each node that answered for its identity. Takes at most `listen_ms`, plus `answer_ms`
    /// for every `at_once` node IDs, plus eight times `answer_ms` for every node found.
    ///
    /// # Errors
    /// The link broke. A node that falls silent is no error, its fields stay `None`.
    pub async fn scan(&mut self, scan: &Scan) -> Result<Vec<Found>, LinkError> {
        let mut found = BTreeMap::new();
        self.listen(scan.listen_ms, &mut found).await?;
        let all: Vec<NodeId> = scan.nodes.clone().filter_map(NodeId::new).collect();
        for group in all.chunks(usize::from(scan.at_once.max(1))) {
            self.ask_group(group, scan, &mut found).await?;
        }
        let usual = self.settings;
        self.settings = Settings {
            answer_ms: scan.answer_ms,
            attempts: 1,
            form: RequestForm::Standard,
            method: Method::Auto,
            ..usual
        };
        let mut identified = Ok(());
        for found in found.values_mut().filter(|found| found.answers_sdo) {
            identified = self.identify(found).await;
            if identified.is_err() {
                break;
            }
        }
        self.settings = usual;
        identified?;
        Ok(found.into_values().collect())
    }

    /// Notes who sends heartbeats and boot-ups; every frame stays in the inbox.
    async fn listen(
        &mut self,
        listen_ms: u64,
        found: &mut BTreeMap<NodeId, Found>,
    ) -> Result<(), LinkError> {
        let until = self.now().plus_ms(listen_ms);
        let noted = self.wait_for(until, |_, frame| {
            note_state(frame, found);
            None::<()>
        });
        noted.await.map(|_| ())
    }

    async fn ask_group(
        &mut self,
        group: &[NodeId],
        scan: &Scan,
        found: &mut BTreeMap<NodeId, Found>,
    ) -> Result<(), LinkError> {
        self.set_aside().await?;
        for node in group {
            if let Some(frame) = Request::Upload(DEVICE_TYPE).frame(*node, RequestForm::Standard) {
                self.send(frame).await?;
            }
        }
        let until = self.now().plus_ms(scan.answer_ms);
        let mut silent = group.len();
        while silent > 0 {
            let answer = self.wait_for(until, |_, frame| {
                note_state(frame, found);
                let node = group
                    .iter()
                    .find(|n| frame.key() == 0x580 + u32::from(n.get()))?;
                match Answer::parse(frame)? {
                    Answer::Uploaded(DEVICE_TYPE, data) => Some((*node, Some(data.raw()))),
                    // A node without 0x1000 is one, too.
                    Answer::Aborted(DEVICE_TYPE, _) => Some((*node, None)),
                    _ => None,
                }
            });
            let Some((node, device_type)) = answer.await? else {
                break;
            };
            let entry = found.entry(node).or_insert_with(|| Found::new(node));
            entry.answers_sdo = true;
            entry.device_type = device_type;
            silent -= 1;
        }
        Ok(())
    }

    async fn identify(&mut self, found: &mut Found) -> Result<(), LinkError> {
        let Some(node) = NodeId::new(found.node) else {
            return Ok(());
        };
        for (sub, field) in [
            (1, &mut found.vendor),
            (2, &mut found.product),
            (3, &mut found.revision),
            (4, &mut found.serial),
        ] {
            let value = self
                .read(node, Address::new(0x1018, sub), DataType::U32)
                .await;
            *field = match told(value)? {
                Some(Value::Integer(number)) => u32::try_from(number).ok(),
                _ => None,
            };
        }
        for (index, field) in [
            (0x1008, &mut found.name),
            (0x1009, &mut found.hardware),
            (0x100A, &mut found.software),
        ] {
            // A name may be longer than an expedited answer.
            let bytes = self.upload_all(node, Address::new(index, 0)).await;
            let value = told(bytes)?.and_then(|bytes| Value::decode(&bytes, DataType::Text));
            *field = match value {
                Some(Value::Text(text)) => Some(text),
                _ => None,
            };
        }
        Ok(())
    }
}

/// A value, or `None` if the node did not give one.
fn told<T>(value: Result<T, SdoError>) -> Result<Option<T>, LinkError> {
    match value {
        Ok(value) => Ok(Some(value)),
        Err(SdoError {
            cause: Cause::Link(error),
            ..
        }) => Err(error),
        Err(_) => Ok(None),
    }
}

/// Notes the state in an error control frame.
fn note_state(frame: &can::Frame, found: &mut BTreeMap<NodeId, Found>) {
    if let Some((node, state)) = nmt::error_control(frame) {
        let entry = found.entry(node).or_insert_with(|| Found::new(node));
        entry.state = NmtState::from_heartbeat(state);
    }
}
