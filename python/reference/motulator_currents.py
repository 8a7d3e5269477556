"""Phase currents of the EC-max 22 under imposed voltages, by motulator.

    python motulator_currents.py > ../../crates/plant/tests/reference/motulator_currents.csv

motulator's own machine, mechanics and converter, switched edge by edge (carrier comparison, 100 kHz);
this script imposes the duties, and notes the phase currents at the ends of PWM periods.
`crates/plant/tests/motulator.rs` imposes the same on the plant. Needs requirements.txt beside this file.
"""

import cmath
import math
import sys
from importlib.metadata import version

from motulator.common.model import CarrierComparison
from motulator.drive import model
from motulator.drive.utils import SynchronousMachinePars

# maxon EC-max 22 283860, as in crates/plant/src/motor.rs.
POLE_PAIRS = 1
RESISTANCE_OHM = 13.1 / 2
INDUCTANCE_H = 0.729e-3 / 2
FLUX_WB = 34.8e-3 * math.pi / (3 * math.sqrt(3) * POLE_PAIRS)
INERTIA_KGM2 = 4.45e-7
VISCOUS_NMS = (0.064 * 34.8e-3 - 1.2e-3) / (12_900 * math.tau / 60)

BUS_V = 48.0
PERIOD_S = 10e-6
HIGH_SPEED = 12_900 * math.tau / 60


def locked(time_s):
    """A voltage that jumps on, and on to another direction after 1 ms."""
    return 4.0 if time_s < 1e-3 else cmath.rect(9.0, 2.0)


def at_speed(time_s):
    """24 V in phase with the EMF of a rotor at 12,900 rpm."""
    return cmath.rect(24.0, HIGH_SPEED * time_s + math.pi / 2)


def spin_up(time_s):
    """From rest to 6,000 rpm in 60 ms, in step: the angle of an even acceleration."""
    speed = math.tau * 100 * min(time_s / 60e-3, 1.0)
    angle = speed * time_s / 2 if time_s < 60e-3 else speed * (time_s - 30e-3)
    return cmath.rect(2.5 + FLUX_WB * speed, angle + 0.6)


# Name, voltage, inertia, viscous friction, first speed, PWM periods, and how many a row.
SCENARIOS = [
    ("locked", locked, 1e6, 0.0, 0.0, 200, 5),
    ("at_speed", at_speed, 1e6, 0.0, HIGH_SPEED, 1_000, 10),
    ("spin_up", spin_up, INERTIA_KGM2, VISCOUS_NMS, 0.0, 7_000, 50),
]


def duties(voltage):
    """Duties centred between the rails."""
    phases = [(voltage * cmath.rect(1.0, -k * math.tau / 3)).real for k in range(3)]
    middle = (max(phases) + min(phases)) / 2
    return [(phase - middle) / BUS_V + 0.5 for phase in phases]


class Imposed:
    """What motulator calls as the control system, twice a PWM period: for each slope of the carrier."""

    def __init__(self, voltage):
        self.voltage = voltage
        self.calls = 0
        self.currents = []

    def __call__(self, drive):
        period = self.calls // 2
        if self.calls % 2 == 0:
            self.currents.append(drive.machine.meas_currents())
        self.calls += 1
        # The voltage of the middle of the period.
        return PERIOD_S / 2, duties(self.voltage((period + 0.5) * PERIOD_S))

    def post_process(self):
        """Nothing to do afterwards."""


def run(voltage, inertia, viscous, speed, periods):
    """Phase currents at the begin of every PWM period."""
    machine = model.SynchronousMachine(
        SynchronousMachinePars(
            n_p=POLE_PAIRS,
            R_s=RESISTANCE_OHM,
            L_d=INDUCTANCE_H,
            L_q=INDUCTANCE_H,
            psi_f=FLUX_WB,
        )
    )
    mechanics = model.StiffMechanicalSystem(J=inertia, B_L=viscous)
    mechanics.state.w_M = speed
    converter = model.VoltageSourceConverter(u_dc=BUS_V)
    drive = model.Drive(converter, machine, mechanics)
    drive.delay = lambda given: given
    drive.pwm = CarrierComparison(N=2**24)
    imposed = Imposed(voltage)
    simulation = model.Simulation(drive, imposed)
    simulation.simulate(t_stop=(periods + 0.25) * PERIOD_S, max_step=1e-6)
    return imposed.currents


def main():
    print(f"# motulator {version('motulator')}, python/reference/motulator_currents.py")
    print("scenario,period,a_a,b_a,c_a")
    for name, voltage, inertia, viscous, speed, periods, step in SCENARIOS:
        currents = run(voltage, inertia, viscous, speed, periods)
        for period in range(step, periods + 1, step):
            a, b, c = currents[period]
            print(f"{name},{period},{a:.6f},{b:.6f},{c:.6f}")
        print(f"{name}: done", file=sys.stderr)


if __name__ == "__main__":
    main()
