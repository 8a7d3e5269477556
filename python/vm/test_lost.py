"""Interfaces that are not there, go down, or vanish: one message each."""

import pytest

import interfaces
from interfaces import Program, cansend, ip, run, scan
from simulation import Simulation, directory


@pytest.fixture
def vcan1():
    interfaces.make_virtual("vcan1")
    yield "vcan1"
    if "vcan1" in ip("show"):
        ip("delete", "vcan1")


@pytest.mark.parametrize("command", ["scan", "sim"])
def test_what_is_not_there(command):
    error = run(command, "--bus", "socketcan://vcan9", code=2)
    assert error.startswith("error: there is no CAN interface vcan9: `ip link` lists"), error
    assert error.count("\n") == 1


@pytest.mark.parametrize("command", ["scan", "sim"])
def test_what_is_down(vcan1, command):
    ip("set", vcan1, "down")
    error = run(command, "--bus", f"socketcan://{vcan1}", code=2)
    expected = "error: the CAN interface vcan1 is down: switch it on by `ip link set vcan1 up`"
    assert error.startswith(expected), error
    assert error.count("\n") == 1


def test_what_is_not_for_can():
    error = run("scan", "--bus", "socketcan://lo", code=2)
    assert error.startswith("error: lo is a network interface, but none for CAN"), error


@pytest.mark.parametrize(
    "lose, words",
    [
        (lambda name: ip("set", name, "down"), "the CAN interface vcan1 is down"),
        (lambda name: ip("delete", name), "there is no CAN interface vcan1"),
    ],
    ids=["down", "deleted"],
)
def test_a_client_is_told(vcan1, lose, words):
    with Program("monitor", "--bus", f"socketcan://{vcan1}") as monitor:
        monitor.wait_for("0x123", asking=lambda: cansend(vcan1, "123#"))
        lose(vcan1)
        monitor.wait()
    said = [line for line in monitor.lines if line.startswith("error: ")]
    assert monitor.status == 1
    assert len(said) == 1 and words in said[0], monitor.text()


def test_the_drives_come_back_with_their_interface(vcan1):
    drives = Simulation("1", directory() / "lost.log", doors=[f"socketcan://{vcan1}"])
    told = drives.stderr.read_text

    def are_there():
        assert scan(vcan1, "1") == [1]

    are_there()
    ip("set", vcan1, "down")
    interfaces.wait_until(lambda: "client 1 left: the CAN interface vcan1 is down" in told(), told)
    ip("set", vcan1, "up")
    interfaces.wait_until(lambda: "client 2 joined from the interface vcan1" in told(), told)
    are_there()
    ip("delete", vcan1)
    interfaces.wait_until(lambda: "client 2 left: there is no CAN interface vcan1" in told(), told)
    interfaces.make_virtual(vcan1)
    interfaces.wait_until(lambda: "client 3 joined from the interface vcan1" in told(), told)
    are_there()
    drives.stop()
    assert told().count(" left: ") == 2 and told().count(" joined ") == 3
