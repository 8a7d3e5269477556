"""Interfaces, can-utils and servobus as programs."""

import contextlib
import json
import signal
import subprocess
import threading
import time

from simulation import servobus

PATIENCE_S = 20
# A frame that means nothing to anybody.
MARK = "7FF#6D61726B"


def ip(*words: str, options=()) -> str:
    """`ip link ...`, which must succeed."""
    command = ["ip", *options, "link", *words]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def recorded(simulation) -> list:
    """The frames that went over the simulated bus so far, as candump writes them."""
    # What stands behind the last line feed is still being written.
    lines = simulation.log.read_text().split("\n")[:-1]
    return [line.split()[2] for line in lines]


def make_virtual(name: str) -> None:
    ip("add", name, "type", "vcan")
    ip("set", name, "up")


def cansend(interface: str, *frames: str) -> None:
    """can-utils' cansend, once for each frame."""
    for frame in frames:
        subprocess.run(["cansend", interface, frame], check=True, timeout=PATIENCE_S)


class Candump:
    """can-utils' candump, which listens from when this is made."""

    def __init__(self, interface: str, *options: str):
        # Line by line, or it would wait for a whole block.
        command = ["stdbuf", "-oL", "candump", "-L", *options, interface]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self._interface = interface
        self.frames = []
        threading.Thread(target=self._read, daemon=True).start()
        # It is listening when it hears us.
        until = time.monotonic() + PATIENCE_S
        while MARK not in self.frames:
            assert time.monotonic() < until, "candump does not start"
            cansend(interface, MARK)
            time.sleep(0.05)

    def _read(self):
        for line in self._process.stdout:
            # `(1436509052.249713) vcan0 044#2A366C2BBA`
            _stamp, interface, frame = line.split()[:3]
            assert interface == self._interface
            self.frames.append(frame)

    def heard(self) -> list:
        """All frames so far but the marks."""
        return [frame for frame in self.frames if frame != MARK]

    def wait_for(self, frame: str) -> None:
        wait_until(lambda: frame in self.frames, lambda: f"{frame} is not in {self.heard()}")

    def stop(self) -> list:
        self._process.terminate()
        self._process.wait(PATIENCE_S)
        return self.heard()


@contextlib.contextmanager
def candump(interface: str, *options: str):
    listening = Candump(interface, *options)
    try:
        yield listening
    finally:
        listening.stop()


def wait_until(so, why) -> None:
    """Waits until `so()`; fails with `why()` if that takes too long."""
    until = time.monotonic() + PATIENCE_S
    while not so():
        assert time.monotonic() < until, why()
        time.sleep(0.02)


def run(*words: str, code: int = 0) -> str:
    """What `servobus` prints: to standard output if it succeeds, else to standard error."""
    ended = subprocess.run([servobus(), *words], capture_output=True, text=True, timeout=60)
    assert ended.returncode == code, ended.stdout + ended.stderr
    return ended.stderr if code else ended.stdout


def scan(interface: str, nodes: str) -> list:
    """Which of these nodes `servobus scan` finds. A machine in a machine takes its time."""
    where = ["--bus", f"socketcan://{interface}", "--nodes", nodes]
    found = json.loads(run("scan", *where, "--timeout", "5s", "--json"))
    return [node["node"] for node in found]


class Program:
    """A `servobus` command that goes on until it is ended."""

    def __init__(self, *words: str):
        self._process = subprocess.Popen(
            [servobus(), *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self.lines = []
        self.status = None
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            self.lines.append(line.rstrip())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()

    def text(self) -> str:
        return "\n".join(self.lines)

    def wait_for(self, words: str, asking=lambda: None) -> None:
        """Until it has printed these words; asks for them again and again."""

        def printed():
            asking()
            return words in self.text()

        wait_until(printed, lambda: f"no '{words}' in:\n{self.text()}")

    def wait(self) -> None:
        """Until it ends by itself."""
        self.status = self._process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)

    def end(self) -> None:
        """Ends it as Ctrl-C does."""
        self._process.send_signal(signal.SIGINT)
        self.wait()
