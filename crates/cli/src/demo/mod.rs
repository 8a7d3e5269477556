//! `servobus demo`: virtual drives boot, are configured, and move, in virtual time.

mod cast;
mod dialogue;
mod plot;
mod report;
mod script;
mod stage;
#[cfg(test)]
mod tests;
mod tour;
mod trajectory;
mod watch;

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::rc::Rc;

use ::sim::scenario::Scenario;
use ::sim::{BusSettings, DriveSettings, Place, ProbeSample};
use canopen::{Instant, NodeId};
use client::block_on;
use personalities::Personality;
use personalities::p3::P3;

use self::cast::{FOLLOWER, MOVER, NODES, PUSHER};
use self::report::Act;
use self::script::{Arrival, Move, Scene, TORQUE_PM, Trouble, mode_of, turning_points};
use self::stage::{Phase, Stage, Wire};
use crate::{Failure, drive_kind, output, scenario_file};

/// Where the plot goes.
const PLOT: &str = "servobus-demo.svg";

/// Virtual drives boot, are configured and move, in virtual time: a first look.
///
/// Three P3s: a profile position move, a cyclic position trajectory and a torque step against a blocked
/// rotor, with nothing but this program. Other drives are brought into operation by their own document's
/// way and moved in their own modes; of one with several axes, each axis. Prints the decoded dialogue and a table, and draws position,
/// velocity and current in servobus-demo.svg in the current folder. Ends by itself in seconds.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus demo
  servobus demo --drive md80                  another drive; servobus drives lists them
  servobus demo --seed 7 --record demo.log    demo.log is a candump log; with demo.log.run beside
                                              it, servobus replay demo.log repeats the run

Exit code 0 only if every target was reached.")]
pub(crate) struct Arguments {
    /// Which drive.
    #[arg(long, value_name = "NAME", default_value = "p3", value_parser = drive_kind::parse)]
    drive: &'static Personality,
    /// From it everything random follows: latencies, serial numbers [default: 1]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Write all frames to FILE, and to FILE.run what they follow from. FILE ends in .log (candump),
    /// .pcapng (Wireshark) or .mcap (Foxglove; with position, speed and current of each drive).
    /// Existing files are replaced.
    #[arg(long, value_name = "FILE", value_parser = crate::record_file::parse)]
    record: Option<PathBuf>,
    /// Let the drives be what this scenario says, and what goes wrong in it (docs/scenarios.md). Its
    /// seed holds unless --seed is given; its nodes and bit rate are the demo's.
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
}

/// What the demo is to be.
#[derive(Clone, Copy, Debug)]
struct Settings<'a> {
    drive: &'static Personality,
    seed: u64,
    scenario: Option<&'a Scenario>,
    record: Option<&'a Path>,
    /// A shaft that is held from the start on.
    held: Option<NodeId>,
}

/// What the demo was.
#[derive(Debug)]
struct Report {
    drive: &'static Personality,
    /// Who plays: "three virtual P3 drives".
    who: String,
    acts: Vec<Act>,
    samples: Vec<ProbeSample>,
    /// How long it was, ns of virtual time.
    length_ns: u64,
    /// Frames in the recording.
    recorded: Option<u64>,
    /// Whether the dialogue could be printed.
    printed: io::Result<()>,
}

impl Report {
    fn is_p3(&self) -> bool {
        is_p3(self.drive)
    }

    fn every_target_was_reached(&self) -> bool {
        self.acts.iter().all(|act| act.reached.is_ok())
    }
}

