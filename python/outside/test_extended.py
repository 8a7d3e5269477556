"""BaseNode402 and the extended P3: plain CiA 402, with modes in any state, halt and remote bits."""

import canopen
import pytest

import axis
from axis import wait_until
from conftest import connected
from dictionary import object_dictionary
from simulation import Simulation, directory

HALT = 1 << 8
REMOTE = 1 << 9
TARGET_REACHED = 1 << 10


@pytest.fixture(scope="module")
def extended():
    """One virtual extended P3."""
    running = Simulation("1", directory() / "extended.log", drive="p3-extended")
    assert running.ready == "ready: 1 virtual p3-extended drive, node 1"
    yield running
    running.stop()


@pytest.fixture
def cycle(extended):
    """Node 1 operational, its PDOs going to and fro by SYNC."""
    for network in connected(extended.socketcand()):
        node = axis.reset(network, lambda node_id: object_dictionary("p3-extended", node_id), 1)
        axis.map_pdos(node)
        with axis.cyclic(network, node):
            node.check_statusword()
            yield node
        axis.stand_still(node)


def stands(node) -> bool:
    return abs(node.tpdo_values[0x606C]) < 700


def test_modes_are_taken_in_any_state_and_stay(cycle):
    assert cycle.state == "SWITCH ON DISABLED"
    assert cycle.statusword & REMOTE
    for mode in ("PROFILED POSITION", "CYCLIC SYNCHRONOUS VELOCITY", "PROFILED VELOCITY"):
        cycle.op_mode = mode
        assert cycle.op_mode == mode
    cycle.state = "OPERATION ENABLED"
    assert cycle.op_mode == "PROFILED VELOCITY"
    with pytest.raises(canopen.SdoAbortedError) as refused:
        cycle.sdo[0x6060].raw = -1
    assert refused.value.code == 0x06090030


def test_a_halted_move_goes_on_to_its_target(cycle):
    cycle.op_mode = "PROFILED POSITION"
    cycle.state = "OPERATION ENABLED"
    start = cycle.tpdo_values[0x6064]
    cycle.rpdo[1][0x607A].raw = start + 200_000
    cycle.controlword = 0x1F
    wait_until(lambda: cycle.tpdo_values[0x6064] > start + 40_000, 3, "on its way")
    cycle.controlword = 0x0F | HALT
    wait_until(lambda: cycle.statusword & TARGET_REACHED, 3, "halted")
    # The velocity of the same SYNC comes in another PDO.
    wait_until(lambda: stands(cycle), 0.2, "standing")
    assert cycle.state == "OPERATION ENABLED"
    assert cycle.tpdo_values[0x6064] < start + 190_000
    cycle.controlword = 0x0F
    wait_until(lambda: not cycle.statusword & TARGET_REACHED, 1, "on its way again")
    wait_until(lambda: cycle.statusword & TARGET_REACHED, 5, "target reached")
    assert abs(cycle.tpdo_values[0x6064] - start - 200_000) <= 20


def test_modes_change_under_halt_as_ros2_canopen_changes_them(cycle):
    cycle.op_mode = "PROFILED VELOCITY"
    cycle.state = "OPERATION ENABLED"
    cycle.rpdo[2][0x60FF].raw = 100_000
    wait_until(lambda: cycle.tpdo_values[0x606C] > 95_000, 3, "up to speed")
    cycle.controlword = 0x0F | HALT
    cycle.op_mode = "PROFILED POSITION"
    wait_until(lambda: cycle.statusword & TARGET_REACHED and stands(cycle), 3, "halted")
    here = cycle.tpdo_values[0x6064]
    # A set-point of the halt waits for its end.
    cycle.rpdo[1][0x607A].raw = here + 8_000
    cycle.controlword = 0x1F | HALT
    wait_until(lambda: cycle.statusword & 1 << 12, 1, "acknowledge")
    assert abs(cycle.tpdo_values[0x6064] - here) < 50
    cycle.controlword = 0x0F
    wait_until(lambda: abs(cycle.tpdo_values[0x6064] - here - 8_000) <= 20, 3, "there")


def test_a_quick_stop_runs_down_its_ramp(cycle):
    cycle.sdo[0x6085].raw = 500_000
    cycle.sdo[0x605A].raw = 6
    cycle.op_mode = "PROFILED VELOCITY"
    cycle.state = "OPERATION ENABLED"
    cycle.rpdo[2][0x60FF].raw = 200_000
    wait_until(lambda: cycle.tpdo_values[0x606C] > 190_000, 3, "up to speed")
    feedback = axis.Feedback(cycle)
    cycle.state = "QUICK STOP ACTIVE"
    wait_until(lambda: cycle.statusword & TARGET_REACHED, 3, "stopped")
    assert cycle.state == "QUICK STOP ACTIVE"
    falling = [(t, v) for t, v in feedback.samples[0x606C] if 40_000 < v < 150_000]
    assert axis.slope(falling) == pytest.approx(-500_000, rel=0.05)
    cycle.rpdo[2][0x60FF].raw = 0
