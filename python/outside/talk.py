"""A short talk with drives whose bus is recorded, and frames as candump writes them."""

import time

import can

from simulation import Simulation, directory

# An SDO, remote frames, 29 bits, and a frame without bytes.
SENT = ["601#4041600000000000", "701#R", "666#R4", "1ABCDEF0#0102030405", "1ABCDEF0#R8", "080#"]


def record(name: str):
    """Records a short talk; what went over the bus, as candump writes it, and the file."""
    path = directory() / name
    running = Simulation("1-2", path)
    # slcan knows remote frames from the beginning.
    with can.Bus(**running.slcan()) as listener, can.Bus(**running.slcan()) as master:
        for frame in SENT:
            master.send(message(frame))
        # Last of all, so that all has been heard when it is answered.
        master.send(message("602#4000100000000000"))
        heard = []
        until = time.monotonic() + 10
        while heard[-1:] != ["582#4200100092010200"]:
            assert time.monotonic() < until, heard
            received = listener.recv(0.1)
            if received is not None:
                heard.append(shown(received))
    running.stop()
    # The boot-up messages came before anybody listened.
    return ["701#00", "702#00"], heard, path


def shown(frame: can.Message) -> str:
    data = f"R{frame.dlc or ''}" if frame.is_remote_frame else bytes(frame.data).hex().upper()
    return identifier(frame.arbitration_id, frame.is_extended_id) + data


def identifier(number: int, extended: bool) -> str:
    return f"{number:08X}#" if extended else f"{number:03X}#"


def message(frame: str) -> can.Message:
    digits, rest = frame.split("#")
    kind = {"arbitration_id": int(digits, 16), "is_extended_id": len(digits) == 8}
    if rest.startswith("R"):
        return can.Message(**kind, is_remote_frame=True, dlc=int(rest[1:] or 0))
    return can.Message(**kind, data=bytes.fromhex(rest))


def whole(boots: list, heard: list, recorded: list) -> None:
    """The boot-up messages come in any order, then everything as it was heard."""
    assert sorted(recorded[: len(boots)]) == boots
    assert recorded[len(boots) :] == heard
    assert [frame for frame in heard if frame in SENT] == SENT
