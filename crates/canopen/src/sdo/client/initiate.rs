//! The first exchange of a transfer: what is asked for, and what the server makes of it.

use super::block_download::BlockDownload;
use super::block_upload::BlockUpload;
use super::segmented::{SegmentedDownload, SegmentedUpload};
use super::transfer::{Answer, Direction, Phase, Reaction, Request, Transfer, command_and};
use super::{Failure, Method, Progress, RequestForm, Settings, Sink, Source};

impl Transfer {
    /// The request that begins the transfer.
    ///
    /// # Errors
    /// The source refuses.
    pub(super) fn initiate(
        &self,
        settings: &Settings,
        source: &mut impl Source,
    ) -> Result<Request, Failure> {
        let crc = u8::from(settings.crc) << 2;
        Ok(match (self.direction, self.method) {
            // CiA 301 7.2.4.3.6.
            (Direction::Upload, Method::Expedited | Method::Segmented) => Request {
                data: self.addressed(0x40, [0; 4]),
                len: match settings.form {
                    RequestForm::Sized | RequestForm::Unsized => 8,
                    RequestForm::Short => 4,
                },
            },
            // CiA 301 7.2.4.3.12.
            (Direction::Upload, Method::Block) => Request::whole(self.addressed(
                0xA0 | crc,
                [settings.block_size, settings.switch_threshold, 0, 0],
            )),
            // CiA 301 7.2.4.3.3.
            (Direction::Download { bytes }, Method::Expedited) => {
                let bytes = bytes.min(4) as u8;
                let mut data = [0; 4];
                if let Some(data) = data.get_mut(..usize::from(bytes)) {
                    source.give(0, data).map_err(Failure::Refused)?;
                }
                let unused = 4u8.saturating_sub(bytes);
                match settings.form {
                    RequestForm::Sized => Request::whole(self.addressed(0x23 | unused << 2, data)),
                    RequestForm::Unsized => Request::whole(self.addressed(0x22, data)),
                    RequestForm::Short => Request {
                        data: self.addressed(0x22, data),
                        len: 8u8.saturating_sub(unused),
                    },
                }
            }
            (Direction::Download { bytes }, Method::Segmented) => {
                Request::whole(self.addressed(0x21, bytes.to_le_bytes()))
            }
            // CiA 301 7.2.4.3.9.
            (Direction::Download { bytes }, Method::Block) => {
                Request::whole(self.addressed(0xC2 | crc, bytes.to_le_bytes()))
            }
        })
    }

    /// The server's answer to it.
    pub(super) fn initiated(
        &self,
        answer: &Answer<'_>,
        settings: &Settings,
        progress: &mut Progress,
        sink: &mut impl Sink,
    ) -> Reaction {
        if !self.is_for_object(answer) {
            return Reaction::Stale;
        }
        let command = answer.command();
        let [.., d0, _, _, _] = answer.frame.bytes();
        match (self.direction, self.method, command >> 5) {
            (Direction::Upload, Method::Block, 6) if command & 1 == 0 => {
                let Some(total) = indicated(answer, command & 2 != 0) else {
                    return Reaction::Stale;
                };
                progress.total = total;
                let crc = settings.crc && command & 4 != 0;
                Reaction::Enter(Phase::BlockUpload(BlockUpload::new(
                    settings.block_size,
                    crc,
                )))
            }
            (Direction::Upload, Method::Block, 2) if settings.switch_threshold == 0 => {
                Reaction::Failed(Failure::Command { command })
            }
            (Direction::Upload, _, 2) if command & 2 != 0 => expedited(answer, progress, sink),
            (Direction::Upload, method, 2) => {
                let Some(total) = indicated(answer, command & 1 != 0) else {
                    return Reaction::Stale;
                };
                if method == Method::Expedited {
                    return Reaction::Failed(Failure::NotExpedited { bytes: total });
                }
                progress.total = total;
                Reaction::Enter(Phase::SegmentedUpload(SegmentedUpload::new()))
            }
            (Direction::Download { bytes }, Method::Expedited, 3) => {
                progress.done = bytes;
                Reaction::DONE
            }
            (Direction::Download { .. }, Method::Segmented, 3) => {
                Reaction::Enter(Phase::SegmentedDownload(SegmentedDownload::new()))
            }
            (Direction::Download { bytes }, Method::Block, 5) if command & 3 == 0 => {
                let crc = settings.crc && command & 4 != 0;
                match BlockDownload::new(bytes, d0, crc) {
                    Ok(block) => Reaction::Enter(Phase::BlockDownload(block)),
                    Err(failure) => Reaction::Failed(failure),
                }
            }
            // No such specifier (CiA 301 table 22, 0x05040001).
            (_, _, 7) => Reaction::Failed(Failure::Command { command }),
            // The answer to an earlier request for this object, which was given up.
            _ => Reaction::Stale,
        }
    }

    /// A frame that names the object.
    pub(super) fn addressed(&self, command: u8, data: [u8; 4]) -> [u8; 8] {
        let [low, high] = self.object.index.to_le_bytes();
        let [d0, d1, d2, d3] = data;
        [command, low, high, self.object.sub, d0, d1, d2, d3]
    }

    /// Whether an answer names the object.
    pub(super) fn is_for_object(&self, answer: &Answer<'_>) -> bool {
        let [_, own @ .., _, _, _, _] = self.addressed(0, [0; 4]);
        let [_, named @ .., _, _, _, _] = answer.frame.bytes();
        answer.frame.len() >= 4 && own == named
    }
}

/// The size in an answer that says whether it has one. `None` if it is too short for that.
fn indicated(answer: &Answer<'_>, is_indicated: bool) -> Option<Option<u32>> {
    let [.., d0, d1, d2, d3] = answer.frame.bytes();
    match is_indicated {
        true if answer.frame.len() < 8 => None,
        true => Some(Some(u32::from_le_bytes([d0, d1, d2, d3]))),
        false => Some(None),
    }
}

/// An upload in one exchange (CiA 301 7.2.4.3.6). If the size is not indicated, or the frame is
/// shorter than it says, all bytes that came are taken.
fn expedited(answer: &Answer<'_>, progress: &mut Progress, sink: &mut impl Sink) -> Reaction {
    let command = answer.command();
    let came = answer.frame.data().get(4..).unwrap_or(&[]);
    let said = 4usize.saturating_sub(usize::from(command >> 2 & 3));
    let (bytes, is_sized) = match came.get(..said) {
        Some(bytes) if command & 1 != 0 => (bytes, true),
        _ => (came, false),
    };
    let taken = progress
        .take(bytes, sink)
        .and_then(|()| progress.complete(sink));
    match taken {
        Ok(()) => Reaction::Done {
            parting: None,
            is_sized,
        },
        Err(failure) => Reaction::Failed(failure),
    }
}

/// The confirmation that a block upload ended, and other frames without address.
pub(super) const fn bare(command: u8) -> [u8; 8] {
    command_and(command, [0; 7])
}
