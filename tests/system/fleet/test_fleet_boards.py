"""Vehicles of other autopilots among ours: stand-ins as strict as the originals fly in one world on one clock."""

import asyncio
import json
import socket
import sys
from math import dist
from pathlib import Path
from threading import Barrier, Thread

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink
from typer.testing import CliRunner

from bench.standins.px4 import Px4StandIn
from mission.boards import watch
from mission.boards.ardupilot_drone import ArduPilotDrone
from mission.boards.px4_drone import Px4Drone
from mission.cli import app
from mission.client import ScriptError
from mission.connections import open_links
from mission.fleet.fleet_boards import board_runs
from mission.fleet.fleet_flight import FleetFlight
from mission.fleet.fleet_options import Member
from mission.fleet.fleet_script import Fleet
from mission.fleet.roster import fleet_configs
from mission.flight import Flight
from mission.flight_config import FlightConfig, start_of
from mission.flight_settings import FlightOptions
from mission.plan.plan_file import default_plan, moved_plan, read_plan
from mission.script import Drone, fly_plan
from mission.simulator.flight_rig import flight_world
from mission.view.replay_file import load_recording
from sim.sensors.ring import RAYS, RingSensor
from sim.world.world import WorldConfig

ROOT = Path(__file__).parents[3]
PILOT = f"{sys.executable} -m bench.standins.pilots"
PX4 = f"{PILOT} px4 {{instance}}"
ARDUPILOT = f"{PILOT} ardupilot {{instance}} {{home}} {{vehicle}}"
BASE = FlightConfig(world=WorldConfig(size_m=200.0, trees_per_ha=0.0))
BALL_M = 0.3  # half of what a multirotor is to others, and more
RING_BAND_RAD = 2.0 * np.pi / RAYS


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))


def fly(script, vehicles, folder=None, config=BASE, **options):
    """What an asynchronous script of a fleet returns."""

    async def whole():
        async with Fleet(vehicles, config, folder=folder, **options) as fleet:
            return await script(fleet)

    return asyncio.run(whole())


def true_places(fleet):
    return [[float(axis) for axis in flight.rig.rows["truth"]["pos_ned"][0]] for flight in fleet.flights.flights]


def faults(folder):
    return [line for path in folder.glob("vehicle-*/*/console.log") for line in path.read_text().splitlines() if line]


def place(number):
    """Of a vehicle of five [m], ned: in a line, 4 m apart."""
    return 12.0, 4.0 * number - 12.0, -4.0


async def set_out(fleet):
    await fleet.each(lambda drone: drone.wait_ready())
    await fleet.each(lambda drone: drone.arm())
    await fleet.each(lambda drone: drone.sleep(0.1) if drone.drives else drone.takeoff(4.0))


def test_five_of_three_kinds_of_boards_fly_and_drive_in_one_frame_and_see_each_other(tmp_path):
    async def script(fleet):
        await set_out(fleet)
        await fleet.each(lambda drone: drone.goto_ned(*place(drone.system_id), acceptance_m=1.5))
        own = fleet.flights.flights[1]
        ring = RingSensor(own.rig, own.world, 0.0, 0)
        reported = [drone.pos_ned for drone in fleet]
        heard = {aircraft.callsign for aircraft in own.controller.traffic.known()}
        texts = [list(drone.texts) for drone in fleet]
        return [type(drone) for drone in fleet], reported, true_places(fleet), ring.measure(0.0), heard, texts

    commands = {"px4": PX4, "ardupilot": ARDUPILOT}
    vehicles = "x500@px4:1,x500:1,x500@ardupilot:1,rover:1,rover@ardupilot:1"
    quiet = BASE.model_copy(update={"noise": 0.1})
    kinds, reported, true, ranges, heard, texts = fly(
        script, vehicles, tmp_path, quiet, commands=commands, has_transponders=True
    )
    assert kinds == [Px4Drone, Drone, ArduPilotDrone, Drone, ArduPilotDrone]
    for number, (told, there) in enumerate(zip(reported, true, strict=True), 1):
        assert dist(told, there) < 1.0  # one frame: that of the world
        axes = 2 if number > 3 else 3
        assert dist(there[:axes], place(number)[:axes]) < 3.0  # the first to arrive wait
    for other in (0, 2):  # west of ours, and east: each of another autopilot
        off = np.subtract(true[other], true[1])
        ray = round(np.arctan2(off[1], off[0]) / RING_BAND_RAD) % RAYS
        near = min(float(ranges[(ray + step) % RAYS]) for step in (-1, 0, 1))
        assert near == pytest.approx(np.hypot(*off[:2]), abs=BALL_M + 0.3)
    assert heard == {"HG001", "HG003", "HG004", "HG005"}
    for number in (1, 3, 5):
        assert {f"heard HG00{k}" for k in range(1, 6) if k != number} <= {
            text.rstrip("\0") for text in texts[number - 1]
        }
    assert faults(tmp_path) == []
    assert (tmp_path / "vehicle-3" / "ardupilot" / "vehicle.parm").read_text().startswith("MAV_SYSID 3\n")
    assert all((tmp_path / f"vehicle-{i}" / "flight.ulg").stat().st_size > 10_000 for i in range(1, 6))


