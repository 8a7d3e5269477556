//! Transfers of up to four bytes, and how transfers of any length fail.

use std::fmt;

use canopen::sdo_client::{Failure, Method, NoData, StartError};
use canopen::{Abort, Address, DataType, NodeId};

use crate::sdo::Data;
use crate::sdo::run::{Direction, go_on};
use crate::{Client, Link, LinkError, Value};

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
    /// The server wants to send more than four bytes, which needs a segmented transfer; only an
    /// expedited one was asked for, and the server was told so.
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
    /// The transfer broke off on the way.
    Failed(Failure),
    /// It could not begin.
    NotBegun(StartError),
    /// No object has more than 4 GiB.
    TooLong,
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
            Cause::Failed(failure) => write!(f, "{failure}"),
            Cause::NotBegun(error) => write!(f, "{error}"),
            Cause::TooLong => f.write_str("no object has more than 4294967295 bytes"),
            Cause::Link(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for SdoError {}

impl<L: Link> Client<L> {
    /// Reads an object by an expedited upload.
    ///
    /// # Errors
    /// [`SdoError`]. Frames that came meanwhile wait in [`Client::receive`].
    pub async fn upload(&mut self, node: NodeId, object: Address) -> Result<Data, SdoError> {
        let mut came = Vec::with_capacity(4);
        let mut sink = |offset: u32, bytes: &[u8]| {
            came.truncate(offset as usize);
            came.extend_from_slice(bytes);
            Ok(())
        };
        let mut sdo = self.sdo_client(node, self.expedited_form(true));
        let (direction, mut none) = (Direction::Upload, NoData);
        let read = self.run(
            &mut sdo,
            object,
            direction,
            Method::Expedited,
            &mut sink,
            &mut none,
            go_on,
        );
        let done = read.await.map_err(|cause| SdoError {
            node,
            object,
            access: Access::Read,
            cause,
        })?;
        let data = match done.is_sized {
            true => Data::sized(&came),
            false => Data::unsized_bytes(&came),
        };
        // An expedited transfer carries at most the four bytes that there is room for.
        Ok(data.unwrap_or(Data::EMPTY))
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
        let mut sdo = self.sdo_client(node, self.expedited_form(data.is_sized()));
        let direction = Direction::Download(data.bytes().len() as u32);
        let (mut none, mut source) = (NoData, data.bytes());
        let written = self.run(
            &mut sdo,
            object,
            direction,
            Method::Expedited,
            &mut none,
            &mut source,
            go_on,
        );
        let done = written.await.map_err(|cause| SdoError {
            node,
            object,
            access: Access::Write,
            cause,
        });
        done.map(|_| ())
    }
}
