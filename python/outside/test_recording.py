"""The recording of the whole session, read and repeated; run after the session has ended."""

import subprocess

import can
import pytest

from simulation import directory, servobus


@pytest.fixture(scope="module")
def log():
    return directory() / "bus.log"


def test_python_can_reads_every_line(log):
    lines = log.read_text().splitlines()
    with can.CanutilsLogReader(log) as reader:
        messages = list(reader)
    assert len(messages) == len(lines) > 5000
    stamps = [message.timestamp for message in messages]
    assert stamps == sorted(stamps)
    identifiers = {message.arbitration_id for message in messages}
    # NMT, SYNC, EMCY, all PDOs that were mapped, SDO both ways, boot-up.
    assert identifiers >= {0x000, 0x080, 0x081, 0x181, 0x281, 0x381, 0x201, 0x301}
    assert identifiers >= {0x581, 0x601, 0x582, 0x602, 0x583, 0x603, 0x701, 0x702, 0x703}


def test_the_run_can_be_repeated(log):
    command = [servobus(), "replay", str(log)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "identical" in ended.stdout, ended.stdout
