//! Samples in the rhythm of SYNC: TPDO 4 carries what is measured, RPDO 4 what is commanded.

use canopen::nmt::Command;
use canopen::{Address, DataType};

use super::{Cause, Object, STATUSWORD, Session, Watch};
use crate::decode::Direction;
use crate::pdo::{Mapped, Order, Pdo};
use crate::sdo::Data;
use crate::{Link, Value};

/// The PDOs of a recording, and what they were before.
#[derive(Debug)]
pub(crate) struct Recorder {
    transmit: Pdo,
    receive: Option<Pdo>,
    before: Vec<Before>,
    /// The node was pre-operational.
    was_started: bool,
}

/// A PDO as it was.
#[derive(Debug)]
struct Before {
    parameter: u16,
    cob_id: u32,
    transmission: u8,
    entries: Vec<u32>,
}

impl Before {
    /// What brings it back: objects, numbers, and their bytes.
    fn writes(&self) -> Vec<(Address, u32, usize)> {
        let parameter = |sub| Address::new(self.parameter, sub);
        let mapping = |sub| Address::new(self.parameter + 0x200, sub);
        let mut writes = vec![
            (parameter(1), self.cob_id | 1 << 31, 4),
            (mapping(0), 0, 1),
            (parameter(2), u32::from(self.transmission), 1),
        ];
        for (sub, entry) in (1..).zip(&self.entries) {
            writes.push((mapping(sub), *entry, 4));
        }
        writes.push((mapping(0), self.entries.len() as u32, 1));
        writes.push((parameter(1), self.cob_id, 4));
        writes
    }
}

/// What one SYNC gave.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sample {
    /// The number of the SYNC, from 0.
    pub(crate) number: usize,
    /// When it was taken, s, from any origin: by the stamps of the answers where the link has some.
    /// Else when the SYNC was sent, which may have been held up on its way.
    pub(crate) time_s: f64,
    /// In the order of the recorded objects.
    pub(crate) values: Vec<f64>,
}

/// An answer to a SYNC.
#[derive(Clone, Debug, PartialEq)]
struct Answer {
    /// On the clock of whoever heard it on the bus.
    stamp_ns: Option<u64>,
    /// The statusword, and the recorded objects.
    values: Vec<f64>,
}

const NUMBER: u16 = 4;

