//! The play of every drive but the P3: each is brought into operation by its own document's way, and moved in
//! modes of its own.
//!
//! Whatever the master knows of the drive, it knows from its personality's data.

use std::cell::RefCell;
use std::rc::Rc;

use canopen::nmt::Command;
use canopen::{Address, DataType, Instant, NodeId};
use cia402::{Mode, State, Statusword};
use client::axis::{Axis, Walk};
use client::scan::Scan;
use client::{Client, Link, Value, block_on};
use personalities::Personality;
use personalities::operation::{Machine, Way, WayKind};

use super::cast::NODES;
use super::dialogue::Dialogue;
use super::report::Act;
use super::script::{Arrival, Trouble};
use super::stage::{Phase, Stage, Wire};
use super::trajectory::{self, Leg};
use crate::drive_kind;

/// How often a drive is asked, ms.
const ASK_MS: u64 = 5;
/// How long a target must hold, ms.
const HOLD_MS: u64 = 100;
/// When it is given up, ms.
const PATIENCE_MS: u64 = 5_000;
/// How long nodes may take to boot, or to tell their state, ms.
const BOOT_MS: u64 = 300;
/// How long a streamed way takes, s, and how often a point of it is written, ms.
const STREAM_S: f64 = 1.0;
const STREAM_MS: u64 = 5;

/// An axis and what it does in the play.
#[derive(Clone, Copy, Debug)]
struct Part {
    node: NodeId,
    /// From 0.
    axis: usize,
    way: &'static Way,
}

/// Who plays what: a node for each way, or one node whose axes have a way each.
fn parts(drive: &'static Personality) -> Vec<Part> {
    let ways = drive.operation.ways.iter();
    let [first, ..] = NODES;
    match drive.axes.len() {
        0 | 1 => ways
            .zip(NODES)
            .map(|(way, node)| Part { node, axis: 0, way })
            .collect(),
        axes => ways
            .take(axes)
            .enumerate()
            .map(|(axis, way)| Part {
                node: first,
                axis,
                way,
            })
            .collect(),
    }
}

/// The nodes of the play.
pub(super) fn nodes(drive: &'static Personality) -> Vec<NodeId> {
    let mut nodes: Vec<NodeId> = parts(drive).iter().map(|part| part.node).collect();
    nodes.dedup();
    nodes
}

impl Part {
    /// The address of an object of this axis, given as the first one's.
    fn object(&self, index: u16) -> Address {
        Address::new(index + 0x800 * self.axis as u16, 0)
    }

    fn of_axis(&self, drive: &Personality) -> Axis {
        Axis {
            base: 0x6000 + 0x800 * self.axis as u16,
            walk: match drive.operation.machine {
                Machine::Short => Walk::Short,
                Machine::Standard | Machine::None => Walk::Standard,
            },
            ..Axis::new(self.node)
        }
    }

    /// Which it is, for people.
    fn name(&self, drive: &Personality) -> String {
        match drive.axes.len() {
            0 | 1 => format!("node {}", self.node),
            _ => format!("node {}, axis {}", self.node, self.axis + 1),
        }
    }

    /// What is to be reached, in words.
    fn target(&self, unit: &str) -> String {
        match self.way.kind {
            WayKind::Position { turns, .. } => format!("{turns:+} turns"),
            WayKind::Stream { turns, .. } => {
                format!("{turns:+} turns, a point each {STREAM_MS} ms")
            }
            WayKind::Velocity { rpm, .. } => format!("{rpm:+} rpm"),
            WayKind::Torque { value, .. } => format!("{value:+} \u{d7} {unit}, rotor blocked"),
        }
    }

    fn is_torque(&self) -> bool {
        matches!(self.way.kind, WayKind::Torque { .. })
    }

    /// Whether there is a position to follow.
    fn follows(&self) -> bool {
        matches!(
            self.way.kind,
            WayKind::Position { .. } | WayKind::Stream { .. }
        )
    }
}

/// Name of a phase.
fn title(way: &Way) -> &'static str {
    match way.kind {
        WayKind::Position { .. } => "moves",
        WayKind::Stream { .. } => "follows",
        WayKind::Velocity { .. } => "turns",
        WayKind::Torque { .. } => "pushes",
    }
}

