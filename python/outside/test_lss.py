"""Layer setting services with python-canopen's LSS master: drives without a node ID get one."""

import time

import canopen
import pytest
from canopen.lss import LssError

from conftest import connected
from dictionary import object_dictionary
from simulation import Simulation, directory, replayed

DRIVE = "p3-extended"
UNCONFIGURED = "unconfigured:3"
IDS = [5, 6, 7]

# python-canopen waits for this long where nobody answers a question of a scan; a drive answers
# within 2 ms. Its default of 0.5 s makes a scan last a minute.
SCAN_TIMEOUT_S = 0.1
ANSWER_TIMEOUT_S = 3
BOOT_TIMEOUT_S = 5


class Bus:
    """A simulation whose drives keep what they store, and a network on it."""

    def __init__(self, name: str, store):
        log = directory() / f"lss-{name}.log"
        self.simulation = Simulation(UNCONFIGURED, log, "--store", str(store), drive=DRIVE)
        self._connection = connected(self.simulation.socketcand())
        self.network = next(self._connection)
        self.lss = self.network.lss
        self.lss.RESPONSE_TIMEOUT = ANSWER_TIMEOUT_S

    def stop(self):
        for _ in self._connection:
            raise AssertionError("a network is connected once")
        self.simulation.stop()
        assert replayed(self.simulation.log)

    def told(self) -> str:
        """What the simulation has said of its drives."""
        return self.simulation.log.with_suffix(".stderr.txt").read_text()

    def scan(self):
        """The identity of the next drive without a node ID, or None."""
        self.lss.RESPONSE_TIMEOUT = SCAN_TIMEOUT_S
        try:
            found, identity = self.lss.fast_scan()
        finally:
            self.lss.RESPONSE_TIMEOUT = ANSWER_TIMEOUT_S
        return tuple(identity) if found else None

    def waiting(self):
        self.lss.send_switch_state_global(self.lss.WAITING_STATE)
        # It has no answer.
        time.sleep(0.05)

    def boots(self, node_id: int) -> bool:
        """Sends all drives to waiting; whether this node boots then."""
        heard = []
        self.network.subscribe(0x700 + node_id, lambda _id, data, _t: heard.append(bytes(data)))
        self.waiting()
        until = time.monotonic() + BOOT_TIMEOUT_S
        while not heard and time.monotonic() < until:
            time.sleep(0.01)
        self.network.unsubscribe(0x700 + node_id)
        return heard[:1] == [b"\0"]

    def assign(self, node_id: int):
        """Finds a drive and gives it a node ID for good; gives its identity."""
        identity = self.scan()
        assert identity is not None, "no drive without a node ID"
        self.lss.configure_node_id(node_id)
        self.lss.store_configuration()
        assert self.boots(node_id), f"node {node_id} does not boot"
        return identity

    def nodes(self) -> list:
        """Who answers SDO requests."""
        self.network.scanner.reset()
        self.network.scanner.search()
        time.sleep(0.5)
        return sorted(self.network.scanner.nodes)

    def identity(self, node_id: int) -> tuple:
        """0x1018 of a node."""
        node = self.network.add_node(canopen.RemoteNode(node_id, object_dictionary(DRIVE, node_id)))
        return tuple(node.sdo[0x1018][sub].raw for sub in range(1, 5))


@pytest.fixture
def start(request, tmp_path):
    """Starts a bus; what its drives store is there when it is started again."""
    running = []

    def start():
        bus = Bus(f"{request.node.name}-{len(running)}", tmp_path / "store")
        running.append(bus)
        return bus

    yield start
    for bus in running[-1:]:
        bus.stop()


@pytest.fixture
def bus(start):
    return start()


def test_drives_without_a_node_id_answer_nothing_but_lss(bus):
    assert bus.nodes() == []
    assert bus.scan() is not None


def test_fastscan_finds_each_drive_once(bus):
    # A drive that was found is in configuration and takes no part any more.
    found = [bus.scan() for _ in range(3)]
    assert len(set(found)) == 3 and None not in found
    assert len({serial for _, _, _, serial in found}) == 3
    assert found == sorted(found), "the lowest is found first"
    assert bus.scan() is None
    # Nothing was given to them, so they are found again.
    bus.waiting()
    assert bus.scan() == found[0]


