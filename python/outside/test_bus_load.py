"""Cyclic synchronous position at 1 kHz: the bus load that the simulation states, counted again."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from simulation import directory, servobus

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python" / "reference"))
import bus_load  # noqa: E402

SECONDS = 30


def cyclic() -> str:
    """The program that runs the cycles, beside the one under test."""
    return os.environ.get("SERVOBUS_CYCLIC", str(Path(servobus()).with_name("servobus-cyclic")))


@pytest.mark.parametrize("drives, sync_hz", [(4, 1000), (6, 500)])
def test_the_load_is_the_sum_of_the_bits(drives, sync_hz):
    path = directory() / f"cyclic-{drives}.log"
    command = [cyclic(), "--drives", str(drives), "--sync-hz", str(sync_hz)]
    command += ["--seconds", str(SECONDS), "--record", str(path)]
    printed = subprocess.run(command, check=True, capture_output=True, text=True, timeout=300)
    figures = json.loads(printed.stdout)
    assert figures["cycles"] == SECONDS * sync_hz
    assert figures["missed"] == figures["not_following"] == 0
    share, frames = bus_load.load(path, 1_000_000)
    assert frames + 1 == figures["frames"] == figures["cycles"] * (1 + 2 * drives)
    assert figures["load"] == pytest.approx(share, rel=0.01)


def test_the_load_of_a_mixed_bus_is_the_sum_of_the_bits():
    path = directory() / "cyclic-mixed.log"
    command = [cyclic(), "--mixed", "--seconds", str(SECONDS), "--record", str(path)]
    printed = subprocess.run(command, check=True, capture_output=True, text=True, timeout=300)
    figures = json.loads(printed.stdout)
    assert figures["cycles"] == SECONDS * 250
    assert figures["missed"] == figures["not_following"] == figures["unexpected"] == 0
    share, frames = bus_load.load(path, 1_000_000)
    assert frames + 1 == figures["frames"] >= figures["cycles"] * figures["frames_per_cycle"]
    assert figures["load"] == pytest.approx(share, rel=0.01)


def test_the_bits_of_frames_counted_by_hand():
    # Identifier 0 without data: 34 dominant bits with 6 between them, then 13 recessive ones.
    assert bus_load.frame_bits(0, b"") == 34 + 6 + 13
    # A SYNC has the check sum 0x1C05 and four stuff bits.
    assert bus_load.crc15("0" + f"{0x80:011b}" + "000" + "0000") == f"{0x1C05:015b}"
    assert bus_load.frame_bits(0x80, b"") == 34 + 4 + 13
