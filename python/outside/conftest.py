"""The drives under test: one simulation for the whole session, recorded."""

import logging

import canopen
import pytest

import axis
from dictionary import object_dictionary
from simulation import Simulation, directory

NODES = [1, 2, 3]


def pytest_configure():
    # BaseNode402 warns of each access that it makes by SDO for want of a PDO.
    logging.getLogger("canopen.profiles.p402").setLevel(logging.ERROR)


@pytest.fixture(scope="session")
def simulation():
    """Three virtual P3 drives."""
    running = Simulation("1-3", directory() / "bus.log")
    assert running.ready == "ready: 3 virtual p3 drives, nodes 1-3"
    yield running
    running.stop()


@pytest.fixture(scope="session")
def dictionary():
    """Makes python-canopen's object dictionary for a node."""
    return lambda node_id: object_dictionary("p3", node_id)


@pytest.fixture
def network(simulation):
    """python-canopen on the bus, by socketcand."""
    yield from connected(simulation.socketcand())


def connected(arguments: dict):
    """A network that is disconnected at the end, and has met no error in between."""
    network = canopen.Network()
    # How long disconnecting may wait for the receiver.
    network.NOTIFIER_CYCLE = 0.05
    network.connect(**arguments)
    try:
        yield network
        network.check()
    finally:
        network.disconnect()


@pytest.fixture
def node(network, dictionary):
    """Node 1 after a reset, pre-operational, without PDOs; brought to a stop at the end."""
    node = axis.reset(network, dictionary, 1)
    yield node
    axis.stop_cycle(network, node)
    # The test may have put another master's view in its place.
    axis.stand_still(network[node.id])


@pytest.fixture
def cycle(network, node):
    """Node 1 operational, its PDOs going to and fro by SYNC."""
    axis.map_pdos(node)
    with axis.cyclic(network, node):
        yield node
