"""The page of several vehicles, clicked without a browser: all are shown, and who is chosen is commanded."""

from dataclasses import replace

import numpy as np
import pytest

from mission.fleet.fleet_flight import FleetFlight
from mission.fleet.fleet_options import Member
from mission.fleet.roster import fleet_configs
from mission.flight import Flight
from mission.flight_config import FlightConfig
from mission.simulator.flight_rig import flight_world
from mission.view.live import LiveView
from mission.view.page import PageServer
from mission.view.replay_file import keep_for_replay, load_recording
from sim.world.world import WorldConfig
from tests.unit.mission.view.rows import hovering, write_log

PLAIN = FlightConfig(world=WorldConfig(size_m=64.0, trees_per_ha=0.0))
MIXED = ("x500", "rover", "x500")


@pytest.fixture
def page():
    server = PageServer(0, "Honeyguide")
    yield server
    server.stop()


def handle(server, label):
    return next(each for each in server.gui._gui_input_handle_from_uuid.values() if each.label == label)


def click(server, label):
    for call in handle(server, label)._impl.update_cb:
        call(None)


def fleet_of(airframes, folder=None):
    world = flight_world(PLAIN)
    return FleetFlight(fleet_configs(PLAIN, [Member(name) for name in airframes], world), world, folder=folder)


def test_who_is_chosen_is_commanded(page):
    fleet = fleet_of(MIXED)
    first, *others = fleet.flights
    view = LiveView(first, page, others=others, change_speed=fleet.change_speed)
    handle(page, "Vehicle").value = "3 x500"
    click(page, "Take off")
    handle(page, "Wind [m/s]").value = 4.0
    fleet.run(lambda flown: flown.time_us >= 12e6, on_frame=lambda _: view.frame())
    assert [flight.controller.state.is_armed for flight in fleet.flights] == [False, False, True]
    assert -fleet.flights[2].rig.rows["truth"]["pos_ned"][0, 2] > 3.0
    assert {float(flight.rig.rows["wind_model"]["mean_ned"][0, 1]) for flight in fleet.flights} == {
        4.0
    }  # from the west
    fleet.close()


def test_the_scene_has_each_vehicle_where_it_is(page):
    fleet = fleet_of(MIXED)
    first, *others = fleet.flights
    view = LiveView(first, page, others=others)
    fleet.frame()
    view._update()
    nodes = page.scene._handle_from_node_name
    for name, flight in zip(("/vehicle", "/vehicle2", "/vehicle3"), fleet.flights, strict=True):
        np.testing.assert_allclose(nodes[name].position, flight.rig.rows["truth"]["pos_ned"][0], atol=1e-6)
    assert "/vehicle2/wheel0" in nodes
    assert "/vehicle3/wheel0" not in nodes
    fleet.close()


def test_a_replay_of_a_run_has_all_vehicles_at_the_same_moments(tmp_path):
    fleet = fleet_of(MIXED, tmp_path)
    for flight in fleet.flights:
        keep_for_replay(flight)
    fleet.run(lambda flown: flown.time_us >= 2e6)
    ends = [flight.rig.rows["truth"]["pos_ned"][0].copy() for flight in fleet.flights]
    fleet.close()
    recording = load_recording(tmp_path)
    shown = (recording, *recording.others)
    assert [each.config.airframe for each in shown] == list(MIXED)
    for each, end in zip(shown, ends, strict=True):
        assert len(each) == len(recording)
        np.testing.assert_allclose(each.rows["pos_ned"][-1], end, atol=1e-6)
        np.testing.assert_array_equal(each.rows["time_s"], recording.rows["time_s"])
    assert [len(other) for other in recording.every(5).others] == [len(recording.every(5))] * 2


def test_a_replay_has_every_moment_of_each_even_if_the_first_one_waits(tmp_path):
    """Of a vehicle that is left disarmed there is a row each second: the others' moments stay."""
    flown = hovering(4.0)
    flown.rows["pos_ned"][:, 0] = np.arange(len(flown))
    for name, rows in (("vehicle-1", flown.rows[::50]), ("vehicle-2", flown.rows)):
        (tmp_path / name).mkdir()
        write_log(replace(flown, rows=rows), tmp_path / name / "flight.ulg")
    recording = load_recording(tmp_path)
    (second,) = recording.others
    np.testing.assert_array_equal(second.rows["pos_ned"], flown.rows["pos_ned"])
    np.testing.assert_allclose(recording.rows["time_s"], flown.rows["time_s"])
    assert recording.rows["pos_ned"][75, 0] == 50.0  # where it was last known to be


def test_the_rays_of_one_are_not_left_when_another_is_chosen(page):
    flights = [Flight(PLAIN.model_copy(update={"has_lidar": has, "airframe": "rover"})) for has in (True, False)]
    view = LiveView(flights[0], page, others=flights[1:])
    for flight in flights:
        flight.frame()
    view._scene.draw_rays(view._moment(), (2.0, 3.0))
    assert page.scene._handle_from_node_name["/rays"].visible
    handle(page, "Vehicle").value = "2 rover"
    view._do_what_was_clicked()
    view._update()
    assert not page.scene._handle_from_node_name["/rays"].visible
    for flight in flights:
        flight.close()
