"""One of each documented drive on one bus, and python-canopen as the master of all of them. Each
dictionary is the EDS that `servobus eds` exports."""

import struct
import time

import pytest
from canopen.lss import LssError

from axis import wait_until
from conftest import connected
from dictionary import drives
from remote import Heard, add, refusal
from simulation import Simulation, directory, replayed

NODES = {1: "p3", 2: "p3-extended", 3: "p3-jpl", 4: "md80", 5: "roboteq-3"}
# 0x1008.
NAMES = {1: "P3", 2: "P3 extended", 3: "Puck", 4: "MD80", 5: "RoboMC"}
# The P3 of 2016 waits for an NMT message, says no boot-up and has no state machine.
WAITING = 3

# The P3s have no segments.
EXPEDITED_ONLY = ["p3", "p3-jpl"]

SYNCS = 250
SYNC_PERIOD_S = 0.004
# Operation enabled under this mask.
STATE_MASK, ENABLED = 0x6F, 0x27

# RPDO, what is mapped in it, and its fields while the set-point moves: a step in each SYNC, or a
# value that stays.
SET_POINTS = {
    1: (1, [0x607A], lambda n: struct.pack("<i", 20 * n)),
    2: (1, [0x607A], lambda n: struct.pack("<i", 20 * n)),
    3: (1, [0x607A], lambda n: struct.pack("<i", 20 * n)),
    # As it came: controlword and target position.
    4: (3, None, lambda n: struct.pack("<Hi", 0x0F, 20 * n)),
    5: (1, [0x60FF, 0x68FF], lambda n: struct.pack("<ii", 200, -150)),
}
# TPDOs and what is mapped in them.
ACTUAL = {
    1: {1: [0x6041, 0x6064], 2: [0x606C]},
    2: {1: [0x6041, 0x6064], 2: [0x606C]},
    3: {1: [0x6061, 0x6064], 2: [0x606C]},
    4: {1: None, 2: None, 3: None},
    5: {1: [0x6041, 0x6064], 2: [0x6841, 0x6864], 3: [0x7041, 0x7064]},
}


@pytest.fixture(scope="module")
def simulation():
    running = Simulation(NODES, directory() / "mixed.log")
    kinds = ", ".join(f"{node_id} {drive}" for node_id, drive in NODES.items())
    assert running.ready == f"ready: {len(NODES)} virtual drives, nodes 1-{len(NODES)}: {kinds}"
    yield running
    running.stop()
    assert replayed(running.log)


@pytest.fixture
def network(simulation):
    yield from connected(simulation.socketcand())


@pytest.fixture
def nodes(network):
    """All drives after a reset, in pre-operational."""
    heard = Heard(network, *(0x700 + node_id for node_id in NODES))
    network.nmt.send_command(0x81)
    talking = [node_id for node_id in NODES if node_id != WAITING]

    def boots() -> bool:
        return all(heard.frames[0x700 + node_id][:1] == [b"\0"] for node_id in talking)

    wait_until(boots, 5, "boot-up messages")
    assert heard.frames[0x700 + WAITING] == []
    network.nmt.send_command(0x80)
    wait_until(lambda: heard.frames[0x700 + WAITING], 3, "the first heartbeat")
    assert heard.frames[0x700 + WAITING] == [b"\x7f"], "no boot-up"
    yield {node_id: add(network, drive, node_id) for node_id, drive in NODES.items()}
    network.nmt.send_command(0x81)


def test_every_drive_is_on_the_bus():
    family = {name.removesuffix("-2").removesuffix("-3") for name in drives()}
    assert {drive.removesuffix("-3") for drive in NODES.values()} == family


def test_each_says_who_it_is(network, nodes):
    network.scanner.reset()
    network.scanner.search(10)
    wait_until(lambda: sorted(network.scanner.nodes) == list(NODES), 3, "all nodes")
    for node_id, node in nodes.items():
        assert node.sdo[0x1008].raw == NAMES[node_id]
        assert node.sdo[0x1000].raw & 0xFFFF == 402


def test_each_refuses_in_its_own_way(nodes):
    def code(node_id, index, data, sub=0) -> str:
        sdo = nodes[node_id].sdo
        return f"{refusal(lambda: sdo.download(index, sub, data)):08X}"

    drives = {name: node_id for node_id, name in NODES.items()}
    for name, node_id in drives.items():
        # A constant, nothing there, no such sub-index, too few bytes, a save without its signature, a
        # mode that nobody has.
        assert code(node_id, 0x1000, bytes(4)) == "06010002", name
        assert code(node_id, 0x5FFF, bytes(4)) == "06020000", name
        assert code(node_id, 0x1018, bytes(4), 9) == "06090011", name
        assert code(node_id, 0x607A, bytes(2)) == "06070013", name
        assert code(node_id, 0x1010, b"evas", 1) == "08000020", name
        assert code(node_id, 0x6060, bytes([5])) == "06090030", name
        # More bytes than an expedited transfer has, to an object of four.
        long = "05040001" if name in EXPEDITED_ONLY else "06070012"
        assert code(node_id, 0x607A, bytes(5)) == long, name
    # Out of range, each in its own code and units.
    assert code(drives["p3"], 0x6072, struct.pack("<h", -1)) == "06090030"
    assert code(drives["p3-extended"], 0x6072, struct.pack("<h", -1)) == "06090032"
    assert code(drives["p3-jpl"], 0x6083, struct.pack("<i", -1)) == "06090032"
    assert code(drives["md80"], 0x6072, struct.pack("<H", 40_000)) == "06090031"
    assert code(drives["roboteq-3"], 0x2000, struct.pack("<i", 1001), 3) == "06090031"
    # What only one of them has.
    assert code(drives["md80"], 0x2003, b"\1", 3) == "08000022"
    assert code(drives["roboteq-3"], 0x1800, struct.pack("<I", 0x185), 1) == "06090030"
    for index in (0x6860, 0x7060):
        nodes[drives["roboteq-3"]].sdo.upload(index, 0)
        for name in ("p3", "p3-extended", "p3-jpl", "md80"):
            sdo = nodes[drives[name]].sdo
            assert refusal(lambda: sdo.upload(index, 0)) == 0x06020000, name


