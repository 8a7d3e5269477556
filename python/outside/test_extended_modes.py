"""BaseNode402 and the extended P3: modes 2 and 7, limited jerk, and the option codes."""

import math
import threading

import canopen
import pytest

import axis
from axis import SYNC_PERIOD_S, wait_until
from simulation import Simulation, directory
from test_extended import cycle, stands  # noqa: F401, the fixture
from test_modes import hand_over

TARGET_REACHED = 1 << 10
INTERPOLATES = 1 << 12
# Counts/s of a revolution per minute.
RPM = 4096 / 60


@pytest.fixture(scope="module")
def extended():
    """One virtual extended P3, with a recording of its own."""
    simulation = Simulation("1", directory() / "extended-modes.log", drive="p3-extended")
    yield simulation
    simulation.stop()


def running(node, velocity: int) -> axis.Feedback:
    """In profile velocity mode, up to speed."""
    node.op_mode = "PROFILED VELOCITY"
    node.state = "OPERATION ENABLED"
    node.rpdo[2][0x60FF].raw = velocity
    wait_until(lambda: node.tpdo_values[0x606C] > 0.98 * velocity, 3, "up to speed")
    return axis.Feedback(node)


def ramp(feedback: axis.Feedback, velocity: int) -> float:
    """How fast it slowed down, in the middle of the way."""
    samples = feedback.samples[0x606C]
    middle = [(t, v) for t, v in samples if 0.2 * velocity < v < 0.75 * velocity]
    return axis.slope(middle)


def test_velocity_mode(cycle):
    cycle.op_mode = "VELOCITY"
    assert cycle.op_mode == "VELOCITY"
    # 3,000 rpm/s up and 6,000 rpm/s down.
    cycle.sdo[0x6048][1].raw = 3000
    cycle.sdo[0x6048][2].raw = 1
    cycle.sdo[0x6049][1].raw = 12_000
    cycle.sdo[0x6049][2].raw = 2
    cycle.state = "OPERATION ENABLED"
    cycle.sdo[0x6042].raw = 1000
    feedback = axis.Feedback(cycle)
    wait_until(lambda: len(feedback.samples[0x606C]) > 20, 2, "feedback")
    assert stands(cycle), "enabled alone it does not move"
    feedback.clear()
    cycle.controlword = 0x7F
    wait_until(lambda: cycle.tpdo_values[0x606C] > 995 * RPM, 3, "1,000 rpm")
    wait_until(lambda: cycle.statusword & TARGET_REACHED, 2, "target reached")
    rising = [(t, v) for t, v in feedback.samples[0x606C] if 200 * RPM < v < 800 * RPM]
    assert axis.slope(rising) == pytest.approx(3000 * RPM, rel=0.05)
    assert cycle.sdo[0x6044].raw == pytest.approx(1000, abs=15)
    # The ramp holds (bit 5), then its input is zero (bit 6).
    cycle.controlword = 0x5F
    feedback.clear()
    wait_until(lambda: len(feedback.samples[0x606C]) > 5, 2, "the controlword's RPDO")
    cycle.sdo[0x6042].raw = 2000
    feedback.clear()
    wait_until(lambda: len(feedback.samples[0x606C]) > 80, 2, "feedback")
    steady = [v for _, v in feedback.samples[0x606C]][40:]
    assert sum(steady) / len(steady) == pytest.approx(1000 * RPM, rel=0.02)
    feedback.clear()
    cycle.controlword = 0x3F
    wait_until(lambda: stands(cycle), 3, "at rest")
    falling = [(t, v) for t, v in feedback.samples[0x606C] if 200 * RPM < v < 800 * RPM]
    assert axis.slope(falling) == pytest.approx(-6000 * RPM, rel=0.05)
    # The ramp off (bit 4).
    cycle.controlword = 0x7F
    wait_until(lambda: cycle.tpdo_values[0x606C] > 1900 * RPM, 3, "2,000 rpm")
    cycle.controlword = 0x6F
    wait_until(lambda: stands(cycle), 3, "at rest")
    assert cycle.state == "OPERATION ENABLED"


