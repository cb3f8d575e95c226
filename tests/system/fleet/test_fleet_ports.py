"""Ids and ports of several vehicles, as PX4's simulator numbers them: clients of others, and our own over UDP."""

import asyncio
import socket

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink

from common.clock import wall_time_s
from mission.client import CLIENT_SYSTEM_ID
from mission.fleet.fleet_script import Fleet
from tests.system.vehicle import IdleVehicle, honeyguide

COUNT = 3
PATIENCE_S = 60.0  # wall clock
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def vehicles(tmp_path_factory):
    with IdleVehicle(tmp_path_factory.mktemp("fleet"), "--vehicles", "x500:2,rover:1") as started:
        yield started


class Station:
    """A ground station of pymavlink's at the one port of all vehicles."""

    def __init__(self, port):
        self.link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=255)
        self.newest = {}  # message by system and type, of autopilots

    def until(self, condition):
        end_s = wall_time_s() + PATIENCE_S
        while not condition():
            assert wall_time_s() < end_s, f"waited in vain; heard {sorted(self.newest)}"
            message = self.link.recv_match(blocking=True, timeout=1.0)
            if message is not None and message.get_srcComponent() == 1:
                self.newest[message.get_srcSystem(), message.get_type()] = message

    def is_armed(self, system):
        return bool(self.newest[system, "HEARTBEAT"].base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)


def test_each_vehicle_sends_from_a_port_of_its_own_to_the_one_of_ground_stations(vehicles):
    heard = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind(("127.0.0.1", vehicles.gcs_port))
        port.settimeout(PATIENCE_S)
        parsers = {}
        while len(heard) < COUNT or min(len(messages) for messages in heard.values()) < 200:
            data, (_, source) = port.recvfrom(65_535)
            parser = parsers.setdefault(source, mavlink.MAVLink(None))
            heard.setdefault(source, []).extend(parser.parse_buffer(data) or ())
    own = vehicles.gcs_port + 18570 - 14550
    systems = {source: {message.get_srcSystem() for message in messages} for source, messages in heard.items()}
    assert {source: ids - {CLIENT_SYSTEM_ID} for source, ids in systems.items()} == {
        own + i: {i + 1} for i in range(COUNT)
    }  # besides the vehicle's own script, a client as any other


def test_a_command_through_the_one_port_reaches_the_vehicle_that_it_names(vehicles):
    station = Station(vehicles.gcs_port)
    everybody = range(1, COUNT + 1)
    prearm = mavlink.MAV_SYS_STATUS_PREARM_CHECK
    station.until(lambda: all((system, "SYS_STATUS") in station.newest for system in everybody))
    station.until(
        lambda: all(station.newest[s, "SYS_STATUS"].onboard_control_sensors_health & prearm for s in everybody)
    )
    for named in everybody:
        station.newest.clear()
        station.link.mav.command_long_send(named, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0)
        station.until(lambda named=named: (named, "COMMAND_ACK") in station.newest)
        assert {system for system, kind in station.newest if kind == "COMMAND_ACK"} == {named}
        station.newest.clear()
        station.until(lambda: all((system, "HEARTBEAT") in station.newest for system in everybody))
        assert [station.is_armed(system) for system in everybody] == [system == named for system in everybody]
        station.link.mav.command_long_send(named, 1, ARM, 0, 0, 0, 0, 0, 0, 0, 0)
        station.until(lambda named=named: not station.is_armed(named))
    station.link.mav.param_request_read_send(0, 1, b"MAV_SYS_ID", -1)
    station.until(lambda: all((system, "PARAM_VALUE") in station.newest for system in everybody))
    station.link.close()


def test_a_script_flies_all_over_their_api_ports(vehicles):
    async def script():
        async with Fleet.over_udp(2, api_port=vehicles.api_port) as fleet:
            await fleet.each(lambda drone: drone.wait_ready())
            await fleet.each(lambda drone: drone.arm())
            await fleet.each(lambda drone: drone.takeoff(5.0))
            heights = [-drone.pos_ned[2] for drone in fleet]
            await fleet.each(lambda drone: drone.land())
            return heights, [drone.system_id for drone in fleet]

    heights, systems = asyncio.run(script())
    assert systems == [1, 2]
    assert heights == pytest.approx([5.0, 5.0], abs=1.5)  # above the origin: homes are where each believes to stand


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--vehicles", "x500"), "--vehicles x500: must be a number, or AIRFRAME:NUMBER,AIRFRAME:NUMBER,..."),
        (("--vehicles", "0"), "--vehicles 0: must be 1 to 100 vehicles"),
        (("--vehicles", "nothing:3"), "--vehicles nothing:3: unknown airframe 'nothing'; known: "),
        (("--vehicles", "x500:2,rover:1", "--engine", "jsbsim"), "--engine jsbsim: it does not move rover"),
        (("--vehicles", "c172:2"), "--airframe c172: it is JSBSim's c172p; add --engine jsbsim"),
        (("--vehicles", "2", "--param", "MAV_SYS_ID=7"), "MAV_SYS_ID: several vehicles are numbered from 1"),
        (("--vehicles", "100", "--spacing", "400"), "--vehicles: the world has free ground for 8 vehicles 400 m apart"),
        (("--adsb",), "--adsb: is for several vehicles; add --vehicles"),
        (("--spacing", "20"), "--spacing: is for several vehicles; add --vehicles"),
        (("--vehicles", "2", "--owner", "walk"), "--vehicles and --owner: choose one"),
    ],
)
def test_what_several_cannot_fly_gets_one_sentence(arguments, sentence, tmp_path):
    done = honeyguide("fly", "--speed", "max", "--run-folder", tmp_path / "run", *arguments)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert sum("honeyguide:" in line for line in done.stderr.splitlines()) == 1
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "run").exists()
