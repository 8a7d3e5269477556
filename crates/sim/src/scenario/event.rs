//! An event: when, to whom, what.

use super::act_rows::ACTS;
use super::acts::{Act, ActKind, Lasting, Object, find};
use super::arguments::{Argument, Arguments};
use super::conditions::When;
use super::frames::place;
use super::problem::{Findings, Span, nearest, suggestion};
use super::section::{Read, Section, Value};
use crate::place::Place;

/// Upon which drives an event acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// Upon the bus.
    Bus,
    /// Upon the connection of the outside programs.
    Outside,
    /// Upon one drive.
    One(Place),
    /// Upon every drive.
    All,
}

/// What sets an event off.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Trigger {
    /// A time, ns.
    At(u64),
    /// Something that happens.
    When(When),
    /// Another event, by its number.
    After(usize),
}

/// How often an event happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Times {
    Number(u32),
    Always,
}

/// An event of a scenario.
#[derive(Clone, Debug)]
pub(super) struct Event {
    /// Its name, or `event 3`.
    pub(super) name: String,
    /// The line in which it begins.
    pub(super) line: usize,
    pub(super) trigger: Trigger,
    pub(super) trigger_span: Span,
    /// From the trigger to the act, ns.
    pub(super) delay_ns: u64,
    /// The act is repeated with this period, ns.
    pub(super) every_ns: Option<u64>,
    pub(super) times: Times,
    pub(super) target: Read<Target>,
    /// Upon which axis of a drive that has several, from 1; none was named: the first, or all where
    /// they share the thing.
    pub(super) axis: Option<Read<u8>>,
    pub(super) kind: &'static ActKind,
    pub(super) act: Act,
    /// Which of several things of one kind it is about, as a phase.
    pub(super) detail: String,
    /// Drives that its arguments name.
    pub(super) named: Vec<Read<Place>>,
    /// How long it lasts, ns, and what follows then.
    pub(super) lasts_ns: Option<u64>,
    pub(super) undo: Option<Act>,
}

/// An event whose `after` is not resolved yet.
pub(super) struct Draft {
    event: Event,
    after: Option<Read<String>>,
    name_span: Option<Span>,
}

/// The keys of every event.
pub const EVENT_KEYS: &[(&str, &str, &str)] = &[
    (
        "name",
        "\"sag\"",
        "What other events and messages call it. Without one it is called after its number, as in event 3.",
    ),
    (
        "drive",
        "1",
        "Upon which drive: 1, \"u1\" or \"all\"; for what is done to a connection also \"outside\". Not for what is done to the bus.",
    ),
    (
        "axis",
        "2",
        "Upon which axis (motor channel) of a drive that has several. The first, if it does not say; supplies and the surroundings are then those of all.",
    ),
    (
        "do",
        "\"motor-supply\"",
        "What is done: one of the acts below. Needed.",
    ),
    (
        "at",
        "\"1.5 s\"",
        "When: simulated time since the start. One of `at`, `when` and `after` is needed.",
    ),
    (
        "when",
        "{ drive = 1, state = \"fault\" }",
        "Or what must happen first: one of the conditions below, `nth` time (the first, if it does not say). Its drive is the event's if it names none.",
    ),
    (
        "after",
        "\"sag\"",
        "Or which other event must happen first.",
    ),
    (
        "delay",
        "\"20 ms\"",
        "So much later than what `when` or `after` wait for.",
    ),
    (
        "every",
        "\"10 ms\"",
        "Again and again with this period, from the first time on.",
    ),
    (
        "times",
        "5",
        "How often, or \"always\". With `every` always, else once, if it does not say.",
    ),
    (
        "for",
        "\"300 ms\"",
        "How long it lasts, where that has a meaning; then it is undone.",
    ),
];

const AT_FORM: &str = "write at = \"1.5 s\", when = { … } or after = \"another event\"";

