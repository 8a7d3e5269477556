"""The load of a CAN bus, from a candump log alone: an independent count of its bits.

    python bus_load.py FILE --bit-rate 1000000

Each frame's bits are written out as ISO 11898-1 has them (start of frame, identifier, control, data,
CRC), stuffed, and what is never stuffed is added: CRC delimiter, acknowledge, end of frame and the
interframe space, 13 bits. Classic data frames with 11-bit identifiers only.
"""

import argparse
import re

LINE = re.compile(r"\((\d+\.\d+)\) \S+ ([0-9A-F]{3})#([0-9A-F]*)$")
CRC_POLYNOMIAL = 0x4599
UNSTUFFED_BITS = 13


def crc15(bits: str) -> str:
    """Division by the generator, as the standard draws its shift register."""
    register = 0
    for bit in bits:
        out = int(bit) ^ (register >> 14)
        register = (register << 1) & 0x7FFF
        if out:
            register ^= CRC_POLYNOMIAL
    return f"{register:015b}"


def stuffed_length(bits: str) -> int:
    """After five equal bits another one follows, which counts as the first of its own kind."""
    length, last, run = 0, None, 0
    for bit in bits:
        length += 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            length += 1
            last, run = ("1" if bit == "0" else "0"), 1
    return length


def frame_bits(identifier: int, data: bytes) -> int:
    """From the start of the frame to the end of the interframe space."""
    # SOF, identifier; RTR, IDE and the reserved bit are dominant.
    head = "0" + f"{identifier:011b}" + "000" + f"{len(data):04b}"
    body = head + "".join(f"{byte:08b}" for byte in data)
    return stuffed_length(body + crc15(body)) + UNSTUFFED_BITS


def load(path, bit_rate: float) -> tuple[float, int]:
    """The share of the time that the frames take, and their number.

    The time runs from the end of the first frame to that of the last, so the first is not counted.
    """
    known: dict[str, int] = {}
    first = last = None
    bits = frames = 0
    with open(path) as log:
        for line in log:
            found = LINE.match(line.rstrip())
            assert found, f"not a classic data frame: {line!r}"
            stamp, identifier, data = found.groups()
            last = float(stamp)
            if first is None:
                first = last
                continue
            frames += 1
            key = identifier + data
            if key not in known:
                known[key] = frame_bits(int(identifier, 16), bytes.fromhex(data))
            bits += known[key]
    assert frames, f"{path} has no two frames"
    return bits / bit_rate / (last - first), frames


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--bit-rate", type=float, default=1_000_000)
    arguments = parser.parse_args()
    share, frames = load(arguments.file, arguments.bit_rate)
    print(f"{frames} frames, load {100 * share:.3f} %")
