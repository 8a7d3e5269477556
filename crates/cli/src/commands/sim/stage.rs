//! A simulated bus with its doors and its recording, moved through time.

use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant as RealTime};

use ::sim::{Bus, Disturbed, Happening, Injection, Pacer, Recording, Sender};
use bus::{Doors, Event};
use can::BitRate;
use canopen::Instant;

use super::guests::Guests;
use super::serial::Serial;
use crate::Failure;
use crate::commands::stop::Stop;
use crate::output::tell;

/// Simulated time that passes at most between two looks at the doors.
const SLICE_NS: u64 = 20_000_000;
/// How long a bus is looked at closely after something happened on it.
const LIVELY_NS: u64 = 3_000_000;
/// How often then, so that an answer reaches its asker soon after it was on the wire.
const CLOSE_LOOK: Duration = Duration::from_micros(100);
/// How often otherwise.
const LOOK: Duration = Duration::from_millis(1);
/// How long drives may boot before they are called ready without having booted.
const BOOT_NS: u64 = 100_000_000;
const BOOT_STEP_NS: u64 = 1_000_000;
/// Real time that simulated time may lag behind before it is let go.
const LAG: Duration = Duration::from_millis(250);
/// Simulated time between two samples of the drives, where they are recorded.
const SAMPLE_NS: u64 = 5_000_000;
/// How often what was recorded is written to the files.
const FLUSH: Duration = Duration::from_millis(500);

/// A recording and its place.
#[derive(Debug)]
pub(super) struct Log {
    path: PathBuf,
    recording: Recording,
    flushed: RealTime,
}

impl Log {
    pub(super) fn new(path: PathBuf, recording: Recording) -> Log {
        Log {
            path,
            recording,
            flushed: RealTime::now(),
        }
    }

    pub(super) fn write(
        &mut self,
        write: impl FnOnce(&mut Recording) -> std::io::Result<()>,
    ) -> Result<(), Failure> {
        write(&mut self.recording).map_err(|error| lost(&self.path, &error))
    }
}

fn lost(path: &std::path::Path, error: &std::io::Error) -> Failure {
    let path = path.display();
    Failure::input(format!(
        "{path}: cannot record any more: {error}; the simulation ends here"
    ))
}

/// What there was.
#[derive(Debug)]
pub(super) struct Summary {
    /// Times, frames and load, for people.
    pub(super) text: String,
    /// What was disturbed on the way to the bus, and from it.
    pub(super) disturbed: [Disturbed; 2],
}

/// A simulated bus with its doors and its recording.
#[derive(Debug)]
pub(super) struct Stage {
    bus: Bus,
    doors: Option<Doors>,
    serial: Option<Serial>,
    guests: Guests,
    log: Option<Log>,
    frames: u64,
    /// The bit rate that was last told.
    bit_rate: BitRate,
    /// When something last happened on the bus.
    lively_at: Option<Instant>,
}

impl Stage {
    pub(super) fn new(
        mut bus: Bus,
        doors: Option<Doors>,
        serial: Option<Serial>,
        log: Option<Log>,
    ) -> Stage {
        if log
            .as_ref()
            .is_some_and(|log| log.recording.takes_samples())
        {
            bus.probe_every(SAMPLE_NS);
        }
        Stage {
            bit_rate: bus.bit_rate(),
            bus,
            doors,
            serial,
            guests: Guests::default(),
            log,
            frames: 0,
            lively_at: None,
        }
    }

    /// The bus as it is now.
    pub(super) fn bus(&self) -> &Bus {
        &self.bus
    }

    /// Lets the drives boot, without pacing, so that whoever is told that they are ready is not
    /// ignored by a drive that is still booting.
    pub(super) fn boot(&mut self, end: Instant) -> Result<(), Failure> {
        let end = end.min(self.bus.now().plus_ns(BOOT_NS));
        let booting = |bus: &Bus| bus.drives().iter().any(|drive| drive.is_booting());
        while self.bus.now() < end && booting(&self.bus) {
            self.advance(end.min(self.bus.now().plus_ns(BOOT_STEP_NS)))?;
        }
        Ok(())
    }

