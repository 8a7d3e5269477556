"""The P3 of 2016 and python-canopen: mute until the first NMT message, then a drive without a state
machine. Its dictionary is the exported EDS."""

import struct
import time

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from axis import wait_until
from conftest import connected
from remote import Heard, add, refusal
from simulation import Simulation, directory

DRIVE = "p3-jpl"
Q16 = 65536


@pytest.fixture(scope="module")
def drives():
    """Two virtual drives."""
    running = Simulation("1-2", directory() / "p3-jpl.log", drive=DRIVE)
    assert running.ready == "ready: 2 virtual p3-jpl drives, nodes 1-2"
    yield running
    running.stop()


@pytest.fixture
def network(drives):
    """All drives reset: in BarrettCAN."""
    for network in connected(drives.socketcand()):
        network.nmt.send_command(0x81)
        time.sleep(0.2)
        yield network
        network.nmt.send_command(0x81)


@pytest.fixture
def node(network):
    """Node 1, operational; idle at the end."""
    node = add(network, DRIVE)
    network.nmt.send_command(0x01)
    wait_until(lambda: node.nmt.state == "OPERATIONAL", 3, "the first heartbeat")
    yield node
    node.sdo[0x6060].raw = 0


def test_nobody_answers_before_the_first_nmt_message(network):
    heartbeats = Heard(network, 0x701)
    network.scanner.reset()
    network.scanner.search(10)
    node = add(network, DRIVE)
    node.sdo.RESPONSE_TIMEOUT = 0.2
    with pytest.raises(canopen.SdoCommunicationError):
        node.sdo[0x1000].raw
    assert network.scanner.nodes == []
    assert heartbeats.all == []
    # BarrettCAN: the host, 0, reads THERM (20) and CTS (68) of number 1; the answers go to group 6.
    answers = Heard(network, 0x426)
    network.send_message(0x001, [20])
    assert answers.came.wait(3)
    therm = struct.unpack("<BBh", answers.all[0])
    assert therm[:2] == (0x94, 0) and 20 < therm[2] / 256 < 60
    answers.came.clear()
    network.send_message(0x001, [68])
    assert answers.came.wait(3)
    assert answers.all[1] == struct.pack("<BBi", 0xC4, 0, 4096)
    # The message to all ends it: no boot-up, one heartbeat with the state.
    network.nmt.send_command(0x80)
    wait_until(lambda: heartbeats.all, 3, "a heartbeat")
    time.sleep(0.2)
    assert heartbeats.all == [b"\x7f"]
    assert node.sdo[0x1000].raw == 0x20192
    network.scanner.search(10)
    wait_until(lambda: sorted(network.scanner.nodes) == [1, 2], 3, "both nodes")
    network.send_message(0x001, [20])
    time.sleep(0.2)
    assert len(answers.all) == 2


