//! A virtual drive's serial line: its command line, and the time that bytes take on the wire.

use std::collections::VecDeque;

use canopen::Instant;
use personalities::Personality;
use personalities::serial::{CommandLine, SerialPort};

use crate::Bus;
use crate::drive::VirtualDrive;
use crate::place::Place;

/// Bytes that may be on their way to a drive, or wait for it.
const ROOM: usize = 4096;

/// What happens at the outer end of a drive's serial line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SerialAct {
    /// These bytes are sent to the drive.
    Bytes(Vec<u8>),
    /// Who was there has gone; what it sent still comes first.
    HangUp,
}

/// A byte that a drive has sent over its serial line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SerialByte {
    /// When its last bit was on the wire.
    pub at: Instant,
    /// Which drive.
    pub place: Place,
    /// What.
    pub byte: u8,
}

/// The line. Bytes to the drive come one after the other, as the bit rate lets them, and wait outside
/// while the command line is not ready: between the simulation and a program nothing is lost.
#[derive(Debug)]
pub(crate) struct SerialLine {
    port: &'static SerialPort,
    channels: u8,
    /// `None` while no program runs that would hear.
    commands: Option<CommandLine>,
    /// What is on its way to the drive: bytes, and `None` where who sent them has gone. Never begins
    /// with that.
    coming: VecDeque<Option<u8>>,
    /// How many of these have gone: what the drive sends meanwhile nobody hears.
    gone: usize,
    /// When the first byte has come.
    comes_at: Instant,
    /// On the wire from the drive, and until when.
    going: Option<(u8, Instant)>,
    sent: Vec<(Instant, u8)>,
}

impl SerialLine {
    /// That of a drive which has one.
    pub(crate) fn of(personality: &Personality) -> Option<SerialLine> {
        Some(SerialLine {
            port: personality.serial?,
            channels: u8::try_from(personality.axes.len()).unwrap_or(u8::MAX),
            commands: None,
            coming: VecDeque::new(),
            gone: 0,
            comes_at: Instant::NEVER,
            going: None,
            sent: Vec::new(),
        })
    }

    /// The program has started.
    pub(crate) fn start(&mut self) {
        self.commands = Some(CommandLine::new(self.port.commands, self.channels));
    }

    /// The program is gone, and with it what was on the wire.
    pub(crate) fn stop(&mut self) {
        self.commands = None;
        self.coming.clear();
        self.gone = 0;
        self.comes_at = Instant::NEVER;
        self.going = None;
    }

    /// What was to be stored is, or cannot be.
    pub(crate) fn stored(&mut self, done: bool) {
        if let Some(commands) = &mut self.commands {
            commands.stored(done);
        }
    }

    fn act(&mut self, act: &SerialAct, now: Instant) {
        // A drive that does not run hears nothing.
        let Some(commands) = &mut self.commands else {
            return;
        };
        match act {
            SerialAct::Bytes(bytes) => {
                if self.coming.is_empty() && !bytes.is_empty() {
                    self.comes_at = now.plus_ns(self.port.byte_ns());
                }
                self.coming.extend(bytes.iter().map(|byte| Some(*byte)));
            }
            SerialAct::HangUp if self.coming.is_empty() => {
                commands.hang_up();
                self.going = None;
                self.sent.clear();
            }
            SerialAct::HangUp => {
                self.coming.push_back(None);
                self.gone += 1;
                self.sent.clear();
            }
        }
    }

    fn is_ready(&self) -> bool {
        self.commands.as_ref().is_some_and(CommandLine::is_ready)
    }

    /// When [`VirtualDrive::poll_serial`] must be called next.
    pub(crate) fn next_deadline(&self) -> Instant {
        let Some(commands) = &self.commands else {
            return Instant::NEVER;
        };
        let mut next = commands.next_deadline();
        match self.going {
            Some((_, until)) => next = next.min(until),
            None if !commands.is_silent() => return Instant::ZERO,
            None => {}
        }
        if self.is_ready() {
            next = next.min(self.comes_at);
        }
        next
    }
}

impl VirtualDrive {
    /// Does what is due at the serial line.
    pub(crate) fn poll_serial(&mut self, now: Instant) {
        let (Some(line), Some(core)) = (&mut self.serial_line, &mut self.core) else {
            return;
        };
        let Some(commands) = &mut line.commands else {
            return;
        };
        if let Some((byte, until)) = line.going
            && now >= until
        {
            if line.gone == 0 {
                line.sent.push((now, byte));
            }
            line.going = None;
        }
        let is_due = now >= commands.next_deadline();
        let comes = now >= line.comes_at && commands.is_ready();
        if is_due || comes {
            let mut objects = core.local(now, self.store.at(now));
            if is_due {
                commands.poll(now, &mut objects);
            }
            if comes && commands.is_ready() {
                if let Some(Some(byte)) = line.coming.pop_front() {
                    commands.receive(byte, now, &mut objects);
                }
                while let Some(None) = line.coming.front() {
                    line.coming.pop_front();
                    line.gone = line.gone.saturating_sub(1);
                    commands.hang_up();
                    line.going = None;
                }
                line.comes_at = match line.coming.is_empty() {
                    true => Instant::NEVER,
                    false => now.plus_ns(line.port.byte_ns()),
                };
            }
        }
        if line.going.is_none()
            && let Some(byte) = commands.transmit()
        {
            line.going = Some((byte, now.plus_ns(line.port.byte_ns())));
        }
    }
}

impl Bus {
    /// Something happens at the outer end of the serial line of the drive at `place`, now. A drive that
    /// has no such line, or does not run, hears nothing of it. Call [`Bus::run_until`] with the present
    /// time before each call, as [`crate::replay()`] does.
    pub fn act_on_serial(&mut self, place: Place, act: &SerialAct) {
        let now = self.now();
        if let Some(drive) = self.drive_at(place)
            && let Some(line) = &mut drive.serial_line
        {
            line.act(act, now);
        }
    }

    /// How many bytes may be sent to that drive at present; 0 if it has no serial line.
    pub fn serial_room(&self, place: Place) -> usize {
        let drive = self.drives().iter().find(|drive| drive.place() == place);
        let line = drive.and_then(|drive| drive.serial_line.as_ref());
        line.map_or(0, |line| ROOM.saturating_sub(line.coming.len()))
    }

    /// What the drives have sent over their serial lines since the last call; that of each drive in
    /// order.
    pub fn take_serial(&mut self) -> Vec<SerialByte> {
        let mut all = Vec::new();
        for drive in self.drives_mut() {
            let place = drive.place();
            if let Some(line) = &mut drive.serial_line {
                let bytes = line.sent.drain(..);
                all.extend(bytes.map(|(at, byte)| SerialByte { at, place, byte }));
            }
        }
        all
    }
}
