"""The MAB MD80 and python-canopen: what its page allows, the maker's sequences, the expected refusals.
Its dictionary is the exported EDS."""

import struct
import threading
import time

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from axis import wait_until
from conftest import connected
from remote import Heard, add, refusal
from simulation import Simulation, directory

DRIVE = "md80"
TURN = 16384
SERVICE, IDLE, PROFILE_POSITION, PROFILE_VELOCITY, CYCLIC_POSITION, CYCLIC_VELOCITY = -1, 0, 1, 3, 8, 9
DEVICE_STATE = 0x08000022


@pytest.fixture(scope="module")
def drives():
    running = Simulation("1-2", directory() / "md80.log", drive=DRIVE)
    assert running.ready == "ready: 2 virtual md80 drives, nodes 1-2"
    yield running
    running.stop()


@pytest.fixture(scope="module")
def out_of_the_box():
    running = Simulation("1", directory() / "md80-factory.log", "--factory", drive=DRIVE)
    yield running
    running.stop()


@pytest.fixture
def network(drives):
    yield from connected(drives.socketcand())


def reset(network, kind=canopen.RemoteNode):
    """Node 1 after a reset; nothing that an earlier test wrote is left."""
    node = add(network, DRIVE, kind=kind)
    booted = threading.Event()
    network.subscribe(0x701, lambda _id, data, _stamp: data == b"\0" and booted.set())
    node.nmt.send_command(0x81)
    assert booted.wait(5), "no boot-up"
    time.sleep(0.05)
    # This process may not be heard of for longer than the drive waits.
    node.sdo[0x2000][12].raw = 0
    return node


@pytest.fixture
def node(network):
    node = reset(network)
    yield node
    node.sdo[0x6040].raw = 0


def write(entry, value) -> int:
    def act():
        entry.raw = value

    return refusal(act)


def enable(node, mode: int) -> None:
    node.sdo[0x6040].raw = 6
    node.sdo[0x6040].raw = 15
    assert node.sdo[0x6041].raw & 0x6F == 0x27
    node.sdo[0x6060].raw = mode
    assert node.sdo[0x6061].raw == mode


def as_the_maker_writes(network, index: int, sub: int, data: bytes) -> bytes:
    """Eight bytes with command 0x22, whatever the object's size; the answer."""
    answers = Heard(network, 0x581)
    request = struct.pack("<BHB", 0x22, index, sub) + data.ljust(4, b"\0")
    network.send_message(0x601, request)
    assert answers.came.wait(3)
    return answers.all[0]


def test_the_sample_motor_is_set(node):
    settings = node.sdo[0x2000]
    assert settings[1].raw == 21
    assert settings[2].raw == pytest.approx(0.091)
    assert settings[6].raw.rstrip("\0") == "AK80_9"
    assert settings[8].raw == pytest.approx(0.11111)
    assert node.sdo[0x1008].raw == "MD80"
    assert node.sdo[0x1000].raw == 0x00020192
    assert node.sdo[0x6502].raw == 647
    assert node.sdo[0x6079].raw == pytest.approx(48000, abs=100)
    assert 20 < node.sdo[0x2006][1].raw < 40


def test_what_it_refuses(node):
    assert write(node.sdo[0x2000][1], 1) == 0x06090032
    assert write(node.sdo[0x2000][3], 1e-9) == 0x06090032
    assert write(node.sdo[0x2000][4], 25.0) == 0x06090031
    assert write(node.sdo[0x6060], 4) == 0x06090030
    assert write(node.sdo[0x6072], 40000) == 0x06090031
    for sub in range(1, 7):
        assert write(node.sdo[0x2003][sub], True) == DEVICE_STATE
    assert refusal(lambda: node.sdo.download(0x6064, 0, bytes(4))) == 0x06010002
    assert refusal(lambda: node.sdo.upload(0x0020, 0)) == 0x06020000


def test_the_makers_sequences(network, node):
    """enable, service mode, zero: 8, 6, 15, then -2, which shows as -1."""
    for word in (8, 6, 15):
        answer = as_the_maker_writes(network, 0x6040, 0, struct.pack("<H", word))
        assert answer[:4] == b"\x60\x40\x60\x00"
    assert node.sdo[0x6041].raw == 39
    as_the_maker_writes(network, 0x6060, 0, b"\xfe")
    assert node.sdo[0x6061].raw == SERVICE
    assert node.sdo[0x6060].raw == -2
    assert as_the_maker_writes(network, 0x2003, 5, b"\x01")[0] == 0x60
    time.sleep(0.05)
    assert node.sdo[0x6064].raw == 0
    # It writes 6 into the mode before it saves, and saves in this state: refused.
    assert as_the_maker_writes(network, 0x6060, 0, b"\x06")[0] == 0x60
    assert node.sdo[0x6061].raw == SERVICE
    assert as_the_maker_writes(network, 0x1010, 1, b"save")[0] == 0x80


