"""A virtual P3 as python-canopen's BaseNode402: reset, its PDOs mapped, SYNC running."""

import contextlib
import threading
import time

import canopen
from canopen.profiles.p402 import BaseNode402

SYNC_PERIOD_S = 0.005
BOOT_TIMEOUT_S = 5

# Applies, or goes out, with every SYNC.
EVERY_SYNC = 1
# Applies upon receipt.
UPON_RECEIPT = 255

# Controlword and target position go together: a set-point is taken with the controlword's edge.
RPDOS = {1: [0x6040, 0x6060, 0x607A], 2: [0x60FF, 0x6071]}
TPDOS = {1: [0x6041, 0x6061, 0x6064], 2: [0x606C, 0x6078, 0x6077], 3: [0x60F4, 0x60FC]}


class PatientNode(BaseNode402):
    """A busy machine may not give this process its turn for longer than BaseNode402 waits."""

    TIMEOUT_SWITCH_OP_MODE = 3
    TIMEOUT_SWITCH_STATE_FINAL = 5
    TIMEOUT_SWITCH_STATE_SINGLE = 3
    TIMEOUT_CHECK_TPDO = 2

    def __init__(self, node_id, object_dictionary):
        super().__init__(node_id, object_dictionary)
        # Asked once (MAX_RETRIES is 1): an answer that does not come is an error.
        self.sdo.RESPONSE_TIMEOUT = 3


def reset(network: canopen.Network, dictionary, node_id: int) -> PatientNode:
    """Resets the drive, waits for its boot-up message, and leaves it pre-operational."""
    node = PatientNode(node_id, dictionary(node_id))
    network.add_node(node)
    booted = threading.Event()

    def heard(_id, data, _stamp):
        if bytes(data) == b"\0":
            booted.set()

    network.subscribe(0x700 + node_id, heard)
    node.nmt.send_command(0x81)
    assert booted.wait(BOOT_TIMEOUT_S), f"node {node_id} sends no boot-up message after a reset"
    network.unsubscribe(0x700 + node_id, heard)
    node.nmt.state = "PRE-OPERATIONAL"
    return node


def map_pdo(pdo, indices, transmission_type) -> None:
    """Writes a mapping with python-canopen's save()."""
    pdo.read()
    pdo.clear()
    for index in indices:
        pdo.add_variable(index)
    pdo.trans_type = transmission_type
    pdo.enabled = True
    pdo.save()


def map_pdos(node: BaseNode402) -> None:
    """Maps RPDOS and TPDOS, all by SYNC, and lets BaseNode402 read them back."""
    for number, indices in RPDOS.items():
        map_pdo(node.rpdo[number], indices, EVERY_SYNC)
    for number, indices in TPDOS.items():
        map_pdo(node.tpdo[number], indices, EVERY_SYNC)
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"


@contextlib.contextmanager
def cyclic(network: canopen.Network, node: BaseNode402):
    """SYNC and RPDOs go out periodically; the target position starts where the motor is."""
    node.rpdo[1][0x607A].raw = node.sdo[0x6064].raw
    network.sync.start(SYNC_PERIOD_S)
    try:
        for number in RPDOS:
            node.rpdo[number].start(SYNC_PERIOD_S)
        yield
    finally:
        stop_cycle(network, node)


def stop_cycle(network: canopen.Network, node: BaseNode402) -> None:
    """Ends what cyclic() started."""
    network.sync.stop()
    for number in RPDOS:
        node.rpdo[number].stop()


def stand_still(node: BaseNode402) -> None:
    """Brakes a free motor, by SDO only, and disables it. It would coast for long."""
    sdo = node.sdo
    # An operational drive would obey RPDOs and miss SYNC.
    node.nmt.state = "PRE-OPERATIONAL"
    sdo[0x2406].raw = 0
    sdo[0x2120].raw = 0
    sdo[0x6072].raw = 1000
    sdo[0x6084].raw = 2_000_000
    sdo[0x60FF].raw = 0
    for controlword in (0x00, 0x86, 0x06, 0x0F):
        sdo[0x6040].raw = controlword
    sdo[0x6060].raw = 3
    until = time.monotonic() + 10
    while abs(sdo[0x606C].raw) > 500:
        assert time.monotonic() < until, f"it still turns at {sdo[0x606C].raw} cts/s"
        time.sleep(0.01)
    sdo[0x6060].raw = 0
    sdo[0x6040].raw = 0


class Feedback:
    """Every TPDO of a drive, with the simulation's own time stamps."""

    def __init__(self, node: BaseNode402):
        self.samples = {index: [] for indices in TPDOS.values() for index in indices}
        for number in TPDOS:
            node.tpdo[number].add_callback(self._heard)

    def _heard(self, pdo):
        for variable in pdo:
            self.samples[variable.index].append((pdo.timestamp, variable.raw))

    def since(self, index: int, begin_s: float, end_s: float) -> list:
        """Samples of an object between two moments after its first one."""
        samples = self.samples[index]
        first = samples[0][0]
        return [(t - first, v) for t, v in samples if begin_s <= t - first <= end_s]

    def clear(self) -> None:
        """Forgets what was heard."""
        for samples in self.samples.values():
            samples.clear()


def slope(samples: list) -> float:
    """Least squares, units per second."""
    count = len(samples)
    assert count >= 3, f"only {count} samples"
    mean_t = sum(t for t, _ in samples) / count
    mean_v = sum(v for _, v in samples) / count
    above = sum((t - mean_t) * (v - mean_v) for t, v in samples)
    return above / sum((t - mean_t) ** 2 for t, _ in samples)


def wait_until(condition, timeout_s: float, what: str) -> None:
    """Waits for something that feedback tells."""
    until = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < until, f"not within {timeout_s} s: {what}"
        time.sleep(0.002)
