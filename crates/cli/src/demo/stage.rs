//! The stage on which the demo plays: the simulated bus, its recording, the dialogue, and what each
//! phase cost.

use std::cell::RefCell;
use std::io::{self, Write};
use std::path::Path;
use std::rc::Rc;

use canopen::{Instant, NodeId};
use client::decode::{Decoder, DriveWords};
use client::{Client, Observed, Seen, block_on};
use sim::{
    Bus, BusSettings, Extremes, Listener, Notice, Place, ProbeSample, Recording, RunHeader,
    VirtualLink,
};

use super::dialogue::Dialogue;

/// The demo's number as an outside program of the bus.
const CLIENT: u32 = 1;
/// How often the plants are looked at, for the plot.
const PROBE_NS: u64 = 1_000_000;

/// A stretch of the demo.
#[derive(Clone, Debug)]
pub(super) struct Phase {
    /// What happens in it.
    pub(super) title: &'static str,
    /// Its begin.
    pub(super) from: Instant,
    /// Its end.
    pub(super) to: Instant,
    /// Time for which the wire was busy, ns.
    busy_ns: u64,
    /// The largest values of each drive, in the order of node IDs.
    extremes: Vec<(NodeId, Extremes)>,
}

impl Phase {
    /// How much of the time the wire was busy, percent.
    pub(super) fn load_percent(&self) -> f64 {
        let length_ns = self.to.since_ns(self.from).max(1);
        100.0 * self.busy_ns as f64 / length_ns as f64
    }

    /// The largest values of `node`.
    pub(super) fn extremes(&self, node: NodeId) -> Extremes {
        let of = self.extremes.iter().find(|(drive, _)| *drive == node);
        of.map(|(_, extremes)| *extremes).unwrap_or_default()
    }
}

/// A master's way to the bus, every frame of which is shown.
pub(super) type Wire<'a> = Observed<VirtualLink<'a>, Box<dyn FnMut(Seen) + 'a>>;

pub(super) struct Stage<'w> {
    bus: Bus,
    recording: Option<Recording>,
    /// Shared with the link, which shows it every frame.
    pub(super) dialogue: Rc<RefCell<Dialogue<'w>>>,
    notices: Notices<'w>,
}

/// What is left when the play is over.
pub(super) struct Played {
    pub(super) samples: Vec<ProbeSample>,
    /// Where it ended.
    pub(super) end: Instant,
    /// Frames in the recording, if there is one.
    pub(super) recorded: Option<u64>,
    /// Whether the dialogue could be printed.
    pub(super) printed: io::Result<()>,
}

/// Says in the dialogue what people should know of.
struct Notices<'w>(Rc<RefCell<Dialogue<'w>>>);

impl Listener for Notices<'_> {
    fn hear(&self, notice: &Notice) {
        self.0.borrow_mut().say(&notice.to_string());
    }
}

impl<'w> Stage<'w> {
    /// A bus of these settings, at time 0, its drives with these words.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub(super) fn new(
        settings: BusSettings,
        words: DriveWords,
        record: Option<&Path>,
        output: &'w mut dyn Write,
    ) -> io::Result<Stage<'w>> {
        let recording = record
            .map(|path| Recording::create(path, &RunHeader::of(&settings)))
            .transpose()?;
        let mut bus = Bus::new(settings);
        bus.probe_every(PROBE_NS);
        let decoder = Decoder::with_words(words);
        let dialogue = Rc::new(RefCell::new(Dialogue::new(output, decoder)));
        Ok(Stage {
            bus,
            recording,
            notices: Notices(Rc::clone(&dialogue)),
            dialogue,
        })
    }

    /// A master at the bus, whose frames are recorded and shown.
    pub(super) fn client(&mut self) -> Client<Wire<'_>> {
        let mut link = VirtualLink::new(&mut self.bus, CLIENT).tell(&self.notices);
        if let Some(recording) = &mut self.recording {
            link = link.record(recording);
        }
        let dialogue = Rc::clone(&self.dialogue);
        let show = move |seen: Seen| dialogue.borrow_mut().see(&seen);
        Client::new(Observed::new(link, Box::new(show)))
    }

    /// Holds the shaft of `node`, or lets it go. This happens to the simulated world, not on the
    /// bus.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub(super) fn block(&mut self, node: NodeId, blocked: bool) -> io::Result<()> {
        let now = self.bus.now();
        if let Some(recording) = &mut self.recording {
            recording.block(now, Place::of_node(node), blocked)?;
        }
        if let Some(drive) = self.bus.drive(node) {
            drive.plant().set_blocked(blocked);
        }
        Ok(())
    }

    /// Plays one phase.
    pub(super) fn play<T>(
        &mut self,
        title: &'static str,
        scene: impl FnOnce(&mut Stage<'w>) -> T,
    ) -> (T, Phase) {
        let (from, busy_before) = (self.bus.now(), self.bus.busy_ns());
        self.take_extremes();
        let result = scene(self);
        let phase = Phase {
            title,
            from,
            to: self.bus.now(),
            busy_ns: self.bus.busy_ns() - busy_before,
            extremes: self.take_extremes(),
        };
        (result, phase)
    }

    fn take_extremes(&mut self) -> Vec<(NodeId, Extremes)> {
        let nodes: Vec<NodeId> = self.bus.drives().iter().filter_map(|d| d.node()).collect();
        nodes
            .into_iter()
            .filter_map(|node| Some((node, self.bus.drive(node)?.take_extremes())))
            .collect()
    }

    /// Ends the play.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub(super) fn finish(mut self) -> io::Result<Played> {
        let now = self.bus.now();
        // What came last is still to be written down and shown.
        let rest = async {
            let mut client = self.client();
            while client.receive(now).await?.is_some() {}
            Ok(())
        };
        block_on(rest).map_err(|error: client::LinkError| io::Error::other(error.to_string()))?;
        let samples = self.bus.take_samples();
        if let Some(recording) = &mut self.recording {
            for sample in &samples {
                recording.sample(sample)?;
            }
        }
        let recorded = self.recording.map(|recording| recording.finish(now));
        drop(self.notices);
        let printed = match Rc::try_unwrap(self.dialogue) {
            Ok(dialogue) => dialogue.into_inner().finish(),
            // Every client, and with it every other owner, is gone.
            Err(_) => Ok(()),
        };
        Ok(Played {
            samples,
            end: now,
            recorded: recorded.transpose()?,
            printed,
        })
    }
}
