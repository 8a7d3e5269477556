//! Does what events say, and tells it in words.

use canopen::Instant;
use plant::{EncoderFault, Load, Plant, Short, SwitchName};

use super::acts::Act;
use super::event::Target;
use super::quantity::Quantity;
use super::runner::Doing;
use crate::bus::Bus;
use crate::drive::VirtualDrive;
use crate::place::Place;
use crate::wire_act::{Participant, WireAct, WireFault};

impl Doing {
    /// Does it; what it was, for people, once for each drive.
    pub(crate) fn perform(&self, bus: &mut Bus) -> Vec<String> {
        let told = |words: String| format!("{}: {words}", self.title);
        let participants: Vec<Participant> = match self.target {
            Target::Bus => return vec![told(self.upon_bus(bus))],
            Target::Outside => vec![Participant::Outside],
            Target::One(place) => vec![Participant::Drive(place)],
            Target::All => {
                let places = bus.drives().iter().map(VirtualDrive::place);
                places.map(Participant::Drive).collect()
            }
        };
        let (now, lasts_ns) = (bus.now(), self.lasts_ns);
        let mut words = Vec::new();
        for who in participants {
            if let Some((act, what)) = self.upon_participant(who) {
                let of = named(bus, who);
                words.push(told(format!("{of} {what}")));
                bus.act_now(act);
            } else if let Participant::Drive(place) = who
                && let Some(drive) = bus.drive_at(place)
            {
                words.push(told(self.act.upon_drive(drive, self.axis, now, lasts_ns)));
            }
        }
        words
    }

    fn upon_bus(&self, bus: &mut Bus) -> String {
        let for_ns = self.lasts_ns;
        match &self.act {
            Act::HoldSync(held) => {
                bus.hold_sync(*held);
                match held {
                    true => "SYNC from outside is held back".to_owned(),
                    false => "SYNC from outside passes again".to_owned(),
                }
            }
            Act::Wire(act) => {
                bus.act_now(*act);
                act.to_string()
            }
            Act::Flood { frame, every_ns } => {
                bus.act_now(WireAct::Flood {
                    frame: *frame,
                    every_ns: *every_ns,
                    for_ns,
                });
                let period = match every_ns {
                    0 => "back to back".to_owned(),
                    _ => format!("every {}", time(*every_ns)),
                };
                format!("a strange node sends {frame} {period} for {}", time(for_ns))
            }
            Act::Break(fault) => {
                let fault = *fault;
                bus.act_now(WireAct::Break { fault, for_ns });
                let level = match fault {
                    WireFault::Recessive => "recessive",
                    WireFault::Dominant => "dominant",
                };
                format!("the wire is {level} for {}", time(for_ns))
            }
            other => unreachable!("an act upon a drive: {other:?}"),
        }
    }

    /// What is done to the wire, and what that is for people, if the act is about somebody's
    /// connection.
    fn upon_participant(&self, who: Participant) -> Option<(WireAct, String)> {
        let for_ns = self.lasts_ns;
        Some(match &self.act {
            Act::HoldFrames => (
                WireAct::Hold { who, for_ns },
                format!("sends nothing for {}", time(for_ns)),
            ),
            Act::LoseFrames(frames) => (
                WireAct::Lose {
                    frames: *frames,
                    receiver: who,
                },
                format!("loses frames {frames}"),
            ),
            Act::Disconnect(true) => (WireAct::Disconnect(who), "is cut off".to_owned()),
            Act::Disconnect(false) => (WireAct::Connect(who), "is connected again".to_owned()),
            _ => return None,
        })
    }
}

fn named(bus: &Bus, who: Participant) -> String {
    match who {
        Participant::Drive(place) => {
            let drive = bus.drives().iter().find(|drive| drive.place() == place);
            drive.map_or_else(|| format!("drive {place}"), name)
        }
        Participant::Outside => "outside".to_owned(),
        Participant::Stranger => "the strange node".to_owned(),
    }
}

/// `node 5`, or `drive u1` if it has no node ID.
fn name(drive: &VirtualDrive) -> String {
    match drive.node() {
        Some(node) if Place::of_node(node) == drive.place() => format!("node {node}"),
        Some(node) => format!("node {node} (drive {})", drive.place()),
        None => format!("drive {}", drive.place()),
    }
}

