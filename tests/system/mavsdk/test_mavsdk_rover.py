"""MAVSDK's plugins against a rover, in this process: what they send is driven, or refused."""

import pytest
from mavsdk.plugins.action import Action, ActionError, ActionResult
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan
from mavsdk.plugins.offboard import Offboard, PositionNedYaw, VelocityBodyYawspeed, VelocityNedYaw
from mavsdk.plugins.telemetry import Telemetry

from autopilot.interface.vehicle_state import Mode
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.drive_benchmarks import OPEN_HILLS
from mission.flight import FlightConfig
from tests.system.mavsdk.raw_mavsdk import RawMavsdk
from tests.system.raw_vehicle import QuickFlight


@pytest.fixture
def session(tmp_path):
    parameters = {"COM_OF_LOSS_T": 30.0}  # MAVSDK's setpoints come by the wall clock
    config = FlightConfig(airframe="rover", world=OPEN_HILLS, parameters=parameters)
    session = QuickFlight(config, folder=tmp_path)
    with RawMavsdk(session.make_turn) as mavsdk:
        session.system = mavsdk.system
        yield session
    session.flight.close()


def place(north, east):
    return geodetic_from_ned(north, east, 0.0, DEFAULT_HOME)[:2]


def is_near(session, north, east, within_m=0.6):
    here = session.state.estimate.pos_ned
    return ((here[0] - north) ** 2 + (here[1] - east) ** 2) ** 0.5 < within_m


def test_it_arms_goes_to_a_location_and_returns(session):
    action = Action(session.system)
    action.arm()
    action.goto_location(*place(15.0, 8.0), DEFAULT_HOME.alt_m, 0.0)
    session.until(lambda: is_near(session, 15.0, 8.0), "at the location")
    action.return_to_launch()
    session.until(lambda: not session.state.is_armed, "parked at home")
    assert is_near(session, 0.0, 0.0, 1.0)


def test_taking_off_and_landing_are_refused(session):
    action = Action(session.system)
    action.arm()
    for ask in (action.takeoff, action.land):
        with pytest.raises(ActionError) as refused:
            ask()
        assert refused.value.result in (ActionResult.UNSUPPORTED, ActionResult.COMMAND_DENIED)
    assert session.state.is_armed
    assert session.state.mode is Mode.HOLD


def test_a_mission_is_driven(session):
    mission = Mission(session.system)
    items = [
        MissionItem(*place(north, east), 0.0, is_fly_through=True, speed_m_s=3.0)
        for north, east in ((20.0, 0.0), (20.0, 15.0), (0.0, 15.0))
    ]
    mission.upload_mission(MissionPlan(items))
    Action(session.system).arm()
    mission.start_mission()
    session.until(mission.is_mission_finished, "mission finished")
    session.until(lambda: is_near(session, 0.0, 15.0), "at its end")


def test_offboard_positions_and_velocities_are_driven(session):
    offboard, action = Offboard(session.system), Action(session.system)
    action.arm()
    offboard.set_position_ned(PositionNedYaw(10.0, 0.0, 0.0, 0.0))
    offboard.start()
    session.until(lambda: is_near(session, 10.0, 0.0), "at the position")
    offboard.set_velocity_ned(VelocityNedYaw(0.0, 2.0, 0.0, 0.0))
    session.until(lambda: session.state.estimate.vel_ned[1] > 1.9, "eastwards")
    offboard.set_velocity_body(VelocityBodyYawspeed(1.0, 0.0, 0.0, 0.0))
    session.until(lambda: session.state.estimate.vel_ned[1] < 1.1, "slower, where it points")
    offboard.stop()
    session.until(lambda: session.state.mode is Mode.HOLD, "hold")


def test_telemetry_says_that_it_is_a_rover_that_is_under_way(session):
    telemetry = Telemetry(session.system)
    Action(session.system).arm()
    session.until(telemetry.in_air, "under way")
    assert session.state.mav_type == 10