def test_lss_reaches_the_one_that_has_it(network, nodes):
    lss = network.lss
    lss.RESPONSE_TIMEOUT = 0.2
    identities = {
        node_id: [node.sdo[0x1018][sub].raw for sub in range(1, 5)]
        for node_id, node in nodes.items()
    }
    for node_id, identity in identities.items():
        if NODES[node_id] == "p3-extended":
            assert lss.send_switch_state_selective(*identity)
            assert lss.inquire_node_id() == node_id
            lss.send_switch_state_global(lss.WAITING_STATE)
            time.sleep(0.05)
        else:
            with pytest.raises(LssError):
                lss.send_switch_state_selective(*identity)
    # Everybody has a node ID.
    assert lss.fast_scan()[0] is False
    for node in nodes.values():
        assert node.sdo[0x1000].raw & 0xFFFF == 402


def test_heartbeats_tell_each_state(network, nodes):
    for node in nodes.values():
        node.sdo[0x1017].raw = 50
    heard = Heard(network, *(0x700 + node_id for node_id in NODES))
    for command, state in [(0x01, 5), (0x02, 4), (0x80, 0x7F)]:
        network.nmt.send_command(command)
        time.sleep(0.2)
        before = {key: len(frames) for key, frames in heard.frames.items()}
        time.sleep(1)
        for key, frames in heard.frames.items():
            new = frames[before[key] :]
            assert set(new) == {bytes([state])}, f"{key:03X}"
            assert 10 <= len(new) <= 30, f"{key:03X}"


def map_pdo(pdo, indices) -> None:
    """By each SYNC; `None` leaves the mapping as it came."""
    pdo.read()
    if indices is not None:
        pdo.clear()
        for index in indices:
            pdo.add_variable(index)
    pdo.trans_type = 1
    pdo.enabled = True
    pdo.save()


def enable(nodes) -> None:
    """Each drive as its document has it."""
    for node_id in (1, 2):
        nodes[node_id].sdo[0x60C2][1].raw = 4
        nodes[node_id].sdo[0x60C2][2].raw = -3
    sdo = nodes[1].sdo
    sdo[0x6040].raw = 0x86
    sdo[0x6040].raw = 0x0F
    sdo[0x6060].raw = 8
    for node_id in (2, 4):
        sdo = nodes[node_id].sdo
        sdo[0x6060].raw = 8
        for word in (0x06, 0x07, 0x0F):
            sdo[0x6040].raw = word
    nodes[3].sdo[0x6060].raw = 1
    sdo = nodes[5].sdo
    sdo[0x30F1].raw = 1
    for offset in (0, 0x800, 0x1000):
        sdo[0x6060 + offset].raw = 3
        for word in (0x06, 0x07, 0x0F):
            sdo[0x6040 + offset].raw = word


def test_set_points_and_actual_values_by_sync(network, nodes):
    heard = Heard(network)
    for node_id, node in nodes.items():
        number, indices, _ = SET_POINTS[node_id]
        map_pdo(node.rpdo[number], indices)
        for number, indices in ACTUAL[node_id].items():
            map_pdo(node.tpdo[number], indices)
            heard.listen(0x080 + 0x100 * number + node_id)
        heard.listen(0x080 + node_id)
    network.nmt.send_command(0x01)
    time.sleep(0.1)
    enable(nodes)

    def actual(node_id, offset=0):
        return nodes[node_id].sdo[0x6064 + offset].raw

    starts = {node_id: actual(node_id) for node_id in NODES}
    channels = [actual(5, offset) for offset in (0, 0x800, 0x1000)]
    for frames in heard.frames.values():
        frames.clear()
    begin = time.monotonic()
    for n in range(SYNCS):
        for node_id, (number, _, data) in SET_POINTS.items():
            network.send_message(0x100 + 0x100 * number + node_id, data(n))
        network.sync.transmit()
        time.sleep(max(0, begin + (n + 1) * SYNC_PERIOD_S - time.monotonic()))

    # One of each for each SYNC, and no emergency.
    def all_came() -> bool:
        counts = {key: len(frames) for key, frames in heard.frames.items() if key > 0x17F}
        return set(counts.values()) == {SYNCS}

    wait_until(all_came, 5, "every actual value")
    for node_id in NODES:
        assert heard.frames[0x080 + node_id] == [], NODES[node_id]
    # Enabled all the time, and following.
    for identifier in (0x181, 0x182, 0x284, 0x185, 0x285, 0x385):
        words = [struct.unpack_from("<H", frame)[0] for frame in heard.frames[identifier]]
        assert {word & STATE_MASK for word in words} == {ENABLED}, f"{identifier:03X}"
    for frame in heard.frames[0x183]:
        assert frame[0] == 1
    for node_id in (1, 2, 3, 4):
        target = 20 * (SYNCS - 1)
        assert abs(starts[node_id] - target) > 1000, "it has to move"
        wait_until(lambda node_id=node_id: abs(actual(node_id) - target) < 100, 3, NODES[node_id])
    ways = [actual(5, offset) - start for offset, start in zip((0, 0x800, 0x1000), channels)]
    assert ways[0] > 500 and ways[1] < -500 and abs(ways[2]) < 100, ways
