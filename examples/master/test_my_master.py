"""What the master does with each drive, and what it does when something is wrong."""

import threading

import canopen
import pytest

import my_master


def test_an_md80_turns(bus, eds):
    network = bus("--drive", "md80", "--nodes", "1")
    node = network.add_node(1, eds("md80"))
    before = node.sdo[0x6064].raw
    my_master.turn_md80(node, 1.5)
    assert node.sdo[0x6064].raw == pytest.approx(before + 1.5 * 16_384, abs=100)


def test_an_md80_refuses_what_its_page_says(bus, eds):
    network = bus("--drive", "md80", "--nodes", "1")
    node = network.add_node(1, eds("md80"))
    with pytest.raises(canopen.SdoAbortedError, match="0x08000022"):
        node.sdo[0x2003][3].raw = True  # a calibration, but not in the service mode


def test_a_sagging_supply_is_noticed(bus, eds, tmp_path):
    scenario = tmp_path / "sag.toml"
    scenario.write_text('[[event]]\nat = "3 s"\ndo = "motor-supply"\ndrive = 1\nto = "5 V"\n')
    dictionary = eds("md80")
    network = bus("--drive", "md80", "--nodes", "1", "--scenario", str(scenario))
    node = network.add_node(1, dictionary)
    told = threading.Event()
    node.emcy.add_callback(lambda emcy: emcy.code == 0x3220 and told.set())
    my_master.enable(node)
    assert told.wait(10)
    my_master.wait_for(lambda: node.sdo[0x6041].raw & 0x4F == 0x08)  # fault, behind its reaction


def test_a_roboteq_turns_three_motors(bus, eds):
    network = bus("--drive", "roboteq", "--channels", "3", "--nodes", "1")
    node = network.add_node(1, eds("roboteq-3"))
    for axis in (1, 2, 3):
        actual = node.sdo[0x6064 + 0x800 * (axis - 1)]
        my_master.turn_roboteq(node, axis, axis)
        assert actual.raw == pytest.approx(4096 * axis, abs=20)


def test_without_the_state_machine_a_roboteq_is_never_enabled(bus, eds):
    network = bus("--drive", "roboteq", "--nodes", "1")
    node = network.add_node(1, eds("roboteq"))
    with pytest.raises(TimeoutError):
        my_master.enable(node)


def test_different_drives_share_a_bus(bus, eds):
    network = bus("--node", "1=md80", "--node", "2=roboteq")
    my_master.turn_md80(network.add_node(1, eds("md80")), -0.5)
    my_master.turn_roboteq(network.add_node(2, eds("roboteq")), 2)
