//! What calibration and tuning have in common: a drive whose motor gets power only under watch.
//!
//! A [`Session`] remembers every object that it changes. Whatever ends a procedure early (a fault, a
//! lost link, an implausible figure, the user) takes the power from the motor first and then gives
//! every object its old value again. Results stay in the drive's memory until [`Session::save`] or
//! [`Session::discard`].

mod error;
mod objects;
mod power;
mod ready;
mod record;
mod run;
mod save;

use canopen::{Abort, Instant, NodeId};

use crate::{Client, Link, LinkError, Value};

pub use error::{Cause, Finding, Left, ProcedureError};
pub use objects::Object;
pub(crate) use objects::*;
pub(crate) use ready::Motor;
pub(crate) use record::{Recorder, Sample};
pub(crate) use run::{Driven, Run, unwrapped};
pub use save::SaveError;

/// Who looks on: is told what happens, and may end it.
pub trait Watch {
    /// A step begins, or has come further.
    fn progress(&mut self, progress: &Progress);

    /// Whether the procedure shall end. Asked all the time; the answer may be late by 50 ms.
    fn stop(&mut self) -> bool;
}

/// Nobody looks on.
impl Watch for () {
    fn progress(&mut self, _: &Progress) {}

    fn stop(&mut self) -> bool {
        false
    }
}

/// What happens.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// A step begins.
    Step(&'static str),
    /// How far the step is.
    Part {
        /// Done.
        done: u32,
        /// In all.
        of: u32,
    },
    /// Something was measured.
    Measured {
        /// What.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
    },
}

/// An object with its value before and the one that a procedure found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Which.
    pub object: Object,
    /// Before.
    pub old: i64,
    /// Found.
    pub new: i64,
}

/// A drive whose motor gets power only under watch.
pub struct Session<'c, L, W> {
    pub(crate) client: &'c mut Client<L>,
    pub(crate) node: NodeId,
    pub(crate) watch: W,
    /// Old values of what only the procedure needs otherwise, in the order of the changes.
    borrowed: Vec<(Object, i64)>,
    /// What procedures found.
    found: Vec<Change>,
    /// When the last SYNC was sent.
    pub(crate) synced: Instant,
    /// Power was applied by this session.
    powered: bool,
    /// When the drive was last seen in operation enabled, where it shall be; `None` where it need
    /// not be.
    looked: Option<Instant>,
    /// The drive watches SYNC: after so many milliseconds without it takes the power away.
    supervised_ms: u16,
    pub(crate) recorder: Option<Recorder>,
}

impl<L, W> std::fmt::Debug for Session<'_, L, W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session")
            .field("node", &self.node)
            .field("borrowed", &self.borrowed)
            .field("found", &self.found)
            .finish_non_exhaustive()
    }
}