/// Runs the demo.
///
/// # Errors
/// [`Failure::Input`] if a file cannot be written, known before anything runs.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let cannot_write = |error| {
        Failure::input(format!(
            "{PLOT}: cannot write the plot: {error}; run this in a folder where it can be written"
        ))
    };
    // Better to know before the run than after it.
    let scenario = arguments.scenario.as_deref();
    let scenario = scenario.map(scenario_file::read).transpose()?;
    if let Some(scenario) = &scenario {
        suits(scenario, arguments.drive)?;
    }
    let is_new = !Path::new(PLOT).exists();
    OpenOptions::new()
        .create(true)
        .append(true)
        .open(PLOT)
        .map_err(cannot_write)?;
    let own_seed = scenario.as_ref().and_then(|scenario| scenario.seed);
    let settings = Settings {
        drive: arguments.drive,
        seed: arguments.seed.or(own_seed).unwrap_or(1),
        scenario: scenario.as_ref(),
        record: arguments.record.as_deref(),
        held: None,
    };
    let report = play(&settings, &mut io::stdout().lock()).inspect_err(|_| {
        if is_new {
            // An empty file is of no use to anybody.
            let _ = fs::remove_file(PLOT);
        }
    })?;
    fs::write(PLOT, plot::svg(&report)).map_err(cannot_write)?;
    let code = Failure::code(report.every_target_was_reached());
    let text = report::text(&report, &settings);
    let printed = report
        .printed
        .map_err(Failure::output)
        .and_then(|()| output::print(text));
    match printed {
        // Whoever does not read on may still ask for the exit code.
        Ok(()) | Err(Failure::ReaderGone) => Ok(code),
        Err(failure) => Err(failure),
    }
}

/// The P3 has a play of its own.
fn is_p3(drive: &Personality) -> bool {
    drive.name == P3.name
}

/// The demo's nodes.
fn nodes(drive: &'static Personality) -> Vec<NodeId> {
    match is_p3(drive) {
        true => NODES.into(),
        false => tour::nodes(drive),
    }
}

/// Who plays, in words.
fn who(drive: &'static Personality) -> String {
    let name = match is_p3(drive) {
        true => "P3",
        false => drive.name,
    };
    match nodes(drive).len() {
        1 => format!("one virtual {name} with {} axes", drive.axes.len()),
        2 => format!("two virtual {name} drives"),
        _ => format!("three virtual {name} drives"),
    }
}

/// Refuses a scenario of other drives than the demo's.
///
/// # Errors
/// What it says, and what the demo has.
fn suits(scenario: &Scenario, drive: &'static Personality) -> Result<(), Failure> {
    let refused = |what: String| {
        Failure::input(format!(
            "{}: {what}; play it with servobus sim, or leave that out",
            scenario.file()
        ))
    };
    if let Some(rate) = scenario
        .bit_rate
        .filter(|rate| *rate != can::BitRate::Mbit1)
    {
        return Err(refused(format!(
            "it says {rate}, and the demo's bus has 1 Mbit/s"
        )));
    }
    let nodes = nodes(drive);
    let places: Vec<Place> = nodes.iter().map(|node| Place::of_node(*node)).collect();
    if let Some(place) = scenario.places().into_iter().find(|p| !places.contains(p)) {
        let has = match nodes.len() {
            1 => "node 1".to_owned(),
            last => format!("nodes 1 to {last}"),
        };
        return Err(refused(format!("the demo has {has}, and no drive {place}")));
    }
    for place in places {
        let kind = scenario.personality_of(place).or(scenario.personality);
        if let Some(kind) = kind.filter(|kind| kind.name != drive.name) {
            return Err(refused(format!(
                "the demo's drives are {}, not {} (--drive {} makes them so)",
                drive.name, kind.name, kind.name
            )));
        }
    }
    Ok(())
}

/// Plays all phases and prints the dialogue to `output`.
fn play(settings: &Settings<'_>, output: &mut dyn Write) -> Result<Report, Failure> {
    let drive = settings.drive;
    let mut bus = BusSettings::new(
        settings.seed,
        nodes(drive)
            .into_iter()
            .map(|node| DriveSettings::new(node, drive))
            .collect(),
    );
    if let Some(scenario) = settings.scenario {
        let set_up = scenario.set_up(&mut bus, Instant::NEVER);
        set_up.map_err(|problems| scenario_file::refused(&problems))?;
    }
    let mut stage =
        Stage::new(bus, drive_kind::words(drive), settings.record, output).map_err(|error| {
            let path = settings.record.unwrap_or(Path::new(""));
            Failure::input(format!(
                "{}: cannot write the recording: {error}; name another file",
                path.display()
            ))
        })?;
    let who = who(drive);
    let mut letters = who.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    let begin = first.unwrap_or_default() + letters.as_str();
    stage.dialogue.borrow_mut().say(&format!(
        "{begin} on a simulated CAN bus at 1 Mbit/s, seed {}.\n\
         Time is virtual, in seconds; \u{2192} the master sends, \u{2190} it receives.",
        settings.seed
    ));
    let broken_off = |trouble| Failure::unsuccessful(format!("the demo was broken off: {trouble}"));
    if let Some(node) = settings.held {
        stage
            .block(node, true)
            .map_err(|error| broken_off(Trouble::Recording(error)))?;
    }
    let acts = match is_p3(drive) {
        true => acts(&mut stage),
        false => tour::acts(&mut stage, drive),
    };
    // What was said so far must be seen also if the play was broken off.
    let played = stage.finish();
    let acts = acts.map_err(broken_off)?;
    let played = played.map_err(|error| broken_off(Trouble::Recording(error)))?;
    Ok(Report {
        drive,
        who,
        acts,
        samples: played.samples,
        length_ns: played.end.0,
        recorded: played.recorded,
        printed: played.printed,
    })
}

