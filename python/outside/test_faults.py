"""Faults that a master provokes, sees and resets."""

import threading

import axis

SYNC_LOSS = 0x8180
POSITION_TRACKING = 0x8614


class Emergencies:
    """What EmcyConsumer hears, in order."""

    def __init__(self, node):
        self.heard = []
        self._more = threading.Condition()
        node.emcy.add_callback(self._hear)

    def _hear(self, error):
        with self._more:
            self.heard.append((error.code, error.register, bytes(error.data)))
            self._more.notify_all()

    def wait(self, code: int, timeout_s: float = 3):
        def found():
            return next((e for e in self.heard if e[0] == code), None)

        with self._more:
            self._more.wait_for(found, timeout_s)
            assert found() is not None, f"no EMCY 0x{code:04X} in {self.heard}"
            return found()


def test_a_lost_sync_is_a_fault_that_can_be_reset(network, node):
    # Without PDOs: BaseNode402 would insist on a TPDO per SYNC.
    node.setup_402_state_machine()
    emergencies = Emergencies(node)
    network.sync.start(0.01)
    node.nmt.state = "OPERATIONAL"
    node.sdo[0x2406].raw = 100
    node.state = "OPERATION ENABLED"
    node.op_mode = "PROFILED VELOCITY"
    assert emergencies.heard == []

    network.sync.stop()
    _, register, data = emergencies.wait(SYNC_LOSS)
    # Generic and communication (CiA 301 7.5.2.2); 6 and 7 are zero but on a reset (P16).
    assert register & 0x11 == 0x11
    assert data[3:5] == b"\0\0"
    axis.wait_until(node.is_faulted, 2, "fault")
    assert node.state == "FAULT"
    assert node.sdo[0x603F].raw == SYNC_LOSS
    assert node.sdo[0x1001].raw & 0x11 == 0x11
    assert node.sdo[0x1003][1].raw & 0xFFFF == SYNC_LOSS

    network.sync.start(0.01)
    node.reset_from_fault()
    assert node.state == "OPERATION ENABLED"
    _, register, data = emergencies.wait(0)
    assert register == 0
    # The code that was reset, in bytes 6 and 7 (P16).
    assert int.from_bytes(data[3:5], "little") == SYNC_LOSS
    assert node.sdo[0x1001].raw == 0
    assert [code for code, _, _ in emergencies.heard] == [SYNC_LOSS, 0]
    node.sdo[0x2406].raw = 0
    network.sync.stop()


def test_a_following_error_beyond_the_window_is_a_fault(cycle):
    emergencies = Emergencies(cycle)
    cycle.check_statusword()
    cycle.sdo[0x2120].raw = 50
    cycle.sdo[0x2121].raw = 5
    cycle.state = "OPERATION ENABLED"
    cycle.op_mode = "CYCLIC SYNCHRONOUS POSITION"
    # A step of ten turns cannot be followed.
    cycle.rpdo[1][0x607A].raw = cycle.tpdo_values[0x6064] + 40_960
    emergencies.wait(POSITION_TRACKING)
    axis.wait_until(cycle.is_faulted, 2, "fault")
    assert cycle.sdo[0x603F].raw == POSITION_TRACKING
    cycle.sdo[0x2120].raw = 0
    cycle.rpdo[1][0x607A].raw = cycle.tpdo_values[0x6064]
    cycle.reset_from_fault()
    assert cycle.state == "OPERATION ENABLED"
    _, _, data = emergencies.wait(0)
    assert int.from_bytes(data[3:5], "little") == POSITION_TRACKING
