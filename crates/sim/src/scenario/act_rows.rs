//! The acts: one row each.

use can::{ExtendedId, Frame, StandardId};
use plant::{EncoderFault, Phase, Short, SwitchName};

use super::acts::{Act, ActKind, Lasting, Object};
use super::arguments::{Argument, Arguments, Kind, number, optional, required};
use super::quantity::Quantity;
use crate::wire_act::{BitPlace, WireAct, WireFault};

const VOLTAGE: Argument = required("to", number(Quantity::Voltage, 0.0, 1e3), "The voltage.");
const TEMPERATURE: Argument = required(
    "to",
    number(Quantity::Temperature, -273.15, 1000.0),
    "The temperature.",
);
const PHASE: Argument = required("phase", Kind::Word(&["A", "B", "C"]), "Which phase.");
const SWITCH: Argument = required(
    "switch",
    Kind::Word(&["negative-limit", "positive-limit", "home"]),
    "Which switch; the drive must have it (see `[drive.N.switches]`).",
);
const FRAMES: Argument = required("frames", Kind::Frames, "Which frames.");
const SKIP: Argument = optional(
    "skip",
    COUNT,
    "So many of them are left alone first; 0 if it does not say.",
);
const COUNT_OF: Argument = optional(
    "count",
    ONE_OR_MORE,
    "So many are meant then; 1 if it does not say.",
);
const SEEN_BY: Argument = optional(
    "seen_by",
    Kind::Participant,
    "Who reads the bit so, sender included; everybody if it does not say.",
);
const COUNT: Kind = Kind::Whole {
    least: 0,
    most: 1_000_000,
};
const ONE_OR_MORE: Kind = Kind::Whole {
    least: 1,
    most: 1_000_000,
};

/// An act upon a drive.
const fn of_drive(
    name: &'static str,
    what: &'static str,
    thing: &'static str,
    lasting: Lasting,
    arguments: &'static [Argument],
    build: fn(&Arguments) -> Act,
) -> ActKind {
    ActKind {
        name,
        what,
        thing,
        object: Object::Drive,
        lasting,
        arguments,
        build,
    }
}

/// An act upon the bus.
const fn of_bus(
    name: &'static str,
    what: &'static str,
    thing: &'static str,
    lasting: Lasting,
    arguments: &'static [Argument],
    build: fn(&Arguments) -> Act,
) -> ActKind {
    ActKind {
        name,
        what,
        thing,
        object: Object::Bus,
        lasting,
        arguments,
        build,
    }
}

/// An act upon a drive's connection to the bus, or that of the outside programs.
const fn of_participant(
    name: &'static str,
    what: &'static str,
    thing: &'static str,
    lasting: Lasting,
    arguments: &'static [Argument],
    build: fn(&Arguments) -> Act,
) -> ActKind {
    ActKind {
        name,
        what,
        thing,
        object: Object::Participant,
        lasting,
        arguments,
        build,
    }
}

