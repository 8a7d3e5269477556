"""Every object of every node, and refusals."""

import struct
import time

import canopen
import pytest

import axis
from conftest import NODES
from dictionary import default, entries

FORMATS = {
    "BOOLEAN": "<?",
    "INTEGER8": "<b",
    "INTEGER16": "<h",
    "INTEGER32": "<i",
    "UNSIGNED8": "<B",
    "UNSIGNED16": "<H",
    "UNSIGNED32": "<I",
    "REAL32": "<f",
}

# What a drive computes or measures, or has of its own, and what is set after a reset: the default
# says nothing of it.
LIVE = {0x1002, 0x1018, 0x3000, 0x3008, 0x3012, 0x6064, 0x606C, 0x6078, 0x6077, 0x6041, 0x60FC}
LIVE |= {0x60F4, 0x3022, 0x3023, 0x6043}
# Of others only these: the gains that belong to bandwidth and damping, the motor's thermistor, and
# the electrical angle, which has a test of its own.
SHOWN = {(0x3019, sub) for sub in (7, 8, 9, 12, 13, 14)} | {(0x3010, 3), (0x60EA, 0)}
# Each drive's own.
NODE_ID = (0x21B0, 0)


@pytest.mark.parametrize("node_id", NODES)
def test_every_object_reads_as_declared(network, dictionary, node_id):
    node = axis.reset(network, dictionary, node_id)
    wrong = []
    read = 0
    for entry in entries("p3"):
        if entry["access"] == "wo":
            continue
        name = f"{entry['index']:04X},{entry['sub']} {entry['name']}"
        try:
            data = node.sdo.upload(entry["index"], entry["sub"])
        except canopen.SdoAbortedError as abort:
            # CiA 301 7.5.2.4: an error history without errors has no data.
            if entry["index"] != 0x1003 or abort.code != 0x08000024:
                wrong.append(f"{name}: {abort}")
            continue
        read += 1
        if entry["type"] == "VISIBLE_STRING":
            value = data.rstrip(b"\0").decode("ascii")
        else:
            value = struct.unpack(FORMATS[entry["type"]], data)[0]
            least, most = entry["minimum"], entry["maximum"]
            if (least is not None and value < least) or (most is not None and value > most):
                wrong.append(f"{name}: {value} is not in {least}..{most}")
        address = (entry["index"], entry["sub"])
        if entry["index"] in LIVE or address in SHOWN:
            continue
        expected = node_id if address == NODE_ID else default(entry, node_id)
        if value != expected:
            wrong.append(f"{name}: {value} is not {expected}")
    assert not wrong, "\n".join(wrong)
    assert read > 150


def test_the_electrical_angle_is_the_shafts(node):
    motor = node.sdo[0x3011]
    zero, polarity, poles = (motor[sub].raw for sub in (1, 2, 3))
    # A count of the encoder, in 1/65,536 turn of the frame.
    step = polarity * poles // 2 * 65536 // node.sdo[0x3013][1].raw
    seen = set()
    for speed in (20_000, -30_000, 40_000):
        axis.stand_still(node)
        # Enabled, in profile velocity.
        for controlword in (0x06, 0x0F):
            node.sdo[0x6040].raw = controlword
        node.sdo[0x6060].raw = 3
        node.sdo[0x60FF].raw = speed
        time.sleep(0.1)
        axis.stand_still(node)
        raw = at_rest(node)
        wanted = (raw - zero) * step
        off = (node.sdo[0x60EA].raw - wanted + 0x8000) % 0x10000 - 0x8000
        # The drive's velocity may not be quite 0, and the angle is meant for a little later.
        assert abs(off) <= 1, f"at {raw} of the encoder the angle is off by {off}"
        seen.add(raw)
    assert len(seen) == 3, f"the shaft has not turned: {seen}"


def at_rest(node) -> int:
    """The encoder's reading, once it stays."""
    until = time.monotonic() + 5
    while True:
        raw = node.sdo[0x3012][1].raw
        time.sleep(0.05)
        if node.sdo[0x3012][1].raw == raw:
            return raw
        assert time.monotonic() < until, "the shaft does not come to rest"


def test_serial_numbers_differ(network, dictionary):
    nodes = [axis.reset(network, dictionary, node_id) for node_id in NODES]
    assert len({node.sdo[0x1018][4].raw for node in nodes}) == len(NODES)


# CiA 301 table 22.
REFUSALS = [
    ("no such object", 0x5FFF, 0, b"\1", 0x06020000),
    ("no such sub-index", 0x1018, 9, b"\1", 0x06090011),
    ("read only", 0x6041, 0, b"\0\0", 0x06010002),
    ("too long", 0x6040, 0, b"\0\0\0\0", 0x06070012),
    ("above the range", 0x605A, 0, b"\x09\0", 0x06090030),
    ("a mode that is only set in operation enabled", 0x6060, 0, b"\x08", 0x08000022),
]


@pytest.mark.parametrize("what, index, sub, data, code", REFUSALS, ids=[r[0] for r in REFUSALS])
def test_what_cannot_be_written_is_refused(node, what, index, sub, data, code):
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo.download(index, sub, data)
    assert refused.value.code == code, f"{what}: 0x{refused.value.code:08X}"


def test_what_is_written_is_read_back_and_gone_after_a_reset(network, dictionary, node):
    was = node.sdo[0x6083].raw
    node.sdo[0x6083].raw = 1_234_567
    assert node.sdo[0x6083].raw == 1_234_567
    again = axis.reset(network, dictionary, node.id)
    assert again.sdo[0x6083].raw == was
