//! BarrettCAN, which the drive speaks until the first NMT message (l.57).
//!
//! An identifier is a group bit, five bits of the sender and five of the receiver; the host is number
//! 0. A read is one byte, the property's number, and its answer goes to group 6, as Barrett's own
//! library wants it: number with the highest bit set, 0, and the value in two bytes, or in four if it
//! is a property of two numbers.

use can::Frame;
use canopen::NodeId;

use super::properties::{LAST, is_long};

/// Bits of an identifier.
const GROUP: u32 = 0x400;
const NUMBER: u32 = 0x1F;
const SENDER_SHIFT: u32 = 5;
/// Bit of the first byte: the message sets, or tells, a property.
const SET: u8 = 0x80;
/// The group to which answers go.
const ANSWERS: u16 = 6;
/// GRPA, GRPB and GRPC: the groups to which every drive belongs.
pub(super) const GROUPS: [u32; 3] = [0, 1, 4];

/// The property that the host reads of the drive `id`, if that is what the frame is.
///
/// Whatever comes from another sender is none: an SDO request or a heartbeat looks like a message to
/// a group. Sets are not obeyed: 0x3F00 is read only, too (J18).
pub(super) fn read(frame: &Frame, id: NodeId) -> Option<u8> {
    let key = frame.key();
    let is_from_host = key & !(GROUP | NUMBER) == 0;
    let receiver = key & NUMBER;
    let is_mine = match key & GROUP {
        0 => receiver == u32::from(id.get()),
        _ => GROUPS.contains(&receiver),
    };
    match *frame.data() {
        [number] if is_from_host && is_mine && number <= LAST => Some(number),
        _ => None,
    }
}

/// The answer of the drive `id`: the value of a property. A number above 31 has no place in an
/// identifier.
pub(super) fn answer(id: NodeId, number: u8, value: u32) -> Option<Frame> {
    let sender = u16::from(id.get());
    if u32::from(sender) > NUMBER {
        return None;
    }
    let [v0, v1, v2, v3] = value.to_le_bytes();
    let length = if is_long(number) { 6 } else { 4 };
    let identifier = GROUP as u16 | sender << SENDER_SHIFT | ANSWERS;
    let data = [SET | number, 0, v0, v1, v2, v3, 0, 0];
    Some(Frame::classic(identifier, data, length))
}
