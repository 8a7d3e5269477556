"""Recordings as MCAP, read by the MCAP library, against what python-can heard."""

import json
import time

import can
import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader

from simulation import Simulation, directory
from talk import identifier, message, record, whole


def test_the_mcap_library_reads_mcap():
    boots, heard, path = record("live.mcap")
    recorded, stamps, signals = [], [], {1: [], 2: []}
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        schemas = {schema.name: json.loads(schema.data) for schema in summary.schemas.values()}
        for schema, channel, entry in reader.iter_messages():
            assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
            content = json.loads(entry.data)
            assert set(content) == set(schemas[schema.name]["properties"])
            if channel.topic == "can0":
                recorded.append(frame_of(content))
                stamps.append(entry.log_time)
            elif channel.topic.startswith("drive/"):
                signals[int(channel.topic.removeprefix("drive/"))].append((entry.log_time, content))
    whole(boots, heard, recorded)
    assert stamps == sorted(stamps) and stamps[0] < 1_000_000_000
    for samples in signals.values():
        times = [at for at, _ in samples]
        # Every 5 ms, from the beginning to the end.
        assert times == [5_000_000 * n for n in range(len(times))]
        assert times[-1] >= stamps[-1] - 20_000_000
        assert {content["speed_rad_s"] for _, content in samples} == {0.0}


def frame_of(content: dict) -> str:
    assert not content["error"]
    rest = bytes(content["data"]).hex().upper()
    if content["remote"]:
        rest = f"R{content['length'] or ''}"
    return identifier(content["id"], content["extended"]) + rest


def test_what_is_left_of_a_recording_that_is_killed():
    """Half a second later all is in the file, though it has no end."""
    path = directory() / "killed.mcap"
    running = Simulation("1", path)
    with can.Bus(**running.socketcand()) as bus:
        bus.send(message("123#4567"))
        time.sleep(2)
    running.kill()
    frames = []
    with path.open("rb") as file:
        # Sorted, it would be read to its end first.
        entries = NonSeekingReader(file).iter_messages(log_time_order=False)
        with pytest.raises(McapError):
            for _schema, channel, entry in entries:
                if channel.topic == "can0":
                    frames.append(frame_of(json.loads(entry.data)))
    assert frames == ["701#00", "123#4567"]
