"""The Roboteq's serial command line: a plain socket and pyserial at a terminal, and python-canopen,
which looks at the same drive from the other side. The dictionary is the exported EDS."""

import os
import socket
import time

import pytest
import serial

from axis import wait_until
from conftest import connected
from remote import add, refusal
from simulation import Simulation, directory, replayed

LOG = "roboteq-serial.log"
# Statuswords of the document, with voltage and remote always set (table 14).
SWITCH_ON_DISABLED = 0x0250
OPERATION_ENABLED = 0x0237


@pytest.fixture(scope="module")
def drives():
    """A controller with two channels at a TCP port, and one at a pseudo-terminal."""
    log = directory() / LOG
    options = ["--channels", "2", "--serial", "1=tcp://127.0.0.1:0", "--serial", "2=pty"]
    running = Simulation("1-2", log, *options, drive="roboteq")
    yield running
    running.stop()
    assert replayed(log)


class Line:
    """One end of a serial line; answers end with a carriage return."""

    def __init__(self, send, receive):
        self.send = send
        self._receive = receive
        self._heard = b""

    def line(self, timeout_s: float = 3) -> str:
        """The next line."""
        end = time.monotonic() + timeout_s
        while b"\r" not in self._heard:
            assert time.monotonic() < end, f"no answer, only {self._heard!r}"
            self._heard += self._receive()
        line, _, self._heard = self._heard.partition(b"\r")
        return line.decode("ascii")

    def ask(self, text: str) -> str:
        """Sends a line, and gives its answer."""
        self.send(text.encode("ascii") + b"\r")
        return self.line()

    def obey(self, *lines: str) -> None:
        for line in lines:
            assert self.ask(line) == "+", line

    def silent(self, for_s: float = 0.3) -> bool:
        end = time.monotonic() + for_s
        while time.monotonic() < end:
            self._heard += self._receive()
        return not self._heard

    def quiet(self) -> "Line":
        """Without its echo."""
        self.send(b"\r^ECHOF 1\r")
        wait_until(lambda: self.line() == "+", 3, "the echo is off")
        while not self.silent(0.1):
            self._heard = b""
        return self


def tcp(simulation) -> socket.socket:
    host, port = simulation.serial[0].removeprefix("tcp://").rsplit(":", 1)
    # Whoever was there before needs a moment to go.
    end = time.monotonic() + 10
    while True:
        plug = socket.create_connection((host, int(port)), timeout=0.05)
        plug.sendall(b"\r")
        try:
            if plug.recv(1) == b"":
                raise ConnectionError("somebody is there")
        except TimeoutError:
            return plug
        except ConnectionError:
            assert time.monotonic() < end
            plug.close()
            time.sleep(0.1)
            continue
        return plug


def socket_line(plug: socket.socket) -> Line:
    def receive() -> bytes:
        try:
            data = plug.recv(4096)
        except TimeoutError:
            return b""
        assert data, "the line was closed"
        return data

    return Line(plug.sendall, receive)


@pytest.fixture
def plug(drives):
    """A raw socket at the line of node 1."""
    with tcp(drives) as plug:
        yield plug


@pytest.fixture
def line(plug):
    line = socket_line(plug).quiet()
    # These tests wait for longer than a second between two commands.
    line.obey("^RWD 0")
    yield line
    line.send(b"\r# C\r!CW 1 0\r!CW 2 0\r!S 1 0\r!S 2 0\r!G 1 0\r!G 2 0\r^FSA 0\r")
    time.sleep(0.2)


@pytest.fixture
def terminal(drives):
    """pyserial at the line of node 2, as at a serial port."""
    with serial.Serial(drives.serial[1], 115_200, timeout=0.05) as port:
        yield Line(port.write, lambda: port.read(4096)).quiet()
    # Its closing is noticed.
    time.sleep(0.3)


@pytest.fixture
def network(drives):
    yield from connected(drives.socketcand())


def test_the_echo_is_on_at_first_and_an_acknowledge_follows(drives):
    # Another drive's line would have been quieted by the tests before.
    drives_here = Simulation(
        "5",
        directory() / "roboteq-echo.log",
        "--serial",
        "tcp://127.0.0.1:0",
        drive="roboteq",
    )
    try:
        with tcp(drives_here) as plug:
            line = socket_line(plug)
            assert [line.ask("?SW"), line.line()] == ["?SW", "SW=0"]
            assert [line.ask("!G 1 0"), line.line()] == ["!G 1 0", "+"]
            assert [line.ask("?XX"), line.line()] == ["?XX", "-"]
            assert [line.ask("^ECHOF 1"), line.line()] == ["^ECHOF 1", "+"]
            assert line.ask("?SW") == "SW=0"
    finally:
        drives_here.stop()


def test_the_line_and_can_see_one_drive(line, network):
    can = add(network, "roboteq-2")
    line.obey("^FSA 1", "!ROM 2 3", "!PAC 2 12345", "!SPL 3 11", "!SPL 4 1234")
    assert can.sdo[0x6860].raw == 3
    assert can.sdo[0x6883].raw == 12345
    assert [can.sdo[0x6846][sub].raw for sub in (1, 2)] == [11, 1234]
    can.sdo[0x6081].raw = 777
    assert line.ask("?PSP") == "PSP=777:1000"
    assert line.ask("?PSP 1") == "PSP=777"
    assert line.ask("?SW 2") == f"SW={SWITCH_ON_DISABLED}"
    # Refused by both: a mode that the controller does not have.
    assert line.ask("!ROM 1 8") == "-"
    assert refusal(lambda: setattr(can.sdo[0x6060], "raw", 8)) == 0x06090030
    assert can.sdo[0x6060].raw == 0


