//! Virtual drives as a transcript sees them: a link, and motors that can be looked at.

use can::Frame;
use canopen::{Instant, NodeId};
use client::transcript::{Physics, Reading};
use client::{Link, LinkError};
use sim::{Bus, VirtualLink};

/// The number under which the player is on the bus.
const CLIENT: u32 = 1;

/// A simulated bus in virtual time with its drives' motors.
#[derive(Debug)]
pub(crate) struct PlantBench<'a> {
    link: VirtualLink<'a>,
}

impl<'a> PlantBench<'a> {
    pub(crate) fn new(bus: &'a mut Bus) -> PlantBench<'a> {
        PlantBench {
            link: VirtualLink::new(bus, CLIENT),
        }
    }
}

/// The quantities that `docs/transcripts.md` lists.
const QUANTITIES: &[&str] = &["position", "speed", "current", "torque", "bus_voltage"];

impl Physics for PlantBench<'_> {
    fn quantity(&mut self, node: NodeId, name: &str) -> Reading {
        let Some(drive) = self.link.bus().drive(node) else {
            return Reading::UnknownNode;
        };
        let plant = drive.plant();
        let (truth, parameters) = (plant.truth(), plant.parameters());
        let counts_per_turn = f64::from(parameters.encoder.counts_per_turn);
        let torque_nm = f64::from(truth.torque_nm);
        let (value, unit) = match name {
            "position" => (truth.position_turns() * counts_per_turn, "counts"),
            "speed" => {
                let turns_per_s = f64::from(truth.speed_rad_s) / std::f64::consts::TAU;
                (turns_per_s * counts_per_turn, "counts/s")
            }
            // The current that makes the torque; without saliency the other one makes none.
            "current" => {
                let constant = parameters.motor.torque_constant_nm_per_a();
                (torque_nm / constant, "A")
            }
            "torque" => (torque_nm, "Nm"),
            "bus_voltage" => (f64::from(truth.bus_voltage_v), "V"),
            _ => return Reading::UnknownQuantity { known: QUANTITIES },
        };
        Reading::Value { value, unit }
    }
}

impl Link for PlantBench<'_> {
    fn now(&self) -> Instant {
        self.link.now()
    }

    fn send(&mut self, frame: Frame) -> impl Future<Output = Result<(), LinkError>> {
        self.link.send(frame)
    }

    fn receive(
        &mut self,
        until: Instant,
    ) -> impl Future<Output = Result<Option<(Instant, Frame)>, LinkError>> {
        self.link.receive(until)
    }
}
