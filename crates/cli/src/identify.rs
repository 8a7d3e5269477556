//! Which documented drive a node is, by what it answers.

use canopen::{Address, DataType, Default, NodeId};
use client::scan::{Found, Scan};
use client::sdo::{Cause, SdoError};
use client::{Client, Link, LinkError};
use personalities::Personality;

/// Which drive a node says it is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Identity {
    /// This one.
    Drive(&'static Personality),
    /// None that is known here, or one of several.
    Unknown,
    /// It does not answer.
    Silent,
}

impl Identity {
    /// The drive, if it is known.
    pub(crate) fn drive(self) -> Option<&'static Personality> {
        match self {
            Identity::Drive(drive) => Some(drive),
            Identity::Unknown | Identity::Silent => None,
        }
    }
}

/// Asks `node` which drive it is.
///
/// # Errors
/// The link broke.
pub(crate) async fn node<L: Link>(
    client: &mut Client<L>,
    node: NodeId,
) -> Result<Identity, LinkError> {
    let scan = Scan {
        nodes: node.get()..=node.get(),
        answer_ms: client.settings.answer_ms,
        ..Scan::default()
    };
    let scanned = client.scan(&scan).await?.pop();
    let Some(scanned) = scanned.filter(|found| found.answers_sdo) else {
        return Ok(Identity::Silent);
    };
    let drive = found(client, &scanned).await?;
    Ok(drive.map_or(Identity::Unknown, Identity::Drive))
}

/// The drive that a scan has found, if it is known. Asks the node on where its identity is that of several.
///
/// # Errors
/// The link broke.
pub(crate) async fn found<L: Link>(
    client: &mut Client<L>,
    found: &Found,
) -> Result<Option<&'static Personality>, LinkError> {
    let mut candidates = candidates(found);
    // One family with several numbers of axes: the last one that is there tells.
    candidates.sort_by_key(|drive| std::cmp::Reverse(drive.axes.len()));
    let Some(node) = NodeId::new(found.node) else {
        return Ok(None);
    };
    while let [first, _, ..] = candidates[..] {
        let Some(above) = first.axes.len().checked_sub(1).filter(|above| *above > 0) else {
            // Nothing tells them apart.
            return Ok(None);
        };
        let modes = Address::new(0x6061 + 0x800 * above as u16, 0);
        match client.read(node, modes, DataType::I8).await {
            Ok(_) => return Ok(Some(first)),
            Err(error) if error.abort().is_some() => {
                candidates.remove(0);
            }
            Err(SdoError {
                cause: Cause::Link(error),
                ..
            }) => return Err(error),
            Err(_) => return Ok(None),
        }
    }
    Ok(candidates.pop())
}

/// The drives with this vendor (0x1018,1) and name (0x1008). Revisions are those of a firmware.
fn candidates(found: &Found) -> Vec<&'static Personality> {
    let (Some(vendor), Some(name)) = (found.vendor, &found.name) else {
        return Vec::new();
    };
    let all = personalities::ALL.iter().copied();
    let says = |drive: &&Personality| {
        let default = |index, sub| {
            let mut rows = drive.device.table.rows().iter();
            let row = rows.find(|row| row.address == Address::new(index, sub));
            row.map(|row| row.default)
        };
        default(0x1018, 1) == Some(Default::Value(vendor.into()))
            && default(0x1008, 0).is_some_and(
                |default| matches!(default, Default::Text(own) if own == name.trim_end_matches('\0')),
            )
    };
    all.filter(says).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every drive is told from those of other names by its own data, the numbers of axes apart.
    #[test]
    fn no_two_families_say_the_same() {
        for drive in personalities::ALL {
            let rows = drive.device.table.rows();
            let default = |index, sub| {
                let mut rows = rows.iter();
                let row = rows.find(|row| row.address == Address::new(index, sub));
                row.unwrap_or_else(|| panic!("{}", drive.name)).default
            };
            let (Default::Value(vendor), Default::Text(name)) =
                (default(0x1018, 1), default(0x1008, 0))
            else {
                panic!("{}", drive.name);
            };
            let found = Found {
                vendor: u32::try_from(vendor).ok(),
                name: Some(name.to_owned()),
                ..Found::new(NodeId::new(1).unwrap())
            };
            let axes: Vec<usize> = candidates(&found).iter().map(|d| d.axes.len()).collect();
            assert!(axes.contains(&drive.axes.len()), "{}", drive.name);
            let mut once = axes.clone();
            once.dedup();
            assert_eq!(once, axes, "{}", drive.name);
            let silent = Found {
                name: None,
                ..found
            };
            assert!(candidates(&silent).is_empty());
        }
    }
}