    /// Moves time on as fast as it can be computed.
    pub(super) fn run_fast(&mut self, end: Instant, stop: &Stop) -> Result<(), Failure> {
        while self.bus.now() < end && !stop.asked() {
            self.advance(end.min(self.bus.now().plus_ns(SLICE_NS)))?;
        }
        Ok(())
    }

    /// Moves time on at `speed` times real time, and lets programs in and out.
    pub(super) fn run_paced(
        &mut self,
        speed: f64,
        end: Instant,
        stop: &Stop,
    ) -> Result<(), Failure> {
        let mut pacer = Pacer::start(speed, self.bus.now());
        let mut pace = Pace::new(speed, self.bus.now());
        while !stop.asked() {
            let wanted = pacer.now().min(end);
            let until = wanted.min(self.bus.now().plus_ns(SLICE_NS));
            self.advance(until)?;
            self.admit()?;
            if until >= end {
                break;
            }
            if pace.is_lost(self.bus.now(), pacer.now()) {
                pacer = Pacer::start(speed, self.bus.now());
            } else if until == wanted {
                self.wait(&pacer);
            }
        }
        Ok(())
    }

    /// Sleeps until it is time to look again, or somebody at a door has something.
    fn wait(&mut self, pacer: &Pacer) {
        let now = self.bus.now();
        let lively = self.bus.outside_waiting() > 0
            || self
                .lively_at
                .is_some_and(|at| now.since_ns(at) < LIVELY_NS);
        let longest = if lively { CLOSE_LOOK } else { LOOK };
        // At a high speed the next slice is due earlier.
        let due = pacer.wait_for(now.plus_ns(SLICE_NS));
        let pause = longest.min(due);
        match &mut self.doors {
            Some(doors) => doors.wait(pause),
            None => thread::sleep(pause),
        }
    }

    /// Moves time to `until` and passes on what happened.
    fn advance(&mut self, until: Instant) -> Result<(), Failure> {
        self.bus.run_until(until);
        let mut samples = self.bus.take_samples().into_iter().peekable();
        for happening in self.bus.take_happenings() {
            let traffic = match happening {
                Happening::Frame(traffic) => traffic,
                Happening::Notice(notice) => {
                    if let Some(log) = &mut self.log {
                        log.write(|recording| recording.notice(&notice))?;
                    }
                    if let Some(doors) = &mut self.doors {
                        doors.note(&notice.to_string(), notice.at.0);
                    }
                    tell(notice);
                    continue;
                }
                Happening::Error(_) => {
                    if let Some(log) = &mut self.log {
                        log.write(|recording| recording.happening(&happening))?;
                    }
                    continue;
                }
            };
            self.frames += 1;
            self.lively_at = Some(traffic.at);
            if let Some(log) = &mut self.log {
                while let Some(sample) = samples.next_if(|sample| sample.at <= traffic.at) {
                    log.write(|recording| recording.sample(&sample))?;
                }
                log.write(|recording| recording.frame(&traffic))?;
            }
            let Some(doors) = &mut self.doors else {
                continue;
            };
            let sender = match traffic.sender {
                // Without copies it was good for others only, and is sent again.
                Sender::Outside(_) if traffic.copies == 0 => None,
                Sender::Outside(number) => self.guests.sent(number, doors),
                Sender::Drive(_) | Sender::Stranger => None,
            };
            for _ in 0..traffic.copies {
                doors.deliver(&traffic.frame, traffic.at.0, sender);
            }
        }
        let dropped = self.bus.take_dropped();
        if let Some(doors) = &mut self.doors {
            // They wait no longer, so others may come.
            for number in dropped {
                self.guests.sent(number, doors);
            }
        }
        if let Some(doors) = &mut self.doors
            && self.bus.outside_waiting() == 0
        {
            self.guests.all_sent(doors);
        }
        if let Some(serial) = &mut self.serial
            && serial.deliver(&mut self.bus, &mut self.log)?
        {
            self.lively_at = Some(self.bus.now());
        }
        if let Some(log) = &mut self.log {
            for sample in samples {
                log.write(|recording| recording.sample(&sample))?;
            }
        }
        if self.bus.bit_rate() != self.bit_rate {
            self.bit_rate = self.bus.bit_rate();
            tell(format_args!(
                "the bus has {} now, as an LSS master said; outside programs follow",
                self.bit_rate
            ));
        }
        if let Some(log) = &mut self.log
            && log.flushed.elapsed() >= FLUSH
        {
            log.flushed = RealTime::now();
            log.write(Recording::flush)?;
        }
        Ok(())
    }

