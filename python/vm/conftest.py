"""Tests for a machine whose kernel has CAN; `cargo xtask vm` runs them in a virtual one.

There, as root: interfaces come and go.
"""

import sys
from pathlib import Path

import pytest

# The tools of the outside tests.
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "outside"))

import interfaces  # noqa: E402
from simulation import Simulation, directory  # noqa: E402


@pytest.fixture(scope="session")
def vcan0():
    """A virtual CAN interface."""
    interfaces.make_virtual("vcan0")
    return "vcan0"


@pytest.fixture(scope="module")
def drives(vcan0):
    """Two virtual P3s that live on vcan0, and behind an slcan door as well."""
    doors = [f"socketcan://{vcan0}", "slcan://127.0.0.1:0"]
    running = Simulation("1-2", directory() / "vcan.log", doors=doors)
    yield running
    running.stop()
