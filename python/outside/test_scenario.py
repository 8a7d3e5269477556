"""What goes wrong on purpose, as a master sees it: scenarios of `servobus sim --scenario`."""

import subprocess
from pathlib import Path

import pytest

import axis
from conftest import connected
from simulation import Simulation, directory, replayed, servobus
from test_faults import Emergencies

UNDER_VOLTAGE = 0x3220
BUS_OFF_RECOVERED = 0x8140
PARAMETER_ERROR = 0x6320
EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "scenarios"


def scenario(name: str, text: str) -> Path:
    path = directory() / f"{name}.toml"
    path.write_text(text)
    return path


def play(name: str, text: str, nodes: str = "1"):
    """A network on which the scenario is played, and the simulation."""
    log = directory() / f"scenario-{name}.log"
    simulation = Simulation(nodes, log, "--scenario", str(scenario(name, text)))
    return simulation, log


def told(log: Path) -> list:
    """What the scenario told while it was played."""
    lines = log.with_suffix(".stderr.txt").read_text().splitlines()
    return [line for line in lines if " scenario: " in line]


def finish(simulation: Simulation, log: Path) -> list:
    simulation.stop()
    assert replayed(log), "a run with a scenario is repeated byte for byte"
    comments = [
        line.removeprefix("# ")
        for line in Path(f"{log}.run").read_text().splitlines()
        if line.startswith("# ")
    ]
    assert comments == told(log)
    return comments


def test_a_sag_is_an_under_voltage_fault(dictionary):
    simulation, log = play(
        "sag",
        """
[[event]]
name = "sag"
when = { drive = 1, state = "operation enabled" }
delay = "100 ms"
do = "motor-supply"
drive = 1
to = "10 V"
for = "900 ms"
""",
    )
    for network in connected(simulation.socketcand()):
        node = axis.reset(network, dictionary, 1)
        node.setup_402_state_machine()
        emergencies = Emergencies(node)
        node.nmt.state = "OPERATIONAL"
        node.state = "OPERATION ENABLED"
        assert emergencies.heard == []
        _, register, _ = emergencies.wait(UNDER_VOLTAGE)
        assert register & 0x04, "voltage (CiA 301 7.5.2.2)"
        axis.wait_until(node.is_faulted, 2, "fault")
        # Tenths of a volt.
        assert 95 <= node.sdo[0x3000][1].raw <= 105
        axis.wait_until(lambda: node.sdo[0x3000][1].raw > 470, 3, "the supply's return")
        node.reset_from_fault()
        assert node.state == "OPERATION ENABLED"
    lines = finish(simulation, log)
    assert len(lines) == 2
    assert lines[0].endswith('event "sag" (line 2): motor supply of node 1 to 10 V')
    assert lines[1].endswith('event "sag" (line 2) is over: motor supply of node 1 to 48 V')


def test_destroyed_frames_lead_to_bus_off_and_back(dictionary):
    # Node 1 sends, everybody reads a bit of it as its opposite, 32 times: its error counter passes
    # 255. Node 2 and the master hear that and lose nothing.
    simulation, log = play(
        "bus-off",
        """
[[event]]
when = { frame = { id = 0x123 } }
do = "flip-bit"
frames = { from = 1 }
bit = "crc-delimiter"
seen_by = 1
count = 32
""",
        nodes="1-2",
    )
    for network in connected(simulation.socketcand()):
        node = axis.reset(network, dictionary, 1)
        other = axis.reset(network, dictionary, 2)
        node.sdo[0x2405].raw = 1
        emergencies = Emergencies(node)
        network.send_message(0x123, b"")
        node.sdo.RESPONSE_TIMEOUT = 0.2
        node.sdo.MAX_RETRIES = 10
        assert node.sdo[0x1000].raw == other.sdo[0x1000].raw
        emergencies.wait(BUS_OFF_RECOVERED)
        assert [code for code, *_ in emergencies.heard] == [BUS_OFF_RECOVERED]
    lines = finish(simulation, log)
    assert len(lines) == 1
    assert "bus-off" in log.with_suffix(".stderr.txt").read_text()


def test_damaged_parameters_and_a_supply_that_comes_back(dictionary):
    text = (EXAMPLES / "memory.toml").read_text().replace('length = "2 s"\n', "")
    # Late enough for a master that has to connect first.
    simulation, log = play("memory", text.replace('at = "500 ms"', 'at = "2 s"'), nodes="1-2")
    for network in connected(simulation.socketcand()):
        node = network.add_node(1, dictionary(1))
        emergencies = Emergencies(node)
        assert node.sdo[0x6065].raw == 20_000
        emergencies.wait(PARAMETER_ERROR, 6)
        assert node.sdo[0x6065].raw != 20_000
    lines = finish(simulation, log)
    assert any(line.endswith("newest parameters stored in node 1 spoiled") for line in lines)


@pytest.mark.parametrize(
    "text, expected",
    [
        ('[[event]]\nat = "-1 s"\n', ":2:6: -1 s is out of range"),
        ("[drive.9]\n[drive.1]\n", ":1:8: there is no drive 9"),
        ('[drive.1.motor]\nflux = "20 mV"\n', ":2:8: 'mV' is no unit of a flux linkage"),
    ],
)
def test_what_is_impossible_is_refused_before_the_start(text, expected):
    path = scenario("bad", text)
    command = [servobus(), "sim", "--nodes", "1", "--bus", "none", "--scenario", str(path)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert ended.returncode == 2
    assert "ready" not in ended.stdout
    assert f"{path}{expected}" in ended.stderr, ended.stderr
