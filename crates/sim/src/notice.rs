//! What people should know of while a bus runs.

use std::path::PathBuf;

use can::BitRate;
use canopen::{Instant, NodeId, store::Damage};
use drive::ParameterError;
use personalities::board::Lights;

use crate::error_frame::ErrorSeen;
use crate::medium::{ErrorCounters, Traffic};
use crate::place::Place;
use crate::store::StoreError;
use crate::wire_act::Participant;

/// Something that people should know of.
#[derive(Debug)]
pub struct Notice {
    /// When.
    pub at: Instant,
    /// Whom it is about; `None` if it is the scenario that acts.
    pub who: Option<Participant>,
    /// A drive's node ID at that time.
    pub node: Option<NodeId>,
    /// What.
    pub kind: NoticeKind,
}

/// What people should know of.
#[derive(Debug)]
pub enum NoticeKind {
    /// The stored parameters were damaged; the drive has started on its defaults. A copy of the
    /// damaged file is kept under the name given, if there is a file.
    StoreDamaged {
        /// What is wrong with them.
        damage: Damage,
        /// Where they are kept now.
        kept: Result<Option<PathBuf>, StoreError>,
    },
    /// The newest stored parameters were damaged; the drive has started on the set before them. A
    /// copy of the damaged file is kept under the name given, if there is a file.
    StoreFellBack {
        /// Where the copy is.
        kept: Result<Option<PathBuf>, StoreError>,
    },
    /// A save command failed.
    CannotStore(StoreError),
    /// The logic supply failed in the middle of a save, and is back: it boots.
    PowerCutInSave,
    /// The personality's defaults make no drive.
    CannotStart(ParameterError),
    /// Its controller has found so many errors that it is error passive.
    ErrorPassive(ErrorCounters),
    /// Its controller has found so many errors while it sent that it is bus-off.
    BusOff,
    /// It is back from bus-off.
    BusOn,
    /// The lights of its board do something else than before.
    Lights(Lights),
    /// The scenario has done this.
    Scenario(String),
    /// It has started with a bit rate that is not the one of the bus.
    OtherBitRate {
        /// The drive's.
        drive: BitRate,
        /// The one of outside programs.
        bus: BitRate,
    },
}

/// Something that a bus has to tell.
#[derive(Debug)]
pub enum Happening {
    /// A frame went over it.
    Frame(Traffic),
    /// There is something that people should know of.
    Notice(Notice),
    /// The controller of outside programs has seen an error.
    Error(ErrorSeen),
}

impl Happening {
    /// All of them in the order of their times; of one time, frames first, then errors.
    pub(crate) fn merge(
        traffic: Vec<Traffic>,
        notices: Vec<Notice>,
        errors: Vec<ErrorSeen>,
    ) -> Vec<Happening> {
        let mut all = Vec::with_capacity(traffic.len() + notices.len());
        let mut notices = notices.into_iter().peekable();
        for traffic in traffic {
            while let Some(notice) = notices.next_if(|notice| notice.at < traffic.at) {
                all.push(Happening::Notice(notice));
            }
            all.push(Happening::Frame(traffic));
        }
        all.extend(notices.map(Happening::Notice));
        if !errors.is_empty() {
            all.extend(errors.into_iter().map(Happening::Error));
            all.sort_by_key(Happening::order);
        }
        all
    }

    fn order(&self) -> (Instant, u8) {
        match self {
            Happening::Frame(traffic) => (traffic.at, 0),
            Happening::Error(error) => (error.at, 1),
            Happening::Notice(notice) => (notice.at, 2),
        }
    }
}

impl std::fmt::Display for Notice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.who, self.node) {
            (Some(Participant::Drive(place)), Some(node)) if Place::of_node(node) == place => {
                write!(f, "node {node}: ")?;
            }
            (Some(Participant::Drive(place)), Some(node)) => {
                write!(f, "node {node} (drive {place}): ")?
            }
            (Some(Participant::Drive(place)), None) => {
                write!(f, "drive {place}, which has no node ID: ")?;
            }
            (Some(Participant::Outside), _) => f.write_str("outside programs: ")?,
            (Some(Participant::Stranger), _) => f.write_str("babbling node: ")?,
            (None, _) => {}
        }
        match &self.kind {
            NoticeKind::Scenario(words) => {
                write!(f, "{:.6} scenario: {words}", self.at.seconds())
            }
            NoticeKind::Lights(lights) => write!(f, "{lights}"),
            NoticeKind::StoreDamaged { damage, kept } => {
                write!(f, "the stored parameters are damaged ({damage})")?;
                write_kept(f, kept)?;
                f.write_str("; it starts on its defaults and reports parameter error 0x6320")
            }
            NoticeKind::StoreFellBack { kept } => {
                f.write_str("the newest stored parameters are damaged")?;
                write_kept(f, kept)?;
                f.write_str("; it starts on those stored before")
            }
            NoticeKind::CannotStore(error) => write!(f, "{error}"),
            NoticeKind::PowerCutInSave => {
                f.write_str("its logic supply failed while it saved; it boots")
            }
            NoticeKind::CannotStart(error) => {
                write!(f, "it cannot start, its defaults make no drive: {error:?}")
            }
            NoticeKind::ErrorPassive(ErrorCounters { transmit, receive }) => write!(
                f,
                "error passive: {transmit} transmit and {receive} receive errors counted"
            ),
            NoticeKind::BusOff => f.write_str(
                "bus-off: what it sends is destroyed, by a broken cable or by another that sends \
                 with the same identifiers",
            ),
            NoticeKind::BusOn => f.write_str("back from bus-off"),
            NoticeKind::OtherBitRate { drive, bus } => write!(
                f,
                "it starts with {drive}, and the bus has {bus}: it hears nobody there, and nobody \
                 hears it"
            ),
        }
    }
}

fn write_kept(
    f: &mut std::fmt::Formatter<'_>,
    kept: &Result<Option<PathBuf>, StoreError>,
) -> std::fmt::Result {
    match kept {
        Ok(Some(path)) => write!(f, ", kept as {}", path.display()),
        Ok(None) => Ok(()),
        Err(error) => write!(f, ", and {error}"),
    }
}
