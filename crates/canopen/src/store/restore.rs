//! Restoring defaults (0x1011): a store without the records of what is restored.

use super::{Full, Record, Records, Request, Writer, check, lss};
use crate::{Abort, Address, Group, Table};

/// "load" as an UNSIGNED32 (CiA 301 7.5.2.14).
pub const RESTORE_SIGNATURE: u32 = u32::from_le_bytes(*b"load");

impl Request {
    /// What a write of `value` to 0x1011, `sub` (1 to 3) asks to be put back to its defaults.
    ///
    /// # Errors
    /// [`Abort::CANNOT_STORE`] without the signature, [`Abort::NO_SUB_INDEX`] for another `sub`.
    pub const fn from_restore(sub: u8, value: u32) -> Result<Request, Abort> {
        let request = match sub {
            1 => Request::All,
            2 => Request::Communication,
            3 => Request::Application,
            _ => return Err(Abort::NO_SUB_INDEX),
        };
        if value == RESTORE_SIGNATURE {
            Ok(request)
        } else {
            Err(Abort::CANNOT_STORE)
        }
    }

    /// Whether the record of `address` goes when this is restored. An object that the dictionary
    /// does not have, another firmware's, is judged by its area.
    fn restores(self, table: &Table, address: Address) -> bool {
        let row = table
            .find(address.index, address.sub)
            .ok()
            .and_then(|entry| table.row(&entry));
        match (row, self) {
            _ if lss::is_lss(address) => false,
            // Another configuration than the one that was verified (CiA 301 7.5.2.23).
            _ if address.index == 0x1020 => true,
            (_, Request::All) => true,
            (Some(row), _) if row.group != Group::None => self.covers(row, address),
            (_, Request::Communication) => address.is_communication(),
            (_, Request::Application) => !address.is_communication(),
            (_, Request::Single(_) | Request::Run { .. }) => self.names(address),
        }
    }
}

/// Writes a new store into `out`: `old` without what `request` restores. Returns the bytes used.
/// The drive's values are as they were until it is reset and loads this store: so defaults become
/// valid when CiA 301 7.5.2.14 says. What LSS has stored stays. `old` is taken as empty if it is
/// damaged.
///
/// # Errors
/// [`Full`] if `out` is too small; its contents are then of no use.
pub fn restore(table: &Table, request: Request, old: &[u8], out: &mut [u8]) -> Result<usize, Full> {
    let mut writer = Writer::new(out);
    let old = check(old).unwrap_or(&[]);
    for Record { address, bytes } in (Records { rest: old }) {
        if !request.restores(table, address) {
            writer.bytes(address, bytes)?;
        }
    }
    writer.finish()
}
