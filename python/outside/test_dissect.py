"""Wireshark's dissector on the recording of the whole session."""

import subprocess

import pytest

from simulation import directory

# python-can's socketcand and slcan have no remote frames here, and every identifier is CANopen's.
CANOPEN = ["-d", "can.subdissector,canopen"]


def tshark(*arguments) -> list:
    """The lines that tshark prints."""
    command = ["tshark", "-r", str(directory() / "bus.log"), *CANOPEN, *arguments]
    ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=600)
    return ended.stdout.splitlines()


def test_no_frame_is_malformed():
    assert tshark("-Y", "_ws.malformed") == []


def test_every_frame_is_read_as_canopen():
    lines = (directory() / "bus.log").read_text().count("\n")
    assert len(tshark("-Y", "canopen", "-T", "fields", "-e", "frame.number")) == lines


@pytest.mark.parametrize(
    "what, filter",
    [
        ("NMT", "canopen.nmt_ctrl.cd"),
        ("boot-up", "canopen.nmt_guard.state == 0"),
        ("heartbeat", "canopen.nmt_guard.state == 5"),
        ("SYNC", "canopen.cob_id == 0x80"),
        ("EMCY of a lost SYNC", "canopen.em.err_code == 0x8180"),
        ("EMCY of a reset", "canopen.em.err_code == 0"),
        ("PDO", "canopen.pdo.data.bytes"),
        ("SDO download request", "canopen.sdo.ccs == 1"),
        ("SDO upload request", "canopen.sdo.ccs == 2"),
        ("SDO upload answer", "canopen.sdo.scs == 2"),
        ("SDO abort", "canopen.sdo.abort_code == 0x08000022"),
    ],
)
def test_every_kind_of_message_is_recognised(what, filter):
    assert tshark("-Y", filter), f"tshark finds no {what}"