def test_node_ids_are_stored_and_stay(start):
    bus = start()
    identities = {node_id: bus.assign(node_id) for node_id in IDS}
    assert bus.scan() is None
    assert bus.nodes() == IDS
    for node_id, identity in identities.items():
        assert bus.identity(node_id) == identity
    bus.stop()
    again = start()
    assert again.nodes() == IDS
    for node_id, identity in identities.items():
        assert again.identity(node_id) == identity
    assert again.scan() is None


def test_what_is_not_stored_is_gone_after_a_restart(start):
    bus = start()
    assert bus.scan() is not None
    bus.lss.configure_node_id(9)
    assert bus.boots(9)
    assert bus.nodes() == [9]
    bus.stop()
    assert start().nodes() == []


def test_a_drive_is_selected_and_tells_its_identity(bus):
    identity = bus.assign(5)
    assert bus.lss.send_switch_state_selective(*identity)
    # 90 to 93: vendor ID, product code, revision number, serial number.
    assert tuple(bus.lss.inquire_lss_address(90 + part) for part in range(4)) == identity
    assert bus.lss.inquire_node_id() == 5
    # A node ID that is only pending is not told.
    bus.lss.configure_node_id(8)
    assert bus.lss.inquire_node_id() == 5
    bus.waiting()
    assert bus.nodes() == [5]
    bus.network.send_message(0, [0x82, 5])
    time.sleep(0.5)
    assert bus.nodes() == [8]


def test_an_identity_that_nobody_has_selects_nobody(bus):
    vendor, product, revision, serial = bus.scan()
    bus.waiting()
    bus.lss.RESPONSE_TIMEOUT = SCAN_TIMEOUT_S
    for wrong in [
        (vendor + 1, product, revision, serial),
        (vendor, product + 1, revision, serial),
        (vendor, product, revision + 1, serial),
        (vendor, product, revision, 0xFFFF_FFFF),
    ]:
        with pytest.raises(LssError, match="No LSS response"):
            bus.lss.send_switch_state_selective(*wrong)
    # And nobody is in configuration.
    with pytest.raises(LssError, match="No LSS response"):
        bus.lss.inquire_node_id()


@pytest.mark.parametrize("wrong", [0, 128, 254])
def test_what_is_no_node_id_is_refused(bus, wrong):
    assert bus.scan() is not None
    assert bus.lss.inquire_node_id() == 0xFF
    with pytest.raises(LssError, match="LSS Error: 1"):
        bus.lss.configure_node_id(wrong)
    bus.waiting()
    assert bus.nodes() == []


def test_bit_rates_of_table_0_are_taken(bus):
    assert bus.scan() is not None
    for index in [0, 1, 2, 3, 4, 6, 7, 8]:
        bus.lss.configure_bit_timing(index)
    for index in [5, 10, 255]:
        with pytest.raises(LssError, match="LSS Error: 1"):
            bus.lss.configure_bit_timing(index)


def test_a_node_id_can_be_taken_away(start):
    bus = start()
    identity = bus.assign(5)
    assert bus.lss.send_switch_state_selective(*identity)
    bus.lss.configure_node_id(0xFF)
    bus.lss.store_configuration()
    bus.waiting()
    assert bus.nodes() == [5], "until its communication is reset"
    bus.network.send_message(0, [0x82, 5])
    time.sleep(0.5)
    assert bus.nodes() == []
    assert bus.scan() == identity


def test_a_bit_rate_is_activated_stored_and_then_missed_at_the_old_one(start):
    bus = start()
    identity = bus.assign(5)
    assert bus.lss.send_switch_state_selective(*identity)
    bus.lss.configure_bit_timing(4)
    bus.lss.store_configuration()
    bus.lss.activate_bit_timing(50)
    time.sleep(0.3)
    bus.waiting()
    assert bus.nodes() == [5]
    bus.stop()
    # The next bus has 1 Mbit/s again, and the drive has 125 kbit/s.
    again = start()
    assert again.nodes() == []
    assert "node 5 (drive u" in again.told() and "it starts with 125 kbit/s" in again.told()
