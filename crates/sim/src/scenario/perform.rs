//! Does what events say, and tells it in words.

use canopen::Instant;

use super::acts::Act;
use super::event::Target;
use super::quantity::Quantity;
use super::runner::Doing;
use crate::drive::VirtualDrive;
use crate::gateway::Gateway;

/// What events act upon.
#[derive(Debug)]
pub(crate) struct World<'a> {
    pub(crate) drives: &'a mut [VirtualDrive],
    pub(crate) gateway: &'a mut Gateway,
    pub(crate) now: Instant,
}

impl Doing {
    /// Does it; what it was, for people, once for each drive.
    pub(crate) fn perform(&self, world: &mut World<'_>) -> Vec<String> {
        let told = |words: String| format!("{}: {words}", self.title);
        if self.target == Target::Bus {
            return vec![told(self.act.upon_bus(world))];
        }
        let target = self.target;
        let (now, lasts_ns) = (world.now, self.lasts_ns);
        let meant = |drive: &&mut VirtualDrive| match target {
            Target::One(place) => drive.place() == place,
            Target::All => true,
            Target::Bus => false,
        };
        let drives = world.drives.iter_mut().filter(meant);
        drives
            .map(|drive| told(self.act.upon_drive(drive, now, lasts_ns)))
            .collect()
    }
}

impl Act {
    fn upon_bus(&self, world: &mut World<'_>) -> String {
        match self {
            Act::HoldSync(held) => {
                world.gateway.hold_sync(*held);
                match held {
                    true => "SYNC from outside is held back".to_owned(),
                    false => "SYNC from outside passes again".to_owned(),
                }
            }
            _ => unreachable!("an act upon a drive: {self:?}"),
        }
    }

    fn upon_drive(&self, drive: &mut VirtualDrive, now: Instant, lasts_ns: u64) -> String {
        let of = match drive.node() {
            Some(node) => format!("node {node}"),
            None => format!("drive {}", drive.place()),
        };
        let made = *drive.plant().parameters();
        let plant = drive.plant();
        match *self {
            Act::MotorSupply(volts) => {
                let volts = volts.unwrap_or(made.supply_v);
                plant.set_supply_v(volts);
                format!(
                    "motor supply of {of} to {}",
                    shown(Quantity::Voltage, volts)
                )
            }
            Act::Block(blocked) => {
                plant.set_blocked(blocked);
                match blocked {
                    true => format!("shaft of {of} blocked"),
                    false => format!("shaft of {of} free"),
                }
            }
            Act::LoadTorque(torque) => {
                plant.set_load_torque_nm(torque);
                format!("load torque of {of} to {}", shown(Quantity::Torque, torque))
            }
            Act::AmplifierTemperature(celsius) => {
                let celsius = celsius.unwrap_or(made.ambient_c);
                plant.set_amplifier_temperature_c(celsius);
                let shown = shown(Quantity::Temperature, celsius);
                format!("amplifier of {of} to {shown}")
            }
            Act::Stall => {
                drive.stall_until(now.plus_ns(lasts_ns));
                let time = Quantity::Time.format(lasts_ns as f64 * 1e-9);
                format!("processor of {of} stalled for {time}")
            }
            Act::HoldSync(_) => unreachable!("an act upon the bus: {self:?}"),
        }
    }
}

fn shown(quantity: Quantity, value: f32) -> String {
    quantity.format(f64::from(value))
}