impl Act {
    fn upon_drive(
        &self,
        drive: &mut VirtualDrive,
        axis: Option<u8>,
        now: Instant,
        lasts_ns: u64,
    ) -> String {
        let of = name(drive);
        match *self {
            Act::Stall => {
                let idle = drive.why_idle().unwrap_or_default();
                match drive.stall_until(now.plus_ns(lasts_ns)) {
                    true => format!("processor of {of} stalled for {}", time(lasts_ns)),
                    false => format!("processor of {of} is not stalled: it {idle}"),
                }
            }
            Act::Hang => {
                let idle = drive.why_idle().unwrap_or_default();
                match drive.hang(now) {
                    true => format!("processor of {of} hangs"),
                    false => format!("processor of {of} is not made to hang: it {idle}"),
                }
            }
            Act::Spoil { bytes, both } => {
                let seed = now.0 ^ u64::from(drive.place().number());
                match drive.spoil_store(bytes, both, seed) {
                    0 => format!("nothing is stored in {of} that could be spoiled"),
                    1 => format!("newest parameters stored in {of} spoiled"),
                    _ => format!("all parameters stored in {of} spoiled"),
                }
            }
            Act::CutSave(after) => {
                drive.cut_power_in_save(after, now.0);
                format!("power of {of} fails {after} steps into the next save")
            }
            _ => {
                let made = drive.all_made().to_vec();
                let number = drive.plants().len();
                let named = axis.map(|axis| usize::from(axis.max(1) - 1));
                let axes = match named {
                    Some(axis) => axis..(axis + 1).min(number),
                    // What the axes of a controller share.
                    None if self.is_shared() => 0..number,
                    None => 0..1,
                };
                let of = match named {
                    Some(axis) if number > 1 => format!("axis {} of {of}", axis + 1),
                    _ => of,
                };
                let worlds = drive.plants().iter_mut().zip(&made);
                let worlds = worlds.skip(axes.start).take(axes.len());
                let told: Vec<String> = worlds
                    .map(|(plant, made)| self.upon_world(plant, made, &of))
                    .collect();
                told.into_iter().next().unwrap_or_default()
            }
        }
    }

    /// Whether it is about a supply, which is that of all axes.
    pub(super) fn is_upon_supply(&self) -> bool {
        matches!(self, Act::MotorSupply(_) | Act::LogicSupply(_))
    }

    /// Whether all axes of a drive are meant unless one is named.
    fn is_shared(&self) -> bool {
        let temperature = matches!(self, Act::AmplifierTemperature(_) | Act::Ambient(_));
        temperature || self.is_upon_supply()
    }