/// The whole play; what came of the acts.
pub(super) fn acts(
    stage: &mut Stage<'_>,
    drive: &'static Personality,
) -> Result<Vec<Act>, Trouble> {
    let parts = parts(drive);
    let heading = "Power on, who is there?";
    scene(stage, drive, "boot", heading, async |tour| {
        tour.boot().await
    })
    .0?;
    let heading = "Prepare, and enable";
    scene(stage, drive, "enable", heading, async |tour| {
        tour.prepare(&parts).await
    })
    .0?;
    let mut acts = Vec::new();
    for part in &parts {
        let mode = drive_kind::mode_name(drive, part.way.mode);
        let table = &drive.device.table;
        let row = table.find(part.way.target, 0).ok();
        let unit = row
            .and_then(|entry| table.row(&entry))
            .map_or("", |row| row.unit);
        let (who, target) = (part.name(drive), part.target(unit));
        let begin = who.replacen("node", "Node", 1);
        let heading = format!("{begin}, mode {}, {mode}: {target}", part.way.mode);
        if part.is_torque() {
            stage.block(part.node, true).map_err(Trouble::Recording)?;
        }
        let played = scene(stage, drive, title(part.way), &heading, async |tour| {
            tour.act(part).await
        });
        if part.is_torque() {
            stage.block(part.node, false).map_err(Trouble::Recording)?;
        }
        let label = format!("{} {mode}", part.way.mode);
        let act = Act::new(part.node, label, target, played)?;
        acts.push(Act {
            axis: part.axis,
            follows: part.follows(),
            ..act
        });
    }
    scene(stage, drive, "switch off", "Switch off", async |tour| {
        tour.disable(&parts).await
    })
    .0?;
    Ok(acts)
}

fn scene<'w, T>(
    stage: &mut Stage<'w>,
    drive: &'static Personality,
    title: &'static str,
    heading: &str,
    act: impl AsyncFnOnce(&mut Tour<'w, Wire<'_>>) -> T,
) -> (T, Phase) {
    stage.play(title, |stage| {
        let dialogue = Rc::clone(&stage.dialogue);
        dialogue.borrow_mut().heading(heading);
        let mut tour = Tour {
            client: stage.client(),
            dialogue,
            drive,
        };
        block_on(act(&mut tour))
    })
}

/// What a phase is played with.
struct Tour<'w, L> {
    client: Client<L>,
    dialogue: Rc<RefCell<Dialogue<'w>>>,
    drive: &'static Personality,
}

