"""What only the P3 has, by python-canopen: modes 11 and 12, the node ID, one entry saved, gains."""

import math
import time

import canopen
import pytest

from conftest import connected
from dictionary import object_dictionary
from simulation import Simulation, directory, replayed

BOOT_TIMEOUT_S = 5
OUT_OF_RANGE = 0x06090030
NOT_NOW = 0x08000022
CANNOT_STORE = 0x08000020


@pytest.fixture
def bus(tmp_path):
    """A P3 of its own that keeps what it stores; a network on its bus."""
    log = directory() / "p3-objects.log"
    simulation = Simulation("1", log, "--store", str(tmp_path / "store"))
    connection = connected(simulation.socketcand())
    network = next(connection)
    yield network
    for _ in connection:
        raise AssertionError("a network is connected once")
    simulation.stop()
    assert replayed(log)


def node_of(network, node_id: int):
    node = canopen.RemoteNode(node_id, object_dictionary("p3", node_id))
    node.sdo.RESPONSE_TIMEOUT = 3
    network.add_node(node)
    return node


def enable(node, mode: int) -> None:
    """The manual's two controlwords, and the mode (l.243)."""
    node.sdo[0x6040].raw = 0x86
    node.sdo[0x6040].raw = 0x0F
    node.sdo[0x6060].raw = mode
    assert node.sdo[0x6061].raw == mode


def wait_for(condition, what: str) -> None:
    end = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.02)


def refused(write) -> int:
    with pytest.raises(canopen.SdoAbortedError) as caught:
        write()
    return caught.value.code


def test_the_electrical_zero_is_found_in_mode_12(bus):
    node = node_of(bus, 1)
    zero = node.sdo[0x3011][1].raw
    voltage, current = node.sdo[0x3010][4], node.sdo[0x3010][6]
    enable(node, 0)
    assert refused(lambda: setattr(voltage, "raw", 100)) == NOT_NOW
    node.sdo[0x6060].raw = 12
    node.sdo[0x60EA].raw = 0
    # l.262: half of 0.716 A.
    voltage.raw = round(2**15 * (0.716 * 0.5 * 13.1 / 2) / (48 / math.sqrt(3)))
    assert voltage.raw == 2773
    wait_for(lambda: abs(current.raw - 358) < 12, "the current")
    time.sleep(1)
    assert abs(node.sdo[0x3012][1].raw - zero) < 25
    # A quarter of a turn on; the motor has one pole pair.
    node.sdo[0x60EA].raw = 0x4000
    time.sleep(1)
    turned = (node.sdo[0x3012][1].raw - zero) % 4096
    assert abs(turned - 1024) < 25
    node.sdo[0x6040].raw = 0


def test_a_turning_angle_takes_the_rotor_along_in_mode_11(bus):
    node = node_of(bus, 1)
    enable(node, 11)
    node.sdo[0x60EA].raw = -0x4000
    node.sdo[0x6071].raw = 400
    time.sleep(1)
    start = node.sdo[0x6064].raw
    for step in range(1, 33):
        angle = -0x4000 + step * 2048
        node.sdo[0x60EA].raw = (angle + 0x8000) % 0x10000 - 0x8000
        time.sleep(0.05)
    time.sleep(2)
    assert abs(node.sdo[0x6064].raw - start - 4096) < 30
    assert abs(node.sdo[0x6077].raw - 400) < 40
    node.sdo[0x6040].raw = 0


def test_another_node_id_is_usable_at_once_and_can_be_saved(bus):
    node = node_of(bus, 1)
    assert refused(lambda: setattr(node.sdo[0x21B0], "raw", 128)) == OUT_OF_RANGE
    node.sdo[0x21B0].raw = 9
    renamed = node_of(bus, 9)
    assert renamed.sdo[0x21B0].raw == 9
    assert renamed.sdo[0x1014].raw == 0x89
    with pytest.raises(canopen.SdoCommunicationError):
        node.sdo.RESPONSE_TIMEOUT = 0.3
        node.sdo[0x21B0].raw
    renamed.sdo[0x1010][4].raw = 0x21B0 << 8
    renamed.nmt.send_command(0x81)
    renamed.nmt.wait_for_bootup(BOOT_TIMEOUT_S)
    assert renamed.sdo[0x21B0].raw == 9


def test_one_entry_is_saved_and_no_other(bus):
    node = node_of(bus, 1)
    save = node.sdo[0x1010][4]
    node.sdo[0x3011][10].raw = 700
    node.sdo[0x2121].raw = 33
    save.raw = 0x3011 << 8 | 10
    for what in (0x6064 << 8, 0x3012 << 8 | 1, 0x5000 << 8, 0x01000000):
        assert refused(lambda what=what: setattr(save, "raw", what)) == CANNOT_STORE
    node.nmt.send_command(0x81)
    node.nmt.wait_for_bootup(BOOT_TIMEOUT_S)
    assert node.sdo[0x3011][10].raw == 700
    assert node.sdo[0x2121].raw == 0


def test_gains_in_both_forms_agree(bus):
    node = node_of(bus, 1)
    gains = node.sdo[0x3019]
    # A per turn/s²: inertia over torque constant.
    inertia = node.sdo[0x3011][7].raw / 2**15 * 1e-7
    m = inertia / (node.sdo[0x3011][4].raw * 1e-3) * math.tau
    gains[10].raw, gains[11].raw = 800, 192
    omega, damping = math.tau * 80, 0.75
    assert gains[12].raw / 2**15 == pytest.approx(2 * damping * omega * m, rel=2e-3)
    assert gains[13].raw / 2**15 == pytest.approx(omega**2 * m, rel=1e-4)
    # Given: four times the integral gain are twice the frequency, and half the damping.
    gains[13].raw = 4 * gains[13].raw
    assert gains[10].raw == pytest.approx(1600, abs=2)
    assert gains[11].raw == pytest.approx(96, abs=2)
    # As the rule had them, they are the rule's again.
    gains[10].raw, gains[11].raw = 800, 192
    assert gains[13].raw / 2**15 == pytest.approx(omega**2 * m, rel=1e-4)
    for sub, bad in ((7, 0), (7, -1), (8, -1), (9, -1), (12, 0), (13, -1), (14, -1), (5, 0), (11, 0)):
        assert refused(lambda sub=sub, bad=bad: setattr(gains[sub], "raw", bad)) == OUT_OF_RANGE
