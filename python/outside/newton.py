"""What a torque does to the rotor, from the drive's own objects."""

import math


def counts_per_s2(torque_nm: float, inertia_kgm2: float, counts_per_turn: int = 4096) -> float:
    """Acceleration of a free rotor, cts/s²."""
    return torque_nm / inertia_kgm2 * counts_per_turn / (2 * math.pi)


def inertia_kgm2(node) -> float:
    """0x3011,7 is in gcm² / 2^15."""
    return node.sdo[0x3011][7].raw / 32768 * 1e-7
