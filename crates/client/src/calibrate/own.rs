//! A calibration that a drive does by itself: begun, followed, and ended early if the user wants.

use std::fmt;

use canopen::{Address, DataType, NodeId};
use cia402::Mode;

use crate::axis::{Axis, AxisError};
use crate::sdo::{Access, Cause, Data, SdoError};
use crate::session::{Progress, Watch};
use crate::{Client, Link, LinkError, Value, nmt};

/// A calibration that a drive does by itself.
#[derive(Clone, Copy, Debug)]
pub struct OwnCalibration<'a> {
    /// The BOOLEAN that begins it.
    pub command: Address,
    /// The mode of operation that it wants.
    pub mode: Mode,
    /// A command without effect that is refused while it is at work.
    pub probe: Address,
    /// Status words that tell how it ended.
    pub status: &'a [Address],
    /// The bit of one of them that says it has failed.
    pub failed: Option<(Address, u8)>,
    /// At its end the drive stores what it has found, and starts over.
    pub restarts: bool,
    /// It takes no longer, ms.
    pub longest_ms: u64,
}

/// Status words and what they say.
pub type StatusWords = Vec<(Address, u32)>;

/// Why a drive's own calibration gave nothing.
#[derive(Clone, Debug, PartialEq)]
pub enum OwnError {
    /// The drive is not where it must be.
    Axis(AxisError),
    /// It did not take the command, or does not answer any more.
    Sdo(SdoError),
    /// It says that the calibration has failed.
    Failed {
        /// Its status words.
        status: StatusWords,
    },
    /// It is still at work, or says nothing of its end.
    TimedOut {
        /// After this long.
        after_ms: u64,
    },
    /// The user wants no more; the drive was told.
    Stopped,
}

impl fmt::Display for OwnError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OwnError::Axis(error) => write!(f, "{error}"),
            OwnError::Sdo(error) => write!(f, "{error}"),
            OwnError::Failed { status } => {
                f.write_str("the calibration has failed")?;
                let set = status.iter().filter(|(_, word)| *word != 0);
                for (n, (object, word)) in set.enumerate() {
                    let separator = if n == 0 { ":" } else { "," };
                    write!(f, "{separator} {object} is 0x{word:08X}")?;
                }
                Ok(())
            }
            OwnError::TimedOut { after_ms } => write!(
                f,
                "the calibration has not ended after {} s",
                after_ms / 1000
            ),
            OwnError::Stopped => f.write_str("stopped"),
        }
    }
}

impl std::error::Error for OwnError {}

impl From<AxisError> for OwnError {
    fn from(error: AxisError) -> OwnError {
        OwnError::Axis(error)
    }
}

impl From<SdoError> for OwnError {
    fn from(error: SdoError) -> OwnError {
        OwnError::Sdo(error)
    }
}

/// How often the drive is looked at, ms.
const LOOK_MS: u64 = 100;
/// How long a drive that has started over may take until it answers, ms.
const START_MS: u64 = 2_000;

impl<L: Link> Client<L> {
    /// Lets `node` run a calibration of its own, from "switch on disabled", and follows it to its end.
    /// What its status words say then.
    ///
    /// # Errors
    /// [`OwnError`]. The drive has been told to leave the mode then, which takes the power away.
    pub async fn run_own_calibration(
        &mut self,
        node: NodeId,
        own: &OwnCalibration<'_>,
        watch: &mut impl Watch,
    ) -> Result<StatusWords, OwnError> {
        let axis = Axis::new(node);
        axis.disable(self).await?;
        let mode = axis.set_mode(self, own.mode).await;
        let done = match mode {
            Ok(()) => self.begin_and_follow(node, own, watch).await,
            Err(error) => Err(error.into()),
        };
        let restarted = own.restarts && done.is_ok();
        if !restarted {
            let left = axis.set_mode(self, Mode::IDLE).await;
            // What is told of these is that the motor is without power. The others have their reason.
            if matches!(done, Err(OwnError::Stopped | OwnError::TimedOut { .. })) {
                left?;
            }
        }
        done
    }

