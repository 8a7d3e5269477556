"""What a control period of one drive costs in motulator: EC-max 22 at 2,000 rpm, 20 kHz.

Prints one line of JSON. Speed and current control with the measured angle, the duties held over the
control period: motulator's least costly way. The first half of the run is not counted.
"""

import json
import math
import time
from importlib.metadata import version

from motulator.drive import model
from motulator.drive.control import sm
from motulator.drive.utils import SynchronousMachinePars

PERIOD_S = 50e-6
PERIODS = 4_000
SPEED = 2_000 * math.tau / 60
INERTIA_KGM2 = 4.45e-7
RUNS = 3


class Watched:
    """The control system, with the time of every call."""

    def __init__(self, control):
        self.control = control
        self.times = []

    def __call__(self, drive):
        self.times.append(time.perf_counter())
        return self.control(drive)

    def post_process(self):
        """Nothing to do afterwards."""


def run():
    """Seconds of a control period, and the speed reached, rad/s."""
    par = SynchronousMachinePars(
        n_p=1,
        R_s=13.1 / 2,
        L_d=0.729e-3 / 2,
        L_q=0.729e-3 / 2,
        psi_f=34.8e-3 * math.pi / (3 * math.sqrt(3)),
    )
    machine = model.SynchronousMachine(par)
    mechanics = model.StiffMechanicalSystem(J=INERTIA_KGM2, B_L=0.76e-6)
    drive = model.Drive(model.VoltageSourceConverter(u_dc=48.0), machine, mechanics)
    reference = sm.CurrentReferenceCfg(par, nom_w_m=1350.0, max_i_s=2.0)
    control = sm.CurrentVectorControl(
        par,
        reference,
        T_s=PERIOD_S,
        J=INERTIA_KGM2,
        alpha_c=math.tau * 500,
        sensorless=False,
    )
    control.ref.w_m = lambda _: SPEED
    watched = Watched(control)
    simulation = model.Simulation(drive, watched)
    simulation.simulate(t_stop=PERIODS * PERIOD_S)
    times = watched.times
    half = len(times) // 2
    return (times[-1] - times[half]) / (len(times) - 1 - half), mechanics.meas_speed()


def main():
    results = [run() for _ in range(RUNS)]
    for _, speed in results:
        if abs(speed / SPEED - 1) > 0.02:
            raise SystemExit(f"motulator's drive turns at {speed:.1f} rad/s, not at {SPEED:.1f}")
    seconds = sorted(seconds for seconds, _ in results)
    figures = {
        "subject": f"motulator {version('motulator')}",
        "best_ns": seconds[0] * 1e9,
        "median_ns": seconds[len(seconds) // 2] * 1e9,
    }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
