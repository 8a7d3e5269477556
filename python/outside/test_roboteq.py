"""A Roboteq controller with three channels, driven by python-canopen through offsets of 0x800."""

import time

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402, State402

import axis
from axis import wait_until
from conftest import connected
from dictionary import object_dictionary
from simulation import Simulation, directory

DRIVE = "roboteq-3"
CHANNELS = [1, 2, 3]
TARGET_REACHED = 1 << 10
# python-canopen names no negative modes.
OPEN_LOOP, COUNT_POSITION, VELOCITY, PROFILE_VELOCITY, TORQUE = 0, 1, 2, 3, 4
RELATIVE, TRACKING, SPEED_POSITION = -1, -2, -3


class Channel:
    """One channel's objects and state machine."""

    def __init__(self, node, number: int):
        self.sdo = node.sdo
        self.number = number
        self.offset = 0x800 * (number - 1)

    def __getitem__(self, index):
        return self.sdo[index + self.offset]

    @property
    def statusword(self) -> int:
        return self[0x6041].raw

    @property
    def state(self) -> str:
        word = self.statusword
        for state, (mask, bits) in State402.SW_MASK.items():
            if word & mask == bits:
                return state
        return "UNKNOWN"

    @state.setter
    def state(self, target: str):
        for _ in range(8):
            now = self.state
            if now == target:
                return
            direct = State402.TRANSITIONTABLE.get((now, target))
            step = target if direct is not None else State402.next_state_indirect(now)
            self[0x6040].raw = State402.TRANSITIONTABLE[(now, step)]
        assert self.state == target

    @property
    def mode(self) -> int:
        return self[0x6061].raw

    @mode.setter
    def mode(self, mode: int):
        self[0x6060].raw = mode
        assert self.mode == mode

    def refuses(self, index: int, value: int, code: int):
        with pytest.raises(canopen.SdoAbortedError) as refused:
            self[index].raw = value
        assert refused.value.code == code


@pytest.fixture(scope="module")
def controller():
    """One virtual controller with three channels."""
    running = Simulation("1", directory() / "roboteq.log", "--channels", "3", drive="roboteq")
    assert running.ready == "ready: 1 virtual roboteq-3 drive, node 1"
    yield running
    running.stop()


@pytest.fixture
def network(controller):
    yield from connected(controller.socketcand())


@pytest.fixture
def fresh(network):
    """Node 1 after a reset, with the state machine off."""
    return axis.reset(network, lambda node_id: object_dictionary(DRIVE, node_id), 1)


@pytest.fixture
def node(fresh):
    """The same without the watchdog of commands: these tests wait for longer than a second."""
    fresh.sdo[0x3008].raw = 0
    return fresh


@pytest.fixture
def channels(node):
    """All channels with the state machine on, and off again at the end."""
    node.sdo[0x30F1].raw = 1
    all_channels = [Channel(node, number) for number in CHANNELS]
    assert [channel.statusword for channel in all_channels] == [0x0250] * 3
    yield all_channels
    for channel in all_channels:
        channel[0x6040].raw = 0
    node.sdo[0x30F1].raw = 0


def test_without_the_state_machine_there_is_none(node):
    for number in CHANNELS:
        channel = Channel(node, number)
        for word in (6, 7, 15):
            channel[0x6040].raw = word
            assert channel.statusword == 0
        # Its commands count all the same.
        channel.mode = PROFILE_VELOCITY
        channel[0x60FF].raw = 300 * number
    for number in CHANNELS:
        channel = Channel(node, number)
        wait_until(lambda channel=channel: abs(channel[0x606C].raw - 300 * channel.number) < 12, 3, "speed")
        channel[0x60FF].raw = 0


def test_base_node_402_walks_the_first_channel(node, channels):
    assert isinstance(node, BaseNode402)
    for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED", "SWITCHED ON",
                  "READY TO SWITCH ON", "SWITCH ON DISABLED", "OPERATION ENABLED"):
        node.state = state
        assert node.state == state
    assert [channel.state for channel in channels[1:]] == ["SWITCH ON DISABLED"] * 2


def test_every_channel_walks_by_itself(channels):
    for channel in channels:
        others = [other for other in channels if other is not channel]
        for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED"):
            channel.state = state
            assert {other.state for other in others} == {"SWITCH ON DISABLED"}
        channel.state = "SWITCH ON DISABLED"


