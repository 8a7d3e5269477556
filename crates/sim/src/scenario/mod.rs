//! Scenarios: a file that says what the drives and their worlds are, and what goes wrong when.
//!
//! ```toml
//! seed = 7
//!
//! [drive.1.motor]
//! phase_resistance = "7.2 ohm"
//!
//! [[event]]
//! name = "sag"
//! do = "motor-supply"
//! drive = 1
//! to = "20 V"
//! for = "600 ms"
//! when = { state = "operation enabled" }
//! delay = "100 ms"
//! ```
//!
//! Reading is driven by tables, of which documents and listings are made too: [`PARAMETERS`],
//! [`ACTS`], [`CONDITIONS`], [`EVENT_KEYS`]. A file is checked whole before anything starts
//! ([`Scenario::read`], [`Scenario::set_up`]); the `Runner` then plays its events inside the
//! bus's own order of events, so the same seed and scenario give the same trace.

mod act_rows;
mod acts;
mod arguments;
mod check;
mod conditions;
mod document;
mod drives;
mod event;
mod frames;
mod parameter_rows;
mod parameters;
mod perform;
mod problem;
mod quantity;
mod runner;
mod section;
mod truth;

use std::sync::Arc;

use can::BitRate;
use canopen::Instant;
use personalities::Personality;
use toml::de::DeTable;

use self::drives::DriveSection;
use self::event::{Draft, Event};
use self::frames::place;
use self::problem::{Findings, Source};
use self::section::{Read, Section};
use crate::bus::BusSettings;
use crate::place::Place;

pub use self::act_rows::ACTS;
pub use self::acts::ActKind;
pub use self::conditions::CONDITIONS;
pub use self::document::{acts_document, parameters_document, parameters_template};
pub use self::drives::DRIVE_KEYS;
pub use self::event::EVENT_KEYS;
pub use self::parameter_rows::PARAMETERS;
pub use self::parameters::Parameter;
pub use self::problem::{Problem, Problems};
pub use self::quantity::Quantity;
pub(crate) use self::runner::Runner;

/// The keys at the top of a file.
pub const GLOBAL_KEYS: &[(&str, &str, &str)] = &[
    (
        "seed",
        "7",
        "Everything random follows from it; `--seed` comes before it. Default 1.",
    ),
    (
        "bit_rate",
        "\"500k\"",
        "Bit rate of the bus; `--bit-rate` comes before it. Default 1M.",
    ),
    (
        "personality",
        "\"p3\"",
        "Which drives there are; `--drive` and `--node` come before it. Default p3.",
    ),
    (
        "nodes",
        "[1, 2, \"u1\"]",
        "Their node IDs, `u1` for the first without one; `--nodes` and `--node` come before it. By default the drives that have a table, else 1 to 3.",
    ),
    (
        "length",
        "\"10 s\"",
        "The simulation ends after this simulated time; `--for` comes before it.",
    ),
    (
        "drive",
        "[drive.1]",
        "What a drive and its world are; `[drive.all]` speaks of every drive.",
    ),
    ("event", "[[event]]", "What happens."),
];

/// A scenario that was read.
#[derive(Clone, Debug)]
pub struct Scenario {
    file: Arc<str>,
    text: Arc<str>,
    /// Everything random follows from it.
    pub seed: Option<u64>,
    /// The bit rate of outside programs.
    pub bit_rate: Option<BitRate>,
    /// The kind of the drives that name none themselves.
    pub personality: Option<&'static Personality>,
    /// When the run ends.
    pub length: Option<Instant>,
    nodes: Option<Vec<Read<Place>>>,
    drives: Vec<DriveSection>,
    events: Arc<[Event]>,
}

