//! Process data from the master's side: configuring PDOs, packing and reading them, and exchanging
//! them in the rhythm of SYNC.

use std::fmt;

use can::Frame;
use canopen::{Address, DataType, Instant, NodeId};

use crate::decode::Direction;
use crate::sdo::{Data, SdoError};
use crate::{Client, Link, LinkError, Value, ValueError};

/// An object in a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mapped {
    /// Which.
    pub object: Address,
    /// Its type, which says how many bytes of the PDO it takes.
    pub data_type: DataType,
}

impl Mapped {
    /// Sub-index 0 of `index`.
    pub const fn new(index: u16, data_type: DataType) -> Mapped {
        Mapped {
            object: Address::new(index, 0),
            data_type,
        }
    }

    /// The mapping entry: index, sub-index, length in bits (CiA 301 7.5.2.36).
    fn entry(self) -> u32 {
        let [index_low, index_high] = self.object.index.to_le_bytes();
        let bits = 8 * self.data_type.size();
        u32::from_le_bytes([bits, self.object.sub, index_low, index_high])
    }
}

/// A PDO of a node, as a master wants it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pdo {
    /// Whose.
    pub node: NodeId,
    /// RPDO or TPDO, from the node's side.
    pub direction: Direction,
    /// Number, 1 to 512.
    pub number: u16,
    /// Its 11-bit identifier.
    pub cob_id: u16,
    /// Transmission type: 0 to 240 with SYNC, 255 at once (CiA 301 7.5.2.35, 7.5.2.37).
    pub transmission: u8,
    /// The objects, in their order in the frame.
    pub mapped: Vec<Mapped>,
}

/// In which order PDO parameters are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// The PDO is switched off by bit 31 of its COB-ID while it changes (CiA 301 7.5.2.36): every
    /// device takes this.
    #[default]
    OffFirst,
    /// The mapping is emptied while the COB-ID stays valid, as the P3's manual prints it (l.309):
    /// fewer writes, for devices that allow it.
    WhileValid,
}

/// Why a PDO cannot be configured or packed.
#[derive(Clone, Debug, PartialEq)]
pub enum PdoError {
    /// There is no such PDO.
    NoNumber {
        /// What was asked for.
        number: u16,
    },
    /// The mapped objects do not fit a frame.
    TooLong {
        /// Bytes that they have together.
        bytes: usize,
    },
    /// As many values as mapped objects are needed.
    Values {
        /// Objects.
        mapped: usize,
        /// Values.
        given: usize,
    },
    /// A value does not fit its object.
    Value {
        /// The object.
        object: Address,
        /// Why.
        error: ValueError,
    },
    /// The node did not take a parameter.
    Sdo(SdoError),
}