    /// Takes what happened at the doors; frames get onto the bus from the present time on.
    fn admit(&mut self) -> Result<(), Failure> {
        if let Some(serial) = &mut self.serial
            && serial.admit(&mut self.bus, &mut self.log)?
        {
            self.lively_at = Some(self.bus.now());
        }
        let Some(doors) = &mut self.doors else {
            return Ok(());
        };
        let common = self.bus.bit_rate();
        while let Some(event) = doors.take() {
            match event {
                Event::Joined {
                    client,
                    door,
                    peer,
                    listen_only,
                    bit_rate,
                } => {
                    self.guests.join(client, doors, door, &peer, listen_only);
                    self.guests.check_rate(client, bit_rate, common);
                }
                Event::Left { client, reason } => self.guests.leave(client, &reason),
                Event::Refused { door, peer, reason } => {
                    self.guests.refuse(doors, door, &peer, &reason);
                }
                Event::Trouble { door, trouble } => self.guests.trouble(doors, door, &trouble),
                Event::Frame { client: id, frame } => {
                    let Some(client) = self.guests.sends(id) else {
                        continue;
                    };
                    let at = self.bus.now();
                    // Of frames that come at one instant the first gets the wire if it is free, as
                    // in a replay, which hands them over one by one.
                    self.bus.run_until(at);
                    if let Some(log) = &mut self.log {
                        log.write(|recording| {
                            recording.injection(&Injection { at, client, frame })
                        })?;
                    }
                    if self.bus.send(client, frame) == 0 {
                        // It is lost, and another may come.
                        self.guests.sent(client, doors);
                    }
                    self.lively_at = Some(at);
                }
            }
        }
        Ok(())
    }

    /// Ends the recording and says what there was.
    pub(super) fn finish(self, real: Duration) -> Result<Summary, Failure> {
        let now = self.bus.now();
        if let Some(log) = self.log {
            let finished = log.recording.finish(now);
            finished.map_err(|error| lost(&log.path, &error))?;
        }
        let simulated = now.seconds();
        let real = real.as_secs_f64();
        let frames = self.frames;
        let load = match now.0 {
            0 => 0.0,
            ns => 100.0 * self.bus.busy_ns() as f64 / ns as f64,
        };
        let text = format!(
            "simulated {simulated:.3} s in {real:.3} s, {:.2} times real time; {frames} frames, bus \
             load {load:.2} %",
            simulated / real
        );
        Ok(Summary {
            text,
            disturbed: self.bus.disturbed(),
        })
    }
}

/// Whether the machine keeps pace.
#[derive(Debug)]
struct Pace {
    speed: f64,
    /// When simulated time was last where it should be: in reality, and in the simulation.
    kept: (RealTime, Instant),
    warned: bool,
}

impl Pace {
    fn new(speed: f64, now: Instant) -> Pace {
        Pace {
            speed,
            kept: (RealTime::now(), now),
            warned: false,
        }
    }

    /// Whether so much time has been lost that it should be given up, rather than made up for by
    /// running too fast later. Warns once.
    fn is_lost(&mut self, now: Instant, wanted: Instant) -> bool {
        let lag_ns = wanted.since_ns(now) as f64 / self.speed;
        if lag_ns < SLICE_NS as f64 {
            self.kept = (RealTime::now(), now);
        }
        if lag_ns < LAG.as_nanos() as f64 {
            return false;
        }
        if !self.warned {
            self.warned = true;
            let (kept_real, kept) = self.kept;
            let took = kept_real.elapsed().as_secs_f64();
            let ratio = now.since_ns(kept) as f64 * 1e-9 / self.speed / took;
            tell(format_args!(
                "warning: this machine cannot keep the pace: for {took:.2} s simulated time ran at \
                 {ratio:.2} of the speed asked for, and it falls behind; use fewer drives, a lower \
                 --speed, or a release build"
            ));
        }
        self.kept = (RealTime::now(), now);
        true
    }
}
