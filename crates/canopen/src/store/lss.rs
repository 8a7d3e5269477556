//! What LSS has configured, as records of their own among the stored parameters (CiA 305, store
//! configuration). Saving and restoring parameters (0x1010, 0x1011) leaves them as they are.

use super::{Damage, Full, Record, Records, Writer, check, find, records};
use crate::Address;

/// The node ID's record: one byte. The area of data types, where no stored object can lie.
pub const NODE_ID: Address = Address::new(0x0001, 1);
/// The bit timing's record: table selector and table index, a byte each.
pub const BIT_TIMING: Address = Address::new(0x0001, 2);

/// A bit timing as LSS tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitTiming {
    /// The table; 0 is CiA 301's.
    pub selector: u8,
    /// The entry of the table.
    pub index: u8,
}

/// What LSS has stored. `None`: the drive's own default holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LssConfiguration {
    /// The node ID: 1 to 127, or 255, not configured.
    pub node_id: Option<u8>,
    /// The bit timing.
    pub bit_timing: Option<BitTiming>,
}

/// Whether a record is one of these, and no object's.
pub(super) fn is_lss(address: Address) -> bool {
    address == NODE_ID || address == BIT_TIMING
}

/// What LSS has stored; a record of the wrong length or a node ID that is none counts as not there.
///
/// # Errors
/// The [`Damage`] of the store.
pub fn read(stored: &[u8]) -> Result<LssConfiguration, Damage> {
    let mut configuration = LssConfiguration::default();
    for record in records(stored)? {
        match (record.address, record.bytes) {
            (NODE_ID, &[id @ (1..=127 | 255)]) => configuration.node_id = Some(id),
            (BIT_TIMING, &[selector, index]) => {
                configuration.bit_timing = Some(BitTiming { selector, index });
            }
            _ => {}
        }
    }
    Ok(configuration)
}

/// Writes a new store into `out`: `configuration`, and all other records as they stand in `old`.
/// Returns the bytes used. `old` is taken as empty if it is damaged.
///
/// # Errors
/// [`Full`] if `out` is too small; its contents are then of no use.
pub fn replace(
    old: &[u8],
    configuration: &LssConfiguration,
    out: &mut [u8],
) -> Result<usize, Full> {
    let mut writer = Writer::new(out);
    if let Some(id) = configuration.node_id {
        writer.bytes(NODE_ID, &[id])?;
    }
    if let Some(timing) = configuration.bit_timing {
        writer.bytes(BIT_TIMING, &[timing.selector, timing.index])?;
    }
    let old = check(old).unwrap_or(&[]);
    for Record { address, bytes } in (Records { rest: old }) {
        if !is_lss(address) {
            writer.bytes(address, bytes)?;
        }
    }
    writer.finish()
}

/// Writes the records that `old`, checked, has of these.
pub(super) fn keep(old: &[u8], writer: &mut Writer<'_>) -> Result<(), Full> {
    for address in [NODE_ID, BIT_TIMING] {
        if let Some(bytes) = find(old, address) {
            writer.bytes(address, bytes)?;
        }
    }
    Ok(())
}
