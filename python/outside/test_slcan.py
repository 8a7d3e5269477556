"""The same bus by slcan, and both doors at once."""

import time

import can
import pytest

import axis
from conftest import NODES, connected


@pytest.fixture
def slcan_network(simulation):
    yield from connected(simulation.slcan())


def test_scanner_sdo_and_states_over_slcan(slcan_network, dictionary):
    slcan_network.scanner.reset()
    slcan_network.scanner.search()
    time.sleep(1)
    assert sorted(slcan_network.scanner.nodes) == NODES
    node = axis.reset(slcan_network, dictionary, 2)
    assert node.sdo[0x1000].raw == 0x0002_0192
    assert node.sdo[0x1008].raw.rstrip("\0") == "P3"
    node.setup_402_state_machine()
    for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED", "SWITCH ON DISABLED"):
        node.state = state
        assert node.state == state


def test_both_doors_are_one_bus(simulation, slcan_network):
    with can.Bus(**simulation.socketcand()) as other:
        slcan_network.send_message(0x603, bytes.fromhex("4000100000000000"))
        heard = []
        until = time.monotonic() + 2
        while len(heard) < 2 and time.monotonic() < until:
            message = other.recv(0.1)
            if message is not None and message.arbitration_id in (0x603, 0x583):
                heard.append((message.arbitration_id, bytes(message.data)))
    assert heard == [
        (0x603, bytes.fromhex("4000100000000000")),
        (0x583, bytes.fromhex("4200100092010200")),
    ]
