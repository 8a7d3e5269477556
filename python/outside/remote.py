"""Nodes by the EDS that `servobus eds` exports: their dictionary, their refusals, their frames."""

import functools
import gc
import subprocess
import threading

import canopen
import pytest

from simulation import directory, servobus


@functools.cache
def exported(drive: str) -> str:
    """The path of the drive's exported file."""
    path = directory() / f"{drive}.eds"
    command = [servobus(), "eds", drive, "--output", str(path)]
    subprocess.run(command, check=True, capture_output=True)
    return str(path)


def add(network, drive: str, node_id: int = 1, kind=canopen.RemoteNode):
    """The node, known by that file and by nothing else."""
    node = kind(node_id, canopen.import_od(exported(drive), node_id))
    network.add_node(node)
    # A busy machine may not give this process its turn for longer than python-canopen waits.
    node.sdo.RESPONSE_TIMEOUT = 3
    return node


def refusal(action) -> int:
    """The abort code with which the drive refuses it."""
    with pytest.raises(canopen.SdoAbortedError) as refused:
        action()
    code = refused.value.code
    del refused
    # python-canopen's stream of a segmented download that was refused sends once more when it is
    # collected. In the middle of another request it would wait for that one's lock for ever.
    gc.collect()
    return code


class Heard:
    """What comes on some identifiers, in its order."""

    def __init__(self, network, *identifiers):
        self.frames = {}
        self.came = threading.Event()
        self._network = network
        self.listen(*identifiers)

    def listen(self, *identifiers):
        for identifier in identifiers:
            self.frames[identifier] = []
            self._network.subscribe(identifier, self._take)

    def _take(self, identifier, data, _stamp):
        self.frames[identifier].append(bytes(data))
        self.came.set()

    @property
    def all(self) -> list:
        """The frames of all identifiers."""
        return [frame for frames in self.frames.values() for frame in frames]