def test_interpolation_of_a_stream(cycle):
    cycle.op_mode = "INTERPOLATED POSITION"
    cycle.sdo[0x60C2][1].raw = round(SYNC_PERIOD_S * 1000)
    cycle.sdo[0x60C2][2].raw = -3
    stream = cycle.rpdo[3]
    stream.read()
    stream.clear()
    stream.add_variable(0x60C1, 1)
    # Into the buffer at once: if this process comes late, two may come before a SYNC.
    stream.trans_type = axis.UPON_RECEIPT
    stream.enabled = True
    stream.save()
    cycle.state = "OPERATION ENABLED"
    cycle.controlword = 0x1F
    feedback = axis.Feedback(cycle)
    start = cycle.tpdo_values[0x6064]
    amplitude, frequency, samples = 8_000, 1.0, 300
    targets = []
    for number in range(samples):
        # One set-point per TPDO, so that SYNC is the clock.
        assert cycle.tpdo[1].wait_for_reception(1) is not None
        angle = 2 * math.pi * frequency * number * SYNC_PERIOD_S
        targets.append(start + round(amplitude * (1 - math.cos(angle))))
        stream.map[0].raw = targets[-1]
        stream.transmit()
    wait_until(lambda: cycle.tpdo_values[0x60FC] == targets[-1], 2, "the last set-point")
    wait_until(lambda: cycle.statusword & TARGET_REACHED, 2, "target reached")
    assert not cycle.statusword & INTERPOLATES, "the buffer has run empty"
    active = [word & INTERPOLATES != 0 for _, word in feedback.samples[0x6041]]
    assert sum(active) > 0.8 * samples
    assert abs(cycle.tpdo_values[0x6064] - targets[-1]) <= 20
    pairs = feedback.samples[0x60FC]
    demand = [d for _, d in pairs]
    assert max(demand) - start == pytest.approx(2 * amplitude, rel=0.01)
    assert min(demand) >= start - 1
    # It runs as fast as the set-points do.
    fastest = max(abs(b - a) for a, b in zip(targets, targets[1:])) / SYNC_PERIOD_S
    rates = sorted(abs(d - c) / (t - s) for (s, c), (t, d) in zip(pairs, pairs[1:]))
    assert rates[len(rates) * 9 // 10] <= 1.3 * fastest


def test_interpolation_of_a_filled_buffer(cycle):
    cycle.op_mode = "INTERPOLATED POSITION"
    cycle.sdo[0x60C2][1].raw = 20
    cycle.sdo[0x60C2][2].raw = -3
    record = cycle.sdo[0x60C1][1]
    with pytest.raises(canopen.SdoAbortedError) as refused:
        record.raw = 0
    assert refused.value.code == 0x08000022
    cycle.state = "OPERATION ENABLED"
    start = cycle.tpdo_values[0x6064]
    size = cycle.sdo[0x60C4][1].raw
    assert size == 16
    for number in range(1, size + 1):
        record.raw = start + 500 * number
    assert cycle.sdo[0x60C4][4].raw == size
    with pytest.raises(canopen.SdoAbortedError) as refused:
        record.raw = 0
    assert refused.value.code == 0x08000022
    feedback = axis.Feedback(cycle)
    cycle.controlword = 0x1F
    wait_until(lambda: cycle.statusword & TARGET_REACHED, 3, "target reached")
    assert any(word & INTERPOLATES for _, word in feedback.samples[0x6041])
    assert cycle.sdo[0x60C4][4].raw == 0
    assert abs(cycle.tpdo_values[0x6064] - start - 500 * size) <= 20
    # Straight on: 500 counts in 20 ms, whatever the beat of SYNC.
    way = [(t, d) for t, d in feedback.samples[0x60FC] if 1_000 < d - start < 7_000]
    assert axis.slope(way) == pytest.approx(25_000, rel=0.05)


def test_limited_jerk(cycle):
    for profile_type in (-1, 1, 2, 4):
        with pytest.raises(canopen.SdoAbortedError) as refused:
            cycle.sdo[0x6086].raw = profile_type
        assert refused.value.code == 0x06090030
    velocity, acceleration, jerk, distance = 100_000, 500_000, 2_500_000, 60_000
    cycle.sdo[0x6081].raw = velocity
    cycle.sdo[0x6083].raw = acceleration
    cycle.sdo[0x6084].raw = acceleration
    cycle.sdo[0x60A4][1].raw = jerk
    cycle.op_mode = "PROFILED POSITION"
    cycle.state = "OPERATION ENABLED"
    linear = distance / velocity + velocity / acceleration
    for profile_type, seconds in ((0, linear), (3, linear + acceleration / jerk)):
        cycle.sdo[0x6086].raw = profile_type
        feedback = axis.Feedback(cycle)
        wait_until(lambda: len(feedback.samples[0x60FC]) > 2, 1, "the demand")
        start = cycle.tpdo_values[0x60FC]
        feedback.clear()
        hand_over(cycle, start + distance, 0x0F)
        wait_until(lambda: cycle.tpdo_values[0x60FC] == start + distance, 5, "the end")
        moving = [t for t, d in feedback.samples[0x60FC] if start < d < start + distance]
        # The first and the last count take a while, and SYNC has its jitter; limited jerk is 0.2 s.
        assert moving[-1] - moving[0] == pytest.approx(seconds, abs=0.08)
        wait_until(lambda: cycle.statusword & TARGET_REACHED, 2, "target reached")


def test_disable_operation_slows_down_and_shutdown_lets_go(cycle):
    cycle.sdo[0x6084].raw = 500_000
    assert cycle.sdo[0x605C].raw == 1
    feedback = running(cycle, 150_000)
    cycle.state = "SWITCHED ON"
    assert ramp(feedback, 150_000) == pytest.approx(-500_000, rel=0.05)
    assert cycle.tpdo_values[0x606C] < 20_000
    running(cycle, 150_000)
    assert cycle.sdo[0x605B].raw == 0
    cycle.state = "READY TO SWITCH ON"
    assert cycle.tpdo_values[0x606C] > 100_000, "it coasts"


def test_a_fault_is_reacted_to_on_the_quick_stop_ramp(cycle):
    cycle.sdo[0x6085].raw = 300_000
    cycle.sdo[0x2410][11].raw = 1
    feedback = running(cycle, 150_000)
    states = []
    seen = threading.Event()

    def heard(pdo):
        state = pdo[0x6041].raw & 0x4F
        if not states or states[-1] != state:
            states.append(state)
        if state == 0x08:
            seen.set()

    cycle.tpdo[1].add_callback(heard)
    # A position that wraps: a fault that leaves the motor under control.
    cycle.sdo[0x6064].raw = 2**31 - 3_000
    assert seen.wait(3), "fault"
    assert states[-3:] == [0x07, 0x0F, 0x08], "operation enabled, fault reaction active, fault"
    # Operation enabled is 0x27 under the mask 0x6F, 0x07 under this one.
    assert ramp(feedback, 150_000) == pytest.approx(-300_000, rel=0.05)
    assert [error.code for error in cycle.emcy.log][-1] == 0x73A0
    cycle.sdo[0x2410][11].raw = 0
