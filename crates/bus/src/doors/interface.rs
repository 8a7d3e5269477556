//! A door at a CAN interface of this machine: its frames to the simulation, the bus's frames to it.

use super::outbox::{Item, Next};
use super::roster::Newcomer;
use super::serve::{Door, closed};
use super::{ClientId, LeaveReason, Outbox, Peer, Text, Trouble};
use crate::InterfaceError;
use crate::interface::{Interface, What};
use can::Frame;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{sleep, timeout};

/// How often to look whether an interface that was lost can be used again.
const AGAIN: Duration = Duration::from_millis(250);
/// How long a frame may wait for room in the interface's queue before that is reported.
const PATIENCE: Duration = Duration::from_secs(1);

/// Keeps the interface on the bus until the doors are closed: one stay after the other, as often as
/// it comes back.
pub(super) async fn attend(mut interface: Interface, door: Door) {
    let mut closing = door.closing.clone();
    loop {
        let outbox = Arc::new(Outbox::new(door.options.outbox_frames));
        outbox.open_at_once();
        let client = door.roster.join(Newcomer {
            door: door.door,
            peer: Peer::Interface(door.endpoint.channel().to_owned()),
            outbox: &outbox,
            seat: None,
            listen_only: false,
            bit_rate: None,
            held_frames: door.options.outbox_frames,
        });
        let mut waiting = Vec::new();
        let reason = tokio::select! {
            reason = listen(&interface, &door, client) => reason,
            reason = send(&interface, &door, &outbox, &mut waiting) => reason,
            reason = dropped(&outbox) => reason,
            () = closed(&mut closing) => LeaveReason::Closing,
        };
        if reason == LeaveReason::Closing {
            outbox.finish(Text::Borrowed(b""));
            let rest = send(&interface, &door, &outbox, &mut waiting);
            // What it does not take in that time is lost, as with a client that does not read.
            let _ = timeout(door.options.linger, rest).await;
            return;
        }
        outbox.close();
        door.roster.leave(client, reason);
        let name = door.endpoint.channel();
        interface = tokio::select! {
            back = comes_back(name, &door, client) => back,
            () = closed(&mut closing) => return,
        };
    }
}

/// Until the interface can be used again and its last stay is over.
async fn comes_back(name: &str, door: &Door, before: ClientId) -> Interface {
    loop {
        sleep(AGAIN).await;
        if !door.roster.remembers(before)
            && let Ok(interface) = Interface::open(name)
        {
            return interface;
        }
    }
}

fn lost(error: &InterfaceError) -> LeaveReason {
    LeaveReason::Interface(error.to_string())
}

/// From the interface to the bus.
async fn listen(interface: &Interface, door: &Door, client: ClientId) -> LeaveReason {
    loop {
        match interface.receive().await {
            Ok(heard) => match heard.what {
                What::Frame(frame) => {
                    if !door.roster.send(client, frame) {
                        let waiting = door.options.outbox_frames;
                        return LeaveReason::TooFast { waiting };
                    }
                }
                What::Error(report) => door.roster.trouble(door.door, Trouble::Error(report)),
            },
            Err(error) => return lost(&error),
        }
    }
}

/// From the bus to the interface, until it is lost or the outbox is finished. What was taken from
/// the outbox and not sent stays in `waiting`, the next last.
async fn send(
    interface: &Interface,
    door: &Door,
    outbox: &Outbox,
    waiting: &mut Vec<Item>,
) -> LeaveReason {
    loop {
        while let Some(item) = waiting.last() {
            if let Item::Frame { frame, .. } = item
                && let Err(error) = send_frame(interface, door, frame).await
            {
                return lost(&error);
            }
            waiting.pop();
        }
        match outbox.next(waiting) {
            Next::Send(_) => waiting.reverse(),
            Next::Wait | Next::WaitUntil(_) => outbox.writer_woken().await,
            Next::Close => return LeaveReason::Closing,
        }
    }
}

/// Sends one frame, however long it takes; if that is long, says so once.
async fn send_frame(
    interface: &Interface,
    door: &Door,
    frame: &Frame,
) -> Result<(), InterfaceError> {
    let mut reported = false;
    loop {
        match interface.send(frame, PATIENCE).await {
            Err(stuck @ InterfaceError::Stuck { .. }) => {
                if !std::mem::replace(&mut reported, true) {
                    let trouble = Trouble::Stuck(stuck.to_string());
                    door.roster.trouble(door.door, trouble);
                }
            }
            result => return result,
        }
    }
}

/// Until the outbox has run over.
async fn dropped(outbox: &Outbox) -> LeaveReason {
    loop {
        outbox.reader_woken().await;
        if let Some(reason) = outbox.stopped() {
            return reason;
        }
    }
}