/// An answer that takes longer is lost. A busy computer holds a program up for some tens of
/// milliseconds; what comes then is as good, since it has a stamp.
const LATEST_MS: u64 = 50;

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Lets TPDO 4 carry the statusword and `seen` (6 bytes at most) at every SYNC, and RPDO 4
    /// `commanded`.
    pub(crate) async fn start_recording(
        &mut self,
        seen: &[Object],
        commanded: &[Object],
    ) -> Result<(), Cause> {
        self.stop_recording().await?;
        let mapped = |objects: &[Object]| -> Vec<Mapped> {
            let one = |object: &Object| Mapped {
                object: object.address,
                data_type: object.data_type,
            };
            objects.iter().map(one).collect()
        };
        let pdo = |direction, objects: &[Object]| Pdo {
            node: self.node,
            direction,
            number: NUMBER,
            cob_id: match direction {
                Direction::Transmit => 0x480,
                Direction::Receive => 0x500,
            } + u16::from(self.node.get()),
            transmission: 1,
            mapped: mapped(objects),
        };
        let all: Vec<Object> = std::iter::once(STATUSWORD)
            .chain(seen.iter().copied())
            .collect();
        let transmit = pdo(Direction::Transmit, &all);
        let receive = (!commanded.is_empty()).then(|| pdo(Direction::Receive, commanded));
        let mut before = vec![self.pdo_before(0x1803).await?];
        if receive.is_some() {
            before.push(self.pdo_before(0x1403).await?);
        }
        self.recorder = Some(Recorder {
            transmit: transmit.clone(),
            receive: receive.clone(),
            before,
            was_started: false,
        });
        self.client
            .configure_pdo(&transmit, Order::OffFirst)
            .await?;
        if let Some(receive) = &receive {
            self.client.configure_pdo(receive, Order::OffFirst).await?;
        }
        // A pre-operational node answers no SYNC, or takes no RPDO.
        if self.exchange(None, 20).await?.is_none() {
            self.client.nmt(Command::Start, Some(self.node)).await?;
            let until = self.client.now().plus_ms(20);
            self.pass(until).await?;
            if let Some(recorder) = &mut self.recorder {
                recorder.was_started = true;
            }
        }
        Ok(())
    }

    async fn pdo_before(&mut self, parameter: u16) -> Result<Before, Cause> {
        let mapping = parameter + 0x200;
        let cob_id = self.number(parameter, 1, DataType::U32).await?;
        let transmission = self.number(parameter, 2, DataType::U8).await? as u8;
        let count = self.number(mapping, 0, DataType::U8).await?;
        let mut entries = Vec::new();
        for sub in 1..=count.min(8) as u8 {
            entries.push(self.number(mapping, sub, DataType::U32).await?);
        }
        Ok(Before {
            parameter,
            cob_id,
            transmission,
            entries,
        })
    }

    async fn number(&mut self, index: u16, sub: u8, data_type: DataType) -> Result<u32, Cause> {
        let object = Address::new(index, sub);
        match self.client.read(self.node, object, data_type).await? {
            Value::Integer(value) => Ok(value as u32),
            Value::Real(_) | Value::Text(_) => Ok(0),
        }
    }

    /// Gives the PDOs back as they were. If that fails, the next call does it once more.
    pub(crate) async fn stop_recording(&mut self) -> Result<(), Cause> {
        let Some(recorder) = &self.recorder else {
            return Ok(());
        };
        let was_started = recorder.was_started;
        let writes: Vec<_> = recorder.before.iter().flat_map(Before::writes).collect();
        for (object, number, bytes) in writes {
            let data = Data::sized(&number.to_le_bytes()[..bytes]).unwrap_or(Data::EMPTY);
            self.client.download(self.node, object, data).await?;
        }
        if was_started {
            self.client
                .nmt(Command::EnterPreOperational, Some(self.node))
                .await?;
        }
        self.recorder = None;
        Ok(())
    }

    /// One SYNC, and the frame of set-points behind it; the values that it gave. Takes `ms`, or longer
    /// where the answer is late: behind a network it may be.
    async fn exchange(
        &mut self,
        set_points: Option<&[i64]>,
        ms: u64,
    ) -> Result<Option<Answer>, Cause> {
        let Some(recorder) = &self.recorder else {
            return Ok(None);
        };
        let now = self.client.now();
        let (until, latest) = (now.plus_ms(ms), now.plus_ms(ms.max(LATEST_MS)));
        let frame = match (&recorder.receive, set_points) {
            (Some(receive), Some(values)) => {
                let values: Vec<Value> = values.iter().map(|v| Value::Integer(*v)).collect();
                Some(receive.frame(&values)?)
            }
            _ => None,
        };
        self.client.sync().await?;
        self.synced = now;
        if let Some(frame) = frame {
            self.client.send(frame).await?;
        }
        let mut came = None;
        loop {
            let wait = if came.is_some() { until } else { latest };
            let Some((_, frame)) = self.client.receive(wait).await? else {
                break;
            };
            if let Some(values) = recorder.transmit.values(&frame) {
                let number = |value: Value| match value {
                    Value::Integer(value) => value as f64,
                    Value::Real(_) | Value::Text(_) => 0.0,
                };
                came = Some(Answer {
                    stamp_ns: self.client.stamp_ns(),
                    values: values.into_iter().map(number).collect(),
                });
            }
        }
        Ok(came)
    }

    /// Records for `count` SYNCs, one every `ms`. Before each, `command` is asked for the values of
    /// the commanded objects that take effect with the SYNC after it; it is told the number of the
    /// SYNC and the sample before. `None` ends the recording early. In the end the set-points
    /// become `neutral`, also if the recording fails.
    ///
    /// # Errors
    /// The drive left operation enabled, or more than a tenth of the samples did not come.
    pub(crate) async fn record(
        &mut self,
        count: usize,
        ms: u64,
        neutral: &[i64],
        command: impl FnMut(usize, Option<&Sample>) -> Option<Vec<i64>>,
    ) -> Result<Vec<Sample>, Cause> {
        let recorded = self.recorded(count, ms, command).await;
        // What was sent last would take effect with any later SYNC.
        self.exchange(Some(neutral), ms).await?;
        self.exchange(None, ms).await?;
        recorded
    }

    async fn recorded(
        &mut self,
        count: usize,
        ms: u64,
        mut command: impl FnMut(usize, Option<&Sample>) -> Option<Vec<i64>>,
    ) -> Result<Vec<Sample>, Cause> {
        let began = self.client.now();
        let mut samples: Vec<Sample> = Vec::with_capacity(count);
        let mut first_stamp_ns = None;
        let mut sent = 0;
        for place in 0..count {
            if self.watch.stop() {
                return Err(Cause::Stopped);
            }
            let Some(set_points) = command(place, samples.last()) else {
                break;
            };
            let due = began.plus_ms(place as u64 * ms);
            self.pass(due).await?;
            let sent_ns = self.client.now().since_ns(began);
            let set_points = (!set_points.is_empty()).then_some(set_points.as_slice());
            sent += 1;
            if let Some(Answer {
                stamp_ns,
                mut values,
            }) = self.exchange(set_points, ms).await?
            {
                let word = values.remove(0);
                self.judge(word as u16).await?;
                let ns = match stamp_ns {
                    Some(stamp) => stamp.saturating_sub(*first_stamp_ns.get_or_insert(stamp)),
                    None => sent_ns,
                };
                samples.push(Sample {
                    number: place,
                    time_s: ns as f64 * 1e-9,
                    values,
                });
            }
            if sent >= 20 && samples.len() * 10 < sent * 9 {
                break;
            }
        }
        match samples.len() * 10 < sent * 9 {
            true => Err(Cause::Samples {
                sent,
                came: samples.len(),
            }),
            false => Ok(samples),
        }
    }
}
