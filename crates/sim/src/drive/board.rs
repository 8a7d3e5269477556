//! What a board's parts say to the core, and what its lights show.

use personalities::board::{Board, GateDriver, Lights};
use plant::Plant;

use super::VirtualDrive;
use crate::notice::NoticeKind;

impl VirtualDrive {
    /// Lends the core what the parts of its board say.
    pub(super) fn look_at_board(&mut self) {
        let Some(core) = &mut self.core else { return };
        for (axis, plant) in self.plants.iter().enumerate() {
            core.look_at(axis, &board_of(plant));
        }
    }

    /// Tells of lights that do something else than before.
    pub(super) fn watch_lights(&mut self, notice: &mut impl FnMut(NoticeKind)) {
        let shown = self.core.as_ref().and_then(|core| core.lights());
        if let Some(lights) = shown
            && lights != self.lights
        {
            self.lights = lights;
            notice(NoticeKind::Lights(lights));
        }
    }

    /// What the lights of its board do; `None` if it has none, or boots.
    pub fn lights(&self) -> Option<Lights> {
        self.core.as_ref().and_then(|core| core.lights())
    }
}

fn board_of(plant: &Plant<f32>) -> Board {
    let words = plant.gate_driver();
    Board {
        gate_driver: GateDriver {
            fault_pin: words.fault_pin,
            status: words.status,
            control: words.control,
        },
        output_magnet: plant.output_magnet(),
    }
}
