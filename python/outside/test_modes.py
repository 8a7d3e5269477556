"""Profile and cyclic modes, with PDO feedback on SYNC. Times are the simulation's own."""

import math

import axis
from axis import Feedback, wait_until
from newton import counts_per_s2, inertia_kgm2

SET_POINT_ACKNOWLEDGED = 1 << 12
TARGET_REACHED = 1 << 10


def enabled(node, mode: str) -> Feedback:
    node.check_statusword()
    node.state = "OPERATION ENABLED"
    node.op_mode = mode
    assert node.op_mode == mode
    return Feedback(node)


def hand_over(node, target: int, controlword: int) -> None:
    """The set-point handshake of CiA 402: bit 4 up, acknowledge up, bit 4 down, acknowledge down."""
    node.rpdo[1][0x607A].raw = target
    node.controlword = controlword | 0x10
    wait_until(lambda: node.statusword & SET_POINT_ACKNOWLEDGED, 1, "acknowledge")
    node.controlword = controlword
    wait_until(lambda: not node.statusword & SET_POINT_ACKNOWLEDGED, 1, "acknowledge gone")


def move_to(node, target: int, controlword: int) -> None:
    """Hands a set-point over and waits until it is reached."""
    hand_over(node, target, controlword)
    wait_until(lambda: node.statusword & TARGET_REACHED, 3, "target reached")


def test_profile_position(cycle):
    velocity, acceleration = 200_000, 2_000_000
    cycle.sdo[0x6081].raw = velocity
    cycle.sdo[0x6083].raw = acceleration
    cycle.sdo[0x6084].raw = acceleration
    feedback = enabled(cycle, "PROFILED POSITION")
    start = cycle.tpdo_values[0x6064]
    move_to(cycle, start + 40_000, 0x0F)
    assert abs(cycle.tpdo_values[0x6064] - start - 40_000) <= 20

    fastest = max(v for _, v in feedback.samples[0x606C])
    assert 0.9 * velocity < fastest < 1.1 * velocity
    # The ramp, by position: a trapezoid takes distance / velocity + velocity / acceleration.
    moving = [t for t, p in feedback.samples[0x6064] if 200 < p - start < 39_800]
    whole = 40_000 / velocity + velocity / acceleration
    assert 0.8 * whole < moving[-1] - moving[0] < 1.3 * whole

    # Back, relative (bit 6) and at once (bit 5).
    move_to(cycle, -40_000, 0x6F)
    assert abs(cycle.tpdo_values[0x6064] - start) <= 20


def test_a_drive_that_may_not_push_enough_falls_behind(cycle):
    rated_nm = cycle.sdo[0x6076].raw * 1e-3
    acceleration = 2_000_000
    cycle.sdo[0x6083].raw = acceleration
    cycle.sdo[0x6084].raw = acceleration
    # The ramp needs 59 per mille of rated torque.
    cycle.sdo[0x6072].raw = 40
    possible = counts_per_s2(0.040 * rated_nm, inertia_kgm2(cycle))
    assert possible < 0.8 * acceleration
    feedback = enabled(cycle, "PROFILED POSITION")
    start = cycle.tpdo_values[0x6064]
    target = start + 40_000
    hand_over(cycle, target, 0x0F)
    wait_until(lambda: cycle.tpdo_values[0x60FC] == target, 2, "the end of the demand")
    # The position rises with a·(t − t0)²/2, where t0 is the moment at which the velocity loop has
    # asked for all the torque it may have: the root of twice the way is a line of slope √a. Friction,
    # which no object tells of, takes a little.
    errors = dict(feedback.samples[0x60F4])
    ramp = [(t, d - start) for t, d in feedback.samples[0x60FC] if 2_000 < d - start < 9_000]
    assert len(ramp) >= 5
    assert all(errors[t] > 0 for t, _ in ramp)
    roots = [(t, math.sqrt(2 * (demand - errors[t]))) for t, demand in ramp]
    assert 0.93 < axis.slope(roots) ** 2 / possible < 1.02
    # It cannot brake in time either, swings around the target, and comes to rest there.
    def rests():
        at_target = abs(cycle.tpdo_values[0x6064] - target) <= 20
        return at_target and abs(cycle.tpdo_values[0x606C]) < 700

    wait_until(rests, 10, "rest at the target")


def test_a_set_point_and_its_controlword_in_one_rpdo(node):
    node.setup_402_state_machine()
    axis.map_pdo(node.rpdo[1], [0x6040, 0x607A], axis.UPON_RECEIPT)
    node.nmt.state = "OPERATIONAL"
    node.state = "OPERATION ENABLED"
    node.op_mode = "PROFILED POSITION"
    target = node.sdo[0x6064].raw + 10_000
    pdo = node.rpdo[1]
    pdo[0x6040].raw = 0x1F
    pdo[0x607A].raw = target
    pdo.transmit()
    wait_until(lambda: abs(node.sdo[0x6064].raw - target) <= 20, 2, "the target of the same RPDO")
    assert node.sdo[0x607A].raw == target


