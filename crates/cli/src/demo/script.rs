//! The play: what the master does, from boot-up to switched off.
//!
//! Whatever it knows, it knows from the bus.

use std::cell::RefCell;
use std::fmt;
use std::io;
use std::rc::Rc;

use can::Frame;
use canopen::nmt::Command;
use canopen::{Address, DataType, Instant, NodeId};
use cia402::Mode;
use client::axis::{AxisError, Goal};
use client::decode::Direction;
use client::pdo::{Cycle, Order, PdoError};
use client::scan::Scan;
use client::sdo::{Cause, SdoError};
use client::{Client, Link, LinkError, RequestForm, Value};

use super::cast::{Actor, COUNTS_PER_TURN, FOLLOWER, MOVER, NODES, PUSHER};
use super::dialogue::Dialogue;
use super::trajectory::{self, Leg};
use super::watch::{Sign, Watch};

/// SYNC period, ns.
const PERIOD_NS: u64 = 1_000_000;
/// How near an actual position must be to its target, counts: the P3's own window (P53).
const POSITION_WINDOW: u32 = 20;
/// How near the actual torque must be to its target, per mille.
const TORQUE_WINDOW_PM: u16 = 10;
/// How long a position must hold, ms.
const HOLD_MS: u64 = 20;
/// How long a torque must hold, ms.
const TORQUE_HOLD_MS: u64 = 150;
/// When a target is given up, cycles.
const PATIENCE: u64 = 600;

/// Profile velocity (0x6081), counts/s, and acceleration (0x6083, 0x6084), counts/s², of the
/// profile moves: 5,900 rpm in 40 ms.
const PROFILE: [(u16, DataType, i64); 3] = [
    (0x6081, DataType::I32, 400_000),
    (0x6083, DataType::U32, 10_000_000),
    (0x6084, DataType::U32, 10_000_000),
];

/// The streamed trajectory.
const LEGS: [Leg; 3] = [
    Leg {
        to_turns: 12.0,
        duration_s: 0.25,
        rest_s: 0.03,
    },
    Leg {
        to_turns: -8.0,
        duration_s: 0.35,
        rest_s: 0.03,
    },
    Leg {
        to_turns: 4.0,
        duration_s: 0.25,
        rest_s: 0.0,
    },
];

/// The torque step, per mille of rated torque.
pub(super) const TORQUE_PM: i16 = 500;

/// Why the play was broken off.
#[derive(Debug)]
pub(crate) enum Trouble {
    /// A drive did not boot or answer.
    Missing(NodeId),
    /// An axis did not obey.
    Axis(AxisError),
    /// PDOs could not be set up.
    Pdo(PdoError),
    /// The bus, which includes writing the recording.
    Link(LinkError),
    /// The recording cannot be written.
    Recording(io::Error),
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Trouble::Missing(node) => write!(f, "node {node} did not boot or does not answer"),
            Trouble::Axis(error) => write!(f, "{error}"),
            Trouble::Pdo(error) => write!(f, "{error}"),
            Trouble::Link(error) => write!(f, "{error}"),
            Trouble::Recording(error) => write!(f, "cannot write the recording: {error}"),
        }
    }
}

impl std::error::Error for Trouble {}

impl From<AxisError> for Trouble {
    fn from(error: AxisError) -> Trouble {
        match error {
            AxisError::Sdo(SdoError {
                cause: Cause::Link(error),
                ..
            }) => Trouble::Link(error),
            error => Trouble::Axis(error),
        }
    }
}

impl From<SdoError> for Trouble {
    fn from(error: SdoError) -> Trouble {
        AxisError::Sdo(error).into()
    }
}

impl From<PdoError> for Trouble {
    fn from(error: PdoError) -> Trouble {
        match error {
            PdoError::Sdo(error) => error.into(),
            error => Trouble::Pdo(error),
        }
    }
}

impl From<LinkError> for Trouble {
    fn from(error: LinkError) -> Trouble {
        Trouble::Link(error)
    }
}

/// How an act went: the time from the first frame of the command until the target was reached for
/// good, ns; or what the bus says instead.
pub(super) type Arrival = Result<u64, String>;

/// Where the axes stood when they were enabled, counts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Homes([i32; 3]);

impl Homes {
    fn of(&self, node: NodeId) -> i32 {
        let known = NODES.iter().zip(self.0).find(|(n, _)| **n == node);
        known.map_or(0, |(_, home)| home)
    }

    /// The position `turns` from home.
    fn plus_turns(&self, node: NodeId, turns: f64) -> i32 {
        self.of(node)
            .wrapping_add((turns * COUNTS_PER_TURN).round() as i32)
    }
}

/// A profile position move, turns from home.
#[derive(Clone, Copy, Debug)]
pub(super) struct Move {
    pub(super) from_turns: f64,
    pub(super) to_turns: f64,
    /// Whether the drive is told the way, not the target.
    pub(super) is_relative: bool,
}

/// What a phase is played with.
pub(super) struct Scene<'w, L> {
    client: Client<L>,
    dialogue: Rc<RefCell<Dialogue<'w>>>,
}

