//! `servobus calibrate own`: a calibration that the drive does by itself.

use canopen::{Address, NodeId, Row};
use cia402::Mode;
use client::calibrate::{OwnCalibration, OwnError, StatusWords};
use client::{Client, Value};
use personalities::Personality;
use personalities::commissioning::{OwnCalibration as Offered, SetUp};
use serde::Serialize;

use super::super::motor::{Common, Display, question};
use super::super::stop::Stop;
use crate::wire::WireLink;
use crate::{Failure, drive_kind, output, time_span};

/// Let the drive run a calibration of its own, as an MD80 does.
///
/// What it needs is set with --set and shown first. The drive stores what it finds by itself and starts
/// over, where its document says so; so the question comes before it begins. Ctrl-C ends it, and takes the
/// power away.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  servobus calibrate own --node 2 --dry-run          what it needs, and what is set; nothing is done
  servobus calibrate own --node 2 --set pole-pairs=21 --set torque-constant=0.091 --set bandwidth=500
  servobus calibrate own current-gains --node 2 --yes

The shaft must be free: it turns.")]
pub(super) struct OwnArguments {
    /// Which; a name that the drive does not have lists those it has. [default: its first one]
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// Set a parameter that it builds on before, by the name that --dry-run shows; may be given several
    /// times.
    #[arg(long, value_name = "NAME=VALUE", allow_hyphen_values = true)]
    set: Vec<String>,
    #[command(flatten)]
    pub(super) common: Common,
}

/// A parameter or a result, for programs.
#[derive(Debug, Serialize)]
struct Entry {
    index: u16,
    sub: u8,
    name: &'static str,
    unit: &'static str,
    value: f64,
}

impl Entry {
    fn columns(&self) -> [String; 4] {
        [
            Address::new(self.index, self.sub).to_string(),
            self.name.to_owned(),
            significant(self.value),
            self.unit.to_owned(),
        ]
    }
}

/// What came of it, for programs.
#[derive(Debug, Serialize)]
struct Outcome {
    node: u8,
    drive: &'static str,
    calibration: &'static str,
    set_up: Vec<Entry>,
    begun: bool,
    results: Vec<Entry>,
    /// The set bits of its status words.
    status: Vec<String>,
    stored: bool,
}

/// Runs it.
///
/// # Errors
/// Exit code 2 for names that the drive does not have, 1 if the calibration did not succeed.
pub(super) fn run(
    arguments: &OwnArguments,
    drive: Option<&'static Personality>,
) -> Result<(), Failure> {
    let node = arguments.common.node;
    let Some(drive) = drive else {
        return Err(Failure::unsuccessful(format!(
            "node {node} does not say that it is a drive that is known here; servobus scan tells who is \
             there"
        )));
    };
    run_named(
        &arguments.common,
        drive,
        arguments.name.as_deref(),
        &arguments.set,
    )
}

/// Runs the calibration of that name, or the drive's first one.
///
/// # Errors
/// As [`run`].
pub(super) fn run_named(
    common: &Common,
    drive: &'static Personality,
    name: Option<&str>,
    set: &[String],
) -> Result<(), Failure> {
    let job = Job {
        common,
        drive,
        offered: chosen(common.node, drive, name)?,
    };
    let settings: Result<Vec<Setting>, Failure> =
        set.iter().map(|text| job.setting(text)).collect();
    let settings = settings?;
    common.can_ask()?;
    let stop = Stop::watch()?;
    common.wire.run(async |connection| {
        let mut client = Client::new(WireLink::new(connection));
        client.settings.answer_ms = time_span::milliseconds(common.timeout);
        job.run(&mut client, &settings, &stop).await
    })
}

/// The calibration of that name.
fn chosen(
    node: NodeId,
    drive: &'static Personality,
    name: Option<&str>,
) -> Result<&'static Offered, Failure> {
    let all = drive.commissioning.calibrations;
    let found = match name {
        Some(name) => all.iter().find(|offered| offered.name == name),
        None => all.first(),
    };
    found.ok_or_else(|| match (all.is_empty(), drive.commissioning.calibrating) {
        (true, Some(offers)) => {
            Failure::unsuccessful(format!("node {node} is a {}: {offers}", drive.name))
        }
        (true, None) => Failure::unsuccessful(format!(
            "node {node} is a {}, which has no calibration of its own: servobus calibrate all --node \
             {node} does it step by step",
            drive.name
        )),
        (false, _) => {
            let names: Vec<&str> = all.iter().map(|offered| offered.name).collect();
            Failure::input(format!(
                "a {} has no calibration '{}'; it has {}",
                drive.name,
                name.unwrap_or(""),
                names.join(", ")
            ))
        }
    })
}

