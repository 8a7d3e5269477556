"""Virtual drives on vcan0: can-utils, python-can, python-canopen and servobus at the other end."""

import json
import time

import can
import canopen
import pytest

from dictionary import object_dictionary
from interfaces import Program, candump, cansend, recorded, run, scan, wait_until

BUS = "socketcan://vcan0"


@pytest.fixture
def network(drives):
    network = canopen.Network()
    network.connect(interface="socketcan", channel="vcan0")
    try:
        yield network
        network.check()
    finally:
        network.disconnect()


@pytest.fixture
def node(network):
    node = canopen.RemoteNode(1, object_dictionary("p3", 1))
    node.sdo.RESPONSE_TIMEOUT = 5
    network.add_node(node)
    return node


def test_the_door_is_told(drives):
    told = drives.stderr.read_text
    wait_until(lambda: "client 1 joined from the interface vcan0" in told(), told)


def test_can_utils(drives):
    with candump("vcan0") as dump:
        cansend("vcan0", "601#4000100000000000")
        dump.wait_for("581#4200100092010200")
        assert dump.heard() == ["601#4000100000000000", "581#4200100092010200"]


def test_the_scanner_finds_all_nodes(network):
    network.scanner.reset()
    network.scanner.search(limit=5)
    wait_until(lambda: sorted(network.scanner.nodes) == [1, 2], lambda: network.scanner.nodes)


def test_sdo(node):
    assert node.sdo[0x1000].raw == 0x0002_0192
    assert node.sdo[0x1008].raw.rstrip("\0") == "P3"
    node.sdo[0x1017].raw = 150
    assert node.sdo[0x1017].raw == 150
    node.sdo[0x1017].raw = 0
    with pytest.raises(canopen.SdoAbortedError):
        node.sdo.upload(0x5FFF, 0)


def test_sync_and_tpdo(network, node):
    node.nmt.state = "PRE-OPERATIONAL"
    tpdo = node.tpdo[1]
    tpdo.read()
    tpdo.clear()
    tpdo.add_variable(0x6041)
    tpdo.add_variable(0x6064)
    tpdo.trans_type = 1
    tpdo.enabled = True
    tpdo.save()
    heard = []
    tpdo.add_callback(lambda pdo: heard.append(pdo[0].raw))
    node.nmt.state = "OPERATIONAL"
    for count in range(1, 11):
        network.sync.transmit()
        wait_until(lambda: len(heard) >= count, lambda: f"{len(heard)} TPDOs of {count} SYNCs")
    node.nmt.state = "PRE-OPERATIONAL"
    assert len(heard) == 10
    assert len(set(heard)) == 1


def test_every_frame_goes_once(drives):
    """Nothing comes back to where it came from, and nothing is left out."""
    count = 1000
    with candump("vcan0") as dump, can.Bus(interface="socketcan", channel="vcan0") as bus:
        for number in range(count):
            bus.send(can.Message(arbitration_id=0x333, is_extended_id=False, data=number.to_bytes(4)))
        last = f"333#{count - 1:08X}"
        wait_until(lambda: last in recorded(drives), lambda: "the last frame does not get through")
        dump.wait_for(last)
        time.sleep(0.3)
        expected = [f"333#{number:08X}" for number in range(count)]
        assert [frame for frame in recorded(drives) if frame.startswith("333#")] == expected
        assert [frame for frame in dump.heard() if frame.startswith("333#")] == expected
        assert bus.recv(0) is None


FRAMES = ["666#", "666#R", "666#R4", "1ABCDEF0#0102", "1ABCDEF0#R", "00000666#R8"]


def test_remote_and_29_bit_frames_come_in(drives):
    """From the interface to the drives' bus and to the other door there."""
    with can.Bus(**drives.slcan()) as other:
        cansend("vcan0", *FRAMES)
        heard = []
        for _ in FRAMES:
            message = other.recv(10)
            assert message is not None, heard
            heard.append(shown(message))
    assert heard == FRAMES
    wait_until(lambda: recorded(drives)[-len(FRAMES) :] == FRAMES, lambda: recorded(drives)[-10:])


def test_remote_and_29_bit_frames_go_out(drives):
    """From the other door over the drives' bus to the interface."""
    with can.Bus(**drives.slcan()) as other, candump("vcan0") as dump:
        for frame in FRAMES:
            other.send(message(frame))
        dump.wait_for(FRAMES[-1])
        assert dump.heard() == FRAMES


def shown(message: can.Message) -> str:
    """As candump writes it."""
    digits = 8 if message.is_extended_id else 3
    rest = bytes(message.data).hex().upper()
    if message.is_remote_frame:
        rest = f"R{message.dlc or ''}"
    return f"{message.arbitration_id:0{digits}X}#{rest}"


def message(frame: str) -> can.Message:
    identifier, rest = frame.split("#")
    kind = {"arbitration_id": int(identifier, 16), "is_extended_id": len(identifier) == 8}
    if rest.startswith("R"):
        return can.Message(**kind, is_remote_frame=True, dlc=int(rest[1:] or 0))
    return can.Message(**kind, data=bytes.fromhex(rest))


def test_servobus_scan(drives):
    assert scan("vcan0", "1-2") == [1, 2]


def test_servobus_sdo(drives):
    where = ["--bus", BUS, "--node", "2"]
    run("sdo", "write", *where, "0x1017", "250")
    assert json.loads(run("sdo", "read", *where, "0x1017", "--json"))["value"] == 250
    run("sdo", "write", *where, "0x1017", "0")
    error = run("sdo", "read", *where, "0x5FFF", code=1)
    assert "refused, 0x06020000" in error


def test_servobus_nmt_and_monitor(drives):
    with Program("monitor", "--bus", BUS) as monitor:
        monitor.wait_for("0x666", asking=lambda: cansend("vcan0", "666#"))
        # It waits for the boot-up message.
        run("nmt", "reset-node", "2", "--bus", BUS)
        monitor.wait_for("boot")
        monitor.end()
    assert monitor.status == 0, monitor.text()


def test_error_frames_are_reported(drives):
    """On vcan they are made by hand: class 0x204, warning level, error counters 96 and 8."""
    report = "socketcan://vcan0: warning level of transmit errors, 96 transmit and 8 receive errors"
    with Program("monitor", "--bus", BUS) as monitor:
        monitor.wait_for(report, asking=lambda: cansend("vcan0", "20000204#0008000000006008"))
    wait_until(lambda: report in drives.stderr.read_text(), drives.stderr.read_text)
    # They are no frames of the bus.
    time.sleep(1)
    assert [frame for frame in recorded(drives) if frame.endswith("#0008000000006008")] == []
