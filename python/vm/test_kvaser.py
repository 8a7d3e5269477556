"""Two Kvaser controllers on one bus: a real driver, 500 kbit/s, drives behind the one, masters at
the other."""

import json

import canopen
import pytest

from dictionary import object_dictionary
from interfaces import Program, candump, cansend, ip, recorded, run, scan, wait_until
from simulation import Simulation, directory

BUS = "socketcan://can1"


@pytest.fixture(scope="module")
def drives():
    for name in ("can0", "can1"):
        assert "kvaser_pci" in driver(name)
        ip("set", name, "type", "can", "bitrate", "500000")
        ip("set", name, "up")
    running = Simulation("1-2", directory() / "kvaser.log", doors=["socketcan://can0"])
    yield running
    running.stop()


def driver(name: str) -> str:
    """Who drives an interface."""
    with open(f"/sys/class/net/{name}/device/uevent") as file:
        return file.read()


def test_the_bit_rate(drives):
    details = json.loads(ip("show", "can1", options=["-details", "-json"]))[0]
    assert details["linkinfo"]["info_data"]["bittiming"]["bitrate"] == 500_000


def test_can_utils(drives):
    with candump("can1") as dump:
        cansend("can1", "601#4000100000000000")
        dump.wait_for("581#4200100092010200")


def test_servobus(drives):
    assert scan("can1", "1-2") == [1, 2]
    where = ["--bus", BUS, "--node", "1"]
    run("sdo", "write", *where, "0x1017", "100")
    with Program("monitor", "--bus", BUS, "--json") as monitor:
        monitor.wait_for("heartbeat")
    run("sdo", "write", *where, "0x1017", "0")


def test_python_canopen(drives):
    network = canopen.Network()
    network.connect(interface="socketcan", channel="can1")
    network.scanner.search(limit=5)
    wait_until(lambda: sorted(network.scanner.nodes) == [1, 2], lambda: network.scanner.nodes)
    node = canopen.RemoteNode(2, object_dictionary("p3", 2))
    node.sdo.RESPONSE_TIMEOUT = 5
    network.add_node(node)
    assert node.sdo[0x1000].raw == 0x0002_0192
    network.check()
    network.disconnect()


def test_remote_and_29_bit_frames(drives):
    """Remote frames of length 0: QEMU's controllers let others spoil the frame behind them, with
    can-utils at both ends too."""
    frames = ["666#R", "1ABCDEF0#0102030405060708", "1ABCDEF0#R", "00000666#", "666#01"]
    cansend("can1", *frames)

    def came():
        return [frame for frame in recorded(drives) if frame in frames]

    wait_until(lambda: came() == frames, came)