def test_ours_and_one_of_another_autopilot_strike_each_other():
    async def script(fleet):
        first, second = fleet
        await set_out(fleet)
        first.start(first.goto_ned(0.0, 10.0, -4.0))
        second.start(second.goto_ned(0.0, 0.0, -4.0))
        truths = [flight.rig.rows["truth"] for flight in fleet.flights.flights]
        await first.until(lambda: truths[0]["impact_speed"][0] > 1.0, 20.0, "a blow")
        return [float(truth["impact_speed"][0]) for truth in truths]

    impacts = fly(script, "x500:1,x500@px4:1", config=BASE.model_copy(update={"noise": 0.1}), commands=PX4)
    assert impacts[0] > 1.0
    assert impacts[0] == pytest.approx(impacts[1], rel=0.1)


def test_one_whose_program_ends_falls_and_the_others_fly_on(tmp_path):
    async def script(fleet):
        await set_out(fleet)
        with pytest.raises(ScriptError, match=r"vehicle 2: \S+ has ended with exit code 0") as lost:
            await fleet.each(lambda drone: drone.goto_ned(30.0, 10.0 * drone.system_id, -4.0, speed_m_s=2.0))
        await fleet[0].land()
        flights = fleet.flights.flights
        armed = [flight.controller.state.is_armed for flight in flights]
        return str(lost.value), [flight.end_reason for flight in flights], true_places(fleet), armed

    reason, reasons, true, armed = fly(script, "x500:1,x500@px4:1", tmp_path, commands=f"{PX4} 12")
    assert "vehicle 1" not in reason
    assert reasons[0] == ""
    assert "has ended" in reasons[1]
    assert armed == [False, False]
    assert dist(true[0][:2], (30.0, 10.0)) < 2.0
    assert true[1][0] < 25.0  # on its way
    ground_m = flight_world(BASE).height(*true[1][:2])
    assert -true[1][2] - float(ground_m) < 0.5


def fleet_of(members, world, folder, commands, **options):
    """A fleet that no script advances."""
    boards = board_runs(members, commands, folder, print, shows_consoles=False)
    return FleetFlight(fleet_configs(BASE, members, world), world, boards=boards, folder=folder, **options)


def start_plan(flight):
    plan = read_plan(default_plan(flight.airframe.vehicle))
    flight.drone.start(fly_plan(flight.drone, moved_plan(plan, start_of(flight.config))))


def test_ours_fly_the_same_with_other_autopilots_in_their_world(tmp_path):
    world = flight_world(BASE)
    fleet = fleet_of([Member("x500", "px4"), Member("rover"), Member("x500")], world, tmp_path / "all", {"px4": PX4})
    for flight in fleet.flights[1:]:
        start_plan(flight)
    fleet.run(lambda flown: flown.time_us >= 6e6)
    fleet.close()
    for number, together in enumerate(fleet.flights[1:], 2):
        alone = Flight(together.config, folder=tmp_path, world=world)
        start_plan(alone)
        alone.run(lambda flown: flown.time_us >= 6e6)
        alone.close()
        for name in ("flight.ulg", "flight.tlog"):
            assert (tmp_path / name).read_bytes() == (tmp_path / "all" / f"vehicle-{number}" / name).read_bytes()


