"""Which vehicles a fleet has, where they boot, which ports they have, and what a script is told."""

import asyncio
import socket
from math import dist

import pytest
from typer.testing import CliRunner

from common.params import ParameterError
from mission.cli import app
from mission.client import ScriptError
from mission.connections import open_links
from mission.console.option_checks import UserError
from mission.fleet.fleet_options import Member, members_of
from mission.fleet.fleet_script import Fleet
from mission.fleet.roster import check_fleet_parameters, fleet_configs, free_places
from mission.flight_config import AIRFIELD, FlightConfig, start_of
from mission.flight_settings import FlightOptions
from mission.view.replay_file import load_recording
from sim.world.world import WorldConfig, build_world
from tests.system.vehicle import free_ports, is_free

FLAT = WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0)


def members(*airframes):
    return [Member(name) for name in airframes]


@pytest.mark.parametrize(
    ("text", "members"),
    [
        ("3", [("f450", "own")] * 3),
        ("x500:2,rover:1", [("x500", "own"), ("x500", "own"), ("rover", "own")]),
        ("x500@px4:1,rover@ardupilot:1,x500:1", [("x500", "px4"), ("rover", "ardupilot"), ("x500", "own")]),
        ("dir/my:own.toml:1", [("dir/my:own.toml", "own")]),
        ("100", [("f450", "own")] * 100),
    ],
)
def test_the_vehicles_are_those_that_the_text_says(text, members):
    assert members_of(text, "f450") == members


def test_a_board_that_is_given_once_flies_those_of_which_the_text_names_none():
    assert members_of("2", "f450", "px4") == [Member("f450", "px4")] * 2
    assert members_of("x500:1,x500@own:1", "f450", "px4") == [Member("x500", "px4"), Member("x500", "own")]


@pytest.mark.parametrize("text", ["", "x500", "0", "101", "x500:2,3", "x500:-1", "x500:", "9999999999999"])
def test_what_says_no_vehicles_is_refused_in_a_sentence(text):
    with pytest.raises(UserError, match=r"^--vehicles .*: must be"):
        members_of(text, "x500")


def test_vehicles_stand_apart_on_free_level_ground_the_first_at_home():
    world = build_world(WorldConfig(size_m=300.0, hill_height_m=60.0, trees_per_ha=300.0, clearing_radius_m=10.0))
    places = free_places(world, 30, 6.0)
    assert places[0] == (0.0, 0.0)
    assert min(dist(a, b) for i, a in enumerate(places) for b in places[:i]) == pytest.approx(6.0)
    for north, east in places:
        assert world.obstacle_distance([north, east, -float(world.height(north, east)) - 0.3]) > 1.0
        assert -world.normal_ned(north, east)[2] > 0.99


def test_a_world_without_room_says_for_how_many_it_has():
    with pytest.raises(UserError, match="free ground for 9 vehicles 40 m apart"):
        free_places(build_world(FLAT), 10, 40.0)


def test_each_has_an_id_a_seed_and_a_place_of_its_own_and_the_parameters_that_it_knows():
    base = FlightConfig(seed=2**31 - 1, parameters={"MPC_XY_CRUISE": 3.0})
    configs = fleet_configs(base, members("x500", "rover", "x500"), build_world(FLAT))
    assert [config.parameters["MAV_SYS_ID"] for config in configs] == [1, 2, 3]
    assert [config.seed for config in configs] == [2**31 - 1, 0, 1]
    assert ["MPC_XY_CRUISE" in config.parameters for config in configs] == [True, False, True]
    assert start_of(configs[0]).lat_deg == pytest.approx(base.home.lat_deg, abs=1e-9)
    assert [config.start_ne_m for config in configs] == [(0.0, 0.0), (0.0, 10.0), (-10.0, 0.0)]


def test_a_parameter_must_be_one_of_some_vehicle():
    check_fleet_parameters(
        FlightConfig(parameters={"MPC_XY_CRUISE": 3.0, "RO_SPEED_LIM": 2.0}), members("rover", "x500")
    )
    for parameters in ({"MPC_XY_CRUISE": 3.0}, {"NONE_SUCH": 1.0}, {"RO_SPEED_LIM": -5.0}):
        with pytest.raises(ParameterError, match=next(iter(parameters))):
            check_fleet_parameters(FlightConfig(parameters=parameters), members("rover"))


def test_ports_are_numbered_as_the_simulators_of_px4_and_ardupilot_do():
    gcs, api = free_ports()
    vehicles = (0, 1, 12)
    tcp = next(p for p in range(gcs + 2000, 65_000) if all(is_free(p + 10 * i, socket.SOCK_STREAM) for i in vehicles))
    options = FlightOptions(gcs_port=gcs, api_port=api, tcp_port=tcp)
    for i in vehicles:
        ground, offboard, connected = links = open_links(options, 1.0, i)
        assert ground.links[0].address[1] == gcs
        assert ground.local_port == gcs + 4020 + i
        assert offboard.links[0].address[1] == api + min(i, 9)
        assert offboard.local_port == api + 40 + i
        assert connected.local_port == tcp + 10 * i
        for link in links:
            link.close()


@pytest.mark.parametrize(
    ("ports", "i_vehicle", "sentence"),
    [
        ({"gcs_port": 14550, "api_port": 14500}, 10, "vehicle 11's own ports 18580 and 14550"),
        ({"tcp_port": 65530}, 1, "--tcp-port 65530: must be at most 65525: that of vehicle 2 is 10 above"),
        ({"gcs_port": 61515}, 1, "--gcs-port 61515: must be at most 61514"),
    ],
)
def test_a_vehicle_whose_port_is_no_port_or_a_clients_is_refused(ports, i_vehicle, sentence):
    for link in open_links(FlightOptions(**ports), 1.0, 0):
        link.close()
    with pytest.raises(UserError, match=sentence):
        open_links(FlightOptions(**ports), 1.0, i_vehicle)


def test_the_number_of_a_vehicle_is_no_ones_to_give():
    with pytest.raises(ParameterError, match="MAV_SYS_ID: several vehicles are numbered from 1"):
        Fleet(2, FlightConfig(world=FLAT, parameters={"MAV_SYS_ID": 7.0}))


def test_the_world_has_a_runway_if_any_of_them_needs_one(tmp_path):
    arguments = ["--vehicles", "x500:1,plane:1", "--speed", "max", "--seconds", "0.5", "--idle"]
    done = CliRunner().invoke(app, ["fly", *arguments, "--run-folder", str(tmp_path)])
    assert done.exit_code == 0, done.output
    recording = load_recording(tmp_path)
    for each in (recording, *recording.others):
        assert each.config.world.clearing_radius_m == AIRFIELD.clearing_radius_m


def test_vehicles_that_are_not_there_end_the_script_with_a_sentence():
    _, api = free_ports()

    async def script():
        async with Fleet.over_udp(2, api_port=api, silence_s=0.2) as fleet:
            await fleet.each(lambda drone: drone.wait_ready())

    with pytest.raises(ScriptError, match=rf"UDP port {api}: no vehicle has been heard for 0\.2 s"):
        asyncio.run(script())


def test_more_than_ten_have_no_port_of_their_own():
    with pytest.raises(ScriptError, match="1 to 10 vehicles"):
        Fleet.over_udp(11)