impl<'w, L: Link> Scene<'w, L> {
    pub(super) fn new(
        mut client: Client<L>,
        dialogue: Rc<RefCell<Dialogue<'w>>>,
        heading: &str,
    ) -> Scene<'w, L> {
        // As the manual prints requests.
        client.settings.form = RequestForm::Short;
        dialogue.borrow_mut().heading(heading);
        Scene { client, dialogue }
    }

    fn fold(&self, lines: u32) {
        self.dialogue.borrow_mut().fold(lines);
    }

    fn unfold(&self, what: &str) {
        self.dialogue.borrow_mut().unfold(what);
    }

    /// Power on; then the manual's "Enumerate": reset all nodes and listen (P3 l.220); then who
    /// they are.
    pub(super) async fn boot(&mut self) -> Result<(), Trouble> {
        let until = self.client.now().plus_ms(30);
        while self.client.receive(until).await?.is_some() {}
        let booted = self.client.reset(None, 30).await?;
        for node in NODES {
            if !booted.iter().any(|boot_up| boot_up.node == node) {
                return Err(Trouble::Missing(node));
            }
        }
        self.fold(6 + 4);
        let scan = Scan {
            nodes: 1..=3,
            ..Scan::default()
        };
        let found = self.client.scan(&scan).await?;
        self.unfold("what are the others, and what are they called?");
        for found in found {
            let line = format!("{:14}virtual {found}", "");
            self.dialogue.borrow_mut().say(&line);
        }
        Ok(())
    }

    /// PDOs and profiles, in the manual's order of writes (P3 l.306 to l.323).
    pub(super) async fn configure(&mut self) -> Result<(), Trouble> {
        for node in NODES {
            let actor = Actor::of(node);
            self.fold(if node == MOVER { 2 } else { 0 });
            for direction in [Direction::Receive, Direction::Transmit] {
                self.client.empty_pdos(node, direction, 1..=4).await?;
            }
            if node == MOVER {
                self.unfold("the other mappings are emptied, too");
            }
            let feedback = &actor.feedback;
            self.client
                .configure_pdo(feedback, Order::WhileValid)
                .await?;
            if node == MOVER {
                self.fold(0);
            }
            let slow = &actor.slow;
            self.client.configure_pdo(slow, Order::WhileValid).await?;
            if node == MOVER {
                self.unfold("TPDO2 is 0x606C Actual velocity and 0x60F4 Following error");
                for (index, data_type, value) in PROFILE {
                    let write = actor.axis.write(&mut self.client, index, data_type, value);
                    write.await?;
                }
            } else {
                let third = match node {
                    PUSHER => "TPDO1 with 0x6077 Actual torque in place of the current",
                    _ => "the same TPDOs",
                };
                self.unfold(&format!("node {node}: emptied mappings, {third}"));
            }
            if let Some(pdo) = &actor.set_point {
                self.client.configure_pdo(pdo, Order::WhileValid).await?;
            }
        }
        self.client.nmt(Command::Start, None).await?;
        Ok(())
    }

    /// 0x0086, 0x000F and the mode (P3 l.324). Each drive's mode is that of its act.
    pub(super) async fn enable(&mut self) -> Result<Homes, Trouble> {
        let mut homes = Homes::default();
        for (node, home) in NODES.into_iter().zip(&mut homes.0) {
            if node != MOVER {
                self.fold(0);
            }
            let (axis, mode) = (Actor::of(node).axis, mode_of(node));
            axis.enable(&mut self.client).await?;
            axis.set_mode(&mut self.client, mode).await?;
            *home = self.position(node).await?;
            self.unfold(&format!(
                "node {node} in the same way, in mode {}, {mode}",
                mode.0
            ));
        }
        Ok(homes)
    }

    /// Torque off, idle, switch on disabled.
    pub(super) async fn disable(&mut self) -> Result<(), Trouble> {
        for node in NODES {
            if node != MOVER {
                self.fold(0);
            }
            let axis = Actor::of(node).axis;
            axis.set_mode(&mut self.client, Mode::IDLE).await?;
            axis.disable(&mut self.client).await?;
            self.unfold(&format!("node {node} is switched off in the same way"));
        }
        Ok(())
    }

    async fn position(&mut self, node: NodeId) -> Result<i32, Trouble> {
        let object = Address::new(0x6064, 0);
        let value = self.client.read(node, object, DataType::I32).await?;
        Ok(match value {
            Value::Integer(counts) => counts as i32,
            // INTEGER32 decodes to nothing else.
            Value::Real(_) | Value::Text(_) => 0,
        })
    }

    /// SYNC cycles until `watch` has seen its goal held, but at least `at_least`; no more than
    /// [`PATIENCE`] further ones. The dialogue shows the first `shown` in full. `set_points` gives
    /// what is sent in a cycle, counted from 0.
    async fn cycles(
        &mut self,
        watch: &mut Watch<'_>,
        shown: u64,
        at_least: u64,
        mut set_points: impl FnMut(u64) -> Result<Option<Frame>, PdoError>,
    ) -> Result<(), Trouble> {
        let mut cycle = Cycle::new(self.client.now(), PERIOD_NS);
        let mut done = 0;
        while done < at_least || watch.reached().is_none() && done < at_least + PATIENCE {
            if done == shown {
                self.fold(0);
            }
            let frame = set_points(done)?;
            cycle
                .run(&mut self.client, frame.as_slice(), |at, frame| {
                    watch.see(at, frame);
                })
                .await?;
            done += 1;
        }
        let more = done.saturating_sub(shown);
        self.unfold(&format!(
            "{more} SYNC cycles like these; the last TPDO1 of the drive:"
        ));
        if let Some(last) = &watch.last {
            self.dialogue.borrow_mut().show(last.at, &last.frame);
        }
        Ok(())
    }

    /// A profile position move by the handshake of bits 4 and 12.
    pub(super) async fn profile_move(
        &mut self,
        homes: Homes,
        way: Move,
    ) -> Result<Arrival, Trouble> {
        let actor = Actor::of(MOVER);
        let target = homes.plus_turns(MOVER, way.to_turns);
        let goal = Goal::Position {
            target,
            window: POSITION_WINDOW,
        };
        let mut watch = Watch::new(&actor.feedback, goal, Sign::TargetReached, HOLD_MS);
        let began = self.client.now();
        let written = match way.is_relative {
            true => target.wrapping_sub(homes.plus_turns(MOVER, way.from_turns)),
            false => target,
        };
        let axis = actor.axis;
        axis.move_to(&mut self.client, written, way.is_relative)
            .await?;
        let shown = if way.is_relative { 0 } else { 2 };
        self.cycles(&mut watch, shown, 0, |_| Ok(None)).await?;
        Ok(arrival(&watch, began, homes))
    }

    /// A trajectory, streamed at 1 kHz.
    pub(super) async fn trajectory(&mut self, homes: Homes) -> Result<Arrival, Trouble> {
        let actor = Actor::of(FOLLOWER);
        let counts = |turns| homes.plus_turns(FOLLOWER, turns);
        let goal = Goal::Position {
            target: counts(trajectory::position_turns(&LEGS, f64::INFINITY)),
            window: POSITION_WINDOW,
        };
        let mut watch = Watch::new(&actor.feedback, goal, Sign::Follows, HOLD_MS);
        let began = self.client.now();
        let period_s = PERIOD_NS as f64 * 1e-9;
        let periods = (trajectory::duration_s(&LEGS) / period_s).ceil() as u64;
        self.cycles(&mut watch, 2, periods, |n| {
            let time_s = (n + 1) as f64 * period_s;
            set_point(&actor, counts(trajectory::position_turns(&LEGS, time_s)))
        })
        .await?;
        Ok(arrival(&watch, began, homes))
    }

    /// A torque step against a shaft that is held, and back to 0.
    pub(super) async fn torque_step(&mut self, homes: Homes) -> Result<Arrival, Trouble> {
        let actor = Actor::of(PUSHER);
        let goal = |target_pm| Goal::Torque {
            target_pm,
            window_pm: TORQUE_WINDOW_PM,
        };
        let sign = Sign::TargetReachedAt(homes.of(PUSHER));
        let mut push = Watch::new(&actor.feedback, goal(TORQUE_PM), sign, TORQUE_HOLD_MS);
        let mut release = Watch::new(&actor.feedback, goal(0), sign, HOLD_MS);
        let began = self.client.now();
        for (watch, torque_pm) in [(&mut push, TORQUE_PM), (&mut release, 0)] {
            self.cycles(watch, 1, 0, |n| match n {
                0 => set_point(&actor, torque_pm.into()),
                _ => Ok(None),
            })
            .await?;
        }
        Ok(arrival(&push, began, homes))
    }
}