impl Draft {
    /// Reads an event, the `number`th of the file, counted from 1.
    pub(super) fn read(
        value: Value<'_>,
        number: usize,
        findings: &mut Findings<'_>,
    ) -> Option<Draft> {
        let form = "write [[event]] with its keys below";
        let mut section = Section::of(value, "an event", form, findings)?;
        let span = section.span.clone();
        let line = findings.source.line_of(span.start);
        let name = section.text("name", "write a name, as in \"sag\"", findings);
        if let Some(name) = &name
            && name.value.contains(char::is_control)
        {
            // What happens is told in lines, with the event's name.
            let what = "a name has no line breaks or other control characters";
            findings.push(&name.span, what, "write it in one line");
        }
        let kind = Self::kind(&mut section, findings);
        let target = match kind.map(|kind| kind.object) {
            Some(Object::Bus) => Some(Read {
                value: Target::Bus,
                span: span.clone(),
            }),
            _ => Self::target(&mut section, kind, findings),
        };
        let axis = section.whole("axis", 1..=9, findings);
        let axis = axis.map(|read| read.map(|axis| axis as u8));
        let trigger = Self::trigger(&mut section, target.as_ref(), findings);
        let delay = section.time_ns("delay", 0, findings);
        let every = section.time_ns("every", 1_000, findings);
        let times = Self::times(&mut section, findings);
        let lasting = kind.map(|kind| kind.lasting);
        let lasts = match lasting {
            Some(Lasting::Once) => None,
            _ => section.time_ns("for", 1, findings),
        };
        let arguments = kind
            .and_then(|kind| Arguments::read(kind.arguments, kind.name, &mut section, findings));
        if let (Some(Lasting::Stated), Some(kind)) = (lasting, kind)
            && !section.has("for")
        {
            let what = format!("{} needs 'for'", kind.name);
            findings.push(&span, what, "say how long, as in for = \"10 ms\"");
        }
        if kind.is_some() {
            let all: Vec<&str> = ACTS
                .iter()
                .flat_map(|kind| kind.arguments.iter().map(Argument::key))
                .chain(["for", "drive", "axis"])
                .collect();
            section.finish(&all, findings);
        }
        let (trigger, after, trigger_span) = trigger?;
        if let (Trigger::At(_), None, Some(delay)) = (&trigger, &after, &delay) {
            let what = "a delay has no meaning with a time";
            findings.push(&delay.span, what, "add it to at, and leave it out");
        }
        let times = match (times, &trigger, &every) {
            (Some(times), Trigger::At(_), None) if after.is_none() => {
                if times.value != Times::Number(1) {
                    let what = "a time passes once";
                    findings.push(
                        &times.span,
                        what,
                        "add every = \"10 ms\", or leave times out",
                    );
                }
                Times::Number(1)
            }
            (Some(times), ..) => times.value,
            (None, _, Some(_)) => Times::Always,
            (None, _, None) => Times::Number(1),
        };
        if let (Some(lasts), Some(every)) = (&lasts, &every)
            && lasts.value > every.value
        {
            let what = "it would last longer than the time between two";
            findings.push(&lasts.span, what, "make for shorter than every");
        }
        let (kind, target, arguments) = (kind?, target?, arguments?);
        let undo = match (kind.lasting, &lasts) {
            (Lasting::Until(undo), Some(_)) => find(undo).map(|undo| (undo.build)(&arguments)),
            _ => None,
        };
        let event = Event {
            name: name.as_ref().map_or_else(
                || format!("event {number}"),
                |name| format!("event \"{}\"", name.value),
            ),
            line,
            trigger,
            trigger_span,
            delay_ns: delay.map_or(0, |delay| delay.value),
            every_ns: every.map(|every| every.value),
            times,
            target,
            axis,
            kind,
            act: (kind.build)(&arguments),
            detail: arguments.detail(),
            named: arguments.drives(),
            lasts_ns: lasts.map(|lasts| lasts.value),
            undo,
        };
        Some(Draft {
            event,
            after,
            name_span: name.map(|name| name.span),
        })
    }