impl<'c, L: Link, W: Watch> Session<'c, L, W> {
    /// A session with `node`; nothing is sent yet.
    pub fn new(client: &'c mut Client<L>, node: NodeId, watch: W) -> Session<'c, L, W> {
        let synced = client.now();
        Session {
            client,
            node,
            watch,
            borrowed: Vec::new(),
            found: Vec::new(),
            synced,
            powered: false,
            looked: None,
            supervised_ms: 0,
            recorder: None,
        }
    }

    /// Who looks on.
    pub fn watch(&mut self) -> &mut W {
        &mut self.watch
    }

    /// What the procedures of this session found and neither saved nor discarded.
    pub fn found(&self) -> &[Change] {
        &self.found
    }

    pub(crate) fn step(&mut self, text: &'static str) {
        self.watch.progress(&Progress::Step(text));
    }

    pub(crate) fn part(&mut self, done: u32, of: u32) {
        self.watch.progress(&Progress::Part { done, of });
    }

    pub(crate) fn measured(&mut self, what: &'static str, value: f64, unit: &'static str) {
        self.watch
            .progress(&Progress::Measured { what, value, unit });
    }

    pub(crate) async fn read(&mut self, object: Object) -> Result<i64, Cause> {
        self.go_on().await?;
        self.read_anyway(object).await
    }

    /// Reads also if the user wants no more.
    async fn read_anyway(&mut self, object: Object) -> Result<i64, Cause> {
        let read = self
            .client
            .read(self.node, object.address, object.data_type);
        match read.await? {
            Value::Integer(value) => Ok(value),
            // No integer type decodes to these.
            Value::Real(_) | Value::Text(_) => Ok(0),
        }
    }

    /// An object that not every drive has.
    pub(crate) async fn read_if_there(&mut self, object: Object) -> Result<Option<i64>, Cause> {
        match self.read(object).await {
            Ok(value) => Ok(Some(value)),
            Err(Cause::Sdo(error)) if error.abort().is_some() => Ok(None),
            Err(other) => Err(other),
        }
    }

    /// An object by which a drive is known.
    ///
    /// # Errors
    /// [`Cause::Foreign`] if the drive does not have it.
    async fn read_own(&mut self, object: Object) -> Result<i64, Cause> {
        match self.read(object).await {
            Err(Cause::Sdo(error))
                if matches!(error.abort(), Some(Abort::NO_OBJECT | Abort::NO_SUB_INDEX)) =>
            {
                Err(Cause::Foreign { missing: object })
            }
            read => read,
        }
    }

    pub(crate) async fn write(&mut self, object: Object, value: i64) -> Result<(), Cause> {
        self.go_on().await?;
        let written = self.write_anyway(object, value).await;
        if let Err(cause) = &written
            && cause.is_refusal()
            && self.looked.is_some()
        {
            // A drive that has gone into fault refuses what moves it.
            self.must_be_enabled().await?;
        }
        written
    }

    async fn write_anyway(&mut self, object: Object, value: i64) -> Result<(), Cause> {
        let data = Value::Integer(value).encode(object.data_type)?;
        Ok(self
            .client
            .download(self.node, object.address, data)
            .await?)
    }

    /// Writes what only the procedure needs; it gets its old value again when that ends.
    pub(crate) async fn borrow(&mut self, object: Object, value: i64) -> Result<(), Cause> {
        if !self.borrowed.iter().any(|(known, _)| *known == object) {
            let old = self.read(object).await?;
            self.borrowed.push((object, old));
        }
        self.write(object, value).await
    }

    /// Gives one borrowed object its old value again.
    pub(crate) async fn give_back_one(&mut self, object: Object) -> Result<(), Cause> {
        let place = self.borrowed.iter().position(|(known, _)| *known == object);
        if let Some((_, old)) = place.map(|place| self.borrowed[place]) {
            self.write(object, old).await?;
            self.borrowed.retain(|(known, _)| *known != object);
        }
        Ok(())
    }

    /// Writes a result. It keeps its value in the drive's memory until it is saved or discarded.
    pub(crate) async fn find(&mut self, object: Object, new: i64) -> Result<(), Cause> {
        match self.found.iter_mut().find(|c| c.object == object) {
            Some(change) => change.new = new,
            None => {
                let old = self.read(object).await?;
                self.found.push(Change { object, old, new });
            }
        }
        self.write(object, new).await
    }

    /// Keeps the drive's SYNC supervision content, and looks whether the user wants no more.
    async fn go_on(&mut self) -> Result<(), Cause> {
        if self.watch.stop() {
            return Err(Cause::Stopped);
        }
        self.keep_alive().await
    }

    async fn keep_alive(&mut self) -> Result<(), Cause> {
        let now = self.client.now();
        if self.supervised_ms > 0 && now.since_ns(self.synced) >= SYNC_EVERY_MS * 1_000_000 {
            self.client.sync().await?;
            self.synced = now;
        }
        Ok(())
    }

    /// Lets time pass, under watch: while the motor has power the drive is asked every 50 ms, however
    /// short the waits are.
    pub(crate) async fn wait(&mut self, ms: u64) -> Result<(), Cause> {
        let until = self.client.now().plus_ms(ms);
        loop {
            self.go_on().await?;
            let now = self.client.now();
            if now >= until {
                return Ok(());
            }
            let look = self.looked.map_or(now, |at| at).plus_ms(LOOK_MS);
            self.pass(until.min(look.max(now))).await?;
            if self.looked.is_some() && self.client.now() >= look {
                self.must_be_enabled().await?;
            }
        }
    }

    /// Lets time pass and drops what comes.
    pub(crate) async fn pass(&mut self, until: Instant) -> Result<(), Cause> {
        while self.client.receive(until).await?.is_some() {}
        Ok(())
    }

    /// Ends a procedure: without power, with every borrowed object as it was. A failed one also
    /// gives its results up.
    pub(crate) async fn end<T>(&mut self, done: Result<T, Cause>) -> Result<T, ProcedureError> {
        let touched = self.powered || !self.borrowed.is_empty() || !self.found.is_empty();
        let done = match done {
            Ok(value) => match self.release().await {
                Ok(()) => return Ok(value),
                Err(cause) => Err::<T, Cause>(cause),
            },
            Err(cause) => Err(cause),
        };
        let left = match (touched, self.make_safe().await) {
            (false, _) => Left::Untouched,
            (true, Ok(())) => Left::Safe,
            (true, Err((_, left))) => left,
        };
        done.map_err(|cause| ProcedureError {
            node: self.node,
            cause,
            left,
        })
    }

    /// Takes the power away and gives borrowed objects their old values again.
    async fn release(&mut self) -> Result<(), Cause> {
        self.power_off().await?;
        self.stop_recording().await?;
        self.give_back().await
    }

    async fn give_back(&mut self) -> Result<(), Cause> {
        let mut done: Result<(), Cause> = Ok(());
        for place in (0..self.borrowed.len()).rev() {
            let (object, old) = self.borrowed[place];
            let stays = self.powered && ACTS_AT_ONCE.contains(&object);
            let written = match (stays, &done) {
                (true, _) => Ok(()),
                // It does not answer.
                (false, Err(cause)) if !cause.is_refusal() => Err(cause.clone()),
                _ => self.write_anyway(object, old).await,
            };
            if !stays && written.is_ok() {
                self.borrowed.remove(place);
                if object == SYNC_LOSS {
                    self.supervised_ms = 0;
                }
            }
            done = done.and(written);
        }
        done
    }

    /// Takes the power away and gives every object its old value again, as far as the drive obeys.
    async fn make_safe(&mut self) -> Result<(), (Cause, Left)> {
        // A late answer must not be taken for the next one, and each write counts.
        let before = self.client.settings.attempts;
        self.client.settings.attempts = before.max(3);
        let within_ms = self.supervised_ms;
        let off = self.power_off_by_all_means().await;
        let done = match off {
            Err(cause @ Cause::Unreached { statusword, .. }) => {
                let restored = self.restore().await.is_ok();
                let left = Left::Powered {
                    statusword,
                    restored,
                };
                Err((cause, left))
            }
            Err(cause) => Err((cause, Left::Unknown { within_ms })),
            Ok(()) => self.restore().await.map_err(|cause| (cause, Left::Changed)),
        };
        self.client.settings.attempts = before;
        done
    }

    /// Gives PDOs, borrowed and found objects their old values again.
    async fn restore(&mut self) -> Result<(), Cause> {
        let recorder = self.stop_recording().await;
        let borrowed = self.give_back().await;
        let found = self.take_back().await;
        recorder.and(borrowed).and(found)
    }

    async fn take_back(&mut self) -> Result<(), Cause> {
        let mut done: Result<(), Cause> = Ok(());
        for place in (0..self.found.len()).rev() {
            let change = self.found[place];
            let written = match &done {
                // It does not answer.
                Err(cause) if !cause.is_refusal() => Err(cause.clone()),
                _ => self.write_anyway(change.object, change.old).await,
            };
            if written.is_ok() {
                self.found.remove(place);
            }
            done = done.and(written);
        }
        done
    }

    /// Gives every found object its old value again, and whatever an end that failed has left
    /// changed.
    ///
    /// # Errors
    /// The drive did not take a value.
    pub async fn discard(&mut self) -> Result<(), ProcedureError> {
        self.make_safe()
            .await
            .map_err(|(cause, left)| ProcedureError {
                node: self.node,
                cause,
                left,
            })
    }

    /// Lets time pass between procedures and drops what comes, so that nobody waits for a program
    /// that reads nothing.
    ///
    /// # Errors
    /// The link broke.
    pub async fn idle(&mut self, ms: u64) -> Result<(), LinkError> {
        let until = self.client.now().plus_ms(ms);
        while self.client.receive(until).await?.is_some() {}
        Ok(())
    }
}

/// How often a SYNC is sent at least while the drive watches for it.
const SYNC_EVERY_MS: u64 = 100;
/// How often a waiting procedure looks at the drive.
const LOOK_MS: u64 = 50;
/// What moves a motor that has power, or takes the power away: it is not given its old value then.
const ACTS_AT_ONCE: [Object; 7] = [
    SYNC_LOSS,
    TARGET_POSITION,
    TARGET_VELOCITY,
    TARGET_TORQUE,
    VELOCITY_OFFSET,
    TORQUE_OFFSET,
    MAX_MOTOR_VELOCITY,
];
