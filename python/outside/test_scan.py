"""Finding the drives."""

import time

from conftest import NODES


def test_the_scanner_finds_all_nodes(network):
    network.scanner.reset()
    network.scanner.search()
    time.sleep(0.5)
    assert sorted(network.scanner.nodes) == NODES


def test_a_reset_of_all_boots_all(network):
    boots = {node: [] for node in NODES}
    for node, heard in boots.items():
        network.subscribe(0x700 + node, lambda _id, data, _t, heard=heard: heard.append(bytes(data)))
    network.nmt.send_command(0x81)
    until = time.monotonic() + 5
    while not all(boots.values()) and time.monotonic() < until:
        time.sleep(0.01)
    # No heartbeat is configured, so nothing follows.
    time.sleep(0.2)
    assert boots == {node: [b"\0"] for node in NODES}


def test_heartbeats_tell_the_nmt_state(node):
    node.sdo[0x1017].raw = 50
    node.nmt.state = "OPERATIONAL"
    # The state that a heartbeat brings, not the one that was commanded.
    assert node.nmt.wait_for_heartbeat(1) == "OPERATIONAL"
    node.nmt.state = "STOPPED"
    assert node.nmt.wait_for_heartbeat(1) == "STOPPED"
    node.nmt.state = "PRE-OPERATIONAL"
    assert node.nmt.wait_for_heartbeat(1) == "PRE-OPERATIONAL"
    node.sdo[0x1017].raw = 0
