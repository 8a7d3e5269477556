//! What a run shall be: the command line first, then the scenario, then what is usual.

use std::path::Path;

use ::sim::scenario::Scenario;
use ::sim::{BusSettings, Disturbance, DriveSettings, FlashFile, Place};
use can::BitRate;
use canopen::Instant;
use personalities::Personality;
use personalities::p3::P3;

use super::{Arguments, store_message};
use crate::{Failure, drive_kind, named_drives, scenario_file, time_span};

/// The drives that there are unless somebody says.
const USUAL_NODES: [u8; 3] = [1, 2, 3];

/// What a run shall be.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) drives: Vec<(Place, &'static Personality)>,
    pub(crate) bit_rate: BitRate,
    pub(crate) seed: u64,
    pub(crate) end: Instant,
    pub(crate) scenario: Option<Scenario>,
    /// Whether each drive's kind was given with its node.
    named: bool,
}

/// What the command line says of the drives.
#[derive(Debug, Default)]
struct Said {
    /// Each drive and its kind: `--node`.
    named: Vec<(Place, &'static Personality)>,
    /// Where drives are: `--nodes`.
    places: Option<Vec<Place>>,
    /// What they are: `--drive`.
    kind: Option<&'static Personality>,
}

impl Plan {
    /// The plan of a scenario alone.
    pub(crate) fn of_scenario(scenario: Scenario) -> Plan {
        Plan::new(Some(scenario), Said::default(), None, None, None)
    }

    /// The plan of these arguments.
    pub(super) fn of(arguments: &Arguments) -> Result<Plan, Failure> {
        let scenario = arguments.scenario.as_deref();
        let scenario = scenario.map(scenario_file::read).transpose()?;
        let end = arguments.time.map(|time| {
            let ns = time_span::nanoseconds(time);
            Instant::ZERO.plus_ns(ns)
        });
        let kind = arguments
            .drive
            .map(|drive| drive_kind::with_channels(drive, arguments.channels))
            .transpose()?;
        let doubled = [
            ("--nodes", arguments.nodes.is_some()),
            ("--drive", arguments.drive.is_some()),
        ];
        if let Some((option, _)) = doubled.iter().find(|(_, is_there)| *is_there)
            && !arguments.node.is_empty()
        {
            return Err(Failure::input(format!(
                "--node and {option} both say what the drives are; leave {option} out, or all --node"
            )));
        }
        let said = Said {
            named: named_drives::all(&arguments.node)?
                .into_iter()
                .map(|(node, kind)| (Place::of_node(node), kind))
                .collect(),
            places: arguments
                .nodes
                .as_ref()
                .map(|nodes| nodes.places().collect()),
            kind,
        };
        Ok(Plan::new(
            scenario,
            said,
            arguments.bit_rate,
            arguments.seed,
            end,
        ))
    }

    fn new(
        scenario: Option<Scenario>,
        command: Said,
        bit_rate: Option<BitRate>,
        seed: Option<u64>,
        end: Option<Instant>,
    ) -> Plan {
        let said = scenario.as_ref();
        let Said {
            named,
            places,
            kind,
        } = command;
        let places = places
            .or_else(|| {
                said.map(Scenario::places)
                    .filter(|places| !places.is_empty())
            })
            .unwrap_or_else(|| {
                let nodes = USUAL_NODES.iter().filter_map(|n| canopen::NodeId::new(*n));
                nodes.map(Place::of_node).collect()
            });
        let kind_of = |place| {
            let own = said.and_then(|scenario| scenario.personality_of(place));
            let all = said.and_then(|scenario| scenario.personality);
            own.or(kind).or(all).unwrap_or(&P3)
        };
        Plan {
            named: !named.is_empty(),
            drives: match named.is_empty() {
                false => named,
                true => places
                    .into_iter()
                    .map(|place| (place, kind_of(place)))
                    .collect(),
            },
            bit_rate: bit_rate
                .or(said.and_then(|scenario| scenario.bit_rate))
                .unwrap_or(BitRate::Mbit1),
            seed: seed
                .or(said.and_then(|scenario| scenario.seed))
                .unwrap_or(1),
            end: end
                .or(said.and_then(|scenario| scenario.length))
                .unwrap_or(Instant::NEVER),
            scenario,
        }
    }

    /// Refuses what the drives cannot be.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        for (place, drive) in &self.drives {
            self.check_drive(*place, drive)?;
        }
        Ok(())
    }

    fn check_drive(&self, place: Place, drive: &Personality) -> Result<(), Failure> {
        let name = drive.name;
        let others = |can: fn(&Personality, BitRate) -> bool| {
            let able = drive_kind::families();
            let able = able.iter().filter(|p| can(p, self.bit_rate));
            let words: Vec<String> = able
                .map(|p| match self.named {
                    true => format!("--node {place}={}", p.name),
                    false => format!("--drive {}", p.name),
                })
                .collect();
            words.join(" or ")
        };
        let has_rate = |drive: &Personality, rate| drive.bit_rates.contains(&rate);
        if !has_rate(drive, self.bit_rate) {
            let own: Vec<String> = drive.bit_rates.iter().map(BitRate::to_string).collect();
            return Err(Failure::input(format!(
                "{name} has {} only; for --bit-rate {} use {}",
                own.join(", "),
                self.bit_rate.word(),
                others(has_rate)
            )));
        }
        let ids = drive.node_ids();
        if let Some(node) = place.node()
            && !ids.contains(&node.get())
        {
            return Err(Failure::input(format!(
                "node {node} cannot be {name}: its node IDs are {} to {}; give it one of these, or make \
                 node {node} another drive",
                ids.start(),
                ids.end()
            )));
        }
        let has_lss = |drive: &Personality, _| drive.device.dialect.lss;
        if place.node().is_none() && !has_lss(drive, self.bit_rate) {
            return Err(Failure::input(format!(
                "{name} has no LSS, so a drive without a node ID could never get one; for --nodes \
                 unconfigured use {}",
                others(has_lss)
            )));
        }
        Ok(())
    }

    /// The bus, its drives' memories in `store` if that is given. With `factory`, drives that have stored
    /// nothing are as out of the box, also those that are delivered commissioned.
    ///
    /// # Errors
    /// Memories that cannot be read, and a scenario that these drives cannot play.
    pub(crate) fn settings(
        &self,
        disturbance: Disturbance,
        store: Option<&Path>,
        factory: bool,
    ) -> Result<BusSettings, Failure> {
        let drive = |(place, kind): &(Place, &'static Personality)| {
            let mut settings = DriveSettings::at(*place, kind);
            if factory {
                settings = settings.factory();
            }
            if let Some(folder) = store {
                let refused = |error| Failure::input(store_message(&error));
                let mut file = FlashFile::file(folder, kind.name, *place).map_err(refused)?;
                // Its first start: what it is delivered with.
                let delivered = settings.store.bytes();
                if file.bytes().is_empty() && !delivered.is_empty() {
                    file.replace(delivered.to_vec()).map_err(refused)?;
                }
                settings.store = file;
            }
            Ok(settings)
        };
        let drives: Result<Vec<DriveSettings>, Failure> = self.drives.iter().map(drive).collect();
        let mut settings = BusSettings {
            bit_rate: self.bit_rate,
            disturbance,
            ..BusSettings::new(self.seed, drives?)
        };
        if let Some(scenario) = &self.scenario {
            let set_up = scenario.set_up(&mut settings, self.end);
            set_up.map_err(|problems| scenario_file::refused(&problems))?;
        }
        Ok(settings)
    }
}
