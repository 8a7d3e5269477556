//! Transfers of any length, by the protocol that fits.

use std::ops::ControlFlow;

use canopen::sdo_client::{self, NoData, SdoClient, Sink, Source, Stage};
use canopen::{Abort, Address, NodeId};

use crate::sdo::run::Direction;
use crate::sdo::{Access, Cause, Done, Failure, Progress, SdoError};
use crate::{Client, Link};

/// Which protocol a transfer uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Expedited up to 4 bytes, in blocks above 256 bytes if the node knows them, segmented
    /// otherwise. Of an upload the node says the size, or else it is segmented. A node that refuses
    /// blocks as unknown (0x05040001) is asked once.
    #[default]
    Auto,
    /// In one exchange, up to 4 bytes.
    Expedited,
    /// Segment by segment. An upload of up to 4 bytes is expedited if the node likes.
    Segmented,
    /// In blocks. An upload becomes segmented or expedited if the node likes and
    /// [`crate::BlockSettings::switch_threshold`] allows it.
    Block,
}

/// Bytes above which blocks are worth a refusal.
const BLOCKS_ABOVE: u32 = 256;

/// Bytes above which [`Client::upload_all`] gives up: a node without end must not fill the memory.
const LONGEST: usize = 64 << 20;

/// Never gives up.
fn patient(_: Progress) -> ControlFlow<Abort> {
    ControlFlow::Continue(())
}

impl<L: Link> Client<L> {
    /// Reads an object of any length into `sink`. `progress` is told how far it is, at least every
    /// 50 ms while the link waits; if it breaks, the node is told why and the transfer ends.
    ///
    /// # Errors
    /// [`SdoError`]. The sink may have taken a part then.
    pub async fn upload_to(
        &mut self,
        node: NodeId,
        object: Address,
        sink: &mut impl Sink,
        progress: impl FnMut(Progress) -> ControlFlow<Abort>,
    ) -> Result<Done, SdoError> {
        self.transfer(node, object, Direction::Upload, sink, &mut NoData, progress)
            .await
            .map_err(|cause| SdoError {
                node,
                object,
                access: Access::Read,
                cause,
            })
    }

    /// Writes an object of `bytes` bytes from `source`; `progress` as in [`Client::upload_to`].
    ///
    /// # Errors
    /// [`SdoError`].
    pub async fn download_from(
        &mut self,
        node: NodeId,
        object: Address,
        bytes: u32,
        source: &mut impl Source,
        progress: impl FnMut(Progress) -> ControlFlow<Abort>,
    ) -> Result<Done, SdoError> {
        let direction = Direction::Download(bytes);
        self.transfer(node, object, direction, &mut NoData, source, progress)
            .await
            .map_err(|cause| SdoError {
                node,
                object,
                access: Access::Write,
                cause,
            })
    }

    /// Reads an object of any length up to 64 MiB.
    ///
    /// # Errors
    /// [`SdoError`].
    pub async fn upload_all(&mut self, node: NodeId, object: Address) -> Result<Vec<u8>, SdoError> {
        let mut all = Vec::new();
        let mut sink = |offset: u32, bytes: &[u8]| {
            all.truncate(offset as usize);
            if all.len() + bytes.len() > LONGEST {
                return Err(Abort::OUT_OF_MEMORY);
            }
            all.extend_from_slice(bytes);
            Ok(())
        };
        self.upload_to(node, object, &mut sink, patient).await?;
        Ok(all)
    }

    /// Writes an object of any length.
    ///
    /// # Errors
    /// [`SdoError`].
    pub async fn download_all(
        &mut self,
        node: NodeId,
        object: Address,
        mut bytes: &[u8],
    ) -> Result<(), SdoError> {
        let Ok(count) = u32::try_from(bytes.len()) else {
            return Err(SdoError {
                node,
                object,
                access: Access::Write,
                cause: Cause::TooLong,
            });
        };
        self.download_from(node, object, count, &mut bytes, patient)
            .await
            .map(|_| ())
    }

    async fn transfer(
        &mut self,
        node: NodeId,
        object: Address,
        direction: Direction,
        sink: &mut impl Sink,
        source: &mut impl Source,
        mut progress: impl FnMut(Progress) -> ControlFlow<Abort>,
    ) -> Result<Done, Cause> {
        let mut sdo = self.sdo_client(node, self.expedited_form(true));
        let is_auto = self.settings.method == Method::Auto;
        let node_bit = 1u128 << (node.get() & 127);
        let may_block = is_auto && self.without_blocks & node_bit == 0;
        let mut method = match (self.settings.method, direction) {
            (Method::Expedited, _) => sdo_client::Method::Expedited,
            (Method::Segmented, _) | (Method::Auto, Direction::Upload) => {
                sdo_client::Method::Segmented
            }
            (Method::Block, _) => sdo_client::Method::Block,
            (Method::Auto, Direction::Download(1..=4)) => sdo_client::Method::Expedited,
            (Method::Auto, Direction::Download(bytes)) if may_block && bytes > BLOCKS_ABOVE => {
                sdo_client::Method::Block
            }
            (Method::Auto, Direction::Download(_)) => sdo_client::Method::Segmented,
        };
        if may_block && matches!(direction, Direction::Upload) {
            let mut is_long = false;
            let watch = |sdo: &SdoClient| {
                let now = sdo.progress();
                if sdo.stage() == Some(Stage::Segment)
                    && now.done == 0
                    && now.total.is_some_and(|total| total > BLOCKS_ABOVE)
                {
                    // Before the first segment has been asked for.
                    is_long = true;
                    return ControlFlow::Break(Abort::GENERAL);
                }
                progress(now)
            };
            let outcome = self.run(&mut sdo, object, direction, method, sink, source, watch);
            let outcome = outcome.await;
            if !(is_long && matches!(outcome, Err(Cause::Failed(Failure::Cancelled(_))))) {
                return outcome;
            }
            method = sdo_client::Method::Block;
        }
        let watch = |sdo: &SdoClient| progress(sdo.progress());
        let outcome = self.run(&mut sdo, object, direction, method, sink, source, watch);
        let outcome = outcome.await;
        let is_unknown = matches!(outcome, Err(Cause::Aborted(Abort::COMMAND)));
        if !(may_block && method == sdo_client::Method::Block && is_unknown)
            || sdo.progress().done != 0
        {
            return outcome;
        }
        self.without_blocks |= node_bit;
        let segmented = sdo_client::Method::Segmented;
        let watch = |sdo: &SdoClient| progress(sdo.progress());
        self.run(&mut sdo, object, direction, segmented, sink, source, watch)
            .await
    }
}
