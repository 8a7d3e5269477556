"""Frames that get lost and come twice on purpose: what a master does then can be tested."""

import re

import pytest

from conftest import connected
from simulation import Simulation, directory, replayed

READS = 300
DEVICE_TYPE = 0x0002_0192
SUMMARY = re.compile(
    r"disturbed on purpose: (\d+) lost and (\d+) duplicated of (\d+) frames to the bus, "
    r"(\d+) lost and (\d+) duplicated of (\d+) from it"
)


def run(name: str, dictionary, *options: str) -> tuple:
    """Reads an object many times; how many requests were repeated, and what the simulation says."""
    log = directory() / f"disturbance-{name}.log"
    simulation = Simulation("1", log, *options)
    for network in connected(simulation.socketcand()):
        node = network.add_node(1, dictionary(1))
        node.sdo.RESPONSE_TIMEOUT = 0.1
        node.sdo.MAX_RETRIES = 10
        requests = []
        send = node.sdo.send_request
        node.sdo.send_request = lambda request: (requests.append(request), send(request))
        for _ in range(READS):
            assert node.sdo[0x1000].raw == DEVICE_TYPE
    simulation.stop()
    assert replayed(log)
    return len(requests) - READS, log.with_suffix(".stderr.txt").read_text()


def test_lost_frames_are_counted_and_a_master_asks_again(dictionary):
    repeated, told = run("lossy", dictionary, "--lose", "3%", "--duplicate", "2%")
    counts = SUMMARY.search(told)
    assert counts, told
    lost_in, twice_in, frames_in, lost_out, twice_out, _ = map(int, counts.groups())
    assert frames_in == READS + repeated
    # Each that is lost on its way in has no answer, and each answer that is lost is missed.
    assert 0 < repeated <= lost_in + lost_out
    assert twice_in + twice_out > 0


def test_nothing_is_lost_unless_asked_for(dictionary):
    repeated, told = run("calm", dictionary)
    assert repeated == 0
    assert "disturbed" not in told


@pytest.mark.parametrize("rate", ["20k", "125k", "800k"])
def test_a_master_works_at_any_bit_rate(rate):
    simulation = Simulation(
        "1", directory() / f"rate-{rate}.log", "--bit-rate", rate, drive="p3-extended"
    )
    for network in connected(simulation.socketcand()):
        node = network.add_node(1)
        for _ in range(20):
            assert node.sdo.upload(0x1000, 0) == DEVICE_TYPE.to_bytes(4, "little")
    simulation.stop()
