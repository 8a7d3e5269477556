//! One transfer at a time: ask, wait for the answer that belongs to it, ask again.

use std::fmt;

use canopen::{Abort, Address, DataType, NodeId};

use crate::sdo::{Answer, Data, Request};
use crate::{Client, Link, LinkError, Settings, Value};

/// What was tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Reading (upload).
    Read,
    /// Writing (download).
    Write,
}

/// Why a transfer failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The server refused.
    Aborted(Abort),
    /// No answer came.
    TimedOut {
        /// How long each attempt waited.
        answer_ms: u64,
        /// How many attempts there were.
        attempts: u32,
    },
    /// The server wants to send more than four bytes, which needs a segmented transfer. It was
    /// told that this client does not do that.
    NotExpedited {
        /// Bytes that the object has, if the server said.
        bytes: Option<u32>,
    },
    /// The value that came is not of the type that was asked for.
    WrongType {
        /// What came.
        data: Data,
        /// What was asked for.
        data_type: DataType,
    },
    /// The link broke.
    Link(LinkError),
}

/// An SDO transfer that failed: which, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SdoError {
    /// The server.
    pub node: NodeId,
    /// The object.
    pub object: Address,
    /// Reading or writing.
    pub access: Access,
    /// Why.
    pub cause: Cause,
}

impl SdoError {
    /// The abort code, if the server refused.
    pub fn abort(&self) -> Option<Abort> {
        match self.cause {
            Cause::Aborted(abort) => Some(abort),
            _ => None,
        }
    }
}

impl fmt::Display for SdoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let access = match self.access {
            Access::Read => "reading",
            Access::Write => "writing",
        };
        write!(f, "node {}: {access} {}: ", self.node, self.object)?;
        match &self.cause {
            Cause::Aborted(abort) => write!(f, "refused, {abort}"),
            Cause::TimedOut {
                answer_ms,
                attempts: 1,
            } => {
                write!(f, "no answer within {answer_ms} ms")
            }
            Cause::TimedOut {
                answer_ms,
                attempts,
            } => {
                write!(f, "no answer within {answer_ms} ms, asked {attempts} times")
            }
            Cause::NotExpedited { bytes: Some(bytes) } => {
                write!(
                    f,
                    "the object has {bytes} bytes, which needs a segmented transfer"
                )
            }
            Cause::NotExpedited { bytes: None } => {
                f.write_str("the object has more than 4 bytes, which needs a segmented transfer")
            }
            Cause::WrongType { data, data_type } => {
                write!(
                    f,
                    "{} bytes came, which is no {}",
                    data.bytes().len(),
                    data_type.name()
                )
            }
            Cause::Link(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for SdoError {}

/// What the answer to an upload may be.
enum Upload {
    Data(Data),
    Segmented(Option<u32>),
}

impl<L: Link> Client<L> {
    /// Reads an object by an expedited upload.
    ///
    /// # Errors
    /// [`SdoError`]. Frames that came meanwhile wait in [`Client::receive`].
    pub async fn upload(&mut self, node: NodeId, object: Address) -> Result<Data, SdoError> {
        let answer = self.ask(
            node,
            object,
            Request::Upload(object),
            |answer| match answer {
                Answer::Uploaded(address, data) if address == object => Some(Upload::Data(data)),
                Answer::SegmentedUpload(address, bytes) if address == object => {
                    Some(Upload::Segmented(bytes))
                }
                _ => None,
            },
        );
        let failed = |cause| SdoError {
            node,
            object,
            access: Access::Read,
            cause,
        };
        match answer.await.map_err(failed)? {
            Upload::Data(data) => Ok(data),
            Upload::Segmented(bytes) => {
                // Leave no server waiting for the request of the first segment.
                let give_up = Request::Abort(object, Abort::OUT_OF_MEMORY);
                if let Some(frame) = give_up.frame(node, self.settings.form) {
                    self.send(frame)
                        .await
                        .map_err(|error| failed(Cause::Link(error)))?;
                }
                Err(failed(Cause::NotExpedited { bytes }))
            }
        }
    }

    /// Reads an object as a value of a known type, whatever the server says about its size (P2).
    ///
    /// # Errors
    /// [`SdoError`].
    pub async fn read(
        &mut self,
        node: NodeId,
        object: Address,
        data_type: DataType,
    ) -> Result<Value, SdoError> {
        let data = self.upload(node, object).await?;
        data.value(data_type).ok_or(SdoError {
            node,
            object,
            access: Access::Read,
            cause: Cause::WrongType { data, data_type },
        })
    }

    /// Writes an object by an expedited download and waits until the server says that it did.
    ///
    /// # Errors
    /// [`SdoError`].
    pub async fn download(
        &mut self,
        node: NodeId,
        object: Address,
        data: Data,
    ) -> Result<(), SdoError> {
        self.ask(
            node,
            object,
            Request::Download(object, data),
            |answer| match answer {
                Answer::Downloaded(address) if address == object => Some(()),
                _ => None,
            },
        )
        .await
        .map_err(|cause| SdoError {
            node,
            object,
            access: Access::Write,
            cause,
        })
    }

    /// Asks as often as the settings say, until `pick` takes an answer or the server aborts. Other
    /// answers are stale: they belong to a transfer that timed out, and go to the inbox.
    async fn ask<T>(
        &mut self,
        node: NodeId,
        object: Address,
        request: Request,
        pick: impl Fn(Answer) -> Option<T>,
    ) -> Result<T, Cause> {
        let Settings {
            answer_ms,
            attempts,
            form,
        } = self.settings;
        let attempts = attempts.max(1);
        let answers = 0x580 + u32::from(node.get());
        if let Some(frame) = request.frame(node, form) {
            for _ in 0..attempts {
                self.set_aside().await.map_err(Cause::Link)?;
                self.send(frame).await.map_err(Cause::Link)?;
                let until = self.now().plus_ms(answer_ms);
                let answer = self.wait_for(until, |_, frame| {
                    let answer = (frame.key() == answers).then(|| Answer::parse(frame))??;
                    match answer {
                        Answer::Aborted(address, abort) if address == object => Some(Err(abort)),
                        answer => pick(answer).map(Ok),
                    }
                });
                match answer.await.map_err(Cause::Link)? {
                    Some(Ok(answer)) => return Ok(answer),
                    Some(Err(abort)) => return Err(Cause::Aborted(abort)),
                    None => {}
                }
            }
        }
        Err(Cause::TimedOut {
            answer_ms,
            attempts,
        })
    }
}
