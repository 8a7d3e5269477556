//! The part of a scenario that says what the drives and their worlds are.

use canopen::store::{self, Request};
use canopen::{Address, Node, NodeId};
use personalities::Personality;
use plant::{Parameters, Spread};
use toml::de::DeValue;

use super::parameter_rows::PARAMETERS;
use super::parameters::Parameter;
use super::problem::{Findings, Span, any_of, nearest};
use super::quantity::Quantity;
use super::section::{Read, Section, Value, kind, read_quantity, read_whole};
use super::truth;
use crate::drive::DriveSettings;
use crate::flash_file::FlashFile;
use crate::place::Place;

/// `[drive.1]`, or `[drive.all]`.
#[derive(Clone, Debug)]
pub(super) struct DriveSection {
    /// `None` is all of them.
    pub(super) place: Option<Place>,
    pub(super) span: Span,
    pub(super) personality: Option<&'static Personality>,
    /// Parameters that are given.
    given: Vec<(&'static Parameter, Read<f64>)>,
    /// Everything that differs between motors and boards is random.
    hidden_truth: bool,
    /// Parameters that are random.
    spreads: Vec<(&'static Parameter, Read<truth::Spread>)>,
    /// Parameters that are given for a further axis, from 2 on.
    axes: Vec<(Read<u8>, &'static Parameter, Read<f64>)>,
    /// Objects that are stored before the start.
    stored: Vec<(Address, Read<u64>)>,
    /// Where that stands.
    stored_span: Option<Span>,
}

/// Words of `[drive.N]` beside the sections of parameters.
pub const DRIVE_KEYS: &[(&str, &str, &str)] = &[
    (
        "personality",
        "\"p3-extended\"",
        "Which drive it is; `servobus od NAME` lists its objects.",
    ),
    (
        "axis",
        "{ 2 = { load.inertia = \"10 gcm2\" } }",
        "What the world of another axis (motor channel) of a drive with several has otherwise than the first one's, which is what stands in the tables below.",
    ),
    (
        "spread",
        "{ motor.phase_resistance = \"10 %\" }",
        "Hidden truth: the parameter is random, evenly within plus and minus this much (a share, or in its own unit) of what it would be. It follows from the seed and from the drive's place, and from nothing else.",
    ),
    (
        "stored",
        "{ \"0x6065\" = 1000 }",
        "Objects whose values are stored when it starts, as index or \"index,sub-index\"; all else is at its default. Not with `--store`, which says what is stored by itself.",
    ),
];

/// Reads `[drive]`.
pub(super) fn read(value: Value<'_>, findings: &mut Findings<'_>) -> Vec<DriveSection> {
    let form = "write [drive.1] with its keys below";
    let Some(section) = Section::of(value, "'drive'", form, findings) else {
        return Vec::new();
    };
    let mut sections = Vec::new();
    for (key, span, value) in section.entries() {
        let place = match key {
            "all" => None,
            _ => match key.parse::<Place>() {
                Ok(place) => Some(place),
                Err(error) => {
                    let what = format!("'{key}' is no drive: {error}");
                    findings.push(&span, what, "write [drive.1], [drive.u1] or [drive.all]");
                    continue;
                }
            },
        };
        if let Some(section) = DriveSection::read(place, span, value, findings) {
            sections.push(section);
        }
    }
    // What is said of all drives comes first, so that what is said of one holds.
    sections.sort_by_key(|section| section.place);
    sections
}

impl DriveSection {
    fn read(
        place: Option<Place>,
        span: Span,
        value: Value<'_>,
        findings: &mut Findings<'_>,
    ) -> Option<DriveSection> {
        let form = "write [drive.1] with its keys below";
        let mut section = Section::of(value, "a drive", form, findings)?;
        let personality = personality(&mut section, findings);
        let mut given = read_world(&mut section, findings);
        let axes = section.take("axis");
        let mut axes = axes.map_or_else(Vec::new, |value| read_axes(value, findings));
        let mut spreads = Vec::new();
        if let Some(value) = section.take("spread") {
            read_spreads(value, findings, &mut spreads);
        }
        let stored_span = section.key_span("stored");
        let stored = section.take("stored");
        let stored = stored.map_or_else(Vec::new, |value| read_stored(value, findings));
        // In the order of the rows: some speak of what others have made.
        let row = |parameter: &Parameter| PARAMETERS.iter().position(|p| p.path == parameter.path);
        given.sort_by_key(|(parameter, _)| row(parameter));
        axes.sort_by_key(|(axis, parameter, _)| (axis.value, row(parameter)));
        let hidden_truth = section.flag("hidden_truth", findings);
        section.finish(&[], findings);
        Some(DriveSection {
            place,
            span,
            personality,
            given,
            hidden_truth: hidden_truth.is_some_and(|flag| flag.value),
            spreads,
            axes,
            stored_span: stored_span.filter(|_| !stored.is_empty()),
            stored,
        })
    }

    /// Whether it speaks of that drive.
    pub(super) fn is_of(&self, place: Place) -> bool {
        self.place.is_none_or(|own| own == place)
    }

    /// Changes the world of a drive of that place, on a bus of that seed.
    pub(super) fn change(&self, world: &mut Parameters, place: Place, seed: u64) {
        for (parameter, read) in &self.given {
            parameter.give(world, read.value);
        }
        if self.hidden_truth {
            *world = Spread::TYPICAL.draw(world, truth::seed_of(place, seed));
        }
        for (parameter, spread) in &self.spreads {
            let value = truth::draw(parameter, parameter.of(world), spread.value, place, seed);
            parameter.give(world, value);
        }
    }

    /// Where it says what is stored, if it does.
    pub(super) fn stored_span(&self) -> Option<&Span> {
        self.stored_span.as_ref()
    }

    /// The last axis that it speaks of.
    pub(super) fn most_axes(&self) -> u8 {
        let axes = self.axes.iter().map(|(axis, ..)| axis.value);
        axes.max().unwrap_or(1)
    }

    /// Changes the world of a further axis, which was as the first.
    pub(super) fn change_axis(&self, axis: u8, world: &mut Parameters) {
        for (own, parameter, read) in &self.axes {
            if own.value == axis {
                parameter.give(world, read.value);
            }
        }
    }

    /// Complains of axes that a drive does not have.
    pub(super) fn check_axes(&self, drive: &DriveSettings, findings: &mut Findings<'_>) {
        let number = drive.personality.axes.len();
        for (axis, ..) in &self.axes {
            if usize::from(axis.value) > number {
                let what = format!("drive {} has no axis {}", drive.place, axis.value);
                findings.push(&axis.span, what, format!("the last it has is {number}"));
            }
        }
    }

    /// Where a parameter of that path is given.
    pub(super) fn span_of(&self, wanted: impl Fn(&Parameter) -> bool) -> Option<Span> {
        let given = self
            .given
            .iter()
            .map(|(parameter, read)| (parameter, &read.span));
        let spread = self
            .spreads
            .iter()
            .map(|(parameter, read)| (parameter, &read.span));
        let mut found = given
            .chain(spread)
            .filter(|(parameter, _)| wanted(parameter));
        found.next_back().map(|(_, span)| span.clone())
    }

    /// Complains of stored objects that a drive of this kind does not have.
    pub(super) fn check_stored(
        &self,
        personality: &'static Personality,
        findings: &mut Findings<'_>,
    ) {
        let table = personality.device.table;
        for (address, read) in &self.stored {
            let shown = shown(*address);
            let Ok(entry) = table.find(address.index, address.sub) else {
                let what = format!("{} has no object {shown}", personality.name);
                let remedy = format!("`servobus od {}` lists its objects", personality.name);
                findings.push(&read.span, what, remedy);
                continue;
            };
            if !store::is_stored(&table, *address) {
                let what = format!("{shown} cannot be stored");
                findings.push(&read.span, what, "leave it out: a master writes it");
                continue;
            }
            // A text has no number.
            let size = usize::from(entry.field.size());
            if !(1..=8).contains(&size) {
                let what = format!("{shown} is not a number");
                findings.push(&read.span, what, "leave it out: a master writes it");
                continue;
            }
            let bits = 8 * size as u32;
            let sign = (read.value as i64) >> (bits - 1);
            let fits = bits == 64 || read.value >> bits == 0 || sign == -1;
            let allowed = || {
                let mut image = vec![0; table.image_bytes()];
                let stored = stored(personality, NodeId::new(1), *address, read.value, &[]);
                let mut node = Node::new(&personality.device, image.as_mut_slice(), ONE);
                let loaded = store::load(&table, &mut node.image(), &stored?);
                loaded.ok().filter(|loaded| loaded.skipped == 0)
            };
            if !fits || allowed().is_none() {
                let what = format!("{shown} does not take this value");
                let remedy = format!("`servobus od {} {shown}` shows its range", personality.name);
                findings.push(&read.span, what, remedy);
            }
        }
    }

    /// Puts what it says is stored into the memory of a drive; false if it does not fit.
    pub(super) fn store(&self, settings: &mut DriveSettings) -> bool {
        if self.stored.is_empty() {
            return true;
        }
        let (personality, id) = (settings.personality, settings.place.node());
        let mut bytes = settings.store.bytes().to_vec();
        for (address, read) in &self.stored {
            match stored(personality, id, *address, read.value, &bytes) {
                Some(with) => bytes = with,
                None => return false,
            }
        }
        if bytes.len() > settings.store.capacity() {
            return false;
        }
        settings.store = FlashFile::memory(bytes);
        true
    }
}

/// The parameters of a world.
fn read_world(
    section: &mut Section<'_>,
    findings: &mut Findings<'_>,
) -> Vec<(&'static Parameter, Read<f64>)> {
    let mut given = Vec::new();
    for name in section_names() {
        if let Some(value) = section.take(name) {
            read_parameters(name, value, findings, &mut |parameter, value, findings| {
                let none = matches!(value.get_ref(), DeValue::String(word) if word == "none");
                if none && parameter.may_be_none() {
                    let (value, span) = (parameter.none(), value.span());
                    given.push((parameter, Read { value, span }));
                    return;
                }
                let range = parameter.least..=parameter.most;
                if let Some(read) = read_quantity(value, parameter.quantity, range, findings) {
                    given.push((parameter, read));
                }
            });
        }
    }
    given
}

/// `[drive.1.axis.2]`.
fn read_axes(
    value: Value<'_>,
    findings: &mut Findings<'_>,
) -> Vec<(Read<u8>, &'static Parameter, Read<f64>)> {
    const FORM: &str = "write the axis's number, from 2 on, as in [drive.1.axis.2.load]";
    let Some(section) = Section::of(value, "'axis'", FORM, findings) else {
        return Vec::new();
    };
    let mut list = Vec::new();
    for (key, span, value) in section.entries() {
        let Some(axis) = key.parse().ok().filter(|axis| (2..=9).contains(axis)) else {
            findings.push(&span, format!("'{key}' is no further axis"), FORM);
            continue;
        };
        let Some(mut world) = Section::of(value, "an axis", FORM, findings) else {
            continue;
        };
        for (parameter, read) in read_world(&mut world, findings) {
            if parameter.path.starts_with("supply.") {
                let what = format!("{} is that of all axes", parameter.path);
                findings.push(&read.span, what, "write it in the drive's own table");
                continue;
            }
            let axis = Read {
                value: axis,
                span: span.clone(),
            };
            list.push((axis, parameter, read));
        }
        world.finish(&[], findings);
    }
    list
}

/// Stands for a node ID that LSS will give.
const ONE: NodeId = NodeId::new(1).unwrap();

/// `old` with another object stored.
fn stored(
    personality: &'static Personality,
    node: Option<NodeId>,
    address: Address,
    value: u64,
    old: &[u8],
) -> Option<Vec<u8>> {
    let device = &personality.device;
    let (table, id) = (device.table, node.unwrap_or(ONE));
    let mut image = vec![0; table.image_bytes()];
    let entry = table.find(address.index, address.sub).ok()?;
    let mut node = Node::new(device, image.as_mut_slice(), id);
    let little = value.to_le_bytes();
    let size = usize::from(entry.field.size()).min(8);
    node.image().set_bytes(entry.field, little.get(..size)?);
    let mut bytes = vec![0; old.len() + 64];
    let request = Request::Single(address);
    let used = store::save(&table, &node.image(), id, request, old, &mut bytes).ok()?;
    bytes.truncate(used);
    Some(bytes)
}

fn shown(address: Address) -> String {
    match address.sub {
        0 => format!("0x{:04X}", address.index),
        sub => format!("0x{:04X},{sub}", address.index),
    }
}

/// The tables of parameters, each once.
fn section_names() -> Vec<&'static str> {
    let mut names: Vec<&str> = PARAMETERS.iter().map(Parameter::section).collect();
    names.dedup();
    names
}

/// The kind of drive that is named.
pub(super) fn personality(
    section: &mut Section<'_>,
    findings: &mut Findings<'_>,
) -> Option<&'static Personality> {
    let names: Vec<&str> = personalities::ALL.iter().map(|p| p.name).collect();
    let form = format!("write {}", any_of(names.iter().copied()));
    let name = section.text("personality", &form, findings)?;
    let found = personalities::by_name(name.value);
    if found.is_none() {
        let remedy = super::problem::suggestion(name.value, &names);
        findings.push(
            &name.span,
            format!("no drive is called '{}'", name.value),
            remedy,
        );
    }
    found
}

/// The keys of a table of parameters.
fn read_parameters<'t>(
    name: &'static str,
    value: Value<'t>,
    findings: &mut Findings<'_>,
    each: &mut dyn FnMut(&'static Parameter, Value<'t>, &mut Findings<'_>),
) {
    let form = format!("write a table, as in [drive.1.{name}]");
    let Some(section) = Section::of(value, "this", &form, findings) else {
        return;
    };
    let own = || PARAMETERS.iter().filter(|p| p.section() == name);
    for (key, span, value) in section.entries() {
        match own().find(|parameter| parameter.key() == key) {
            Some(parameter) => each(parameter, value, findings),
            None => {
                let remedy = match nearest(key, own().map(Parameter::key)) {
                    Some(word) => format!("did you mean '{word}'?"),
                    None => format!("it has {}", any_of(own().map(Parameter::key))),
                };
                findings.push(&span, format!("'{name}' has no parameter '{key}'"), remedy);
            }
        }
    }
}

fn read_spreads(
    value: Value<'_>,
    findings: &mut Findings<'_>,
    spreads: &mut Vec<(&'static Parameter, Read<truth::Spread>)>,
) {
    let form = "write a table, as in [drive.1.spread] motor.phase_resistance = \"10 %\"";
    let Some(mut section) = Section::of(value, "'spread'", form, findings) else {
        return;
    };
    for name in section_names() {
        if let Some(value) = section.take(name) {
            read_parameters(name, value, findings, &mut |parameter, value, findings| {
                let quantity = parameter.quantity;
                if matches!(quantity, Quantity::Flag) {
                    let what = format!("'{}' cannot be spread", parameter.path);
                    findings.push(&value.span(), what, "give it a value, true or false");
                    return;
                }
                let is_share = matches!(value.get_ref(), DeValue::String(text)
                    if text.trim_end().ends_with('%') && quantity != Quantity::Share);
                let read = if is_share {
                    let read = read_quantity(value, Quantity::Share, 0.0..=100.0, findings);
                    read.map(|read| read.map(|percent| truth::Spread::Share(percent / 100.0)))
                } else {
                    let quantity = match quantity {
                        Quantity::Temperature => Quantity::TemperatureStep,
                        other => other,
                    };
                    let read = read_quantity(value, quantity, 0.0..=f64::MAX, findings);
                    read.map(|read| read.map(truth::Spread::Absolute))
                };
                if let Some(read) = read {
                    spreads.push((parameter, read));
                }
            });
        }
    }
    section.finish(&[], findings);
}

fn read_stored(value: Value<'_>, findings: &mut Findings<'_>) -> Vec<(Address, Read<u64>)> {
    const FORM: &str = "write objects and numbers, as in { \"0x6065\" = 1000, \"0x3001,1\" = 50 }";
    let Some(section) = Section::of(value, "'stored'", FORM, findings) else {
        return Vec::new();
    };
    let mut list = Vec::new();
    for (key, span, value) in section.entries() {
        let Some(address) = address(key) else {
            findings.push(&span, format!("'{key}' is no object"), FORM);
            continue;
        };
        let read = match value.get_ref() {
            DeValue::Integer(number) if number.as_str().starts_with('-') => {
                let number: Result<i64, _> = number.as_str().replace('_', "").parse();
                number.ok().map(|number| Read {
                    value: number as u64,
                    span: value.span(),
                })
            }
            DeValue::Integer(_) => read_whole(value, 0..=u64::MAX, findings),
            other => {
                let what = format!("a whole number is expected, not {}", kind(other));
                findings.push(&value.span(), what, FORM);
                None
            }
        };
        list.extend(read.map(|read| (address, read)));
    }
    list
}

/// `0x6065`, `0x3001,1`.
fn address(text: &str) -> Option<Address> {
    let number = |text: &str| {
        let text = text.trim();
        match text.strip_prefix("0x") {
            Some(digits) => u16::from_str_radix(digits, 16).ok(),
            None => text.parse().ok(),
        }
    };
    let (index, sub) = text.split_once(',').unwrap_or((text, "0"));
    if !index.trim().starts_with("0x") {
        return None;
    }
    Some(Address::new(
        number(index)?,
        u8::try_from(number(sub)?).ok()?,
    ))
}
