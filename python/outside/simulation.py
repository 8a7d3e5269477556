"""`servobus sim` as a child process: started on free ports, ended like Ctrl-C."""

import os
import queue
import signal
import subprocess
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

START_TIMEOUT_S = 60
STOP_TIMEOUT_S = 30


def servobus() -> str:
    """The program under test; cargo xtask names it."""
    program = os.environ.get("SERVOBUS")
    if program is None:
        root = Path(__file__).resolve().parents[2]
        program = str(root / "target" / "debug" / "servobus")
    if not Path(program).is_file():
        raise FileNotFoundError(f"{program}: build it (cargo build -p servobus) or set SERVOBUS")
    return program


def directory() -> Path:
    """Where recordings and logs are kept."""
    default = Path(__file__).resolve().parents[2] / "target" / "outside"
    path = Path(os.environ.get("SERVOBUS_OUTSIDE_DIR", default))
    path.mkdir(parents=True, exist_ok=True)
    return path


def replayed(log: Path) -> bool:
    """Whether a recording is repeated byte for byte."""
    command = [servobus(), "replay", str(log)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=STOP_TIMEOUT_S)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout.rstrip().endswith("identical")


class Simulation:
    """Virtual drives behind a socketcand and an slcan door, or other ones, recorded to `log`;
    `options` are more words for `servobus sim`. `nodes` is a list as `--nodes` has it, or says by
    node ID which drive is there.
    """

    def __init__(
        self,
        nodes: str | dict,
        log: Path,
        *options: str,
        drive: str = "p3",
        doors=("socketcand://127.0.0.1:0", "slcan://127.0.0.1:0"),
    ):
        self.log = log
        self.stderr = log.with_suffix(".stderr.txt")
        self._stderr = open(self.stderr, "wb")
        command = [servobus(), "sim", "--record", str(log), *options]
        if isinstance(nodes, dict):
            for node_id, name in nodes.items():
                command += ["--node", f"{node_id}={name}"]
        else:
            command += ["--drive", drive, "--nodes", nodes]
        for door in doors:
            command += ["--bus", door]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self._stderr)
        self._lines = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()
        self._deadline = time.monotonic() + START_TIMEOUT_S
        self.ready = self._line()
        for door in doors:
            address, *rest = self._line().split()
            if door.startswith("socketcand:"):
                # `socketcand://127.0.0.1:40001 channel can0`
                word, self.channel = rest
                assert word == "channel"
                self.socketcand_port = self._port(address, "socketcand")
            elif door.startswith("slcan:"):
                self.slcan_port = self._port(address, "slcan")
            else:
                assert address == door and not rest
        # `serial tcp://127.0.0.1:40002 node 1`, or with `/dev/pts/3`.
        self.serial = []
        for _ in range(options.count("--serial")):
            word, address, *rest = self._line().split()
            assert word == "serial" and rest[0] == "node"
            self.serial.append(address)

    def _read(self):
        for line in self._process.stdout:
            self._lines.put(line.decode().rstrip())

    def _line(self) -> str:
        while True:
            try:
                return self._lines.get(timeout=0.1)
            except queue.Empty:
                assert self._process.poll() is None, (
                    f"it ended with {self._process.returncode}, see {self._stderr.name}"
                )
                assert time.monotonic() < self._deadline, "it prints no ready line and no doors"

    @staticmethod
    def _port(address: str, scheme: str) -> int:
        parts = urlsplit(address)
        assert parts.scheme == scheme and parts.hostname == "127.0.0.1", address
        return parts.port

    def socketcand(self) -> dict:
        """What python-can needs to join by socketcand."""
        return {
            "interface": "socketcand",
            "host": "127.0.0.1",
            "port": self.socketcand_port,
            "channel": self.channel,
            "tcp_tune": True,
        }

    def slcan(self) -> dict:
        """What python-can needs to join by slcan; there is no adapter that must wake up first."""
        return {
            "interface": "slcan",
            "channel": f"socket://127.0.0.1:{self.slcan_port}",
            "bitrate": 1_000_000,
            "sleep_after_open": 0,
        }

    def kill(self) -> None:
        """Ends it in the middle of what it does."""
        self._process.kill()
        self._process.wait(STOP_TIMEOUT_S)
        self._stderr.close()

    def stop(self) -> None:
        """Ends it, as Ctrl-C does; the recording is complete then."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            code = self._process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise AssertionError(f"it does not end within {STOP_TIMEOUT_S} s of SIGINT") from None
        finally:
            self._stderr.close()
        assert code == 0, f"it ended with {code}, see {self._stderr.name}"
