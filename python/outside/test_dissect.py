"""Wireshark's dissector on the recording of the whole session, as candump's log and as pcapng."""

import subprocess

import pytest

from simulation import directory, servobus
from talk import identifier, record, whole

# In that session there are no remote frames, and every identifier is CANopen's.
CANOPEN = ["-d", "can.subdissector,canopen"]


@pytest.fixture(scope="module", params=["bus.log", "bus.pcapng"])
def recording(request):
    """The log, and the same frames as pcapng, by a replay."""
    path = directory() / request.param
    if path.suffix == ".pcapng":
        command = [servobus(), "replay", str(directory() / "bus.log"), "--output", str(path)]
        subprocess.run(command, check=True, timeout=600)
    return path


def tshark(recording, *arguments) -> list:
    """The lines that tshark prints."""
    command = ["tshark", "-r", str(recording), *CANOPEN, *arguments]
    ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=600)
    return ended.stdout.splitlines()


def test_no_frame_is_malformed(recording):
    assert tshark(recording, "-Y", "_ws.malformed") == []


def test_every_frame_is_read_as_canopen(recording):
    lines = (directory() / "bus.log").read_text().count("\n")
    shown = tshark(recording, "-Y", "canopen", "-T", "fields", "-e", "frame.number")
    assert len(shown) == lines


@pytest.mark.parametrize(
    "what, filter",
    [
        ("NMT", "canopen.nmt_ctrl.cd"),
        ("boot-up", "canopen.nmt_guard.state == 0"),
        ("heartbeat", "canopen.nmt_guard.state == 5"),
        ("SYNC", "canopen.cob_id == 0x80"),
        ("EMCY of a lost SYNC", "canopen.em.err_code == 0x8180"),
        ("EMCY of a reset", "canopen.em.err_code == 0"),
        ("PDO", "canopen.pdo.data.bytes"),
        ("SDO download request", "canopen.sdo.ccs == 1"),
        ("SDO upload request", "canopen.sdo.ccs == 2"),
        ("SDO upload answer", "canopen.sdo.scs == 2"),
        ("SDO abort", "canopen.sdo.abort_code == 0x08000022"),
    ],
)
def test_every_kind_of_message_is_recognised(recording, what, filter):
    assert tshark(recording, "-Y", filter), f"tshark finds no {what}"


# What other tests record: the extended drive, and one of each drive on one bus.
OTHERS = [
    "mixed.log",
    "extended.log",
    "extended-modes.log",
    "services.log",
    "transfers.log",
    "transfers-bad-segmented-65536.log",
    "transfers-bad-block-1048576.log",
]


@pytest.mark.parametrize("name", OTHERS)
def test_every_frame_of_the_other_recordings_is_read_and_none_malformed(name):
    """Segments, blocks, emergencies, programs: whatever the other tests have recorded."""
    path = directory() / name
    lines = path.read_text().count("\n")
    assert lines > 0
    assert tshark(path, "-Y", "_ws.malformed") == []
    assert len(tshark(path, "-Y", "canopen", "-T", "fields", "-e", "frame.number")) == lines


def test_tshark_reads_pcapng():
    boots, heard, path = record("live.pcapng")
    fields = ["frame.time_epoch", "can.flags.xtd", "can.flags.rtr", "can.id", "can.len"]
    fields += ["data.data", "frame.packet_flags_direction"]
    command = ["tshark", "-r", str(path), "-T", "fields", "-E", "separator=;"]
    for field in fields:
        command += ["-e", field]
    # Without CANopen, so that the bytes are shown as they are.
    command += ["-d", "can.subdissector,data"]
    ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=600)
    recorded, stamps = [], []
    for line in ended.stdout.splitlines():
        stamp, extended, remote, number, length, data, direction = line.split(";")
        text = identifier(int(number, 0), is_true(extended))
        length = int(length)
        recorded.append(text + (f"R{length or ''}" if is_true(remote) else data.upper()))
        stamps.append(float(stamp))
        # Sent by the drives, or received from outside.
        answers = {0x581, 0x582, 0x701, 0x702}
        outbound = int(number, 0) in answers and not is_true(remote)
        assert int(direction, 0) == (2 if outbound else 1), line
    whole(boots, heard, recorded)
    # Simulated time, from zero.
    assert stamps == sorted(stamps) and 0 < stamps[0] < 1 and stamps[-1] < 60


DISTURBED = """\
servobus run 1
seed 5
error-frames on
drive 1 p3
drive 2 p3
wire 0.050000000 flip 30 0/0 from any skip 0 times 1 seen-by all
(0.050000000) client1 601#40411000
wire 0.051000000 flip ack-slot 0/0 from any skip 0 times 1 seen-by all
(0.051000000) client1 602#40411000
wire 0.052000000 flip crc-delimiter 0/0 from 1 skip 0 times 1 seen-by all
(0.052000000) client1 601#40411000
wire 0.053000000 break recessive 1000000ns
(0.053000000) client1 7F0#00
end 0.070000000
"""


@pytest.mark.parametrize("ending", [".log", ".pcapng"])
def test_tshark_reads_error_messages(ending):
    """What the controller of outside programs has seen, in each format."""
    run = directory() / "errors.log.run"
    run.write_text(DISTURBED)
    path = directory() / f"errors-again{ending}"
    command = [servobus(), "replay", str(run.with_suffix("")), "--output", str(path)]
    subprocess.run(command, check=True, timeout=600)

    def shown(which) -> int:
        return len(tshark(path, "-Y", f"can.flags.err == 1 && {which}"))

    # A bit of the data, seen by its sender; the delimiter of a drive's frame, seen by a receiver.
    assert shown("can.err.prot.type.bit == 1 && can.err.prot.location == 10") == 1
    assert shown("can.err.prot.type.form == 1 && can.err.prot.location == 24") == 1
    assert shown("can.err.ack == 1") == 1
    # Into bus-off and out of it: an error in each start of frame and each bit of the first flags.
    assert shown("can.err.ctrl.tx_passive == 1") == 1
    assert shown("can.err.prot.type.tx == 1 && can.err.prot.location == 3") == 16
    assert shown("can.err.busoff == 1") == 1
    assert shown("can.err.restarted == 1") == 1
    assert tshark(path, "-Y", "can.err.dlc_mismatch") == []


def is_true(flag: str) -> bool:
    return flag in ("1", "True")
