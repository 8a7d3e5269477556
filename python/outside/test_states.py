"""BaseNode402 walks the state machine, by SDO and by PDO."""

import pytest

STATES = [
    "READY TO SWITCH ON",
    "SWITCHED ON",
    "OPERATION ENABLED",
    "SWITCHED ON",
    "READY TO SWITCH ON",
    "SWITCH ON DISABLED",
    # Several transitions in one assignment.
    "OPERATION ENABLED",
    "READY TO SWITCH ON",
    "OPERATION ENABLED",
    "SWITCH ON DISABLED",
]


def walk(node) -> None:
    assert node.state == "SWITCH ON DISABLED"
    for state in STATES:
        node.state = state
        assert node.state == state


def test_all_states_by_sdo(node):
    node.setup_402_state_machine()
    walk(node)


def test_all_states_by_pdo(cycle):
    cycle.check_statusword()
    walk(cycle)


def test_a_quick_stop_may_hold_or_disable(cycle):
    cycle.check_statusword()
    # 6: stays in quick stop active, from which operation may be enabled again (transition 16).
    cycle.sdo[0x605A].raw = 6
    cycle.state = "OPERATION ENABLED"
    cycle.state = "QUICK STOP ACTIVE"
    assert cycle.state == "QUICK STOP ACTIVE"
    cycle.state = "OPERATION ENABLED"
    # 2: leads to switch on disabled. The stop of a motor at rest is over at once, so that
    # python-canopen may or may not see the state in between.
    cycle.sdo[0x605A].raw = 2
    cycle.controlword = 0x02
    for _ in range(20):
        cycle.check_statusword()
    assert cycle.state == "SWITCH ON DISABLED"


def test_modes_are_shown_and_idle_on_enabling(cycle):
    cycle.check_statusword()
    cycle.state = "OPERATION ENABLED"
    assert cycle.op_mode == "NO MODE"
    for mode in ("PROFILED TORQUE", "PROFILED VELOCITY", "CYCLIC SYNCHRONOUS POSITION"):
        cycle.op_mode = mode
        assert cycle.op_mode == mode
    cycle.op_mode = "NO MODE"
    assert cycle.op_mode == "NO MODE"
    with pytest.raises(TypeError):
        cycle.op_mode = "INTERPOLATED POSITION"