/// The mode of operation of a drive's act.
pub(super) fn mode_of(node: NodeId) -> Mode {
    match node {
        MOVER => Mode::PROFILE_POSITION,
        FOLLOWER => Mode::CYCLIC_POSITION,
        _ => Mode::PROFILE_TORQUE,
    }
}

/// The turning points of the trajectory, turns from home.
pub(super) fn turning_points() -> impl Iterator<Item = f64> {
    LEGS.iter().map(|leg| leg.to_turns)
}

/// The frame of a set-point, for a drive that takes them by PDO.
fn set_point(actor: &Actor, value: i32) -> Result<Option<Frame>, PdoError> {
    let values = [Value::Integer(value.into())];
    let frame = actor.set_point.as_ref().map(|pdo| pdo.frame(&values));
    frame.transpose()
}

/// Since when the goal has held, from the begin of the command on; or what the bus says instead.
fn arrival(watch: &Watch<'_>, began: Instant, homes: Homes) -> Arrival {
    match (watch.reached(), &watch.last) {
        (Some(since), _) => Ok(since.since_ns(began)),
        (None, Some(last)) => {
            let moved = last.position.wrapping_sub(homes.of(watch.node()));
            let turns = f64::from(moved) / COUNTS_PER_TURN;
            Err(format!("at {turns:+.2} turns, {}", last.statusword))
        }
        (None, None) => Err("the drive sent nothing".to_owned()),
    }
}
