"""Emergencies, heartbeats, TIME, guarding and program download of the extended P3, seen by python-canopen."""

import subprocess
import time

import can
import canopen
import pytest

from axis import wait_until
from conftest import connected
from simulation import Simulation, directory, servobus

NODE = 1


@pytest.fixture
def master():
    """python-canopen and one virtual extended P3 of its own."""
    running = Simulation("1", directory() / "services.log", drive="p3-extended")
    for network in connected(running.socketcand()):
        yield network, network.add_node(NODE)
    running.stop()


def write(node, index: int, sub: int, value: int, length: int) -> None:
    node.sdo.download(index, sub, value.to_bytes(length, "little"))


def test_emergencies_are_consumed_with_their_end(master):
    network, node = master
    # A frame shorter than the mapping of RPDO 1 (CiA 301 7.2.2.4).
    write(node, 0x1400, 1, 0x8000_0201, 4)
    write(node, 0x1600, 0, 0, 1)
    write(node, 0x1600, 1, 0x6071_0010, 4)
    write(node, 0x1600, 0, 1, 1)
    write(node, 0x1400, 1, 0x201, 4)
    network.nmt.send_command(1)
    network.send_message(0x201, [0])
    assert node.emcy.wait(0x8210, 2) is not None
    assert [error.code for error in node.emcy.active] == [0x8210]
    network.send_message(0x201, [0, 0])
    wait_until(lambda: not node.emcy.active, 2, "the end of the error")
    # The history holds it until it is cleared.
    assert node.sdo.upload(0x1003, 1)[:2] == (0x8210).to_bytes(2, "little")
    write(node, 0x1003, 0, 0, 1)
    assert node.sdo.upload(0x1003, 0) == b"\0"
    with pytest.raises(canopen.SdoAbortedError):
        node.sdo.upload(0x1003, 1)


def test_heartbeats_both_ways(master):
    network, node = master
    write(node, 0x1017, 0, 50, 2)
    node.nmt.wait_for_heartbeat(2)
    assert node.nmt.state == "PRE-OPERATIONAL"
    # The drive listens for node 9, which is this test.
    write(node, 0x1016, 1, 9 << 16 | 200, 4)
    network.send_message(0x709, [5])
    assert node.emcy.wait(0x8130, 2) is not None
    network.send_message(0x709, [5])
    wait_until(lambda: not node.emcy.active, 2, "the end of the error")


def test_guarding_by_remote_frames_over_slcan():
    """socketcand knows no remote frames; slcan does."""
    running = Simulation("1", directory() / "guarding.log", drive="p3-extended")
    with can.Bus(**running.slcan()) as bus:
        toggles = []
        for _ in range(4):
            bus.send(can.Message(arbitration_id=0x701, is_remote_frame=True, dlc=1, is_extended_id=False))
            answer = bus.recv(2)
            while answer is not None and (answer.arbitration_id != 0x701 or answer.is_remote_frame):
                answer = bus.recv(2)
            assert answer is not None and answer.dlc == 1
            assert answer.data[0] & 0x7F == 0x7F
            toggles.append(answer.data[0] >> 7)
        assert toggles in ([0, 1, 0, 1], [1, 0, 1, 0])
    running.stop()


def test_an_event_driven_pdo_keeps_its_inhibit_time_and_timer(master):
    network, node = master
    write(node, 0x1800, 1, 0x8000_0181, 4)
    write(node, 0x1800, 2, 255, 1)
    write(node, 0x1800, 3, 0, 2)
    write(node, 0x1800, 5, 100, 2)
    write(node, 0x1A00, 0, 0, 1)
    write(node, 0x1A00, 1, 0x6041_0010, 4)
    write(node, 0x1A00, 0, 1, 1)
    write(node, 0x1800, 1, 0x181, 4)
    seen = []
    network.subscribe(0x181, lambda _id, data, stamp: seen.append((stamp, bytes(data))))
    network.nmt.send_command(1)
    time.sleep(1)
    # The first at once, then one each 100 ms.
    assert 8 <= len(seen) <= 12, seen
    before = len(seen)
    node.sdo.download(0x6040, 0, b"\x06\x00")
    wait_until(lambda: any(data[0] & 0x6F == 0x21 for _, data in seen[before:]), 0.09, "the event")


def test_a_program_is_downloaded_and_started(master, tmp_path):
    network, node = master
    body = tmp_path / "body.bin"
    body.write_bytes(bytes(range(256)) * 200)
    image = tmp_path / "program.sbp"
    subprocess.run(
        [servobus(), "program", "make", "--version", "2.5.0", "--product", "0x5033", body, image],
        check=True,
    )
    assert node.sdo.upload(0x100A, 0) == b"1.0.0"
    identification = node.sdo.upload(0x1F56, 1)

    def status() -> int:
        return int.from_bytes(node.sdo.upload(0x1F57, 1), "little")

    write(node, 0x1F51, 1, 0, 1)
    write(node, 0x1F51, 1, 3, 1)
    wait_until(lambda: status() & 1 == 0, 5, "the cleared memory")
    # Damaged on its way: refused, the old program stays, and 0x1F57 says why.
    damaged = bytearray(image.read_bytes())
    damaged[1000] ^= 1
    with pytest.raises(canopen.SdoAbortedError):
        node.sdo.download(0x1F50, 1, bytes(damaged), force_segment=True)
    assert status() & 0xFE != 0
    assert node.sdo.upload(0x1F56, 1) == identification
    # Whole, in blocks.
    write(node, 0x1F51, 1, 3, 1)
    wait_until(lambda: status() & 1 == 0, 5, "the cleared memory")
    with node.sdo.open(
        0x1F50, 1, "wb", size=image.stat().st_size, block_transfer=True, buffering=7 * 127
    ) as stream:
        stream.write(image.read_bytes())
    assert status() == 0
    assert node.sdo.upload(0x1F56, 1) != identification
    write(node, 0x1F51, 1, 1, 1)
    node.nmt.wait_for_bootup(3)
    assert node.sdo.upload(0x100A, 0) == b"2.5.0"


def test_parameters_are_stored_verified_and_restored(master):
    network, node = master

    def number(index: int, sub: int) -> int:
        return int.from_bytes(node.sdo.upload(index, sub), "little")

    def reset() -> None:
        network.nmt.send_command(0x81)
        node.nmt.wait_for_bootup(3)

    def save() -> None:
        node.sdo.download(0x1010, 1, b"save")

    write(node, 0x1015, 0, 70, 2)
    write(node, 0x6083, 0, 12345, 4)
    write(node, 0x1020, 1, 15_000, 4)
    write(node, 0x1020, 2, 4_000, 4)
    save()
    reset()
    assert (number(0x1015, 0), number(0x6083, 0)) == (70, 12345)
    assert (number(0x1020, 1), number(0x1020, 2)) == (15_000, 4_000)
    # Someone else stores other parameters: whoever verifies the configuration sees it.
    write(node, 0x6083, 0, 54321, 4)
    save()
    reset()
    assert number(0x6083, 0) == 54321
    assert (number(0x1020, 1), number(0x1020, 2)) == (0, 0)
    # Without the signature nothing happens; with it the defaults hold from the next reset on.
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo.download(0x1011, 1, b"save")
    assert refused.value.code == 0x08000020
    node.sdo.download(0x1011, 3, b"load")
    assert number(0x6083, 0) == 54321
    reset()
    assert number(0x6083, 0) != 54321
    assert number(0x1015, 0) == 70
    node.sdo.download(0x1011, 1, b"load")
    reset()
    assert number(0x1015, 0) == 0