def test_programs_of_others_compute_at_the_same_time(tmp_path):
    both = Barrier(2, timeout=30.0)
    answers = []

    def answer_together(px4):
        if 10 < px4.counts["answers"] < 20:
            both.wait()  # in vain, if one were waited for before the other has been asked
        return [0.0] * 16

    def run(instance):
        px4 = Px4StandIn(4560 + instance, answer_together)
        while px4.time_us < 200_000:
            px4.step()
        answers.append((px4.counts["answers"], px4.timeout_count, px4.faults))
        px4.close()

    fleet = fleet_of([Member("x500", "px4")] * 2, flight_world(BASE), tmp_path, {})
    threads = [Thread(target=run, args=(i,), daemon=True) for i in (0, 1)]
    for thread in threads:
        thread.start()
    fleet.run(lambda flown: flown.time_us >= 200_000)
    for thread in threads:
        thread.join(30.0)
    fleet.close()
    assert answers == [(50, 0, [])] * 2


class Station:
    """A ground station at the one port, which answers whoever has sent to it, as pymavlink's and QGroundControl do."""

    def __init__(self):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 14550))
        self._socket.setblocking(False)
        self._mav = mavlink.MAVLink(None, srcSystem=255)
        self._parsers = {}
        self.heartbeats = {}
        """The newest of each system."""
        self.systems = {}
        """Those that each port has sent as autopilots."""

    def frame(self):
        while True:
            try:
                data, (_, port) = self._socket.recvfrom(65_535)
            except BlockingIOError:
                return
            for message in self._parsers.setdefault(port, mavlink.MAVLink(None)).parse_buffer(data) or ():
                if message.get_srcComponent() == 1 and message.get_type() == "HEARTBEAT":
                    self.systems.setdefault(port, set()).add(message.get_srcSystem())
                    self.heartbeats[message.get_srcSystem()] = message

    def arm(self, system, *, is_armed=True):
        """For one, sent to all."""
        asked = mavlink.MAVLink_command_long_message(system, 1, 400, 0, is_armed, 21196, 0, 0, 0, 0, 0)
        for port in self.systems:
            self._socket.sendto(asked.pack(self._mav), ("127.0.0.1", port))

    def armed(self):
        return {system for system, message in self.heartbeats.items() if message.base_mode & 128}

    def close(self):
        self._socket.close()


def test_a_ground_station_reaches_each_by_its_id_through_one_port(tmp_path):
    members = [Member("x500"), Member("x500", "px4"), Member("rover", "ardupilot")]
    links = [open_links(FlightOptions(), 1.0, 0), [], open_links(FlightOptions(), 1.0, 2)]
    fleet = fleet_of(members, flight_world(BASE), tmp_path, {"px4": PX4, "ardupilot": ARDUPILOT}, links=links)
    station = Station()

    def fly_s(seconds):
        end_us = fleet.time_us + int(seconds * 1e6)
        fleet.run(lambda flown: flown.time_us >= end_us, on_frame=lambda _: station.frame())

    fly_s(3.0)
    assert station.systems == {18570: {1}, 18571: {2}, 18572: {3}}
    for system in (1, 2, 3):
        station.arm(system)
        fly_s(2.5)
        assert station.armed() == {system}
        station.arm(system, is_armed=False)
        fly_s(2.5)
    station.close()
    fleet.close()


def command_line(*options, folder):
    return CliRunner().invoke(app, ["fly", "--speed", "max", "--run-folder", str(folder), *options])


