"""The shell: lines in, text out."""

from io import BytesIO

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import ChangeMode, LandAt, TakeOff
from autopilot.interface.item_lists import MissionItem
from autopilot.interface.platform import LogFile
from autopilot.interface.vehicle_state import Reply, Verdict
from autopilot.mavlink.services.files.shell import PIECES_PER_FRAME, PROMPT
from common.logs.ulog import UlogWriter
from tests.unit.autopilot.mavlink.rig import Client, Rig

SHELL = mavlink.SERIAL_CONTROL_DEV_SHELL
RESPOND = mavlink.SERIAL_CONTROL_FLAG_RESPOND | mavlink.SERIAL_CONTROL_FLAG_EXCLUSIVE


class Shell:
    """One client's terminal."""

    def __init__(self, rig: Rig, client: Client | None = None) -> None:
        self.rig = rig
        self.client = client or rig.client

    def type(self, text, **fields):
        data = text.encode()
        for at in range(0, len(data), 70):
            piece = data[at : at + 70]
            content = {"device": SHELL, "flags": RESPOND, "count": len(piece), "data": tuple(piece.ljust(70, b"\0"))}
            self.client.send("SERIAL_CONTROL", **(content | fields))

    def pieces(self, frames=1):
        messages = []
        for _ in range(frames):
            own = self.rig.frame()
            messages += own if self.client is self.rig.client else self.client.received()
        return [message.fields for message in messages if message.name == "SERIAL_CONTROL"]

    def run(self, line):
        """What a command prints."""
        self.type(line + "\n")
        text = "".join(bytes(piece.data[: piece.count]).decode() for piece in self.pieces(30))
        assert text.startswith(line + "\n"), text
        assert text.endswith(PROMPT), text
        return text.removeprefix(line + "\n").removesuffix(PROMPT).splitlines()


@pytest.fixture
def rig():
    return Rig()


@pytest.fixture
def shell(rig):
    return Shell(rig)


def test_empty_line_gives_the_prompt(shell):
    assert shell.run("") == []


def test_reply_is_marked_and_addressed(shell):
    shell.type("\n")
    (piece,) = shell.pieces()
    assert (piece.device, piece.flags) == (SHELL, mavlink.SERIAL_CONTROL_FLAG_REPLY)
    assert (piece.target_system, piece.target_component) == (255, 190)


def test_help_names_every_command(shell):
    text = "\n".join(shell.run("help"))
    for name in ("status", "param", "listener", "commander", "mission", "logger", "ver", "reboot"):
        assert f"  {name}" in text


def test_unknown_command_says_so(shell):
    assert shell.run("rm -rf /") == ["nsh: rm: command not found"]


def test_line_may_come_in_pieces_and_end_in_any_way(shell):
    shell.type("ver")
    assert shell.pieces(3) == []
    shell.type(" all\r\n")
    text = "".join(bytes(piece.data[: piece.count]).decode() for piece in shell.pieces(2))
    assert text.count(PROMPT) == 1
    assert "compatible with px4 1.18.0" in text


def test_two_lines_at_once_are_two_commands(shell):
    shell.type("foo\nbar\n")
    text = "".join(bytes(piece.data[: piece.count]).decode() for piece in shell.pieces(2))
    assert "foo: command not found" in text
    assert "bar: command not found" in text


def test_long_line_is_refused_and_forgotten(shell):
    shell.type("x" * 1000 + "\n")
    text = "".join(bytes(piece.data[: piece.count]).decode() for piece in shell.pieces(5))
    assert "longer than 200" in text
    assert len(text) < 400
    assert shell.run("") == []


def test_other_devices_and_replies_are_left_alone(shell):
    shell.type("help\n", device=mavlink.SERIAL_CONTROL_DEV_GPS1)
    shell.type("help\n", flags=mavlink.SERIAL_CONTROL_FLAG_REPLY)
    shell.type("help\n", target_system=7)
    assert shell.pieces(3) == []


def test_output_is_paced_and_bounded(shell):
    shell.type("param show\n")
    assert len(shell.pieces()) == PIECES_PER_FRAME
    for _ in range(30):
        shell.type("param show\n")
    text = "".join(bytes(piece.data[: piece.count]).decode() for piece in shell.pieces(200))
    assert "nsh: too much output" in text
    assert len(text) < 150_000


def test_two_clients_have_lines_of_their_own(rig, shell):
    other = Shell(rig, rig.second_client)
    shell.type("ver ")
    other.type("ver")
    shell.type("x\n")
    assert shell.pieces(2)
    assert other.pieces(2) == []


