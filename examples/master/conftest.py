"""Virtual drives for the tests of a master: each test gets a bus of its own, just switched on."""

import os
import subprocess

import canopen
import pytest

SERVOBUS = os.environ.get("SERVOBUS", "servobus")


@pytest.fixture
def bus(tmp_path):
    """Starts drives and joins them: `network = bus("--drive", "md80", "--nodes", "1")`."""
    started = []

    def start(*words):
        command = [SERVOBUS, "sim", "--bus", "socketcand://127.0.0.1:0", *words]
        drives = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        network = canopen.Network()
        started.append((drives, network))
        # "ready: 1 virtual md80 drive, node 1", then "socketcand://127.0.0.1:40001 channel can0".
        assert drives.stdout.readline().startswith("ready: ")
        address, _, channel = drives.stdout.readline().split()
        host, port = address.removeprefix("socketcand://").split(":")
        network.connect(interface="socketcand", host=host, port=int(port), channel=channel)
        return network

    yield start
    for drives, network in started:
        network.disconnect()
        drives.terminate()
        drives.wait(10)


@pytest.fixture
def eds(tmp_path):
    """The EDS of a drive: `network.add_node(1, eds("md80"))`."""

    def export(drive):
        path = tmp_path / f"{drive}.eds"
        with open(path, "w") as file:
            subprocess.run([SERVOBUS, "eds", drive], stdout=file, check=True)
        return str(path)

    return export