def test_a_program_that_ends_is_the_exit_code_and_in_the_summary(tmp_path):
    options = ("--vehicles", "x500:1,x500@px4:1", "--command", f"{PX4} 2", "--idle", "--seconds", "5")
    done = command_line(*options, folder=tmp_path / "run")
    assert done.exit_code == 1, done.output
    assert "has ended with exit code 0" in done.output
    ours, theirs = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert ours["result"] == "no mission"
    assert theirs["result"].startswith("failed: ")
    assert ours["simulated_s"] == theirs["simulated_s"] == 5.0
    recording = load_recording(tmp_path / "run")
    assert [each.config.start_ne_m for each in (recording, *recording.others)] == [(0.0, 0.0), (0.0, 10.0)]
    for each in (recording, *recording.others):
        assert each.rows["pos_ned"][-1][:2] == pytest.approx(each.config.start_ne_m, abs=0.5)


def test_one_that_never_comes_is_given_up_and_the_others_fly(tmp_path, monkeypatch):
    monkeypatch.setattr(watch, "PATIENCE_S", 2.5)
    done = command_line("--vehicles", "x500:1,rover@ardupilot:1", "--idle", "--seconds", "1", folder=tmp_path / "run")
    assert done.exit_code == 1, done.output
    assert (
        "waiting for ArduPilot of vehicle 2: start it with --model JSON; its servos are expected at UDP port 9012"
        in (done.output)
    )
    assert "ArduPilot of vehicle 2 has been silent for 2.5 s" in done.output
    assert [each["simulated_s"] for each in json.loads((tmp_path / "run" / "summary.json").read_text())] == [1.0, 1.0]


@pytest.mark.parametrize(
    ("kind", "port", "sentence"),
    [
        (socket.SOCK_STREAM, 4561, "PX4, instance 1: TCP port 4561 is in use"),
        (socket.SOCK_DGRAM, 14031, "PX4, instance 1: UDP port 14031 is in use"),
        (socket.SOCK_DGRAM, 9022, "ArduPilot, instance 2: UDP port 9022 is in use"),
    ],
)
def test_a_port_that_is_taken_is_told_and_nothing_is_left_open(kind, port, sentence, tmp_path):
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", port))
        vehicles = "x500:1,x500@px4:1,x500@ardupilot:1"
        done = CliRunner().invoke(app, ["fly", "--vehicles", vehicles, "--run-folder", str(tmp_path / "run")])
    assert done.exit_code == 2
    assert sentence in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "run").exists()
    for free in (18570, 14580, 4561, 14031, 9022, 18572):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM if free == 4561 else socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", free))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--vehicles", "x500@px5:1"), "unknown board 'px5'; known: own, ardupilot, px4"),
        (("--vehicles", "rover@betaflight:1,x500:1"), "--board betaflight: it flies no rover here"),
        (("--vehicles", "x500@betaflight:2"), "one Betaflight at most"),
        (("--vehicles", "x500@ardupilot:1,x500:1", "--engine", "pybullet"), "--board ardupilot and --engine pybullet"),
        (("--vehicles", "x500@px4:1,x500:1", "--noise", "0"), "--noise 0 and --board px4"),
        (("--vehicles", "2", "--board", "px4", "--lidar"), "--lidar and --board px4"),
        (("--vehicles", "2", "--board", "px4", "--instance", "3"), "--vehicles and --instance: choose one"),
        (
            ("--vehicles", "x500@px4:1,x500@ardupilot:1", "--command", "true"),
            "say whose it is: px4=COMMAND or ardupilot",
        ),
        (("--vehicles", "x500@px4:1", "--command", "px4=true", "--command", "true"), "px4 has one already"),
        (("--vehicles", "2", "--command", "true"), "no program of others flies here; add --board"),
        (("--vehicles", "x500@px4:1", "--command", "ardupilot=true"), "ardupilot flies nothing here"),
        (("--vehicles", "x500@px4:1,x500:1", "--param", "MAV_SYS_ID=3"), "MAV_SYS_ID: several vehicles are numbered"),
        (("--vehicles", "x500@px4:1", "--command", "/no/such/program"), "--command /no/such/program"),
    ],
)
def test_what_does_not_go_together_is_refused_by_a_sentence(options, sentence, tmp_path):
    done = command_line(*options, folder=tmp_path / "run")
    assert done.exit_code == 2
    assert sentence in done.stderr
    assert sum("honeyguide:" in line for line in done.stderr.splitlines()) == 1
