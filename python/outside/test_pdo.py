"""PDO mapping with python-canopen's save(), and what the PDOs then do."""

import time

import pytest

import axis


def described(pdo) -> tuple:
    entries = [(v.index, v.subindex, v.length) for v in pdo.map]
    return pdo.enabled, pdo.cob_id, pdo.trans_type, entries


def test_a_saved_mapping_reads_back(network, dictionary, node):
    axis.map_pdos(node)
    node.nmt.state = "PRE-OPERATIONAL"
    written = [node.rpdo[n] for n in axis.RPDOS] + [node.tpdo[n] for n in axis.TPDOS]
    # A second master knows nothing of the first one's mapping.
    other = axis.PatientNode(node.id, dictionary(node.id))
    network.add_node(other)
    other.pdo.read()
    found = [other.rpdo[n] for n in axis.RPDOS] + [other.tpdo[n] for n in axis.TPDOS]
    assert [described(pdo) for pdo in found] == [described(pdo) for pdo in written]
    # Lengths in bits, as the objects' types are.
    assert described(other.tpdo[1]) == (
        True,
        0x181,
        axis.EVERY_SYNC,
        [(0x6041, 0, 16), (0x6061, 0, 8), (0x6064, 0, 32)],
    )
    assert len(other.tpdo[4].map) == 0


def test_an_rpdo_applies_upon_receipt_or_with_sync(network, node):
    pdo = node.rpdo[1]
    node.nmt.state = "PRE-OPERATIONAL"
    axis.map_pdo(pdo, [0x6071], axis.UPON_RECEIPT)
    node.nmt.state = "OPERATIONAL"
    pdo[0x6071].raw = 123
    pdo.transmit()
    assert node.sdo[0x6071].raw == 123

    axis.map_pdo(pdo, [0x6071], axis.EVERY_SYNC)
    pdo[0x6071].raw = -77
    pdo.transmit()
    assert node.sdo[0x6071].raw == 123
    network.sync.transmit()
    assert node.sdo[0x6071].raw == -77


def test_a_tpdo_goes_out_with_every_third_sync(network, node):
    axis.map_pdo(node.tpdo[2], [0x606C, 0x6077], 3)
    node.nmt.state = "OPERATIONAL"
    heard = []
    node.tpdo[2].add_callback(lambda pdo: heard.append(bytes(pdo.data)))
    for _ in range(7):
        network.sync.transmit()
        time.sleep(0.02)
    assert len(heard) == 2
    assert all(len(data) == 6 for data in heard)


@pytest.mark.parametrize("off", [0, 0x80000181])
def test_a_cob_id_of_0_or_with_bit_31_is_off(network, node, off):
    axis.map_pdo(node.tpdo[1], [0x6041], axis.EVERY_SYNC)
    heard = []
    node.tpdo[1].add_callback(lambda pdo: heard.append(bytes(pdo.data)))
    node.nmt.state = "OPERATIONAL"
    node.sdo[0x1800][1].raw = off
    network.sync.transmit()
    time.sleep(0.05)
    assert heard == []
    node.sdo[0x1800][1].raw = 0x181
    network.sync.transmit()
    time.sleep(0.05)
    assert len(heard) == 1