def test_profile_velocity(cycle):
    acceleration = 500_000
    cycle.sdo[0x6083].raw = acceleration
    cycle.sdo[0x6084].raw = acceleration
    feedback = enabled(cycle, "PROFILED VELOCITY")
    feedback.clear()
    wait_until(lambda: feedback.samples[0x606C], 1, "feedback")
    cycle.rpdo[2][0x60FF].raw = 150_000
    wait_until(lambda: cycle.tpdo_values[0x606C] > 145_000, 2, "145,000 cts/s")
    wait_until(lambda: cycle.statusword & TARGET_REACHED, 2, "target reached")
    ramp = [(t, v) for t, v in feedback.samples[0x606C] if 20_000 < v < 130_000]
    assert abs(axis.slope(ramp) / acceleration - 1) < 0.05

    feedback.clear()
    wait_until(lambda: len(feedback.samples[0x606C]) > 40, 3, "feedback")
    steady = [v for _, v in feedback.samples[0x606C]][20:]
    assert abs(sum(steady) / len(steady) / 150_000 - 1) < 0.01

    cycle.rpdo[2][0x60FF].raw = -50_000
    wait_until(lambda: cycle.tpdo_values[0x606C] < -49_000, 2, "-49,000 cts/s")
    cycle.rpdo[2][0x60FF].raw = 0
    wait_until(lambda: abs(cycle.tpdo_values[0x606C]) < 700, 2, "standstill")


def test_cyclic_position(cycle):
    # 60C2: the set-points come every SYNC.
    cycle.sdo[0x60C2][1].raw = round(axis.SYNC_PERIOD_S * 1000)
    cycle.sdo[0x60C2][2].raw = -3
    feedback = enabled(cycle, "CYCLIC SYNCHRONOUS POSITION")
    start = cycle.tpdo_values[0x6064]
    amplitude, frequency, samples = 8_000, 1.0, 300
    feedback.clear()
    targets = []
    for number in range(samples):
        # One set-point per TPDO, so that SYNC is the clock.
        assert cycle.tpdo[1].wait_for_reception(1) is not None
        angle = 2 * math.pi * frequency * number * axis.SYNC_PERIOD_S
        targets.append(start + round(amplitude * (1 - math.cos(angle))))
        cycle.rpdo[1][0x607A].raw = targets[-1]
    wait_until(lambda: abs(cycle.tpdo_values[0x6064] - targets[-1]) <= 20, 2, "the last target")

    reached = [p for _, p in feedback.samples[0x6064]]
    assert abs(max(reached) - start - 2 * amplitude) < 0.02 * amplitude
    assert min(reached) > start - 0.02 * amplitude
    # A fifth of the peak speed's distance in a period and a half of the position loop (20 Hz).
    errors = [abs(e) for _, e in feedback.samples[0x60F4]]
    assert 0 < max(errors) < amplitude / 4
    demand = [d for _, d in feedback.samples[0x60FC]]
    assert max(demand) - min(demand) > 1.9 * amplitude


def test_cyclic_velocity(cycle):
    feedback = enabled(cycle, "CYCLIC SYNCHRONOUS VELOCITY")
    cycle.rpdo[2][0x60FF].raw = 100_000
    wait_until(lambda: cycle.tpdo_values[0x606C] > 99_000, 2, "99,000 cts/s")
    feedback.clear()
    wait_until(lambda: len(feedback.samples[0x6064]) > 60, 3, "feedback")
    # Velocity and the change of position agree.
    assert abs(axis.slope(feedback.samples[0x6064]) / 100_000 - 1) < 0.01
    mean = sum(v for _, v in feedback.samples[0x606C]) / len(feedback.samples[0x606C])
    assert abs(mean / 100_000 - 1) < 0.01
    cycle.rpdo[2][0x60FF].raw = 0
    wait_until(lambda: abs(cycle.tpdo_values[0x606C]) < 700, 2, "standstill")


def test_cyclic_torque_turns_both_ways(cycle):
    enabled(cycle, "CYCLIC SYNCHRONOUS TORQUE")
    cycle.rpdo[2][0x6071].raw = 20
    wait_until(lambda: cycle.tpdo_values[0x606C] > 50_000, 3, "50,000 cts/s")
    cycle.rpdo[2][0x6071].raw = -20
    wait_until(lambda: cycle.tpdo_values[0x606C] < -20_000, 3, "-20,000 cts/s")
    cycle.rpdo[2][0x6071].raw = 0