    async fn begin_and_follow(
        &mut self,
        node: NodeId,
        own: &OwnCalibration<'_>,
        watch: &mut impl Watch,
    ) -> Result<StatusWords, OwnError> {
        // A boot-up of before is not its end.
        while self.boots(node, own.command, 0).await? {}
        self.tell(node, own.command).await?;
        watch.progress(&Progress::Step("the drive calibrates itself"));
        let began = self.now();
        let until = began.plus_ms(own.longest_ms);
        loop {
            if watch.stop() {
                return Err(OwnError::Stopped);
            }
            let now = self.now();
            let done_s = now.since_ns(began) / 1_000_000_000;
            watch.progress(&Progress::Part {
                done: u32::try_from(done_s).unwrap_or(u32::MAX),
                of: u32::try_from(own.longest_ms / 1000).unwrap_or(u32::MAX),
            });
            if now >= until {
                return Err(OwnError::TimedOut {
                    after_ms: own.longest_ms,
                });
            }
            let booted = self.boots(node, own.command, LOOK_MS).await?;
            if booted && own.restarts {
                return self.after_start(node, own).await;
            }
            // Asked before, so that the words are those of the end.
            let is_over = !own.restarts && self.is_idle(node, own).await?;
            match self.status_words(node, own).await {
                Ok(status) if has_failed(&status, own) => return Err(OwnError::Failed { status }),
                Ok(status) if is_over => return Ok(status),
                Ok(_) => {}
                // It is starting over.
                Err(error) if own.restarts && is_silence(&error) => {}
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// What the drive says once it answers again.
    async fn after_start(
        &mut self,
        node: NodeId,
        own: &OwnCalibration<'_>,
    ) -> Result<StatusWords, OwnError> {
        let until = self.now().plus_ms(START_MS);
        loop {
            match self.status_words(node, own).await {
                Ok(status) if has_failed(&status, own) => return Err(OwnError::Failed { status }),
                Ok(status) => return Ok(status),
                Err(error) if is_silence(&error) && self.now() < until => {}
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// Gives a command.
    async fn tell(&mut self, node: NodeId, command: Address) -> Result<(), SdoError> {
        let one = Data::sized(&[1]).unwrap_or(Data::EMPTY);
        self.download(node, command, one).await.map(|_| ())
    }

    /// Whether nothing is at work.
    async fn is_idle(&mut self, node: NodeId, own: &OwnCalibration<'_>) -> Result<bool, SdoError> {
        match self.tell(node, own.probe).await {
            Ok(()) => Ok(true),
            Err(error) if error.abort().is_some() => Ok(false),
            Err(error) => Err(error),
        }
    }

    async fn status_words(
        &mut self,
        node: NodeId,
        own: &OwnCalibration<'_>,
    ) -> Result<StatusWords, SdoError> {
        let mut words = Vec::new();
        for object in own.status {
            let word = match self.read(node, *object, DataType::U32).await? {
                Value::Integer(word) => word as u32,
                // No integer type decodes to these.
                Value::Real(_) | Value::Text(_) => 0,
            };
            words.push((*object, word));
        }
        Ok(words)
    }

    /// Whether the node boots up in the following `ms`, or has done so before. Other frames are dropped.
    async fn boots(&mut self, node: NodeId, object: Address, ms: u64) -> Result<bool, SdoError> {
        let until = self.now().plus_ms(ms);
        let lost = |error: LinkError| SdoError {
            node,
            object,
            access: Access::Write,
            cause: Cause::Link(error),
        };
        while let Some((_, frame)) = self.receive(until).await.map_err(lost)? {
            if nmt::error_control(&frame) == Some((node, 0)) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

fn has_failed(status: &StatusWords, own: &OwnCalibration<'_>) -> bool {
    own.failed.is_some_and(|(object, bit)| {
        let mut words = status.iter();
        words.any(|(of, word)| *of == object && word >> bit & 1 == 1)
    })
}

fn is_silence(error: &SdoError) -> bool {
    matches!(error.cause, Cause::TimedOut { .. })
}
