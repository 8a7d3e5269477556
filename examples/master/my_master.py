"""A small master, as a team would write it: it turns a drive's shaft. The tests beside it test it."""

import time

ENABLED = 0x27


def wait_for(what, timeout_s=5.0):
    """Asks until `what` is true."""
    end = time.monotonic() + timeout_s
    while not what():
        if time.monotonic() > end:
            raise TimeoutError
        time.sleep(0.005)


def enable(node, window=0):
    """Walks to "operation enabled". `window` is 0x800 for the second axis, 0x1000 for the third."""
    control, status = node.sdo[0x6040 + window], node.sdo[0x6041 + window]
    for word in (0x06, 0x07, 0x0F):
        control.raw = word
    wait_for(lambda: status.raw & 0x6F == ENABLED)


def turn_md80(node, turns):
    """Turns the output of an MD80: a target counts as soon as it is written."""
    node.sdo[0x2000][12].raw = 0  # no watchdog: this master is silent while the drive moves
    node.sdo[0x6067].raw = 100
    node.sdo[0x6083].raw = 600  # RPM/s; 0 after every start, and nothing starts with 0
    node.sdo[0x6084].raw = 600
    enable(node)
    node.sdo[0x6060].raw = 1
    node.sdo[0x607A].raw = node.sdo[0x6064].raw + round(16_384 * turns)
    wait_for(lambda: node.sdo[0x6041].raw & 1 << 10)


def turn_roboteq(node, turns, axis=1):
    """Turns a motor of a Roboteq: the state machine must be switched on, and bit 4 hands a target over."""
    window = 0x800 * (axis - 1)
    node.sdo[0x30F1].raw = 1  # ^FSA
    node.sdo[0x3008].raw = 0  # ^RWD, no watchdog: as above
    enable(node, window)
    node.sdo[0x6060 + window].raw = 1
    node.sdo[0x607A + window].raw = node.sdo[0x6064 + window].raw + round(4096 * turns)
    node.sdo[0x6040 + window].raw = 0x1F
    wait_for(lambda: node.sdo[0x6041 + window].raw & 1 << 12)
    node.sdo[0x6040 + window].raw = 0x0F
    wait_for(lambda: node.sdo[0x6041 + window].raw & 1 << 10)