/// All of them.
#[rustfmt::skip]
pub const ACTS: &[ActKind] = &[
    of_drive("motor-supply", "Sets the motor supply.", "the motor supply",
        Lasting::Until("restore-motor-supply"), &[VOLTAGE],
        |given| Act::MotorSupply(Some(given.number("to") as f32))),
    of_drive("cut-motor-supply", "Disconnects the motor supply. The processor stays alive.",
        "the motor supply", Lasting::Until("restore-motor-supply"), &[],
        |_| Act::MotorSupply(Some(0.0))),
    of_drive("restore-motor-supply", "Sets the motor supply back to what the drive began with.",
        "the motor supply", Lasting::Once, &[],
        |_| Act::MotorSupply(None)),
    of_drive("logic-supply", "Sets the logic supply. Below its least voltage the processor is off; it boots when enough returns.",
        "the logic supply", Lasting::Until("restore-logic-supply"), &[VOLTAGE],
        |given| Act::LogicSupply(Some(given.number("to") as f32))),
    of_drive("cut-logic-supply", "Switches the logic supply off.", "the logic supply",
        Lasting::Until("restore-logic-supply"), &[],
        |_| Act::LogicSupply(Some(0.0))),
    of_drive("restore-logic-supply", "Sets the logic supply back to what the drive began with.",
        "the logic supply", Lasting::Once, &[],
        |_| Act::LogicSupply(None)),
    of_drive("block-shaft", "Holds the shaft where it is.", "the shaft",
        Lasting::Until("free-shaft"), &[],
        |_| Act::Block(true)),
    of_drive("free-shaft", "Lets the shaft go.", "the shaft", Lasting::Once, &[],
        |_| Act::Block(false)),
    of_drive("load-torque", "Sets the torque of the load.", "the load's torque",
        Lasting::Until("remove-load-torque"),
        &[required("to", number(Quantity::Torque, -1e3, 1e3), "The torque; positive opposes positive rotation.")],
        |given| Act::LoadTorque(given.number("to") as f32)),
    of_drive("remove-load-torque", "Sets the torque of the load to 0.", "the load's torque",
        Lasting::Once, &[],
        |_| Act::LoadTorque(0.0)),
    of_drive("load-inertia", "Changes the inertia of the load.", "the load's inertia",
        Lasting::Until("restore-load-inertia"),
        &[required("to", number(Quantity::Inertia, 0.0, 1e3), "The inertia.")],
        |given| Act::LoadInertia(Some(given.number("to")))),
    of_drive("restore-load-inertia", "Sets the inertia of the load back to what it was at the start.",
        "the load's inertia", Lasting::Once, &[],
        |_| Act::LoadInertia(None)),
    of_drive("load-friction", "Changes the friction of the load.", "the load's friction",
        Lasting::Until("restore-load-friction"),
        &[
            required("to", number(Quantity::Torque, 0.0, 1e3), "The Coulomb friction."),
            optional("viscous", number(Quantity::ViscousFriction, 0.0, 1e3), "The friction per speed; as it was at the start if it does not say."),
        ],
        |given| Act::LoadFriction(Some((given.number("to"), given.maybe_number("viscous"))))),
    of_drive("restore-load-friction", "Sets the friction of the load back to what it was at the start.",
        "the load's friction", Lasting::Once, &[],
        |_| Act::LoadFriction(None)),
    of_drive("heat-amplifier", "Sets the temperature of the amplifier; from there it cools down or warms up.",
        "the amplifier's temperature", Lasting::Until("cool-amplifier"), &[TEMPERATURE],
        |given| Act::AmplifierTemperature(Some(given.number("to") as f32))),
    of_drive("cool-amplifier", "Sets the temperature of the amplifier to that of the surroundings.",
        "the amplifier's temperature", Lasting::Once, &[],
        |_| Act::AmplifierTemperature(None)),
    of_drive("heat-motor", "Sets the temperature of the motor, winding and housing; from there it cools down or warms up.",
        "the motor's temperature", Lasting::Until("cool-motor"), &[TEMPERATURE],
        |given| Act::MotorTemperature(Some(given.number("to") as f32))),
    of_drive("cool-motor", "Sets the temperature of the motor to that of the surroundings.",
        "the motor's temperature", Lasting::Once, &[],
        |_| Act::MotorTemperature(None)),
    of_drive("heat-surroundings", "Sets the temperature of the surroundings.",
        "the surroundings", Lasting::Until("restore-surroundings"), &[TEMPERATURE],
        |given| Act::Ambient(Some(given.number("to") as f32))),
    of_drive("restore-surroundings", "Sets it back to what it was at the start.",
        "the surroundings", Lasting::Once, &[],
        |_| Act::Ambient(None)),
    of_drive("open-phase", "A wire of the motor breaks.", "the phase's wire",
        Lasting::Until("close-phase"), &[PHASE],
        |given| Act::OpenPhase(phase(given), true)),
    of_drive("close-phase", "The wire is mended.", "the phase's wire", Lasting::Once, &[PHASE],
        |given| Act::OpenPhase(phase(given), false)),
    of_drive("short-circuit", "A short circuit between two wires of the motor, or to a rail of the supply.",
        "the short circuit", Lasting::Until("end-short-circuit"),
        &[required("between", Kind::Word(&["A-B", "B-C", "A-C", "A-ground", "B-ground", "C-ground", "A-supply", "B-supply", "C-supply"]), "Between what.")],
        |given| Act::Short(Some(short(given.word("between"))))),
    of_drive("end-short-circuit", "The short circuit ends.", "the short circuit", Lasting::Once, &[],
        |_| Act::Short(None)),
    of_drive("break-encoder", "The encoder fails.", "the encoder", Lasting::Until("mend-encoder"),
        &[required("how", Kind::Word(&["stuck", "no-answer", "wrong-parity"]), "It always answers with the same angle, or not at all, or each answer has a wrong check sum.")],
        |given| Act::Encoder(match given.word("how") {
            "stuck" => EncoderFault::Stuck,
            "no-answer" => EncoderFault::NoAnswer,
            _ => EncoderFault::BadParity,
        })),
    of_drive("mend-encoder", "The encoder works again.", "the encoder", Lasting::Once, &[],
        |_| Act::Encoder(EncoderFault::None)),
    of_drive("bad-encoder-answers", "Some of the encoder's answers have a wrong check sum, as with noise on its cable.",
        "the encoder's answers", Lasting::Until("good-encoder-answers"),
        &[required("share", number(Quantity::Share, 0.0, 100.0), "How many of them.")],
        |given| Act::BadAnswers(Some((given.number("share") / 100.0) as f32))),
    of_drive("good-encoder-answers", "They are again as they were at the start.",
        "the encoder's answers", Lasting::Once, &[],
        |_| Act::BadAnswers(None)),
    of_drive("move-magnet", "Moves the encoder's magnet to another distance from its sensor. 1 mm is best; above 1.9 mm it is too weak, below 0.28 mm too strong, and above 4.1 mm the encoder finds no angle.",
        "the magnet's distance", Lasting::Until("restore-magnet"),
        &[required("to", number(Quantity::Length, 0.0, 1.0), "The distance.")],
        |given| Act::Magnet(Some((given.number("to") * 1e3) as f32))),
    of_drive("restore-magnet", "Moves it back to where it was at the start.", "the magnet's distance",
        Lasting::Once, &[],
        |_| Act::Magnet(None)),
    of_drive("slip-magnet", "Turns the encoder's magnet on the shaft: the electrical zero is elsewhere from then on.",
        "the magnet's angle", Lasting::Once,
        &[required("by", number(Quantity::Position, -0.5, 0.5), "The angle.")],
        |given| Act::Slip(given.number("by"))),
    of_drive("reverse-encoder", "The encoder counts the other way round, as if its direction bit had been turned: a turn of N counts reads N less what it was.",
        "the encoder's direction", Lasting::Until("restore-encoder-direction"), &[],
        |_| Act::EncoderTurned(true)),
    of_drive("restore-encoder-direction", "It counts again as it did at the start.",
        "the encoder's direction", Lasting::Once, &[],
        |_| Act::EncoderTurned(false)),
    of_drive("break-output-encoder", "The cable of the second encoder, on the output of a gear, is off; the drive must have one (see `encoder.output_gear`).",
        "the output encoder", Lasting::Until("mend-output-encoder"), &[],
        |_| Act::OutputSilent(true)),
    of_drive("mend-output-encoder", "The second encoder answers again.", "the output encoder", Lasting::Once, &[],
        |_| Act::OutputSilent(false)),
    of_drive("reverse-output-encoder", "The second encoder counts the other way round, as if its ring had been mounted anew with the other face ahead.",
        "the output encoder's direction", Lasting::Until("restore-output-encoder-direction"), &[],
        |_| Act::OutputTurned(true)),
    of_drive("restore-output-encoder-direction", "It counts again as it did at the start.",
        "the output encoder's direction", Lasting::Once, &[],
        |_| Act::OutputTurned(false)),
    of_drive("move-output-magnet", "Moves the second encoder's magnet to another distance from its sensor, with the limits of `move-magnet`.",
        "the output magnet's distance", Lasting::Until("restore-output-magnet"),
        &[required("to", number(Quantity::Length, 0.0, 1.0), "The distance.")],
        |given| Act::OutputMagnet(Some((given.number("to") * 1e3) as f32))),
    of_drive("restore-output-magnet", "Moves it back to where it was at the start.", "the output magnet's distance",
        Lasting::Once, &[],
        |_| Act::OutputMagnet(None)),
    of_drive("gate-supply", "Sets the voltage with which the gate drivers drive the bridge's switches, 12 V. Below 8 V they open the bridge and say so on their fault pin and in their status register; from 8.5 V on they drive again.",
        "the gate supply", Lasting::Until("restore-gate-supply"), &[VOLTAGE],
        |given| Act::GateSupply(Some(given.number("to") as f32))),
    of_drive("restore-gate-supply", "Sets it back to 12 V.", "the gate supply", Lasting::Once, &[],
        |_| Act::GateSupply(None)),
    of_drive("heat-gate-drivers", "Sets the temperature of the gate drivers. From 170 degC on they open the bridge and say so; below 150 degC they drive again.",
        "the gate drivers' temperature", Lasting::Until("cool-gate-drivers"), &[TEMPERATURE],
        |given| Act::GateDriverTemperature(Some(given.number("to") as f32))),
    of_drive("cool-gate-drivers", "They are cool again.", "the gate drivers' temperature", Lasting::Once, &[],
        |_| Act::GateDriverTemperature(None)),
    of_drive("cut-gate-driver-link", "The serial interface of the gate drivers does not answer any more: all that is read of it are ones. They drive all the same.",
        "the gate drivers' link", Lasting::Until("mend-gate-driver-link"), &[],
        |_| Act::GateDriverSilent(true)),
    of_drive("mend-gate-driver-link", "It answers again.", "the gate drivers' link", Lasting::Once, &[],
        |_| Act::GateDriverSilent(false)),
    of_drive("press-switch", "Presses a switch, wherever the shaft is.", "the switch",
        Lasting::Until("leave-switch"), &[SWITCH],
        |given| Act::Switch(switch(given), Some(true))),
    of_drive("release-switch", "Holds a switch released, wherever the shaft is.", "the switch",
        Lasting::Until("leave-switch"), &[SWITCH],
        |given| Act::Switch(switch(given), Some(false))),
    of_drive("leave-switch", "Leaves a switch to the shaft again.", "the switch", Lasting::Once, &[SWITCH],
        |given| Act::Switch(switch(given), None)),
    of_drive("set-input", "Sets the level of a digital input to which no switch is connected.",
        "the input", Lasting::Once,
        &[
            required("input", Kind::Word(&["negative-limit", "positive-limit", "home", "interlock", "1", "2", "3", "4"]), "Which input: bits 0 to 3 and 16 to 19 of 0x60FD."),
            required("level", Kind::Word(&["high", "low"]), "The level."),
        ],
        |given| Act::Input(input_bit(given.word("input")), given.word("level") == "high")),
    of_drive("analog-input", "Sets the voltage at an analog input.", "the analog input", Lasting::Once,
        &[
            required("input", Kind::Word(&["1", "2"]), "Which input."),
            required("to", number(Quantity::Voltage, 0.0, 3.3), "The voltage."),
        ],
        |given| Act::Analog(usize::from(given.word("input") == "2"), given.number("to") as f32)),
    of_drive("torque-off", "Safe torque off is asked for.", "safe torque off",
        Lasting::Until("torque-on"), &[],
        |_| Act::TorqueOff(true)),
    of_drive("torque-on", "Safe torque off is no longer asked for.", "safe torque off", Lasting::Once, &[],
        |_| Act::TorqueOff(false)),
    of_drive("stall-processor", "The processor handles no frame for some time; a controller whose FIFO of 16 frames is full loses those that follow (CAN overrun).",
        "the processor", Lasting::Stated, &[],
        |_| Act::Stall),
    of_drive("hang-processor", "The processor hangs: it hears nothing and computes nothing, and the bridge goes on with its last duties, until the watchdog resets it after 20 ms.",
        "the processor", Lasting::Once, &[],
        |_| Act::Hang),
    of_drive("spoil-store", "Flips a bit in some bytes of the stored parameters. The drive finds out when it starts.",
        "what is stored", Lasting::Once,
        &[
            optional("bytes", Kind::Whole { least: 1, most: 4096 }, "In how many bytes; 1 if it does not say."),
            optional("sets", Kind::Word(&["newest", "both"]), "The newest set, as if it does not say, or also the one stored before it."),
        ],
        |given| Act::Spoil {
            bytes: given.maybe_number("bytes").unwrap_or(1.0) as u32,
            both: given.word("sets") == "both",
        }),
    of_drive("cut-power-in-save", "Lets the logic supply fail for a moment in the middle of the next save of parameters, by 0x1010, 0x1011 or LSS.",
        "", Lasting::Once,
        &[required("steps", COUNT, "So many bytes are written and sectors erased before; a save that has fewer leaves the rest to the next one.")],
        |given| Act::CutSave(given.number("steps") as u64)),
    of_bus("stop-sync", "SYNC messages (0x080) of outside programs do not get onto the bus any more.",
        "SYNC", Lasting::Until("resume-sync"), &[],
        |_| Act::HoldSync(true)),
    of_bus("resume-sync", "SYNC messages of outside programs get onto the bus again.", "SYNC",
        Lasting::Once, &[],
        |_| Act::HoldSync(false)),
    of_bus("flip-bit", "A bit of a frame arrives as its opposite: the frame is destroyed by error flags and repeated.",
        "", Lasting::Once,
        &[
            FRAMES,
            required("bit", Kind::Bit, "Which, counted from start of frame with stuff bits, or by name."),
            SEEN_BY,
            SKIP,
            COUNT_OF,
        ],
        |given| flip(given, given.bit("bit"))),
    of_bus("duplicate-frames", "Flips the last bit of end of frame: receivers take the frame, and its sender repeats it.",
        "", Lasting::Once, &[FRAMES, SKIP, COUNT_OF],
        |given| flip(given, BitPlace::EndOfFrame(7))),
    of_participant("lose-frames", "One receiver's controller loses whole frames after it has acknowledged them.",
        "", Lasting::Once, &[FRAMES, SKIP, COUNT_OF],
        |given| Act::LoseFrames(given.which("frames"))),
    of_participant("hold-frames", "What it sends waits for some time before it takes part in arbitration.",
        "", Lasting::Stated, &[],
        |_| Act::HoldFrames),
    of_participant("disconnect", "Cuts it off from the bus: it hears nothing but itself, and nobody acknowledges what it sends.",
        "the connection", Lasting::Until("connect"), &[],
        |_| Act::Disconnect(true)),
    of_participant("connect", "Connects it again.", "the connection", Lasting::Once, &[],
        |_| Act::Disconnect(false)),
    of_bus("flood", "A node that is no drive sends a frame again and again.", "", Lasting::Stated,
        &[
            required("id", Kind::Whole { least: 0, most: 0x1FFF_FFFF }, "Identifier; of 29 bits above 0x7FF."),
            optional("data", Kind::Bytes, "Data; none if it does not say."),
            optional("period", number(Quantity::Time, 0.0, 3600.0), "From one frame to the next; back to back if it does not say."),
        ],
        |given| Act::Flood {
            frame: frame(given.number("id") as u32, &given.bytes("data")),
            every_ns: (given.maybe_number("period").unwrap_or(0.0) * 1e9).round() as u64,
        }),
    of_bus("break-bus", "The cable is broken: the wire is recessive or dominant whatever anybody sends.",
        "the cable", Lasting::Stated,
        &[required("level", Kind::Word(&["recessive", "dominant"]), "CAN_H and CAN_L touch, or one of them touches a supply.")],
        |given| Act::Break(match given.word("level") {
            "dominant" => WireFault::Dominant,
            _ => WireFault::Recessive,
        })),
];

