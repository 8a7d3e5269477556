//! What a transcript consists of.

use canopen::NodeId;

use super::expression::Expression;
use super::pattern::Pattern;

/// A transcript that was read.
#[derive(Clone, Debug)]
pub struct Transcript {
    pub(super) file: String,
    pub(super) header: Header,
    pub(super) steps: Vec<Step>,
    /// Lines after `finally`.
    pub(super) finally: Vec<Step>,
}

/// What a transcript says of the bus it is for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// `drive p3`: the personality of the drives.
    pub drive: Option<String>,
    /// `nodes 1 2`: which drives must be on the bus; those that are named alone, too.
    pub nodes: Vec<NodeId>,
    /// `node 2 = md80`: the personality of one of them, where it is not `drive`.
    pub named: Vec<(NodeId, String)>,
    /// `settle 100 ms`: how long frames are dropped before the first line.
    pub settle_ns: Option<u64>,
}

impl Header {
    /// The personality of the drive at `node`.
    pub fn drive_of(&self, node: NodeId) -> Option<&str> {
        let mut named = self.named.iter();
        let own = named.find(|(named, _)| *named == node);
        own.map(|(_, drive)| drive)
            .or(self.drive.as_ref())
            .map(String::as_str)
    }
}

impl Transcript {
    /// The file, as it was named.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// What it says of the bus it is for.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Whether it makes physical assertions, which only a simulation can check.
    pub fn asserts_physics(&self) -> bool {
        let is_assertion = |step: &Step| match &step.action {
            Action::Assert(_) => true,
            Action::Misprint(block) => block
                .steps
                .iter()
                .any(|step| matches!(step.action, Action::Assert(_))),
            _ => false,
        };
        self.steps.iter().chain(&self.finally).any(is_assertion)
    }
}

/// One line, or one block.
#[derive(Clone, Debug)]
pub(super) struct Step {
    /// Line, from 1.
    pub(super) line: usize,
    /// The line without blanks at its ends.
    pub(super) text: String,
    pub(super) action: Action,
}

#[derive(Clone, Debug)]
pub(super) enum Action {
    Send(Pattern),
    /// Frames in any order; usually just one.
    Expect(Vec<Expectation>, Option<Span>),
    Wait(u64),
    Silence(u64),
    Limit(u64),
    Ignore(Ignored),
    Let(String, Expression),
    Assert(Assertion),
    Misprint(Block),
}

/// A frame that must come.
#[derive(Clone, Debug)]
pub(super) struct Expectation {
    pub(super) line: usize,
    pub(super) pattern: Pattern,
}

/// When a frame must come, in nanoseconds after the line before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) from_ns: u64,
    pub(super) to_ns: u64,
}

/// Frames that need not be listed.
#[derive(Clone, Debug)]
pub(super) enum Ignored {
    /// Heartbeats of all nodes, but not boot-ups.
    Heartbeats,
    Frames(Pattern),
}

/// A dialogue as a manual misprints it.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) reason: String,
    pub(super) steps: Vec<Step>,
}

/// A statement about the physical world.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Assertion {
    pub(super) node: NodeId,
    pub(super) quantity: String,
    pub(super) comparison: Comparison,
    pub(super) unit: String,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Comparison {
    Above(f64),
    AtLeast(f64),
    Below(f64),
    AtMost(f64),
    Near { value: f64, tolerance: f64 },
}

impl Comparison {
    pub(super) fn holds(self, measured: f64) -> bool {
        match self {
            Comparison::Above(value) => measured > value,
            Comparison::AtLeast(value) => measured >= value,
            Comparison::Below(value) => measured < value,
            Comparison::AtMost(value) => measured <= value,
            Comparison::Near { value, tolerance } => (measured - value).abs() <= tolerance,
        }
    }
}

impl std::fmt::Display for Comparison {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Comparison::Above(value) => write!(f, "> {value}"),
            Comparison::AtLeast(value) => write!(f, ">= {value}"),
            Comparison::Below(value) => write!(f, "< {value}"),
            Comparison::AtMost(value) => write!(f, "<= {value}"),
            Comparison::Near { value, tolerance } => write!(f, "= {value} +- {tolerance}"),
        }
    }
}
