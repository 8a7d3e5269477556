//! Network management from the master's side: commands, boot-ups, states.

use std::fmt;

use can::Frame;
use canopen::nmt::Command;
use canopen::{Instant, NmtState, NodeId};

use crate::{Client, Link, LinkError};

/// A boot-up message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BootUp {
    /// Who booted.
    pub node: NodeId,
    /// When the message came.
    pub at: Instant,
}

/// Why waiting for nodes ended without them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WaitError {
    /// These nodes did not report in time.
    TimedOut {
        /// What was waited for.
        what: &'static str,
        /// Nodes that are missing.
        missing: Vec<NodeId>,
        /// How long was waited.
        within_ms: u64,
    },
    /// The link broke.
    Link(LinkError),
}

impl fmt::Display for WaitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WaitError::TimedOut {
                what,
                missing,
                within_ms,
            } => {
                let nodes: Vec<String> = missing.iter().map(NodeId::to_string).collect();
                let plural = if missing.len() == 1 { "" } else { "s" };
                write!(
                    f,
                    "node{plural} {}: no {what} within {within_ms} ms",
                    nodes.join(", ")
                )
            }
            WaitError::Link(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for WaitError {}

/// Node and state in an error control frame (heartbeat, boot-up); `None` for any other frame.
pub(crate) fn error_control(frame: &Frame) -> Option<(NodeId, u8)> {
    let &[state] = frame.data() else {
        return None;
    };
    let id = frame.key().checked_sub(0x700)?;
    Some((NodeId::new(u8::try_from(id).ok()?)?, state))
}

impl<L: Link> Client<L> {
    /// Sends an NMT command to one node, or with `None` to all. NMT has no answer.
    ///
    /// # Errors
    /// The link broke.
    pub async fn nmt(&mut self, command: Command, node: Option<NodeId>) -> Result<(), LinkError> {
        let node = node.map_or(0, NodeId::get);
        self.send(Frame::classic(
            0,
            [command as u8, node, 0, 0, 0, 0, 0, 0],
            2,
        ))
        .await
    }

    /// Sends a SYNC without counter.
    ///
    /// # Errors
    /// The link broke.
    pub async fn sync(&mut self) -> Result<(), LinkError> {
        self.send(Frame::classic(0x80, [0; 8], 0)).await
    }

    /// Resets one node or all, and collects the boot-ups that come within `within_ms`. With one
    /// node it returns as soon as that has booted.
    ///
    /// # Errors
    /// The link broke.
    pub async fn reset(
        &mut self,
        node: Option<NodeId>,
        within_ms: u64,
    ) -> Result<Vec<BootUp>, LinkError> {
        self.set_aside().await?;
        self.nmt(Command::ResetNode, node).await?;
        let until = self.now().plus_ms(within_ms);
        let mut booted = Vec::new();
        while let Some(boot_up) = self.wait_for(until, boot_up).await? {
            booted.push(boot_up);
            if node == Some(boot_up.node) {
                break;
            }
        }
        Ok(booted)
    }

    /// Resets `nodes`, one command each, and waits until all have booted.
    ///
    /// # Errors
    /// [`WaitError`], which names the nodes that did not.
    pub async fn reset_and_wait(
        &mut self,
        nodes: &[NodeId],
        within_ms: u64,
    ) -> Result<(), WaitError> {
        self.set_aside().await.map_err(WaitError::Link)?;
        for node in nodes {
            self.nmt(Command::ResetNode, Some(*node))
                .await
                .map_err(WaitError::Link)?;
        }
        let until = self.now().plus_ms(within_ms);
        let mut missing = nodes.to_vec();
        while !missing.is_empty() {
            match self
                .wait_for(until, boot_up)
                .await
                .map_err(WaitError::Link)?
            {
                Some(boot_up) => missing.retain(|node| *node != boot_up.node),
                None => {
                    return Err(WaitError::TimedOut {
                        what: "boot-up",
                        missing,
                        within_ms,
                    });
                }
            }
        }
        Ok(())
    }

    /// Waits for a heartbeat of `node` that says `state`. Heartbeats that came before the call do
    /// not count.
    ///
    /// # Errors
    /// [`WaitError`]. A node without heartbeat (0x1017 = 0) always times out.
    pub async fn wait_for_state(
        &mut self,
        node: NodeId,
        state: NmtState,
        within_ms: u64,
    ) -> Result<Instant, WaitError> {
        self.set_aside().await.map_err(WaitError::Link)?;
        let until = self.now().plus_ms(within_ms);
        let wanted = |at, frame: &Frame| {
            let (from, byte) = error_control(frame)?;
            (from == node && NmtState::from_heartbeat(byte) == Some(state)).then_some(at)
        };
        self.wait_for(until, wanted)
            .await
            .map_err(WaitError::Link)?
            .ok_or(WaitError::TimedOut {
                what: "heartbeat of the wanted state",
                missing: vec![node],
                within_ms,
            })
    }
}

fn boot_up(at: Instant, frame: &Frame) -> Option<BootUp> {
    match error_control(frame)? {
        (node, 0) => Some(BootUp { node, at }),
        _ => None,
    }
}