def test_a_move_of_one_turn(node):
    node.sdo[0x6083].raw = 300
    node.sdo[0x6084].raw = 300
    node.sdo[0x6067].raw = 100
    enable(node, PROFILE_POSITION)
    start = node.sdo[0x6064].raw
    node.sdo[0x607A].raw = start + TURN
    wait_until(lambda: node.sdo[0x6041].raw & 0x400, 10, "target reached")
    assert node.sdo[0x6064].raw == pytest.approx(start + TURN, abs=150)


@pytest.mark.parametrize("mode", [PROFILE_VELOCITY, CYCLIC_VELOCITY])
def test_velocity_and_the_quick_stop(node, mode):
    node.sdo[0x6083].raw = 600
    node.sdo[0x6084].raw = 600
    enable(node, mode)
    node.sdo[0x60FF].raw = 60
    wait_until(lambda: abs(node.sdo[0x606C].raw - 60) <= 3, 5, "60 RPM")
    node.sdo[0x6040].raw = 2
    wait_until(lambda: node.sdo[0x6041].raw & 0x4F == 0x40, 5, "switch on disabled")


def test_the_watchdog_stops_it(node):
    node.sdo[0x6083].raw = 600
    enable(node, PROFILE_VELOCITY)
    node.sdo[0x60FF].raw = 30
    node.sdo[0x2000][12].raw = 100
    time.sleep(1)
    wait_until(lambda: node.sdo[0x6041].raw & 0x4F == 0x40, 5, "switch on disabled")
    assert node.sdo[0x2004][8].raw == 1 << 30


def test_the_402_profile_of_python_canopen(network):
    node = reset(network, BaseNode402)
    node.TIMEOUT_SWITCH_STATE_FINAL = 5
    node.TIMEOUT_SWITCH_STATE_SINGLE = 3
    node.TIMEOUT_SWITCH_OP_MODE = 3
    node.setup_402_state_machine(read_pdos=False)
    node.state = "OPERATION ENABLED"
    assert node.state == "OPERATION ENABLED"
    node.op_mode = "PROFILED POSITION"
    assert node.op_mode == "PROFILED POSITION"
    # It believes 0x6502 = 647 (M5): mode 9, which the drive has, is not among it.
    assert not node.is_op_mode_supported("CYCLIC SYNCHRONOUS VELOCITY")
    assert node.is_op_mode_supported("VELOCITY")
    assert write(node.sdo[0x6060], 2) == 0x06090030
    node.state = "SWITCH ON DISABLED"


def test_pdos_on_sync(network):
    node = reset(network)
    node.nmt.state = "PRE-OPERATIONAL"
    node.tpdo.read()
    node.rpdo.read()
    assert [variable.index for variable in node.tpdo[2].map] == [0x6041, 0x6064]
    assert [variable.index for variable in node.rpdo[3].map] == [0x6040, 0x607A]
    node.tpdo[2].trans_type = 1
    node.tpdo[2].enabled = True
    node.tpdo[2].save()
    node.nmt.state = "OPERATIONAL"
    network.sync.start(0.01)
    try:
        assert node.tpdo[2].wait_for_reception(3) is not None
        assert node.tpdo[2][0x6041].raw & 0x6F == 0x40
    finally:
        network.sync.stop()


def test_a_drive_out_of_the_box_is_calibrated(out_of_the_box):
    for network in connected(out_of_the_box.socketcand()):
        node = reset(network)
        settings = node.sdo[0x2000]
        assert [settings[sub].raw for sub in (1, 2, 3, 4, 5)] == [0, 0, 0, 0, 0]
        assert node.sdo[0x2004][3].raw == 1 << 4
        settings[1].raw = 21
        settings[2].raw = 0.091
        settings[5].raw = 500
        settings[8].raw = 1 / 9
        node.sdo[0x6060].raw = SERVICE
        booted = threading.Event()
        network.subscribe(0x701, lambda _id, data, _stamp: data == b"\0" and booted.set())
        node.sdo[0x2003][3].raw = True
        assert write(node.sdo[0x2003][1], True) == DEVICE_STATE
        assert booted.wait(60), hex(node.sdo[0x2004][1].raw)
        time.sleep(0.1)
        assert settings[4].raw == pytest.approx(0.085, rel=0.03)
        assert settings[3].raw == pytest.approx(28.5e-6, rel=0.05)
        assert node.sdo[0x2004][3].raw == 0
        assert node.sdo[0x2004][1].raw == 0