def test_three_channels_in_three_modes(channels):
    first, second, third = channels
    first.mode, second.mode, third.mode = PROFILE_VELOCITY, COUNT_POSITION, RELATIVE
    for channel in channels:
        channel.state = "OPERATION ENABLED"
    first[0x60FF].raw = 400
    second[0x607A].raw = second[0x6064].raw + 8192
    there = second[0x607A].raw
    third[0x607A].raw = 100
    for channel in (second, third):
        channel[0x6040].raw = 0x1F
        wait_until(lambda channel=channel: channel.statusword & 1 << 12, 1, "acknowledge")
        channel[0x6040].raw = 0x0F
    for channel in channels:
        wait_until(lambda channel=channel: channel.statusword & TARGET_REACHED, 5, "target reached")
    assert abs(first[0x606C].raw - 400) < 12
    assert abs(second[0x6064].raw - there) <= 20
    assert third[0x6064].raw == 100
    # Halt on the first; the others stay.
    first[0x6040].raw = 0x10F
    wait_until(lambda: abs(first[0x606C].raw) < 5, 3, "halted")
    assert first.state == "OPERATION ENABLED"


def test_velocity_mode_torque_and_open_loop(channels):
    first, second, third = channels
    first.mode, second.mode, third.mode = VELOCITY, TORQUE, OPEN_LOOP
    for channel in channels:
        channel.state = "OPERATION ENABLED"
    first[0x6040].raw = 0x7F
    first[0x6042].raw = 350
    second[0x6071].raw = 2
    third.sdo[0x2000][3].raw = 200
    wait_until(lambda: abs(first[0x6044].raw - 350) < 12, 3, "speed")
    wait_until(lambda: second[0x606C].raw > 500, 5, "a motor that torque speeds up")
    wait_until(lambda: abs(third.sdo[0x2103][3].raw - 860) < 60, 5, "a fifth of the voltage")
    third.sdo[0x2000][3].raw = 0


def test_who_commands_must_go_on_commanding(fresh):
    assert fresh.sdo[0x3008].raw == 1000
    fresh.sdo[0x30F1].raw = 1
    first = Channel(fresh, 1)
    first.mode = PROFILE_VELOCITY
    first.state = "OPERATION ENABLED"
    for _ in range(15):
        first[0x60FF].raw = 300
        time.sleep(0.1)
    assert abs(first[0x606C].raw - 300) < 12
    # Reading it is no command.
    wait_until(lambda: abs(first[0x606C].raw) < 5, 3, "rest")
    assert first.state == "OPERATION ENABLED"
    assert not first.statusword & TARGET_REACHED
    first[0x60FF].raw = 300
    wait_until(lambda: abs(first[0x606C].raw - 300) < 12, 1, "speed")
    first[0x6040].raw = 0
    fresh.sdo[0x30F1].raw = 0


def test_what_the_document_does_not_allow_is_refused(node, channels):
    for channel in channels:
        for mode in (5, 6, 7, 8, 10, -5):
            channel.refuses(0x6060, mode, 0x06090030)
        channel.refuses(0x6041, 0, 0x06010002)
        channel.refuses(0x6502, 0, 0x06010002)
        channel.mode = TRACKING
        channel.refuses(0x607A, 1001, 0x06090031)
        channel.refuses(0x607A, -1001, 0x06090032)
    # Bit 30 of a TPDO's COB-ID.
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo[0x1800][1].raw = 0x181
    assert refused.value.code == 0x06090030
    assert node.sdo[0x1800][1].raw == 0x40000181
    # No signature.
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo[0x1010][1].raw = 1
    assert refused.value.code == 0x08000020
    # A window less than there are.
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo.download(0x7840, 0, b"\x06\x00")
    assert refused.value.code == 0x06020000


def test_a_mapped_channel_goes_by_pdo(network, node, channels):
    """Channel 2's words in PDOs that python-canopen maps."""
    second = channels[1]
    second.mode = SPEED_POSITION
    node.tpdo.read()
    node.rpdo.read()
    node.rpdo[1].clear()
    node.rpdo[1].add_variable(0x6840)
    node.rpdo[1].add_variable(0x68FF)
    node.tpdo[1].clear()
    node.tpdo[1].add_variable(0x6841)
    node.tpdo[1].add_variable(0x686C)
    node.tpdo[1].cob_id = 0x181
    node.tpdo[1].rtr_allowed = False
    node.tpdo[1].trans_type = 1
    node.tpdo[1].enabled = True
    for pdo in (node.rpdo[1], node.tpdo[1]):
        pdo.save()
    node.nmt.state = "OPERATIONAL"
    for word in (6, 7, 15):
        node.rpdo[1][0x6840].raw = word
        node.rpdo[1][0x68FF].raw = 500
        node.rpdo[1].transmit()
        time.sleep(0.02)
    wait_until(lambda: second.state == "OPERATION ENABLED", 1, "enabled by PDO")

    def arrived():
        network.sync.transmit()
        node.tpdo[1].wait_for_reception(0.5)
        return abs(node.tpdo[1][0x686C].raw - 500) < 12

    wait_until(arrived, 5, "speed by PDO")
    assert node.tpdo[1][0x6841].raw & 0x6F == 0x27
    node.nmt.state = "PRE-OPERATIONAL"