/// A value for a parameter.
struct Setting {
    object: Address,
    bytes: Vec<u8>,
}

/// A calibration of one drive.
struct Job<'a> {
    common: &'a Common,
    drive: &'static Personality,
    offered: &'static Offered,
}

impl Job<'_> {
    fn row(&self, object: Address) -> Option<&'static Row> {
        let table = &self.drive.device.table;
        let entry = table.find(object.index, object.sub).ok()?;
        table.row(&entry)
    }

    /// Reads `pole-pairs=21`.
    fn setting(&self, text: &str) -> Result<Setting, Failure> {
        let refused = |why: String| Failure::input(format!("--set {text}: {why}"));
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| refused("write NAME=VALUE, as in pole-pairs=21".to_owned()))?;
        let all = self.offered.set_up;
        let found = all.iter().find(|set_up| set_up.name == name);
        let row = found.and_then(|set_up| Some((set_up.object, self.row(set_up.object)?)));
        let (object, row) = row.ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|set_up| set_up.name).collect();
            refused(format!(
                "there is no such parameter; there are: {}",
                names.join(", ")
            ))
        })?;
        let data = Value::parse(value, row.data_type).and_then(|value| value.encode(row.data_type));
        let data = data.map_err(|error| refused(error.to_string()))?;
        Ok(Setting {
            object,
            bytes: data.bytes().to_vec(),
        })
    }

    async fn entry(
        &self,
        client: &mut Client<WireLink>,
        object: Address,
    ) -> Result<Entry, Failure> {
        let Some(row) = self.row(object) else {
            return Err(Failure::unsuccessful(format!(
                "{object} is no object of the drive"
            )));
        };
        let value = client.read(self.common.node, object, row.data_type).await;
        let value = match value.map_err(Failure::unsuccessful)? {
            Value::Integer(number) => number as f64,
            Value::Real(number) => f64::from(number),
            // Numbers decode to nothing else.
            Value::Text(_) => 0.0,
        };
        Ok(Entry {
            index: object.index,
            sub: object.sub,
            name: row.name,
            unit: row.unit,
            value,
        })
    }

    async fn entries(
        &self,
        client: &mut Client<WireLink>,
        objects: impl Iterator<Item = Address>,
    ) -> Result<Vec<Entry>, Failure> {
        let mut entries = Vec::new();
        for object in objects {
            entries.push(self.entry(client, object).await?);
        }
        Ok(entries)
    }

    async fn run(
        &self,
        client: &mut Client<WireLink>,
        settings: &[Setting],
        stop: &Stop,
    ) -> Result<(), Failure> {
        let (common, node) = (self.common, self.common.node);
        if !common.dry_run {
            for Setting { object, bytes } in settings {
                let written = client.download_all(node, *object, bytes).await;
                written.map_err(Failure::unsuccessful)?;
            }
        }
        let objects = self.offered.set_up.iter().map(|set_up| set_up.object);
        let set_up = self.entries(client, objects).await?;
        if !common.json {
            let (drive, name, what) = (self.drive.name, self.offered.name, self.offered.what);
            output::print(format!("node {node}, {drive}: {name} finds {what}"))?;
            output::print(self.set_up_table(&set_up))?;
        }
        // A dry run has written none of the settings.
        let is_given = |set_up: &SetUp| {
            let mut given = settings.iter().filter(|set| set.object == set_up.object);
            common.dry_run && given.any(|set| set.bytes.iter().any(|byte| *byte != 0))
        };
        let is_missing = |(set_up, entry): &(&SetUp, &Entry)| {
            set_up.needed && entry.value == 0.0 && !is_given(set_up)
        };
        let missing: Vec<&str> = self
            .offered
            .set_up
            .iter()
            .zip(&set_up)
            .filter(is_missing)
            .map(|(set_up, _)| set_up.name)
            .collect();
        if common.dry_run {
            let words = match missing.is_empty() {
                true => "all it needs is set".to_owned(),
                false => format!("it needs {}", missing.join(", ")),
            };
            return self.show(
                set_up,
                None,
                &format!("node {node}: nothing was done; {words}"),
            );
        }
        if !missing.is_empty() {
            let sets: Vec<String> = missing
                .iter()
                .map(|name| format!("--set {name}=VALUE"))
                .collect();
            return Err(Failure::unsuccessful(format!(
                "node {node}: not set: {}; add {} (nothing was begun)",
                missing.join(", "),
                sets.join(" ")
            )));
        }
        let stores = match self.offered.restarts {
            true => "stores what it finds by itself",
            false => "does not store what it finds",
        };
        if !common.yes {
            let asked = format!("the shaft will turn, and node {node} {stores}. Begin? [y/N] ");
            let says_yes = question::is_yes(&asked, stop, async || {
                let until = client.now().plus_ms(question::LOOK_MS);
                while client.receive(until).await?.is_some() {}
                Ok(())
            });
            let says_yes = says_yes
                .await
                .map_err(|why| why.failure(node, "nothing was begun"))?;
            if !says_yes {
                return self.show(set_up, None, &format!("node {node}: nothing was begun"));
            }
        }
        let own = OwnCalibration {
            command: self.offered.command,
            mode: Mode(self.offered.mode),
            probe: self.offered.probe,
            status: self.offered.status,
            failed: self.offered.failed,
            restarts: self.offered.restarts,
            longest_ms: 1000 * u64::from(self.offered.longest_s),
        };
        let mut display = Display::new(stop.clone());
        let done = client.run_own_calibration(node, &own, &mut display).await;
        display.clear();
        let status = done.map_err(|error| self.failed(&error))?;
        let results = self
            .entries(client, self.offered.results.iter().copied())
            .await?;
        if !common.json && !results.is_empty() {
            let mut table = output::table(&["object", "name", "value", "unit"]);
            table.add_rows(results.iter().map(Entry::columns));
            output::print(table.trim_fmt())?;
        }
        let end = match self.offered.restarts {
            true => format!("node {node}: calibrated; it has stored that and started over"),
            false => format!(
                "node {node}: calibrated, until the next reset; servobus sdo write --node {node} \
                 0x1010,1 save stores it"
            ),
        };
        self.show(set_up, Some((results, status)), &end)
    }

    /// The last words, or all of them for programs.
    fn show(
        &self,
        set_up: Vec<Entry>,
        done: Option<(Vec<Entry>, StatusWords)>,
        end: &str,
    ) -> Result<(), Failure> {
        let begun = done.is_some();
        let (results, status) = done.unwrap_or_default();
        let status: Vec<String> = status.iter().filter_map(|word| self.bits(word)).collect();
        if !self.common.json {
            for bits in status {
                output::print(format!("warning: {bits}"))?;
            }
            return output::print(end);
        }
        output::print_json(&Outcome {
            node: self.common.node.get(),
            drive: self.drive.name,
            calibration: self.offered.name,
            set_up,
            begun,
            results,
            status,
            stored: begun && self.offered.restarts,
        })
    }

    /// What it builds on.
    fn set_up_table(&self, entries: &[Entry]) -> String {
        let mut table = output::table(&["object", "name", "value", "unit", "--set"]);
        for (set_up, entry) in self.offered.set_up.iter().zip(entries) {
            let set = match set_up.needed {
                true => format!("{}, needed", set_up.name),
                false => set_up.name.to_owned(),
            };
            table.add_row(entry.columns().into_iter().chain([set]));
        }
        table.trim_fmt()
    }

    /// The set bits of a status word by name; `None` if there are none.
    fn bits(&self, &(object, word): &(Address, u32)) -> Option<String> {
        if word == 0 {
            return None;
        }
        let bits = drive_kind::words(self.drive).set_bits(object, word);
        Some(bits.unwrap_or_else(|| format!("{object} is 0x{word:08X}")))
    }

    fn failed(&self, error: &OwnError) -> Failure {
        let node = self.common.node;
        let safe = "it has left the mode, and the motor is without power";
        Failure::unsuccessful(match error {
            OwnError::Failed { status } => {
                let bits: Vec<String> = status.iter().filter_map(|word| self.bits(word)).collect();
                format!(
                    "node {node}: the calibration has failed: {}; nothing is stored ({safe})",
                    bits.join(", ")
                )
            }
            OwnError::Axis(error) => error.to_string(),
            OwnError::Sdo(error) => error.to_string(),
            error => format!("node {node}: {error} ({safe})"),
        })
    }
}

/// Six digits of a number, as people write it.
fn significant(value: f64) -> String {
    if value == 0.0 || value.fract() == 0.0 && value.abs() < 1e9 {
        return format!("{value}");
    }
    if value.abs() < 1e-3 {
        return format!("{value:.4e}");
    }
    let digits = (5.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (21.0, "21"),
            (0.0, "0"),
            (f64::from(0.091_f32), "0.091"),
            (f64::from(0.0853_f32), "0.0853"),
            (f64::from(2.85e-5_f32), "2.8500e-5"),
            (f64::from(1.0 / 9.0_f32), "0.111111"),
            (120_000.4, "120000"),
        ] {
            assert_eq!(significant(value), text);
        }
    }
}
