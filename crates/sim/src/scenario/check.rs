//! What a scenario cannot ask: contradictions, and what the drives of a bus cannot be or do.

use canopen::Instant;
use plant::{Invalid, SwitchName};

use super::Scenario;
use super::acts::Act;
use super::conditions::Condition;
use super::drives::DriveSection;
use super::event::{Event, Target, Trigger};
use super::parameters::Parameter;
use super::problem::{Findings, Span};
use super::truth;
use crate::drive::DriveSettings;
use crate::place::Place;

/// Two events that would set one thing to different values at one time.
pub(super) fn contradictions(events: &[Event], findings: &mut Findings<'_>) {
    for (n, later) in events.iter().enumerate() {
        let Trigger::At(at) = later.trigger else {
            continue;
        };
        for earlier in &events[..n] {
            let meet = match (earlier.target.value, later.target.value) {
                // All are all drives.
                (Target::All, Target::Outside) | (Target::Outside, Target::All) => false,
                (Target::All, _) | (_, Target::All) => true,
                (one, other) => one == other,
            };
            let axis = |event: &Event| event.axis.as_ref().map_or(1, |axis| axis.value);
            let meet = meet && axis(earlier) == axis(later);
            if earlier.trigger == Trigger::At(at)
                && meet
                && !later.kind.thing.is_empty()
                && earlier.kind.thing == later.kind.thing
                && earlier.detail == later.detail
                && earlier.act != later.act
            {
                let what = format!(
                    "{} (line {}) sets {} at the same time to something else",
                    earlier.name, earlier.line, later.kind.thing
                );
                let remedy = "let one of them happen at another time, or leave it out";
                findings.push(&later.trigger_span, what, remedy);
            }
        }
    }
}

/// What these drives cannot do, and what would never happen.
pub(super) fn cast(
    scenario: &Scenario,
    drives: &[DriveSettings],
    end: Instant,
    findings: &mut Findings<'_>,
) {
    let there = drives
        .iter()
        .map(|drive| drive.place)
        .collect::<Vec<Place>>();
    let mut needs = |place: Place, span: &Span| {
        if !there.contains(&place) {
            let list: Vec<String> = there.iter().map(Place::to_string).collect();
            let what = format!("there is no drive {place} on this bus");
            let remedy = format!(
                "its drives are {}; add it to nodes or --nodes",
                list.join(", ")
            );
            findings.push(span, what, remedy);
        }
    };
    for section in &scenario.drives {
        if let Some(place) = section.place {
            needs(place, &section.span);
        }
    }
    for event in scenario.events.iter() {
        if let Target::One(place) = event.target.value {
            needs(place, &event.target.span);
        }
        for drive in &event.named {
            needs(drive.value, &drive.span);
        }
        if let Trigger::When(when) = &event.trigger
            && let Some(drive) = &when.drive
        {
            needs(drive.value, &drive.span);
        }
    }
    for event in scenario.events.iter() {
        let meant = |drive: &&DriveSettings| match event.target.value {
            Target::One(place) => drive.place == place,
            Target::All => true,
            Target::Bus | Target::Outside => false,
        };
        let mut all = vec![(event.axis.as_ref(), drives.iter().find(meant))];
        if let Trigger::When(when) = &event.trigger {
            let of = when.drive.as_ref().map(|drive| drive.value);
            let seen = drives.iter().find(|drive| Some(drive.place) == of);
            all.push((when.axis.as_ref(), seen));
        }
        for (axis, drive) in all {
            let (Some(axis), Some(drive)) = (axis, drive) else {
                continue;
            };
            let number = drive.personality.axes.len();
            if usize::from(axis.value) > number {
                let what = format!("drive {} has no axis {}", drive.place, axis.value);
                let remedy = match number {
                    1 => "it has one; leave axis out".to_owned(),
                    _ => format!("it has {number}"),
                };
                findings.push(&axis.span, what, remedy);
            }
        }
    }
    for event in scenario.events.iter() {
        if let (Some(axis), true) = (&event.axis, event.act.is_upon_supply()) {
            let what = "all axes of a drive have one supply".to_owned();
            findings.push(&axis.span, what, "leave axis out");
        }
        if let Trigger::At(at) = event.trigger
            && Instant(at) >= end
        {
            let what = format!("this never happens: the run ends at {} s", end.seconds());
            findings.push(
                &event.trigger_span,
                what,
                "write an earlier time, or a longer length",
            );
        }
    }
    for section in &scenario.drives {
        for drive in drives.iter().filter(|drive| section.is_of(drive.place)) {
            section.check_stored(drive.personality, findings);
            section.check_axes(drive, findings);
        }
    }
}

