//! `servobus demo`: three virtual drives boot, are configured, and move, in virtual time.

mod cast;
mod dialogue;
mod plot;
mod report;
mod script;
mod stage;
#[cfg(test)]
mod tests;
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
use personalities::p3::P3;

use self::cast::{FOLLOWER, MOVER, NODES, PUSHER};
use self::report::Act;
use self::script::{Move, Scene, TORQUE_PM, Trouble, turning_points};
use self::stage::{Phase, Stage, Wire};
use crate::{Failure, output, scenario_file};

/// Where the plot goes.
const PLOT: &str = "servobus-demo.svg";

/// Three virtual drives boot, are configured and move, in virtual time: a first look.
///
/// A profile position move, a cyclic position trajectory and a torque step against a blocked rotor,
/// with nothing but this program. Prints the decoded dialogue and a table, and draws position,
/// velocity and current in servobus-demo.svg in the current folder. Ends by itself in seconds.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus demo
  servobus demo --seed 7 --record demo.log    demo.log is a candump log; with demo.log.run beside
                                              it, servobus replay demo.log repeats the run

Exit code 0 only if every target was reached.")]
pub(crate) struct Arguments {
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
    seed: u64,
    scenario: Option<&'a Scenario>,
    record: Option<&'a Path>,
    /// A shaft that is held from the start on.
    held: Option<NodeId>,
}

/// What the demo was.
#[derive(Debug)]
struct Report {
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
        suits(scenario)?;
    }
    let is_new = !Path::new(PLOT).exists();
    OpenOptions::new()
        .create(true)
        .append(true)
        .open(PLOT)
        .map_err(cannot_write)?;
    let own_seed = scenario.as_ref().and_then(|scenario| scenario.seed);
    let settings = Settings {
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

/// Refuses a scenario of other drives than the demo's.
///
/// # Errors
/// What it says, and what the demo has.
fn suits(scenario: &Scenario) -> Result<(), Failure> {
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
    let places = NODES.map(Place::of_node);
    if let Some(place) = scenario.places().into_iter().find(|p| !places.contains(p)) {
        return Err(refused(format!(
            "the demo has nodes 1 to 3, and no drive {place}"
        )));
    }
    for place in places {
        let kind = scenario.personality_of(place).or(scenario.personality);
        if let Some(kind) = kind.filter(|kind| kind.name != P3.name) {
            let (drive, usual) = (kind.name, P3.name);
            return Err(refused(format!(
                "the demo's drives are {usual}, not {drive}"
            )));
        }
    }
    Ok(())
}

/// Plays all phases and prints the dialogue to `output`.
fn play(settings: &Settings<'_>, output: &mut dyn Write) -> Result<Report, Failure> {
    let mut bus = BusSettings::new(
        settings.seed,
        NODES.map(|node| DriveSettings::new(node, &P3)).into(),
    );
    if let Some(scenario) = settings.scenario {
        let set_up = scenario.set_up(&mut bus, Instant::NEVER);
        set_up.map_err(|problems| scenario_file::refused(&problems))?;
    }
    let mut stage = Stage::new(bus, settings.record, output).map_err(|error| {
        let path = settings.record.unwrap_or(Path::new(""));
        Failure::input(format!(
            "{}: cannot write the recording: {error}; name another file",
            path.display()
        ))
    })?;
    stage.dialogue.borrow_mut().say(&format!(
        "Three virtual P3 drives on a simulated CAN bus at 1 Mbit/s, seed {}.\n\
         Time is virtual, in seconds; \u{2192} the master sends, \u{2190} it receives.",
        settings.seed
    ));
    let broken_off = |trouble| Failure::unsuccessful(format!("the demo was broken off: {trouble}"));
    if let Some(node) = settings.held {
        stage
            .block(node, true)
            .map_err(|error| broken_off(Trouble::Recording(error)))?;
    }
    let acts = acts(&mut stage);
    // What was said so far must be seen also if the play was broken off.
    let played = stage.finish();
    let acts = acts.map_err(broken_off)?;
    let played = played.map_err(|error| broken_off(Trouble::Recording(error)))?;
    Ok(Report {
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
        acts.push(Act::new(MOVER, target, played)?);
    }

    let points: Vec<String> = turning_points().map(|turns| format!("{turns:+}")).collect();
    let target = format!("{} turns", points.join(", "));
    let heading =
        format!("Node {FOLLOWER}, cyclic position, a set-point each millisecond: {target}");
    let played = scene(stage, "node 2 follows", &heading, async |scene| {
        scene.trajectory(homes).await
    });
    acts.push(Act::new(FOLLOWER, target, played)?);

    stage.block(PUSHER, true).map_err(Trouble::Recording)?;
    let target = format!("{TORQUE_PM} \u{2030} of rated torque, rotor blocked");
    let heading = format!("Node {PUSHER}, profile torque: {target} by the simulation");
    let played = scene(stage, "node 3 pushes", &heading, async |scene| {
        scene.torque_step(homes).await
    });
    acts.push(Act::new(PUSHER, target, played)?);
    stage.block(PUSHER, false).map_err(Trouble::Recording)?;

    let heading = "Switch off";
    scene(stage, "switch off", heading, async |scene| {
        scene.disable().await
    })
    .0?;
    Ok(acts)
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
