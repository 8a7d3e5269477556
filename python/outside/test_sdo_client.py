"""`servobus sdo` as the client of python-canopen's SDO server.

That server does expedited and segmented transfers. It answers the request for a block upload by a
segmented one, of any length, and refuses block downloads as unknown.
"""

import json
import subprocess

import canopen
import pytest
from canopen import objectdictionary as od

from simulation import servobus

NODE = 10
DOMAIN = 0x2100
TEXT = 0x2101
WORD = 0x2102
FIXED = 0x2103


@pytest.fixture
def server(network):
    """A node of python-canopen beside the drives."""
    dictionary = canopen.ObjectDictionary()
    for index, data_type, access in [
        (DOMAIN, od.DOMAIN, "rw"),
        (TEXT, od.VISIBLE_STRING, "rw"),
        (WORD, od.UNSIGNED16, "rw"),
        (FIXED, od.DOMAIN, "const"),
    ]:
        variable = od.ODVariable(f"object {index:04X}", index)
        variable.data_type = data_type
        variable.access_type = access
        dictionary.add_object(variable)
    local = canopen.LocalNode(NODE, dictionary)
    network.add_node(local)
    yield local
    local.remove_network()


@pytest.fixture
def sdo(simulation):
    """Runs `servobus sdo` and gives what it printed."""
    bus = f"socketcand://127.0.0.1:{simulation.socketcand_port}/{simulation.channel}"

    def run(access: str, index: int, *words, code: int = 0) -> str:
        command = [servobus(), "sdo", access, "--node", str(NODE), "--bus", bus]
        command += [f"0x{index:04X}", *map(str, words)]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert ended.returncode == code, f"{ended.stdout}{ended.stderr}"
        return ended.stderr if code else ended.stdout

    return run


def pattern(count: int) -> bytes:
    return bytes(n % 251 for n in range(count))


METHODS = ["auto", "segmented", "block"]
# What changes at these lengths: one exchange, a segment, two of them, a block of 127, and blocks.
LENGTHS = [1, 4, 5, 7, 8, 14, 889, 890, 4096]


@pytest.mark.parametrize("method", METHODS)
def test_objects_of_every_length_are_read(server, sdo, tmp_path, method):
    for count in LENGTHS:
        server.set_data(DOMAIN, 0, pattern(count))
        file = tmp_path / f"{count}"
        sdo("read", DOMAIN, "--method", method, "--output", file)
        assert file.read_bytes() == pattern(count), f"{count} bytes"


@pytest.mark.parametrize("method", ["auto", "segmented"])
def test_objects_of_every_length_are_written(server, sdo, tmp_path, method):
    file = tmp_path / "value"
    for count in LENGTHS:
        file.write_bytes(pattern(count))
        sdo("write", DOMAIN, "--method", method, "--input", file)
        assert bytes(server.get_data(DOMAIN, 0)) == pattern(count), f"{count} bytes"


def test_numbers_and_texts_are_both_sides_of_one_value(server, sdo):
    sdo("write", WORD, "0xBEEF", "--type", "u16")
    assert server.sdo[WORD].raw == 0xBEEF
    server.sdo[WORD].raw = 1234
    assert json.loads(sdo("read", WORD, "--type", "u16", "--json"))["value"] == 1234
    sdo("write", TEXT, "a name of many letters", "--type", "text")
    assert server.sdo[TEXT].raw == "a name of many letters"
    server.sdo[TEXT].raw = "another one"
    assert sdo("read", TEXT, "--type", "text") == 'node 10 0x2101,0 = "another one"\n'


def test_refusals_are_told(server, sdo, tmp_path):
    file = tmp_path / "value"
    file.write_bytes(pattern(100))
    # The server looks at the access only when the last segment has come.
    refused = sdo("write", FIXED, "--input", file, "--method", "segmented", code=1)
    assert refused.startswith("error: node 10: writing 0x2103,0: refused, 0x06010002: ")
    refused = sdo("write", DOMAIN, "--input", file, "--method", "block", code=1)
    assert refused.startswith("error: node 10: writing 0x2100,0: refused, 0x05040001: ")
    refused = sdo("read", 0x2FFF, code=1)
    assert refused.startswith("error: node 10: reading 0x2FFF,0: refused, 0x06020000: ")


def test_a_transfer_given_up_is_aborted_at_the_server(server, sdo):
    server.set_data(DOMAIN, 0, pattern(100))
    refused = sdo("read", DOMAIN, "--method", "expedited", code=1)
    assert refused == (
        "error: node 10: reading 0x2100,0: the object has 100 bytes, "
        "which needs a segmented transfer\n"
    )
    # Served on another thread; the abort is the last thing that was sent.
    sdo("read", DOMAIN)
    assert server.sdo.last_received_error == 0x05040005


def test_64_kib_both_ways(server, sdo, tmp_path):
    file = tmp_path / "value"
    file.write_bytes(pattern(65536))
    sdo("write", DOMAIN, "--input", file)
    assert bytes(server.get_data(DOMAIN, 0)) == pattern(65536)
    file.unlink()
    sdo("read", DOMAIN, "--output", file)
    assert file.read_bytes() == pattern(65536)