def test_a_motor_runs_by_the_line_alone(line, network):
    can = add(network, "roboteq-2")
    line.obey("^FSA 1", "!ROM 2 3", "!CW 2 6", "!CW 2 7", "!CW 2 15", "!S 2 300")
    speed = lambda: int(line.ask("?F 2").removeprefix("F="))  # noqa: E731
    wait_until(lambda: abs(speed() - 300) < 15, 5, "300 RPM")
    assert abs(can.sdo[0x686C].raw - 300) < 15
    assert int(line.ask("?SW 2").removeprefix("SW=")) & ~0x1400 == OPERATION_ENABLED
    assert int(line.ask("?S 1").removeprefix("S=")) == 0
    # CAN stops it, and the line sees that.
    can.sdo[0x68FF].raw = 0
    wait_until(lambda: abs(speed()) < 15, 5, "standstill")
    can.sdo[0x6840].raw = 0
    assert line.ask("?SW 2") == f"SW={SWITCH_ON_DISABLED}"


def test_a_motor_whose_commands_stop_stops(line):
    line.obey("^RWD 500", "^FSA 1", "!ROM 1 3", "!CW 1 6", "!CW 1 15")
    speed = lambda: int(line.ask("?F 1").removeprefix("F="))  # noqa: E731
    for _ in range(8):
        line.obey("!S 1 300")
        time.sleep(0.1)
    assert abs(speed() - 300) < 15
    # Queries do not keep it going.
    wait_until(lambda: abs(speed()) < 10, 3, "standstill")
    line.obey("!S 1 300")
    wait_until(lambda: abs(speed() - 300) < 15, 0.5, "300 RPM")
    line.obey("!CW 1 0")


def test_queries_are_repeated_until_they_are_stopped(line):
    line.send(b"# C_?SW 1_?A 1_# 20_")
    answers = [line.line() for _ in range(42)]
    assert [answer.partition("=")[0] for answer in answers] == ["SW", "A"] * 21
    began = time.monotonic()
    for _ in range(50):
        line.line()
    assert 0.8 < time.monotonic() - began < 1.5
    line.send(b"#\r")
    time.sleep(0.2)
    line.silent(0.1)
    line._heard = b""
    assert line.silent()
    # One by one.
    assert {line.ask("#").partition("=")[0], line.ask("#").partition("=")[0]} == {"SW", "A"}


def test_what_makes_no_sense_is_answered_with_a_minus(line):
    for text in ["!CW", "!CW 3 15", "CW 1 15", "!CW 1 99999999999", "?SW x", "%EESAV 1", "#x", "~"]:
        assert line.ask(text) == "-", text
    line.send(b"A" * 5000 + b"\r")
    assert line.line() == "-"
    garbage = bytes(byte for byte in os.urandom(20_000) if byte not in b"\r_\x05")
    line.send(garbage + b"\r")
    assert line.line(10) == "-"
    assert line.ask("?VNM 1") == f"VNM={0x40100}"
    # Is anybody there?
    line.send(b"\x05?VNM1\r")
    assert line.line() == f"\x06VNM={0x40100}"


def test_who_vanishes_in_the_middle_of_a_line_leaves_nothing_behind(drives, network):
    can = add(network, "roboteq-2")
    with tcp(drives) as plug:
        socket_line(plug).quiet().obey("!TC 1 5")
        plug.sendall(b"!TC 1 1")
    with tcp(drives) as plug:
        line = socket_line(plug)
        assert line.ask("5") == "-"
        assert can.sdo[0x6071].raw == 5
        # At once, and with half a line again.
        plug.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        plug.sendall(b"# 1\r!TC 1 9")
    time.sleep(1)
    assert can.sdo[0x6071].raw == 5


def test_a_second_program_is_turned_away(drives, line):
    host, port = drives.serial[0].removeprefix("tcp://").rsplit(":", 1)
    with socket.create_connection((host, int(port)), timeout=3) as second:
        try:
            assert second.recv(1) == b""
        except ConnectionError:
            pass
    assert line.ask("?VNM 1") == f"VNM={0x40100}"


def test_pyserial_at_the_terminal(terminal, network):
    can = add(network, "roboteq-2", 2)
    terminal.obey("^MAC 2 5432", "^MMOD 1 1")
    assert terminal.ask("~MAC") == "MAC=20000:5432"
    terminal.obey("^RWD 0", "!G 2 200")
    turns = lambda: int(terminal.ask("?S 2").removeprefix("S="))  # noqa: E731
    wait_until(lambda: turns() > 100, 5, "the motor turns in open loop")
    terminal.obey("!G 2 0", "%EESAV")
    # What was stored is there after a reset, and the echo is on again.
    can.nmt.send_command(0x81)
    time.sleep(0.5)
    terminal.quiet()
    assert terminal.ask("~MAC") == "MAC=20000:5432"


def test_a_terminal_can_be_opened_again(drives, terminal):
    assert terminal.ask("?SDM 1") == "SDM=15"
