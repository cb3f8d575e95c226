"""MAVSDK's Mission and MissionRaw plugins against a flight, in this process: what they send is flown, or refused."""

import json
from math import degrees, nan

import pytest
from mavsdk.plugins.action import Action
from mavsdk.plugins.mission import Mission, MissionError, MissionItem, MissionPlan, MissionResult
from mavsdk.plugins.mission_raw import MissionItem as RawItem
from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError, MissionRawResult

from autopilot.interface.vehicle_state import Mode
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.flight import FlightConfig
from sim.world.world import WorldConfig
from tests.system.mavsdk.raw_mavsdk import RawMavsdk
from tests.system.raw_vehicle import QuickFlight

Camera, Vehicle = MissionItem.CameraAction, MissionItem.VehicleAction
CONFIG = FlightConfig(world=WorldConfig(trees_per_ha=0.0))


@pytest.fixture
def session(tmp_path):
    session = QuickFlight(CONFIG, folder=tmp_path)
    with RawMavsdk(session.make_turn) as mavsdk:
        session.system = mavsdk.system
        yield session
    session.flight.close()


def place(north, east):
    return geodetic_from_ned(north, east, 0.0, DEFAULT_HOME)[:2]


def waypoint(north, east, **kinds):
    return MissionItem(*place(north, east), 8.0, **({"is_fly_through": True, "speed_m_s": 5.0} | kinds))


def raw(seq, command, north=nan, east=nan, params=(0.0, 0.0, 0.0, nan), frame=6, height=8.0):
    lat, lon = (0, 0) if north != north else (round(degrees * 1e7) for degrees in place(north, east))
    return RawItem(seq, frame, command, int(seq == 0), 1, *map(float, params), lat, lon, height, 0)


@pytest.mark.slow
def test_mission_with_every_action_is_flown_to_its_return(session):
    shots = []
    session.flight.controller.camera.on_shot(lambda shot, *_: shots.append(shot))
    mission = Mission(session.system)
    reports = []
    mission.subscribe_mission_progress(lambda progress, _: reports.append((progress.current, progress.total)))
    mission.set_return_to_launch_after_mission(True)
    items = [
        waypoint(0.0, 0.0, vehicle_action=Vehicle.TAKEOFF),
        waypoint(15.0, 0.0, gimbal_pitch_deg=-30.0, gimbal_yaw_deg=10.0, camera_action=Camera.TAKE_PHOTO),
        waypoint(15.0, 10.0, is_fly_through=False, loiter_time_s=1.0, camera_action=Camera.TAKE_PHOTO),
        waypoint(0.0, 10.0, camera_action=Camera.START_PHOTO_DISTANCE, camera_photo_distance_m=5.0),
    ]
    mission.upload_mission(MissionPlan(items))
    assert len(mission.download_mission().mission_items) == 4
    assert mission.get_return_to_launch_after_mission()
    Action(session.system).arm()
    mission.start_mission()
    session.until(mission.is_mission_finished, "mission finished")
    session.until(lambda: not session.state.is_armed, "landed at home")
    assert {current for current, _ in reports} == {0, 1, 2, 3, 4}
    assert {total for _, total in reports} == {4}
    assert degrees(session.flight.controller.gimbal.gimbal.aim.pitch) == pytest.approx(-30.0, abs=1.0)
    assert len(shots) >= 3  # two at their places, the others by distance


def test_transition_of_a_vehicle_that_has_no_wings_is_refused(session):
    items = [waypoint(10.0, 0.0), waypoint(30.0, 0.0, vehicle_action=Vehicle.TRANSITION_TO_FW)]
    with pytest.raises(MissionError) as refused:
        Mission(session.system).upload_mission(MissionPlan(items))
    assert refused.value.result == MissionResult.UNSUPPORTED


def test_raw_mission_is_flown_from_the_item_chosen(session):
    mission = MissionRaw(session.system)
    items = [
        raw(0, 22),
        raw(1, 16, 10.0, 0.0),
        raw(2, 82, 20.0, 10.0),
        raw(3, 18, 20.0, 25.0, params=(0.5, 0.0, 5.0, nan)),
        raw(4, 177, params=(5.0, 1.0, 0.0, 0.0), frame=2),
        raw(5, 115, params=(90.0, 0.0, 0.0, 0.0), frame=2),
        raw(6, 21, 10.0, 25.0, height=0.0),
    ]
    mission.upload_mission(items)
    assert [item.command for item in mission.download_mission()] == [item.command for item in items]
    mission.set_current_mission_item(2)
    Action(session.system).arm()
    mission.start_mission()
    session.until(lambda: session.state.mode is Mode.MISSION, "started")
    session.until(mission.is_mission_finished, "finished")
    session.until(lambda: not session.state.is_armed, "landed")
    mission.clear_mission()
    assert session.state.mission_count == 0


def test_raw_item_that_is_not_flown_is_refused_and_the_old_mission_stays(session):
    mission = MissionRaw(session.system)
    mission.upload_mission([raw(0, 16, 10.0, 0.0)])
    for bad in (
        raw(0, 84, 10.0, 0.0),
        raw(0, 208, params=(1.0, 0, 0, 0), frame=2),
        raw(0, 176, params=(1.0, 4.0, 3.0, 0.0), frame=2),
    ):
        with pytest.raises(MissionRawError) as refused:
            mission.upload_mission([bad])
        assert refused.value.result == MissionRawResult.UNSUPPORTED
    assert [item.command for item in mission.download_mission()] == [16]


def test_plan_of_qgroundcontrol_is_imported_and_taken(session):
    lat, lon = place(20.0, 0.0)
    simple = {"type": "SimpleItem", "autoContinue": True, "frame": 3}
    plan = {
        "fileType": "Plan",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": 15,
            "firmwareType": 12,
            "hoverSpeed": 5,
            "items": [
                {**simple, "command": 22, "doJumpId": 1, "params": [0, 0, 0, None, lat, lon, 10]},
                {**simple, "command": 195, "doJumpId": 2, "params": [0, 0, 0, 0, lat, lon, 0]},
                {**simple, "command": 31, "doJumpId": 3, "params": [1, 10, 0, 1, lat, lon, 15]},
                {**simple, "command": 20, "doJumpId": 4, "frame": 2, "params": [0, 0, 0, 0, 0, 0, 0]},
            ],
            "plannedHomePosition": [lat, lon, 488.0],
            "vehicleType": 2,
            "version": 2,
        },
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }
    mission = MissionRaw(session.system)
    mission.upload_mission(mission.import_qgroundcontrol_mission_from_string(json.dumps(plan)).mission_items)
    assert session.state.mission_count == 4