def test_parameters_are_shown_by_pattern_and_set(rig, shell):
    assert shell.run("param show mis_takeoff*")[0].startswith("  MIS_TAKEOFF_ALT: ")
    assert shell.run("param set MIS_TAKEOFF_ALT 7.5")[0].endswith(" -> 7.5")
    assert rig.vehicle.params["MIS_TAKEOFF_ALT"] == 7.5
    assert shell.run("param show MIS_TAKEOFF_ALT")[0] == "* MIS_TAKEOFF_ALT: 7.5"
    assert shell.run("param set MAV_SYS_ID 999") == ["MAV_SYS_ID: 1 -> 250"]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("param set NO_SUCH 1", "param: NO_SUCH: there is none of this name"),
        ("param set MAV_SYS_ID 1.5", "param: 1.5 is not an integer"),
        ("param set MIS_TAKEOFF_ALT nan", "param: nan is not a number"),
        ("param set MIS_TAKEOFF_ALT high", "param: high is not a number"),
        ("param", "usage: param show [PATTERN] | param set NAME VALUE"),
        ("ver", "usage: ver all"),
        ("mission start", "usage: mission status"),
        ("logger", "usage: logger status"),
        ("commander mode sideways", "commander: sideways: no such mode; there are manual"),
        ("commander fly", "usage: commander arm|disarm"),
        ("listener x", "listener: nothing is logged"),
    ],
)
def test_wrong_use_says_what_is_right(shell, line, said):
    assert shell.run(line)[0].startswith(said)


@pytest.mark.parametrize(
    ("line", "call"),
    [
        ("commander arm", ("arm", False)),
        ("commander arm -f", ("arm", True)),
        ("commander disarm", ("disarm", False)),
        ("commander mode auto:loiter", ChangeMode(0)),
        ("commander mode Return", ChangeMode(3)),
        ("reboot", ("reboot",)),
    ],
)
def test_command_asks_the_vehicle_as_a_client_would(rig, shell, line, call):
    assert shell.run(line) == ["accepted"]
    assert rig.vehicle.calls == [call]
    rig.vehicle.reply = Reply(Verdict.TEMPORARILY_REJECTED, "not now")
    assert shell.run(line) == ["temporarily rejected: not now"]


def test_takeoff_and_land_take_their_defaults(rig, shell):
    rig.update(is_armed=False)
    assert shell.run("commander takeoff") == ["accepted"]
    assert shell.run("commander land") == ["accepted"]
    assert rig.vehicle.calls == [TakeOff(), ("arm", False), LandAt()]


def test_check_tells_why_it_will_not_arm(rig, shell):
    assert shell.run("commander check") == ["ready to arm"]
    rig.vehicle.arming_problems = ["no position", "battery low"]
    assert shell.run("commander check") == ["no position", "battery low"]


def test_status_tells_mode_place_and_battery(shell):
    text = "\n".join(shell.run("status"))
    for words in ("mode       HOLD", "armed      yes, IN_AIR", "518.0 m AMSL", "battery    80 %", "mission    0 items"):
        assert words in text


def test_mission_status_counts_items(rig, shell):
    rig.vehicle.lists.load(0, [MissionItem(0, 0, 16, (0.0,) * 4, 47.0, 8.0, 500.0)] * 2)
    assert shell.run("mission status") == ["mission    2 items, item 2 is next"]


def test_listener_prints_the_last_row(rig, shell):
    class Log:
        def __init__(self):
            writer = UlogWriter(BytesIO(), 0, {}, {})
            self.rows = {
                "attitude": writer.add_topic("attitude", {"q": "float[2]", "count": "uint8_t"}),
                "silent": writer.add_topic("silent", {"x": "float"}),
            }
            self.rows["attitude"].write({"timestamp": [1, 2], "q": [[0.0, 0.0], [0.5, -1.0]], "count": [7, 8]})

        def topics(self):
            return list(self.rows)

        def latest(self, topic):
            return self.rows[topic].latest()

    rig.vehicle.host.log_stream = Log()
    assert shell.run("listener") == ["attitude", "silent"]
    assert shell.run("listener attitude") == [
        "TOPIC: attitude",
        "    timestamp: 2",
        "    q: [0.50000, -1.00000]",
        "    count: 8",
    ]
    assert shell.run("listener silent") == ["listener: silent: never published"]
    assert shell.run("listener loud") == ["listener: loud: there is no such topic"]


def test_logger_status_counts_logs(rig, shell):
    assert shell.run("logger status") == ["0 logs, 0 bytes"]

    class Shelf:
        def logs(self):
            return [LogFile("a.ulg", 10, 0), LogFile("b.ulg", 20, 0)]

    rig.vehicle.host.logs = Shelf()
    assert shell.run("logger status") == ["2 logs, 30 bytes; the newest is b.ulg, 20 bytes"]
