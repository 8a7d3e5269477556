//! Who plays: three drives and their process data.

use canopen::{DataType, NodeId};
use client::axis::{Axis, Walk};
use client::decode::Direction;
use client::pdo::{Mapped, Pdo};

/// The drive that makes profile position moves.
pub(super) const MOVER: NodeId = NodeId::new(1).unwrap();
/// The drive that follows a cyclic trajectory.
pub(super) const FOLLOWER: NodeId = NodeId::new(2).unwrap();
/// The drive whose shaft is held while it pushes.
pub(super) const PUSHER: NodeId = NodeId::new(3).unwrap();
/// All drives.
pub(super) const NODES: [NodeId; 3] = [MOVER, FOLLOWER, PUSHER];

/// Counts of a turn of the P3's own encoder (l.49).
pub(super) const COUNTS_PER_TURN: f64 = 4096.0;

/// A drive as the master wants it.
#[derive(Clone, Debug)]
pub(super) struct Actor {
    pub(super) axis: Axis,
    /// TPDO1, with every SYNC: statusword, actual position, and what matters to its mode.
    pub(super) feedback: Pdo,
    /// TPDO2, with every tenth SYNC: actual velocity and following error.
    pub(super) slow: Pdo,
    /// RPDO1, for the drives that take set-points by PDO.
    pub(super) set_point: Option<Pdo>,
}

impl Actor {
    pub(super) fn of(node: NodeId) -> Actor {
        let third = match node {
            PUSHER => 0x6077, // actual torque
            _ => 0x6078,      // actual current
        };
        let pdo = |direction, number, transmission, mapped: &[Mapped]| Pdo {
            node,
            direction,
            number,
            // The predefined connection set (CiA 301 7.3.3), which is the P3's default.
            cob_id: u16::from(node.get())
                + match (direction, number) {
                    (Direction::Receive, _) => 0x200,
                    (Direction::Transmit, 1) => 0x180,
                    (Direction::Transmit, _) => 0x280,
                },
            transmission,
            mapped: mapped.to_vec(),
        };
        Actor {
            axis: Axis {
                walk: Walk::Short,
                ..Axis::new(node)
            },
            feedback: pdo(
                Direction::Transmit,
                1,
                1,
                &[
                    Mapped::new(0x6041, DataType::U16),
                    Mapped::new(0x6064, DataType::I32),
                    Mapped::new(third, DataType::I16),
                ],
            ),
            slow: pdo(
                Direction::Transmit,
                2,
                10,
                &[
                    Mapped::new(0x606C, DataType::I32),
                    Mapped::new(0x60F4, DataType::I32),
                ],
            ),
            set_point: match node {
                // With SYNC, so that all axes of a machine would move at the same time.
                FOLLOWER => Some((1, Mapped::new(0x607A, DataType::I32))),
                // At once, as the manual's example 1 has it (P3 l.313 to l.317).
                PUSHER => Some((255, Mapped::new(0x6071, DataType::I16))),
                _ => None,
            }
            .map(|(transmission, mapped)| pdo(Direction::Receive, 1, transmission, &[mapped])),
        }
    }
}