/// The whole play; what came of the acts.
fn acts(stage: &mut Stage<'_>) -> Result<Vec<Act>, Trouble> {
    let heading = "Power on, reset, who is there?";
    scene(stage, "boot", heading, async |scene| scene.boot().await).0?;
    let heading = "Configure PDOs and profiles";
    scene(stage, "configure", heading, async |scene| {
        scene.configure().await
    })
    .0?;
    let heading = "Enable";
    let homes = scene(stage, "enable", heading, async |scene| scene.enable().await).0?;

    let mut acts = Vec::new();
    let there = Move {
        from_turns: 0.0,
        to_turns: 10.0,
        is_relative: false,
    };
    let back = Move {
        from_turns: 10.0,
        to_turns: 6.0,
        is_relative: true,
    };
    for way in [there, back] {
        let turns = way.to_turns - way.from_turns;
        let target = match way.is_relative {
            true => format!("{turns:+} turns, relative"),
            false => format!("{turns:+} turns"),
        };
        let heading = format!("Node {MOVER}, profile position: {target}");
        let title = match way.is_relative {
            true => "and back",
            false => "node 1 moves",
        };
        let played = scene(stage, title, &heading, async |scene| {
            scene.profile_move(homes, way).await
        });
        acts.push(act(MOVER, target, played)?);
    }

    let points: Vec<String> = turning_points().map(|turns| format!("{turns:+}")).collect();
    let target = format!("{} turns", points.join(", "));
    let heading =
        format!("Node {FOLLOWER}, cyclic position, a set-point each millisecond: {target}");
    let played = scene(stage, "node 2 follows", &heading, async |scene| {
        scene.trajectory(homes).await
    });
    acts.push(act(FOLLOWER, target, played)?);

    stage.block(PUSHER, true).map_err(Trouble::Recording)?;
    let target = format!("{TORQUE_PM} \u{2030} of rated torque, rotor blocked");
    let heading = format!("Node {PUSHER}, profile torque: {target} by the simulation");
    let played = scene(stage, "node 3 pushes", &heading, async |scene| {
        scene.torque_step(homes).await
    });
    let push = act(PUSHER, target, played)?;
    acts.push(Act {
        follows: false,
        ..push
    });
    stage.block(PUSHER, false).map_err(Trouble::Recording)?;

    let heading = "Switch off";
    scene(stage, "switch off", heading, async |scene| {
        scene.disable().await
    })
    .0?;
    Ok(acts)
}

/// An act of a P3, in the mode that it has in the play.
fn act(
    node: NodeId,
    target: String,
    played: (Result<Arrival, Trouble>, Phase),
) -> Result<Act, Trouble> {
    let mode = mode_of(node);
    Act::new(node, format!("{} {mode}", mode.0), target, played)
}

/// Plays one phase.
fn scene<'w, T>(
    stage: &mut Stage<'w>,
    title: &'static str,
    heading: &str,
    act: impl AsyncFnOnce(&mut Scene<'w, Wire<'_>>) -> T,
) -> (T, Phase) {
    stage.play(title, |stage| {
        let dialogue = Rc::clone(&stage.dialogue);
        let mut scene = Scene::new(stage.client(), dialogue, heading);
        block_on(act(&mut scene))
    })
}