    /// What the act does to a drive's world, which was `made` so.
    fn upon_world(&self, plant: &mut Plant<f32>, made: &plant::Parameters, of: &str) -> String {
        let shown = |quantity: Quantity, value: f32| quantity.format(f64::from(value));
        match *self {
            Act::MotorSupply(volts) => {
                let volts = volts.unwrap_or(made.supply_v);
                plant.set_supply_v(volts);
                format!(
                    "motor supply of {of} to {}",
                    shown(Quantity::Voltage, volts)
                )
            }
            Act::LogicSupply(volts) => {
                let volts = volts.unwrap_or(made.logic.supply_v);
                plant.set_logic_supply_v(volts);
                format!(
                    "logic supply of {of} to {}",
                    shown(Quantity::Voltage, volts)
                )
            }
            Act::Block(blocked) => {
                plant.set_blocked(blocked);
                let state = if blocked { "blocked" } else { "free" };
                format!("shaft of {of} {state}")
            }
            Act::LoadTorque(torque) => {
                plant.set_load_torque_nm(torque);
                format!("load torque of {of} to {}", shown(Quantity::Torque, torque))
            }
            Act::LoadInertia(inertia) => {
                let inertia_kgm2 = inertia.unwrap_or(made.load.inertia_kgm2);
                plant.set_load(&Load {
                    inertia_kgm2,
                    ..plant.parameters().load
                });
                let shown = Quantity::Inertia.format(inertia_kgm2);
                format!("load inertia of {of} to {shown}")
            }
            Act::LoadFriction(friction) => {
                let as_made = (made.load.coulomb_friction_nm, None);
                let (coulomb, viscous) = friction.unwrap_or(as_made);
                plant.set_load(&Load {
                    coulomb_friction_nm: coulomb,
                    viscous_friction_nms: viscous.unwrap_or(made.load.viscous_friction_nms),
                    ..plant.parameters().load
                });
                format!(
                    "load friction of {of} to {}",
                    Quantity::Torque.format(coulomb)
                )
            }
            Act::AmplifierTemperature(celsius) => {
                let celsius = celsius.unwrap_or(made.ambient_c);
                plant.set_amplifier_temperature_c(celsius);
                format!(
                    "amplifier of {of} at {}",
                    shown(Quantity::Temperature, celsius)
                )
            }
            Act::MotorTemperature(celsius) => {
                let celsius = celsius.unwrap_or(made.ambient_c);
                plant.set_motor_temperature_c(celsius);
                format!("motor of {of} at {}", shown(Quantity::Temperature, celsius))
            }
            Act::Ambient(celsius) => {
                let celsius = celsius.unwrap_or(made.ambient_c);
                plant.set_ambient_c(celsius);
                let shown = shown(Quantity::Temperature, celsius);
                format!("surroundings of {of} at {shown}")
            }
            Act::OpenPhase(phase, open) => {
                plant.set_open_phase(phase, open);
                let state = if open { "broken" } else { "mended" };
                format!("wire of phase {phase:?} of {of} {state}")
            }
            Act::Short(short) => {
                plant.set_short(short);
                match short {
                    Some(short) => format!("short circuit of {of}, {}", between(short)),
                    None => format!("short circuit of {of} over"),
                }
            }
            Act::Encoder(fault) => {
                plant.set_encoder_fault(fault);
                let state = match fault {
                    EncoderFault::None => "works",
                    EncoderFault::Stuck => "is stuck",
                    EncoderFault::NoAnswer => "gives no answer",
                    EncoderFault::BadParity => "answers with a wrong check sum",
                };
                format!("encoder of {of} {state}")
            }
            Act::BadAnswers(part) => {
                let part = part.unwrap_or(made.encoder.bad_answers);
                plant.set_bad_answers(part);
                let share = Quantity::Share.format(f64::from(part) * 100.0);
                format!("{share} of the encoder's answers of {of} are wrong")
            }
            Act::Magnet(millimetres) => {
                let millimetres = millimetres.unwrap_or(made.encoder.magnet_mm);
                plant.set_magnet_mm(millimetres);
                let shown = Quantity::Length.format(f64::from(millimetres) * 1e-3);
                format!("magnet of {of} {shown} from its sensor")
            }
            Act::Slip(turns) => {
                // Half a turn is the same to either side.
                plant.slip_magnet((turns * 4_294_967_296.0).round() as i64 as i32);
                let degrees = Quantity::Angle.format(turns * std::f64::consts::TAU);
                format!("magnet of {of} slipped by {degrees}")
            }
            Act::EncoderTurned(turned) => {
                plant.set_encoder_turned(turned);
                format!("encoder of {of} counts {}", direction(turned))
            }
            Act::OutputSilent(silent) => {
                plant.set_output_encoder_silent(silent);
                let state = if silent { "gives no answer" } else { "works" };
                format!("output encoder of {of} {state}")
            }
            Act::OutputTurned(turned) => {
                plant.set_output_encoder_turned(turned);
                format!("output encoder of {of} counts {}", direction(turned))
            }
            Act::OutputMagnet(millimetres) => {
                let as_made = made.output_encoder.map(|encoder| encoder.magnet_mm);
                let millimetres = millimetres.or(as_made).unwrap_or(1.0);
                plant.set_output_magnet_mm(millimetres);
                let shown = Quantity::Length.format(f64::from(millimetres) * 1e-3);
                format!("output magnet of {of} {shown} from its sensor")
            }
            Act::GateSupply(volts) => {
                plant.set_gate_supply_v(volts);
                match volts {
                    Some(volts) => {
                        let shown = shown(Quantity::Voltage, volts);
                        format!("gate supply of {of} to {shown}")
                    }
                    None => format!("gate supply of {of} as it should be"),
                }
            }
            Act::GateDriverTemperature(celsius) => {
                plant.set_gate_driver_temperature_c(celsius);
                match celsius {
                    Some(celsius) => {
                        let shown = shown(Quantity::Temperature, celsius);
                        format!("gate drivers of {of} at {shown}")
                    }
                    None => format!("gate drivers of {of} cool"),
                }
            }
            Act::GateDriverSilent(silent) => {
                plant.set_gate_driver_silent(silent);
                let state = if silent { "give no answer" } else { "answer" };
                format!("gate drivers of {of} {state}")
            }
            Act::Switch(switch, held) => {
                plant.hold_switch(switch, held);
                let state = match held {
                    Some(true) => "pressed",
                    Some(false) => "held released",
                    None => "left to the shaft",
                };
                let switch = match switch {
                    SwitchName::NegativeLimit => "negative limit",
                    SwitchName::PositiveLimit => "positive limit",
                    SwitchName::Home => "home",
                };
                format!("{switch} switch of {of} {state}")
            }
            Act::Input(bit, high) => {
                let levels = plant.signals().inputs & !(1 << bit);
                plant.set_inputs(levels | u32::from(high) << bit);
                let level = if high { "high" } else { "low" };
                format!("input {bit} of {of} {level}")
            }
            Act::Analog(number, volts) => {
                let mut all = plant
                    .signals()
                    .auxiliary_adc
                    .map(|adc| adc * (3.3 / 4095.0));
                if let Some(voltage) = all.get_mut(number) {
                    *voltage = volts;
                }
                plant.set_auxiliary_v(all);
                let shown = shown(Quantity::Voltage, volts);
                format!("analog input {} of {of} to {shown}", number + 1)
            }
            Act::TorqueOff(asked) => {
                plant.set_torque_off(asked);
                let state = if asked { "asked for" } else { "over" };
                format!("safe torque off of {of} {state}")
            }
            ref other => unreachable!("no act upon a drive's world: {other:?}"),
        }
    }
}

fn between(short: Short) -> String {
    match short {
        Short::BesidePhase(phase) => {
            let both: Vec<&str> = ["A", "B", "C"]
                .into_iter()
                .filter(|name| *name != format!("{phase:?}"))
                .collect();
            format!("phases {}", both.join(" and "))
        }
        Short::ToNegative(phase) => format!("phase {phase:?} to ground"),
        Short::ToPositive(phase) => format!("phase {phase:?} to the supply"),
    }
}

fn direction(turned: bool) -> &'static str {
    match turned {
        true => "the other way round",
        false => "as at the start",
    }
}

fn time(ns: u64) -> String {
    Quantity::Time.format(ns as f64 * 1e-9)
}