def test_the_dictionary(node):
    assert node.sdo[0x1008].raw == "Puck"
    assert node.sdo[0x1009].raw == "sim1"
    assert node.sdo["Identity object"]["Vendor ID"].raw == 0x408
    read = 0
    for entry in node.object_dictionary.values():
        subs = [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else entry.values()
        for variable in subs:
            node.sdo.upload(variable.index, variable.subindex)
            read += 1
            if not variable.writable:
                code = refusal(lambda: node.sdo.download(variable.index, variable.subindex, b"\0"))
                assert code == 0x06010002, variable.name
    assert read == 259
    # "NOT IMPLEMENTED": acknowledged, without effect.
    for index, sub, size in [(0x6040, 0, 2), (0x606F, 0, 4), (0x2A10, 1, 1), (0x2A12, 2, 1)]:
        node.sdo.download(index, sub, b"\x01" * size)
        assert not any(node.sdo.upload(index, sub)), f"{index:04X}"


def test_refusals(node):
    def write(index, value, sub=0):
        return lambda: node.sdo.download(index, sub, value)

    for mode in (2, 5, 8, -1):
        assert refusal(lambda: setattr(node.sdo[0x6060], "raw", mode)) == 0x06090030
    assert refusal(write(0x6083, struct.pack("<i", -1))) == 0x06090032
    assert refusal(write(0x1010, b"evas", 1)) == 0x08000020
    assert refusal(write(0x6071, b"\0\0")) == 0x06020000
    assert refusal(write(0x1018, b"\0\0\0\0", 7)) == 0x06090011
    # python-canopen says the size, and it is not the object's.
    assert refusal(write(0x607A, b"\0\0")) == 0x06070013
    # Segments are not supported.
    assert refusal(write(0x607A, b"\0\0\0\0\0")) == 0x05040001
    # Bits are no bytes.
    assert refusal(write(0x1600, bytes([4, 0, 0x60, 0x60]), 1)) == 0x06040041
    assert refusal(write(0x1600, bytes([24, 0, 0x7A, 0x60]), 1)) == 0x06040041


def test_a_master_of_cia_402_finds_no_state_machine(network):
    class Impatient(BaseNode402):
        TIMEOUT_SWITCH_STATE_FINAL = 0.5
        TIMEOUT_SWITCH_STATE_SINGLE = 0.3

    node = add(network, DRIVE, kind=Impatient)
    network.nmt.send_command(0x01)
    wait_until(lambda: node.nmt.state == "OPERATIONAL", 3, "the first heartbeat")
    node.tpdo.read()
    node.rpdo.read()
    assert node.state == "NOT READY TO SWITCH ON"
    with pytest.raises((RuntimeError, ValueError)):
        node.state = "OPERATION ENABLED"
    assert node.sdo[0x6041].raw == 0


def test_a_streamed_position_in_sixteen_bits(network, node):
    for pdo in (node.rpdo[1], node.tpdo[1]):
        pdo.read()
        pdo.clear()
    node.rpdo[1].add_variable(0x607A, length=16)
    node.rpdo[1].trans_type = 255
    node.tpdo[1].add_variable(0x6063, length=16)
    node.tpdo[1].trans_type = 0
    for pdo in (node.rpdo[1], node.tpdo[1]):
        pdo.enabled = True
        pdo.save()
    assert node.sdo[0x1600][1].raw == 0x607A0010
    node.sdo[0x3F63].raw = 0
    node.sdo[0x6060].raw = 1
    shown = Heard(network, 0x181)
    for target in [*range(0, 3000, 50), *range(3000, -2000, -50)]:
        network.send_message(0x201, struct.pack("<h", target))
        time.sleep(0.002)
    # Longer than mapped: taken all the same.
    network.send_message(0x201, struct.pack("<hh", -2000, 0x55))

    def asked() -> int:
        shown.came.clear()
        network.sync.transmit()
        assert shown.came.wait(3)
        assert len(shown.all[-1]) == 2
        return struct.unpack("<h", shown.all[-1])[0]

    wait_until(lambda: abs(asked() + 2000) <= 4, 5, "there")
    assert node.sdo[0x607A].raw == -2000


def test_velocity_torque_and_the_trapezoid(node):
    node.sdo[0x6060].raw = 3
    node.sdo[0x60FF].raw = 60 * Q16
    wait_until(lambda: abs(node.sdo[0x606C].raw / Q16 - 60) < 3, 5, "60 rad/s")
    assert node.sdo[0x606B].raw == pytest.approx(60 * Q16, abs=0.01 * Q16)
    node.sdo[0x60FF].raw = 0
    wait_until(lambda: abs(node.sdo[0x606C].raw / Q16) < 2, 5, "standstill")

    node.sdo[0x6060].raw = 4
    node.sdo[0x6074].raw = -50
    wait_until(lambda: node.sdo[0x606C].raw < -20 * Q16, 5, "backwards")
    node.sdo[0x6074].raw = 0

    node.sdo[0x6060].raw = 7
    node.sdo[0x3F63].raw = 0
    time.sleep(0.5)
    node.sdo[0x607A].raw = 30_000
    wait_until(lambda: abs(node.sdo[0x6064].raw - 30_000) <= 5, 5, "at the target")
    # 32 bits: its two halves are one property.
    assert abs(node.sdo[0x3F00][48].raw - 30_000) <= 5
    assert node.sdo[0x6061].raw == node.sdo[0x3F00][8].raw == 7


def test_saved_parameters_and_the_default_mode(network, node):
    node.sdo[0x3F60].raw = 7
    node.sdo[0x1018][6].raw = 12
    node.sdo.RESPONSE_TIMEOUT = 5
    node.sdo[0x1010][1].raw = 0x65766173
    answers = Heard(network, 0x426)
    network.nmt.send_command(0x81)
    time.sleep(0.2)
    network.send_message(0x001, [1])
    assert answers.came.wait(3)
    assert answers.all[0] == bytes([0x81, 0, 12, 0]), "ROLE"
    network.nmt.send_command(0x01)
    wait_until(lambda: node.sdo[0x6061].raw == 7, 3, "its default mode")
    node.sdo[0x3F60].raw = 0
    node.sdo[0x1018][6].raw = 0
    node.sdo[0x1010][1].raw = 0x65766173