impl Scenario {
    /// Reads the text of `file`, whose name is for messages only.
    ///
    /// # Errors
    /// [`Problems`]: everything that is wrong with it whatever drives there are.
    pub fn read(file: &str, text: &str) -> Result<Scenario, Problems> {
        let mut findings = Findings::new(Source { name: file, text });
        let table = match DeTable::parse(text) {
            Ok(table) => table,
            Err(error) => {
                let span = error.span().unwrap_or(0..0);
                let what = error.message().lines().next().unwrap_or("").to_owned();
                findings.push(&span, what, "a scenario is TOML: see https://toml.io");
                return Err(findings.finish(()).expect_err("there is one"));
            }
        };
        let mut section = Section::new(table.get_ref(), table.span(), "a scenario");
        let seed = section.whole("seed", 0..=u64::MAX, &mut findings);
        let bit_rate = bit_rate(&mut section, &mut findings);
        let personality = drives::personality(&mut section, &mut findings);
        let length = section.time_ns("length", 1, &mut findings);
        let nodes = nodes(&mut section, &mut findings);
        let drives = section.take("drive");
        let drives = drives.map_or_else(Vec::new, |value| drives::read(value, &mut findings));
        let events = events(&mut section, &mut findings);
        section.finish(&[], &mut findings);
        check::contradictions(&events, &mut findings);
        findings.finish(Scenario {
            file: file.into(),
            text: text.into(),
            seed: seed.map(|seed| seed.value),
            bit_rate,
            personality,
            length: length.map(|ns| Instant(ns.value)),
            nodes,
            drives,
            events: events.into(),
        })
    }

    /// The file's name, as it was given.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Its text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// How many events it has.
    pub fn event_count(&self) -> usize {
        self.events.len()
    }

    /// The drives that it names: its nodes, else those that have a table.
    pub fn places(&self) -> Vec<Place> {
        let mut places: Vec<Place> = match &self.nodes {
            Some(nodes) => nodes.iter().map(|read| read.value).collect(),
            None => self.drives.iter().filter_map(|drive| drive.place).collect(),
        };
        places.sort();
        places
    }

    /// The kind that a table of its own says the drive at `place` is, or `[drive.all]`.
    pub fn personality_of(&self, place: Place) -> Option<&'static Personality> {
        let own = self.drives.iter().rev();
        let mut own = own.filter(|drive| drive.is_of(place));
        own.find_map(|drive| drive.personality)
    }

    /// Makes the drives of `settings` what it says, and has it played on their bus; `end` is when
    /// the run ends. The drives must be there already, of the kinds that they shall be.
    ///
    /// # Errors
    /// [`Problems`]: what these drives cannot be or do. Then `settings` is of no use.
    pub fn set_up(&self, settings: &mut BusSettings, end: Instant) -> Result<(), Problems> {
        let source = Source {
            name: &self.file,
            text: &self.text,
        };
        let mut findings = Findings::new(source);
        check::cast(self, &settings.drives, end, &mut findings);
        if findings.is_empty() {
            for drive in &mut settings.drives {
                check::world(self, drive, settings.seed, &mut findings);
            }
            check::boards(self, &settings.drives, &mut findings);
        }
        settings.scenario = Some(self.clone());
        findings.finish(())
    }
}

fn bit_rate(section: &mut Section<'_>, findings: &mut Findings<'_>) -> Option<BitRate> {
    let form = "write 10k, 20k, 50k, 100k, 125k, 250k, 500k, 800k or 1M";
    let text = section.text("bit_rate", form, findings)?;
    let rate = text.value.parse::<BitRate>().ok();
    if rate.is_none() {
        findings.push(&text.span, format!("'{}' is no bit rate", text.value), form);
    }
    rate
}

fn nodes(section: &mut Section<'_>, findings: &mut Findings<'_>) -> Option<Vec<Read<Place>>> {
    let form = "write a list, as in [1, 2, \"u1\"]";
    let value = section.take("nodes")?;
    let list = match value.get_ref().as_array() {
        Some(list) if !list.is_empty() => list,
        _ => {
            findings.push(&value.span(), "'nodes' is a list of drives", form);
            return None;
        }
    };
    let mut nodes: Vec<Read<Place>> = Vec::new();
    for value in list.iter() {
        let Some(read) = place(value, form, findings) else {
            continue;
        };
        if nodes.iter().any(|other| other.value == read.value) {
            let what = format!("drive {} is there twice", read.value);
            findings.push(&read.span, what, "leave one out");
        }
        nodes.push(read);
    }
    Some(nodes)
}

fn events(section: &mut Section<'_>, findings: &mut Findings<'_>) -> Vec<Event> {
    let Some(value) = section.take("event") else {
        return Vec::new();
    };
    let Some(list) = value.get_ref().as_array() else {
        let span = section.key_span("event").unwrap_or(value.span());
        findings.push(
            &span,
            "events are a list",
            "write [[event]] with two brackets",
        );
        return Vec::new();
    };
    let drafts: Vec<Draft> = (1..)
        .zip(list.iter())
        .filter_map(|(number, value)| Draft::read(value, number, findings))
        .collect();
    event::resolve(drafts, findings)
}
