"""The kernel's own slcan driver at the slcan door of drives on the host, by a serial line."""

import os
import subprocess
import time

import can
import pytest

from interfaces import PATIENCE_S, candump, cansend, ip, run, scan, wait_until


@pytest.fixture(scope="module")
def slcan0():
    """The interface, when it carries frames. Somebody who takes too long to join loses the line for
    a second, and then may have spoken to nobody."""
    serial = os.environ["SLCAN_SERIAL"]
    for _ in range(5):
        command = ["slcand", "-F", "-o", "-s8", serial, "slcan0"]
        slcand = subprocess.Popen(command)
        wait_until(lambda: "slcan0" in ip("show"), lambda: "slcand makes no interface")
        ip("set", "slcan0", "up")
        with can.Bus(interface="socketcan", channel="slcan0") as bus:
            bus.send(can.Message(arbitration_id=0x601, is_extended_id=False, data=b"\x40\x00\x10\x00"))
            answer = bus.recv(3)
        if answer is not None and answer.arbitration_id == 0x581:
            yield "slcan0"
            slcand.terminate()
            slcand.wait(PATIENCE_S)
            return
        slcand.terminate()
        slcand.wait(PATIENCE_S)
        time.sleep(1)
    raise AssertionError("no drive answers by slcan")


def test_scan(slcan0):
    assert scan(slcan0, "1-3") == [1, 2, 3]


def test_can_utils(slcan0):
    with candump(slcan0) as dump:
        cansend(slcan0, "602#4000100000000000")
        dump.wait_for("582#4200100092010200")


def test_remote_and_29_bit_frames(slcan0):
    """xtask looks for them in the recording on the host."""
    cansend(slcan0, "666#R4", "1ABCDEF0#R", "1ABCDEF0#0102030405060708")
    # Behind them, so that they have been through when it is answered.
    assert "0x00020192" in run("sdo", "read", "--bus", f"socketcan://{slcan0}", "--node", "3", "0x1000")
