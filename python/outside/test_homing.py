"""BaseNode402.homing() on a rail with switches and hard stops, and method 37 on the faithful P3."""

import time

import pytest
from canopen.profiles.p402 import Homing

import axis
from conftest import connected
from dictionary import object_dictionary
from simulation import Simulation, directory, replayed

TURN = 4096
# The encoder's reading at the shaft's start: 0x3011,1.
START = 3576

# Stops at -8 and 8 turns, limit switches at -6 and 6, a home switch from 1.2 to 2.1 turns.
RAIL = """
[drive.1.load]
lowest_stop = "-8 turns"
highest_stop = "8 turns"

[drive.1.switches]
negative_limit = "-6 turns"
positive_limit = "6 turns"
home_from = "1.2 turns"
home_to = "2.1 turns"
bounce = "0.5 ms"
"""

# Method, bit of 0x60FD, whether it is 1 beyond the home point, and the edge's place in turns.
EDGES = [
    (Homing.HM_ON_THE_NEGATIVE_LIMIT_SWITCH, 0, False, -6.0),
    (Homing.HM_ON_THE_POSITIVE_LIMIT_SWITCH, 1, True, 6.0),
    (23, 2, True, 1.2),
    (24, 2, True, 1.2),
    (25, 2, False, 2.1),
    (26, 2, False, 2.1),
    (27, 2, False, 2.1),
    (28, 2, False, 2.1),
    (29, 2, True, 1.2),
    (30, 2, True, 1.2),
]


@pytest.fixture(scope="module")
def rail():
    """One virtual extended P3 on its rail; its run is repeated when all is done."""
    scenario = directory() / "rail.toml"
    scenario.write_text(RAIL, encoding="utf-8")
    log = directory() / "homing.log"
    running = Simulation("1", log, "--scenario", str(scenario), drive="p3-extended")
    yield running
    running.stop()
    assert replayed(log)


@pytest.fixture
def drive(rail):
    """The drive after a reset, without PDOs: BaseNode402 goes by SDO."""
    for network in connected(rail.socketcand()):
        node = axis.reset(network, lambda node_id: object_dictionary("p3-extended", node_id), 1)
        node.setup_402_state_machine(False)
        yield node
        axis.stand_still(node)


def home(node, method: int, offset: int = 0) -> None:
    """Homes, and waits until the axis stands."""
    node.sdo[0x6098].raw = method
    node.sdo[0x607C].raw = offset
    assert node.homing(timeout=30)
    axis.wait_until(lambda: node.sdo[0x6041].raw & 0x3400 == 0x1400, 5, "standing")
    assert node.is_homed()
    assert node.sdo[0x2402].raw == 1


def place_within_turn(node) -> int:
    """Where position 0 is, counts from the shaft's start, within a turn: by the encoder itself."""
    return (node.sdo[0x3012][1].raw - START - node.sdo[0x6064].raw) % TURN


def distance_within_turn(one: float, other: float) -> float:
    """How far two places within a turn are apart."""
    away = (one - other) % TURN
    return min(away, TURN - away)


def move(node, position: int) -> None:
    """A move in profile position mode."""
    node.op_mode = "PROFILED POSITION"
    node.sdo[0x607A].raw = position
    node.sdo[0x6040].raw = 0x2F
    node.sdo[0x6040].raw = 0x3F
    axis.wait_until(lambda: node.sdo[0x6041].raw & 1 << 10, 5, f"at {position}")
    time.sleep(0.01)


def test_the_present_position(drive):
    for method in (Homing.HM_ON_CURRENT_POSITION, 37):
        home(drive, method, -4_321)
        assert abs(drive.sdo[0x6064].raw + 4_321) <= 1


@pytest.mark.parametrize(
    "method", [Homing.HM_ON_NEGATIVE_INDEX_PULSE, Homing.HM_ON_POSITIVE_INDEX_PULSE]
)
def test_the_index_pulse_is_the_encoders_zero(drive, method):
    home(drive, method)
    assert distance_within_turn(place_within_turn(drive), -START) <= 1


@pytest.mark.parametrize("method, bit, beyond, place", EDGES)
def test_position_zero_is_where_the_switch_changes(drive, method, bit, beyond, place):
    home(drive, method)
    assert distance_within_turn(place_within_turn(drive), place * TURN) <= 5
    for position, active in ((-40, not beyond), (40, beyond)):
        move(drive, position)
        assert (drive.sdo[0x60FD].raw >> bit & 1) == active, f"at {position}"


def test_an_index_behind_a_switch(drive):
    # Method 1: the first index pulse to the right of the limit switch's edge at -6 turns.
    home(drive, Homing.HM_ON_THE_NEGATIVE_LIMIT_SWITCH_AND_INDEX_PULSE)
    assert distance_within_turn(place_within_turn(drive), -START) <= 1
    # That is 520 counts from the edge, so the switch is on at 560 counts to the left of it.
    move(drive, -490)
    assert drive.sdo[0x60FD].raw & 1 == 0
    move(drive, -560)
    assert drive.sdo[0x60FD].raw & 1 == 1


def test_a_hard_stop_cannot_be_reached_past_its_limit_switch(drive):
    drive.sdo[0x6098].raw = Homing.HM_ON_THE_NEGATIVE_MECHANICAL_LIMIT
    assert not drive.homing(timeout=30)
    assert drive.sdo[0x6041].raw & 0x2000, "homing error"
    assert drive.sdo[0x2430][6].raw == 4
    assert drive.sdo[0x2402].raw == 0


def test_methods_that_there_are(drive):
    count = drive.sdo[0x60E3][0].raw
    methods = [drive.sdo[0x60E3][sub].raw for sub in range(1, count + 1)]
    standard = [*range(1, 15), *range(17, 31), 33, 34, 35, 37]
    assert sorted(methods) == [-4, -3, -2, -1, *standard]


def test_the_faithful_p3_homes_where_it_stands(node):
    node.setup_402_state_machine(False)
    # It takes a mode in operation enabled only (P10).
    node.state = "OPERATION ENABLED"
    node.sdo[0x607C].raw = 1_000
    assert node.sdo[0x6098].raw == 37
    assert node.homing(timeout=5)
    assert abs(node.sdo[0x6064].raw - 1_000) <= 1
    assert node.sdo[0x2402].raw == 1
    node.sdo[0x607C].raw = 0
