"""MAVSDK 4.1 with a vehicle in ArduPilot's dialect, in this process: what works with ArduPilot works with it."""

from math import nan

import pytest
from mavsdk.plugins.action import Action
from mavsdk.plugins.mission_raw import MissionItem as RawItem
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.offboard import Offboard, PositionNedYaw, VelocityNedYaw
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import FlightMode, LandedState, Telemetry

from autopilot.interface.vehicle_state import Mode
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.flight import FlightConfig
from sim.world.world import WorldConfig
from tests.system.mavsdk.raw_mavsdk import RawMavsdk
from tests.system.raw_vehicle import QuickFlight

CONFIG = FlightConfig(dialect="ardupilot", world=WorldConfig(trees_per_ha=0.0))


@pytest.fixture
def session():
    session = QuickFlight(CONFIG)
    with RawMavsdk(session.make_turn) as mavsdk:
        session.system = mavsdk.system
        yield session
    session.flight.close()


@pytest.mark.slow
def test_takeoff_goto_offboard_and_return(session):
    action, offboard, telemetry = (plugin(session.system) for plugin in (Action, Offboard, Telemetry))
    modes, landed = [], []
    telemetry.subscribe_flight_mode(lambda mode, _: modes.append(mode))
    telemetry.subscribe_landed_state(lambda state, _: landed.append(state))
    action.set_takeoff_altitude(8.0)
    action.arm()
    action.takeoff()
    session.until(lambda: session.place()[2] < -7.5, "takeoff")
    lat, lon, _ = geodetic_from_ned(15.0, 0.0, 0.0, DEFAULT_HOME)
    action.goto_location(lat, lon, session.state.home.alt_m + 10.0, nan)
    session.until(lambda: session.place()[0] > 14.3 and session.place()[2] < -9.3, "goto")
    assert session.state.mode is Mode.GUIDED

    offboard.set_position_ned(PositionNedYaw(5.0, 5.0, -8.0, 0.0))
    offboard.start()
    session.until(lambda: abs(session.place()[0] - 5.0) < 0.7 and abs(session.place()[1] - 5.0) < 0.7, "position")
    offboard.set_velocity_ned(VelocityNedYaw(0.0, 2.0, 0.0, 0.0))
    session.until(lambda: session.place()[1] > 12.0, "velocity")
    offboard.stop()
    session.until(lambda: session.state.mode is Mode.BRAKE, "stopped")  # MAVSDK's Hold for a copter of ArduPilot
    action.return_to_launch()
    session.until(lambda: not session.state.is_armed, "landed")
    assert {FlightMode.OFFBOARD, FlightMode.HOLD, FlightMode.RETURN_TO_LAUNCH} <= set(modes)
    assert {LandedState.ON_GROUND, LandedState.IN_AIR, LandedState.LANDING} <= set(landed)


def test_parameters_have_ardupilots_names_and_types(session):
    param = Param(session.system)
    assert param.get_param_int("FRAME_CLASS") == 1
    param.set_param_int("RTL_ALT", 2000)
    session.until(lambda: session.flight.params["RTL_RETURN_ALT"] == 20.0, "set")
    assert param.get_param_float("RTL_RETURN_ALT") == 20.0


def test_mission_goes_up_and_down_with_home_and_is_cleared(session):
    mission = MissionRaw(session.system)
    lat, lon, _ = geodetic_from_ned(20.0, 0.0, 0.0, DEFAULT_HOME)
    home = RawItem(0, 0, 16, 1, 1, 0.0, 0.0, 0.0, 0.0, round(lat * 1e7), round(lon * 1e7), 488.0, 0)
    takeoff = RawItem(1, 3, 22, 0, 1, 0.0, 0.0, 0.0, 0.0, 0, 0, 10.0, 0)
    waypoint = RawItem(2, 3, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, round(lat * 1e7), round(lon * 1e7), 10.0, 0)
    mission.upload_mission([home, takeoff, waypoint])
    assert session.state.mission_count == 2
    assert [item.command for item in mission.download_mission()] == [16, 22, 16]
    mission.clear_mission()
    session.until(lambda: session.state.mission_count == 0, "cleared")