impl<L: Link> Tour<'_, L> {
    fn fold(&self, lines: u32) {
        self.dialogue.borrow_mut().fold(lines);
    }

    fn unfold(&self, what: &str) {
        self.dialogue.borrow_mut().unfold(what);
    }

    async fn pass(&mut self, ms: u64) -> Result<(), Trouble> {
        let until = self.client.now().plus_ms(ms);
        while self.client.receive(until).await?.is_some() {}
        Ok(())
    }

    /// Resets all; or where the drive tells no boot-up, sends the first NMT message. Then who they are.
    async fn boot(&mut self) -> Result<(), Trouble> {
        self.pass(30).await?;
        let nodes = nodes(self.drive);
        let there = match self.drive.device.dialect.boot_up {
            true => {
                let booted = self.client.reset(None, BOOT_MS).await?;
                booted.iter().map(|boot_up| boot_up.node).collect()
            }
            false => self.heartbeats().await?,
        };
        if let Some(missing) = nodes.iter().find(|node| !there.contains(*node)) {
            return Err(Trouble::Missing(*missing));
        }
        self.fold(4);
        let last = nodes.last().map_or(1, |node| node.get());
        let scan = Scan {
            nodes: 1..=last,
            ..Scan::default()
        };
        let found = self.client.scan(&scan).await?;
        self.unfold("who the nodes are");
        for found in found {
            let line = format!("{:14}virtual {found}", "");
            self.dialogue.borrow_mut().say(&line);
        }
        Ok(())
    }

    /// Who tells its state after the first NMT message.
    async fn heartbeats(&mut self) -> Result<Vec<NodeId>, Trouble> {
        self.client.nmt(Command::EnterPreOperational, None).await?;
        let until = self.client.now().plus_ms(BOOT_MS);
        let mut heard = Vec::new();
        while let Some((_, frame)) = self.client.receive(until).await? {
            let id = frame.key().checked_sub(0x700);
            let id = id.and_then(|id| u8::try_from(id).ok());
            heard.extend(id.and_then(NodeId::new));
        }
        Ok(heard)
    }

    /// What is not so by itself, then the way into operation. The first of all is shown.
    async fn prepare(&mut self, parts: &[Part]) -> Result<(), Trouble> {
        let operation = &self.drive.operation;
        for (n, part) in parts.iter().enumerate() {
            if n > 0 {
                self.fold(0);
            }
            for setting in operation.prepare {
                let of_axis = (0x6000..0x6800).contains(&setting.object.index);
                if part.axis > 0 && !of_axis {
                    continue;
                }
                let object = match of_axis {
                    true => part.object(setting.object.index),
                    false => setting.object,
                };
                let written = self.client.download_all(part.node, object, setting.bytes);
                written.await?;
            }
            let axis = part.of_axis(self.drive);
            if operation.machine != Machine::None {
                axis.enable(&mut self.client).await?;
            }
            axis.set_mode(&mut self.client, Mode(part.way.mode)).await?;
            let (who, mode) = (part.name(self.drive), part.way.mode);
            let mode_name = drive_kind::mode_name(self.drive, mode);
            self.unfold(&format!(
                "{who} in the same way, in mode {mode}, {mode_name}"
            ));
        }
        Ok(())
    }

    async fn read(&mut self, part: &Part, index: u16) -> Result<f64, Trouble> {
        let object = part.object(index);
        let value = self
            .client
            .read(part.node, object, self.type_of(object))
            .await?;
        Ok(match value {
            Value::Integer(number) => number as f64,
            Value::Real(number) => f64::from(number),
            // Targets and actual values are numbers.
            Value::Text(_) => 0.0,
        })
    }

    async fn write(&mut self, part: &Part, value: f64) -> Result<(), Trouble> {
        let data_type = self.type_of(part.object(part.way.target));
        let axis = part.of_axis(self.drive);
        let target = part.way.target;
        axis.write(&mut self.client, target, data_type, value.round() as i64)
            .await?;
        Ok(())
    }

    fn type_of(&self, object: Address) -> DataType {
        let entry = self.drive.device.table.find(object.index, object.sub);
        entry.map_or(DataType::I32, |entry| entry.field.data_type())
    }

    async fn act(&mut self, part: &Part) -> Result<Arrival, Trouble> {
        let began = self.client.now();
        match part.way.kind {
            WayKind::Position {
                per_turn,
                handshake,
                window,
                turns,
            } => {
                let goal = self.read(part, part.way.actual).await? + turns * per_turn;
                match handshake {
                    true => {
                        let axis = part.of_axis(self.drive);
                        axis.move_to(&mut self.client, goal.round() as i32, false)
                            .await?;
                    }
                    false => self.write(part, goal).await?,
                }
                self.wait(part, began, goal, window).await
            }
            WayKind::Stream {
                per_turn,
                window,
                turns,
            } => {
                let home = self.read(part, part.way.actual).await?;
                self.fold(4);
                let leg = Leg {
                    to_turns: turns,
                    duration_s: STREAM_S,
                    rest_s: 0.0,
                };
                let points = (STREAM_S * 1e3) as u64 / STREAM_MS;
                for point in 1..=points {
                    let time_s = (point * STREAM_MS) as f64 * 1e-3;
                    let way = trajectory::position_turns(&[leg], time_s);
                    self.write(part, home + way * per_turn).await?;
                    let until = began.plus_ms(point * STREAM_MS);
                    while self.client.receive(until).await?.is_some() {}
                }
                self.unfold("points like these");
                self.wait(part, began, home + turns * per_turn, window)
                    .await
            }
            WayKind::Velocity { per_rpm, rpm } => {
                let goal = rpm * per_rpm;
                self.write(part, goal).await?;
                let window = 0.03 * goal.abs();
                let reached = self.wait(part, began, goal, window).await;
                self.write(part, 0.0).await?;
                let stopping = self.client.now();
                let stands = self.wait(part, stopping, 0.0, window).await?;
                reached.map(|reached| reached.and_then(|at| stands.map(|_| at)))
            }
            WayKind::Torque { value, window } => {
                self.write(part, value).await?;
                let reached = self.wait(part, began, value, window).await;
                self.write(part, 0.0).await?;
                reached
            }
        }
    }

    /// Asks until the actual value has held at `goal` long enough, and target reached with a profile.
    async fn wait(
        &mut self,
        part: &Part,
        began: Instant,
        goal: f64,
        window: f64,
    ) -> Result<Arrival, Trouble> {
        let axis = part.of_axis(self.drive);
        let has_bit = matches!(part.way.kind, WayKind::Position { .. });
        let patience = self.client.now().plus_ms(PATIENCE_MS);
        let mut since = None;
        self.fold(4);
        let arrival = loop {
            let word = match self.drive.operation.machine {
                Machine::None => None,
                Machine::Standard | Machine::Short => {
                    Some(axis.statusword(&mut self.client).await?)
                }
            };
            let actual = self.read(part, part.way.actual).await?;
            let now = self.client.now();
            let is_there = (actual - goal).abs() <= window
                && word.is_none_or(|word| is_enabled(word) && (word.target_reached() || !has_bit));
            since = is_there.then(|| since.unwrap_or(now));
            if let Some(since) = since.filter(|since| now.since_ns(*since) >= HOLD_MS * 1_000_000) {
                break Ok(since.since_ns(began));
            }
            let is_over = now >= patience || word.is_some_and(|word| !is_enabled(word));
            if is_over {
                let word = word.map_or(String::new(), |word| format!(", {word}"));
                break Err(format!("at {actual} of {goal:.0}{word}"));
            }
            self.pass(ASK_MS).await?;
        };
        self.unfold("asked again and again until it held");
        Ok(arrival)
    }

    async fn disable(&mut self, parts: &[Part]) -> Result<(), Trouble> {
        for (n, part) in parts.iter().enumerate() {
            if n > 0 {
                self.fold(0);
            }
            let axis = part.of_axis(self.drive);
            match self.drive.operation.machine {
                Machine::None => axis.set_mode(&mut self.client, Mode::IDLE).await?,
                Machine::Standard | Machine::Short => {
                    axis.disable(&mut self.client).await?;
                }
            }
            let who = part.name(self.drive);
            self.unfold(&format!("{who} is switched off in the same way"));
        }
        Ok(())
    }
}

fn is_enabled(word: Statusword) -> bool {
    word.state() == Some(State::OperationEnabled)
}