fn phase(given: &Arguments) -> Phase {
    match given.word("phase") {
        "A" => Phase::A,
        "B" => Phase::B,
        _ => Phase::C,
    }
}

fn short(between: &str) -> Short {
    match between {
        "A-B" => Short::BesidePhase(Phase::C),
        "B-C" => Short::BesidePhase(Phase::A),
        "A-C" => Short::BesidePhase(Phase::B),
        "A-ground" => Short::ToNegative(Phase::A),
        "B-ground" => Short::ToNegative(Phase::B),
        "C-ground" => Short::ToNegative(Phase::C),
        "A-supply" => Short::ToPositive(Phase::A),
        "B-supply" => Short::ToPositive(Phase::B),
        _ => Short::ToPositive(Phase::C),
    }
}

fn switch(given: &Arguments) -> SwitchName {
    match given.word("switch") {
        "negative-limit" => SwitchName::NegativeLimit,
        "positive-limit" => SwitchName::PositiveLimit,
        _ => SwitchName::Home,
    }
}

/// The bit of 0x60FD.
fn input_bit(input: &str) -> u32 {
    match input {
        "negative-limit" => 0,
        "positive-limit" => 1,
        "home" => 2,
        "interlock" => 3,
        "1" => 16,
        "2" => 17,
        "3" => 18,
        _ => 19,
    }
}

fn flip(given: &Arguments, bit: BitPlace) -> Act {
    Act::Wire(WireAct::Flip {
        frames: given.which("frames"),
        bit,
        seen_by: given.participant("seen_by"),
    })
}

fn frame(id: u32, data: &[u8]) -> Frame {
    let standard = u16::try_from(id).ok().and_then(StandardId::new);
    let frame = match standard {
        Some(id) => Frame::data_frame(id, data),
        None => ExtendedId::new(id).and_then(|id| Frame::data_frame(id, data)),
    };
    frame.expect("an identifier of 29 bits and at most eight bytes")
}
