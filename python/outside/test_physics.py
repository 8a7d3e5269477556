"""Newton's law, seen from the bus: nothing here knows the simulator's parameters, only the drive's."""

import axis
from axis import Feedback, wait_until
from newton import counts_per_s2, inertia_kgm2


def mean(values) -> float:
    values = list(values)
    return sum(values) / len(values)


def ramp(node, torque_permille: int) -> tuple:
    """Lets the torque act to 300,000 cts/s: acceleration by velocity and by position, and current."""
    feedback = Feedback(node)
    wait_until(lambda: len(feedback.samples[0x606C]) > 2, 1, "feedback")
    feedback.clear()
    sign = 1 if torque_permille > 0 else -1
    node.rpdo[2][0x6071].raw = torque_permille
    wait_until(lambda: sign * node.tpdo_values[0x606C] > 300_000, 3, "300,000 cts/s")
    node.rpdo[2][0x6071].raw = 0
    rising = [(t, v) for t, v in feedback.samples[0x606C] if 60_000 < sign * v < 300_000]
    begin, end = rising[0][0], rising[-1][0]
    assert len(rising) >= 5
    positions = [(t, p) for t, p in feedback.samples[0x6064] if begin - 1e-3 <= t <= end + 1e-3]
    current = mean(i for t, i in feedback.samples[0x6078] if begin <= t <= end)
    return axis.slope(rising), second_difference(positions), current * 1e-3


def second_difference(positions: list) -> float:
    """Constant acceleration from the mean velocities of the first and the second half."""
    (t0, p0), (t1, p1), (t2, p2) = positions[0], positions[len(positions) // 2], positions[-1]
    return 2 * ((p2 - p1) / (t2 - t1) - (p1 - p0) / (t1 - t0)) / (t2 - t0)


def enable_torque(node) -> None:
    node.check_statusword()
    node.state = "OPERATION ENABLED"
    node.op_mode = "CYCLIC SYNCHRONOUS TORQUE"


def test_acceleration_is_torque_over_inertia_kgm2(cycle):
    rated_nm = cycle.sdo[0x6076].raw * 1e-3
    torque_constant = cycle.sdo[0x3011][4].raw * 1e-3
    enable_torque(cycle)
    torque = 0.150 * rated_nm
    expected = counts_per_s2(torque, inertia_kgm2(cycle))
    by_velocity, by_position, current_a = ramp(cycle, 150)
    assert abs(by_velocity / expected - 1) < 0.05
    assert abs(by_position / expected - 1) < 0.05
    assert abs(current_a * torque_constant / torque - 1) < 0.05


def test_the_torque_limit_slows_the_ramp(cycle):
    rated_nm = cycle.sdo[0x6076].raw * 1e-3
    torque_constant = cycle.sdo[0x3011][4].raw * 1e-3
    cycle.sdo[0x6072].raw = 100
    enable_torque(cycle)
    torque = 0.100 * rated_nm
    by_velocity, by_position, current_a = ramp(cycle, 150)
    expected = counts_per_s2(torque, inertia_kgm2(cycle))
    assert abs(by_velocity / expected - 1) < 0.05
    assert abs(by_position / expected - 1) < 0.05
    assert abs(current_a * torque_constant / torque - 1) < 0.05


def test_the_other_way_round(cycle):
    rated_nm = cycle.sdo[0x6076].raw * 1e-3
    enable_torque(cycle)
    by_velocity, _, current_a = ramp(cycle, -100)
    expected = -counts_per_s2(0.1 * rated_nm, inertia_kgm2(cycle))
    assert abs(by_velocity / expected - 1) < 0.05
    assert current_a < 0