    fn kind(section: &mut Section<'_>, findings: &mut Findings<'_>) -> Option<&'static ActKind> {
        let form =
            "write do = \"motor-supply\" or another act; `servobus scenario acts` lists them";
        if !section.has("do") {
            findings.push(&section.span, "this event does nothing", form);
            return None;
        }
        let name = section.text("do", form, findings)?;
        let kind = find(name.value);
        if kind.is_none() {
            let remedy = match nearest(name.value, ACTS.iter().map(|kind| kind.name)) {
                Some(word) => format!("did you mean '{word}'?"),
                None => "`servobus scenario acts` lists them".to_owned(),
            };
            findings.push(
                &name.span,
                format!("there is no act '{}'", name.value),
                remedy,
            );
        }
        kind
    }

    fn target(
        section: &mut Section<'_>,
        kind: Option<&ActKind>,
        findings: &mut Findings<'_>,
    ) -> Option<Read<Target>> {
        let is_participant = kind.is_some_and(|kind| kind.object == Object::Participant);
        let form = match is_participant {
            true => "write a drive, as in 1 or \"u1\", or \"all\", or \"outside\"",
            false => "write a drive, as in 1 or \"u1\", or \"all\"",
        };
        let Some(value) = section.take("drive") else {
            if let Some(kind) = kind {
                let what = format!("{} needs 'drive'", kind.name);
                findings.push(&section.span, what, form);
            }
            return None;
        };
        if let toml::de::DeValue::String(word) = value.get_ref() {
            let target = match word.as_ref() {
                "all" => Some(Target::All),
                "outside" if is_participant => Some(Target::Outside),
                _ => None,
            };
            if let Some(value_of) = target {
                return Some(Read {
                    value: value_of,
                    span: value.span(),
                });
            }
        }
        Some(place(value, form, findings)?.map(Target::One))
    }

    /// The trigger, the event that it names, and where it stands.
    fn trigger(
        section: &mut Section<'_>,
        target: Option<&Read<Target>>,
        findings: &mut Findings<'_>,
    ) -> Option<(Trigger, Option<Read<String>>, Span)> {
        let present: Vec<&str> = ["at", "when", "after"]
            .into_iter()
            .filter(|key| section.has(key))
            .collect();
        let of_event = target.and_then(|target| match target.value {
            Target::One(place) => Some(Read {
                value: place,
                span: target.span.clone(),
            }),
            Target::All | Target::Bus | Target::Outside => None,
        });
        let at = section.time_ns("at", 0, findings);
        let when = section.take("when");
        let when = when.and_then(|value| {
            Some((
                When::read(value, of_event.as_ref(), findings)?,
                value.span(),
            ))
        });
        let form = "write the name of another event, as in \"sag\"";
        let after = section.text("after", form, findings);
        match present[..] {
            [] => {
                findings.push(&section.span, "when this happens is missing", AT_FORM);
                return None;
            }
            [_] => {}
            [first, second, ..] => {
                let span = section.key_span(second).unwrap_or(section.span.clone());
                let what = format!("an event has one beginning, and '{first}' is there already");
                findings.push(&span, what, "leave one out");
                return None;
            }
        }
        if let Some(at) = at {
            return Some((Trigger::At(at.value), None, at.span));
        }
        if let Some((when, span)) = when {
            return Some((Trigger::When(when), None, span));
        }
        let after = after?;
        let name = after.value.to_owned();
        let after = Read {
            value: name,
            span: after.span,
        };
        // Which it is is known when all have been read.
        let span = after.span.clone();
        Some((Trigger::At(0), Some(after), span))
    }

    fn times(section: &mut Section<'_>, findings: &mut Findings<'_>) -> Option<Read<Times>> {
        let value = section.take("times")?;
        if let toml::de::DeValue::String(word) = value.get_ref()
            && word == "always"
        {
            return Some(Read {
                value: Times::Always,
                span: value.span(),
            });
        }
        let read = section.whole("times", 1..=1_000_000, findings)?;
        Some(read.map(|times| Times::Number(times as u32)))
    }
}

/// The events, with the others that they wait for found.
pub(super) fn resolve(drafts: Vec<Draft>, findings: &mut Findings<'_>) -> Vec<Event> {
    let named = |text: &str| format!("event \"{text}\"");
    let names: Vec<String> = drafts.iter().map(|d| d.event.name.clone()).collect();
    for (n, draft) in drafts.iter().enumerate() {
        let first = names.iter().position(|name| *name == names[n]);
        if let (Some(span), Some(first)) = (&draft.name_span, first.filter(|first| *first < n)) {
            let line = drafts[first].event.line;
            let what = format!("line {line} has an {} already", names[n]);
            findings.push(span, what, "give one of them another name");
        }
    }
    let mut events = Vec::new();
    for draft in drafts {
        let mut event = draft.event;
        if let Some(after) = draft.after {
            match names.iter().position(|name| *name == named(&after.value)) {
                Some(n) => event.trigger = Trigger::After(n),
                None => {
                    let known: Vec<&str> = names
                        .iter()
                        .filter_map(|name| name.strip_prefix("event \"")?.strip_suffix('"'))
                        .collect();
                    let remedy = match known[..] {
                        [] => "give the event that it waits for a name".to_owned(),
                        _ => suggestion(&after.value, &known),
                    };
                    let what = format!("there is no event '{}'", after.value);
                    findings.push(&after.span, what, remedy);
                }
            }
        }
        events.push(event);
    }
    // An event that waits for itself, directly or through others, never happens.
    for n in 0..events.len() {
        let mut at = n;
        for _ in 0..events.len() {
            match events[at].trigger {
                Trigger::After(before) => at = before,
                _ => break,
            }
            if at == n {
                let what = format!("{} waits for itself, so it never happens", events[n].name);
                let remedy = "let one of the events in this circle have at or when";
                findings.push(&events[n].trigger_span, what, remedy);
                break;
            }
        }
    }
    events
}