impl fmt::Display for PdoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PdoError::NoNumber { number } => {
                write!(f, "there is no PDO {number}; they count from 1 to 512")
            }
            PdoError::TooLong { bytes } => {
                write!(f, "the mapped objects have {bytes} bytes; a PDO carries 8")
            }
            PdoError::Values { mapped, given } => {
                write!(f, "{given} values for a PDO of {mapped} objects")
            }
            PdoError::Value { object, error } => write!(f, "{object}: {error}"),
            PdoError::Sdo(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for PdoError {}

impl From<SdoError> for PdoError {
    fn from(error: SdoError) -> PdoError {
        PdoError::Sdo(error)
    }
}

/// Bit 31 of a PDO's COB-ID: off.
const OFF: u32 = 1 << 31;

impl Pdo {
    /// A PDO under the identifier of the predefined connection set (CiA 301 7.3.3); `None` for
    /// numbers other than 1 to 4, which have none.
    pub fn predefined(
        node: NodeId,
        direction: Direction,
        number: u16,
        transmission: u8,
        mapped: &[Mapped],
    ) -> Option<Pdo> {
        let base = match direction {
            Direction::Transmit => 0x080,
            Direction::Receive => 0x100,
        };
        (1..=4).contains(&number).then(|| Pdo {
            node,
            direction,
            number,
            cob_id: base + 0x100 * number + u16::from(node.get()),
            transmission,
            mapped: mapped.to_vec(),
        })
    }

    /// Bytes of its frame.
    fn bytes(&self) -> Result<usize, PdoError> {
        let sizes = self.mapped.iter().map(|m| usize::from(m.data_type.size()));
        let bytes = sizes.sum();
        if bytes > 8 {
            return Err(PdoError::TooLong { bytes });
        }
        Ok(bytes)
    }

    /// The frame that carries `values`, one for each mapped object.
    ///
    /// # Errors
    /// Not as many values as objects, or a value that does not fit.
    pub fn frame(&self, values: &[Value]) -> Result<Frame, PdoError> {
        let length = self.bytes()?;
        if values.len() != self.mapped.len() {
            return Err(PdoError::Values {
                mapped: self.mapped.len(),
                given: values.len(),
            });
        }
        let mut bytes = [0; 8];
        let mut rest = bytes.as_mut_slice();
        for (mapped, value) in self.mapped.iter().zip(values) {
            let data = value
                .encode(mapped.data_type)
                .map_err(|error| PdoError::Value {
                    object: mapped.object,
                    error,
                })?;
            let (own, after) = rest.split_at_mut(usize::from(mapped.data_type.size()));
            own.copy_from_slice(data.bytes());
            rest = after;
        }
        Ok(Frame::classic(self.cob_id, bytes, length as u8))
    }

    /// The values in `frame`, one for each mapped object; `None` if it is another frame, or shorter
    /// than the mapping.
    pub fn values(&self, frame: &Frame) -> Option<Vec<Value>> {
        if frame.key() != u32::from(self.cob_id) {
            return None;
        }
        let mut rest = frame.data();
        self.mapped
            .iter()
            .map(|mapped| {
                let (own, after) = rest.split_at_checked(usize::from(mapped.data_type.size()))?;
                rest = after;
                Value::decode(own, mapped.data_type)
            })
            .collect()
    }

    /// Index of the communication parameter; the mapping parameter is 0x200 above.
    fn parameter(&self) -> Result<u16, PdoError> {
        parameter(self.direction, self.number)
    }
}

fn parameter(direction: Direction, number: u16) -> Result<u16, PdoError> {
    if !(1..=512).contains(&number) {
        return Err(PdoError::NoNumber { number });
    }
    let base = match direction {
        Direction::Receive => 0x1400,
        Direction::Transmit => 0x1800,
    };
    Ok(base + (number - 1))
}

/// The data of a download of the low `bytes` bytes of `number`.
fn data(number: u32, bytes: usize) -> Data {
    Data::sized(&number.to_le_bytes()[..bytes]).unwrap_or(Data::EMPTY)
}

impl<L: Link> Client<L> {
    /// Empties the mappings of the PDOs `numbers`: they carry nothing from then on (P3 l.309).
    ///
    /// # Errors
    /// [`PdoError`]. The PDOs before the one that failed are empty.
    pub async fn empty_pdos(
        &mut self,
        node: NodeId,
        direction: Direction,
        numbers: std::ops::RangeInclusive<u16>,
    ) -> Result<(), PdoError> {
        for number in numbers {
            let mapping = parameter(direction, number)? + 0x200;
            self.download(node, Address::new(mapping, 0), data(0, 1))
                .await?;
        }
        Ok(())
    }

    /// Writes communication and mapping parameters of a PDO.
    ///
    /// # Errors
    /// [`PdoError`]. What was written before the failure stays: with [`Order::OffFirst`] the PDO is
    /// off, with [`Order::WhileValid`] it maps nothing.
    pub async fn configure_pdo(&mut self, pdo: &Pdo, order: Order) -> Result<(), PdoError> {
        let (parameter, node) = (pdo.parameter()?, pdo.node);
        let mapping = parameter + 0x200;
        pdo.bytes()?;
        let cob_id = u32::from(pdo.cob_id);
        let mut writes = vec![];
        if order == Order::OffFirst {
            writes.push((Address::new(parameter, 1), data(cob_id | OFF, 4)));
        }
        writes.push((Address::new(mapping, 0), data(0, 1)));
        if order == Order::WhileValid {
            writes.push((Address::new(parameter, 1), data(cob_id, 4)));
        }
        writes.push((
            Address::new(parameter, 2),
            data(u32::from(pdo.transmission), 1),
        ));
        for (sub, mapped) in (1..).zip(&pdo.mapped) {
            writes.push((Address::new(mapping, sub), data(mapped.entry(), 4)));
        }
        writes.push((Address::new(mapping, 0), data(pdo.mapped.len() as u32, 1)));
        if order == Order::OffFirst {
            writes.push((Address::new(parameter, 1), data(cob_id, 4)));
        }
        for (object, data) in writes {
            self.download(node, object, data).await?;
        }
        Ok(())
    }
}

/// SYNC at a fixed rate, with process data between.
///
/// The times of the SYNCs are counted from the first, so that no error adds up.
#[derive(Clone, Copy, Debug)]
pub struct Cycle {
    period_ns: u64,
    next: Instant,
    missed: u64,
}

impl Cycle {
    /// The first SYNC is due at `first`, the others follow every `period_ns`.
    pub fn new(first: Instant, period_ns: u64) -> Cycle {
        Cycle {
            period_ns: period_ns.max(1),
            next: first,
            missed: 0,
        }
    }

    /// When the next SYNC is due.
    pub fn next(&self) -> Instant {
        self.next
    }

    /// SYNCs that were left out because the caller came too late for them.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// One period: waits until SYNC is due and sends it, then sends `set_points`, which take effect
    /// with the next SYNC if they are synchronous, and receives until that is due. Every frame that
    /// came goes to `received`, also those that waited in the client.
    ///
    /// # Errors
    /// The link broke.
    pub async fn run<L: Link>(
        &mut self,
        client: &mut Client<L>,
        set_points: &[Frame],
        mut received: impl FnMut(Instant, &Frame),
    ) -> Result<(), LinkError> {
        let late_ns = client.now().since_ns(self.next);
        let missed = late_ns / self.period_ns;
        self.missed += missed;
        self.next = self.next.plus_ns(missed * self.period_ns);
        while let Some((at, frame)) = client.receive(self.next).await? {
            received(at, &frame);
        }
        client.sync().await?;
        for frame in set_points {
            client.send(*frame).await?;
        }
        self.next = self.next.plus_ns(self.period_ns);
        while let Some((at, frame)) = client.receive(self.next).await? {
            received(at, &frame);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::new(3).unwrap();

    fn pdo(mapped: &[Mapped]) -> Pdo {
        Pdo::predefined(NODE, Direction::Transmit, 2, 1, mapped).unwrap()
    }

    #[test]
    fn predefined_identifiers_are_the_standards() {
        // CiA 301 7.3.3, table 40.
        for (direction, number, cob_id) in [
            (Direction::Transmit, 1, 0x183),
            (Direction::Receive, 1, 0x203),
            (Direction::Transmit, 4, 0x483),
            (Direction::Receive, 4, 0x503),
        ] {
            let pdo = Pdo::predefined(NODE, direction, number, 255, &[]).unwrap();
            assert_eq!(pdo.cob_id, cob_id);
        }
        for number in [0, 5] {
            assert_eq!(
                Pdo::predefined(NODE, Direction::Receive, number, 1, &[]),
                None
            );
        }
    }

    #[test]
    fn values_are_packed_little_endian_in_their_order_and_read_again() {
        let pdo = pdo(&[
            Mapped::new(0x6041, DataType::U16),
            Mapped::new(0x6064, DataType::I32),
            Mapped::new(0x6077, DataType::I16),
        ]);
        let values = [0x1637, -2, -100].map(Value::Integer);
        let frame = pdo.frame(&values).unwrap();
        assert_eq!(frame.to_string(), "283#3716FEFFFFFF9CFF");
        assert_eq!(pdo.values(&frame).unwrap(), values);
        let short = Frame::classic(0x283, [0; 8], 7);
        assert_eq!(pdo.values(&short), None);
        let other = Frame::classic(0x284, [0; 8], 8);
        assert_eq!(pdo.values(&other), None);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let long = pdo(&[Mapped::new(0x6064, DataType::I32); 3]);
        let values = [0, 0, 0].map(Value::Integer);
        assert_eq!(long.frame(&values), Err(PdoError::TooLong { bytes: 12 }));
        let one = pdo(&[Mapped::new(0x6077, DataType::I16)]);
        assert_eq!(
            one.frame(&values),
            Err(PdoError::Values {
                mapped: 1,
                given: 3
            })
        );
        let error = one.frame(&[Value::Integer(40_000)]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "0x6077,0: 40000 does not fit INTEGER16; give a value from -32768 to 32767"
        );
        assert_eq!(
            parameter(Direction::Receive, 513),
            Err(PdoError::NoNumber { number: 513 })
        );
    }
}