/// Makes the world of a drive what the scenario says, and complains if it cannot be so.
pub(super) fn world(
    scenario: &Scenario,
    drive: &mut DriveSettings,
    seed: u64,
    findings: &mut Findings<'_>,
) {
    let place = drive.place;
    let own = || {
        scenario
            .drives
            .iter()
            .filter(move |section| section.is_of(place))
    };
    let mut plant = drive.plant;
    // The upper half of a product mixes all that is below it.
    plant.noise_seed =
        (truth::seed_of(place, seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32) as u32;
    for section in own() {
        section.change(&mut plant, place, seed);
    }
    if let Err(invalid) = plant.check() {
        let suspects = suspects(invalid);
        let suspect = |parameter: &Parameter| suspects.contains(&parameter.path);
        let own: Vec<_> = own().collect();
        let span = own
            .iter()
            .rev()
            .find_map(|section| section.span_of(suspect));
        let span = span
            .or_else(|| own.last().map(|section| section.span.clone()))
            .unwrap_or(0..0);
        let what = format!("no drive can be like this: {}", words(invalid));
        findings.push(
            &span,
            what,
            "`servobus scenario parameters` lists what there may be",
        );
    }
    for section in own() {
        if let (Some(span), Some(path)) = (section.stored_span(), drive.store.path()) {
            let path = path.display();
            let what = format!("drive {place} keeps what it stores in {path}, and this would not");
            let remedy = "leave --store out, or leave this out and let a master store it";
            findings.push(span, what, remedy);
            continue;
        }
        if !section.store(drive) {
            let what = "what is stored does not fit into the drive's flash";
            findings.push(&section.span, what, "store fewer objects");
        }
    }
    drive.plant = plant;
    let most = own().map(DriveSection::most_axes).max().unwrap_or(1);
    if most > 1 {
        let mut all = drive.plants();
        for (axis, world) in (2..).zip(all.iter_mut().skip(1)) {
            for section in own() {
                section.change_axis(axis, world);
            }
            if let Err(invalid) = world.check() {
                let span = own()
                    .next_back()
                    .map_or(0..0, |section| section.span.clone());
                let what = format!("no axis {axis} can be like this: {}", words(invalid));
                let remedy = "`servobus scenario parameters` lists what there may be";
                findings.push(&span, what, remedy);
            }
        }
        drive.others = all.split_off(1);
    }
}

/// Switches and encoders that a drive does not have, and inputs that belong to a switch.
pub(super) fn boards(scenario: &Scenario, drives: &[DriveSettings], findings: &mut Findings<'_>) {
    for event in scenario.events.iter() {
        let meant = |drive: &&DriveSettings| match event.target.value {
            Target::One(place) => drive.place == place,
            Target::All => true,
            Target::Bus | Target::Outside => false,
        };
        for drive in drives.iter().filter(meant) {
            let axis = event
                .axis
                .as_ref()
                .map_or(1, |axis| usize::from(axis.value));
            // An axis without a section of its own is as the first.
            let other = axis.checked_sub(2).and_then(|n| drive.others.get(n));
            let world = other.unwrap_or(&drive.plant);
            let switches = &world.switches;
            let place = drive.place;
            match event.act {
                Act::Switch(name, _) => {
                    let (there, keys) = match name {
                        SwitchName::NegativeLimit => (switches.negative_limit, "negative_limit"),
                        SwitchName::PositiveLimit => (switches.positive_limit, "positive_limit"),
                        SwitchName::Home => (switches.home, "home_from and home_to"),
                    };
                    if there.is_none() {
                        let what = format!("drive {place} does not have this switch");
                        let remedy =
                            format!("say where it is, with {keys} in [drive.{place}.switches]");
                        findings.push(&event.target.span, what, remedy);
                    }
                }
                Act::OutputSilent(_) | Act::OutputTurned(_) | Act::OutputMagnet(_)
                    if world.output_encoder.is_none() =>
                {
                    let what = format!("drive {place} has no encoder on its output");
                    let remedy =
                        format!("give it one, with output_gear in [drive.{place}.encoder]");
                    findings.push(&event.target.span, what, remedy);
                }
                Act::Input(bit @ 0..=2, _) => {
                    let all = [
                        switches.negative_limit,
                        switches.positive_limit,
                        switches.home,
                    ];
                    if all.get(bit as usize).is_some_and(Option::is_some) {
                        let what = format!("a switch is connected to this input of drive {place}");
                        let remedy = "use press-switch or release-switch";
                        findings.push(&event.target.span, what, remedy);
                    }
                }
                _ => {}
            }
        }
    }
}

/// The parameters that may be why a world cannot be.
fn suspects(invalid: Invalid) -> &'static [&'static str] {
    match invalid {
        Invalid::Inertia(_) => &[
            "load.inertia",
            "motor.rotor_inertia",
            "load.coupling_stiffness",
        ],
        Invalid::Friction(_) => &["motor.static_friction", "motor.coulomb_friction"],
        Invalid::Coupling(_) => &["load.coupling_damping", "load.backlash"],
        Invalid::Stops(..) => &["load.lowest_stop", "load.highest_stop", "load.start"],
        Invalid::Switch(_) => &["switches.home_from", "switches.home_to"],
        Invalid::EncoderError(_) => &["encoder.eccentricity", "encoder.noise"],
        Invalid::Bridge(_) => &["inverter.dead_time", "inverter.pwm_period"],
        Invalid::Link(_) => &[
            "supply.capacitance",
            "supply.resistance",
            "supply.brake_on",
            "supply.brake_off",
        ],
        _ => &[],
    }
}

fn words(invalid: Invalid) -> String {
    match invalid {
        Invalid::Inertia(_) => {
            "rotor and load together need an inertia, and a load behind a coupling one of its own"
                .to_owned()
        }
        Invalid::Coupling(_) => "a coupling needs a stiffness".to_owned(),
        Invalid::Stops(..) => {
            "the lowest stop must be below the highest, and the start between them".to_owned()
        }
        Invalid::Switch(_) => "the home switch must begin before it ends".to_owned(),
        Invalid::EncoderError(_) => "an error of the encoder is beyond a quarter turn".to_owned(),
        Invalid::Bridge(_) => "the dead time must be below a tenth of the PWM period".to_owned(),
        Invalid::Link(_) => "a capacitance needs a resistance of the supply above 0, and a brake \
                             that switches off below where it switches on"
            .to_owned(),
        other => format!("{other:?}"),
    }
}

/// Whether an event waits for what happens in a drive's control periods.
pub(super) fn watched_place(event: &Event) -> Option<Place> {
    match &event.trigger {
        Trigger::When(when) => match &when.condition {
            Condition::Drive(place, _, sight) if sight.is_of_the_shaft() => Some(*place),
            _ => None,
        },
        _ => None,
    }
}
