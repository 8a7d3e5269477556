//! Gate drivers that cannot drive open the bridge by themselves.

use control::io::Duty;
use plant::{Plant, VIRTUAL_MD80};

/// A commanded bridge that nobody commands anew: the processor hangs.
#[test]
fn without_gate_supply_a_bridge_opens_before_the_next_command() {
    let cut: [fn(&mut Plant<f32>); 2] = [
        |plant| plant.set_gate_supply_v(Some(0.0)),
        |plant| plant.set_gate_driver_temperature_c(Some(180.0)),
    ];
    for cut in cut {
        let mut plant = Plant::<f32>::new(&VIRTUAL_MD80);
        plant.set_blocked(true);
        plant.load(&Duty {
            phase: [0.52, 0.5, 0.5],
            enabled: true,
        });
        plant.run(400);
        assert!(
            plant.truth().phase_current_a[0] > 1.0,
            "{:?}",
            plant.truth()
        );
        cut(&mut plant);
        plant.run(400);
        assert!(is_dead(&plant), "{:?}", plant.truth());
        // Nor does a command close it again.
        plant.load(&Duty {
            phase: [0.52, 0.5, 0.5],
            enabled: true,
        });
        plant.run(400);
        assert!(is_dead(&plant), "{:?}", plant.truth());
    }
}

fn is_dead(plant: &Plant<f32>) -> bool {
    let currents = plant.truth().phase_current_a;
    currents.iter().all(|current| current.abs() < 1e-6)
}
