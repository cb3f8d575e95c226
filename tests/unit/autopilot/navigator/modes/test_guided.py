from math import cos, nan, pi, radians, sin

import numpy as np
import pytest

from autopilot.interface.client_requests import ChangeMode, GoTo, OffboardSetpoint, TakeOff
from autopilot.interface.vehicle_state import LandedState, Mode, Verdict
from autopilot.ports import SETPOINT_ATTITUDE, SETPOINT_LEAN, SETPOINT_TRAJECTORY
from tests.unit.autopilot.kinematic import ORIGIN, Kinematic, geo, heading_error, position_setpoint


def guided(height_m: float = 10.0) -> Kinematic:
    """In the air in mode Guided, as scripts get there: mode, arm, take-off."""
    vehicle = Kinematic().ready()
    assert vehicle.fc.request(ChangeMode(Mode.GUIDED)).verdict == 0
    assert vehicle.fc.arm(force=False).verdict == 0
    assert vehicle.fc.request(TakeOff(ORIGIN.alt_m + height_m, nan)).verdict == 0
    vehicle.run_until(lambda: abs(vehicle.pos[2] + height_m) < 0.2)
    vehicle.run(3.0)
    return vehicle


def velocity_setpoint(north, east, down, **others):
    return OffboardSetpoint(0, int(SETPOINT_TRAJECTORY), vel_ned=(north, east, down), **others)


def attitude_setpoint(pitch_rad, yaw_rad, thrust):
    half_pitch, half_yaw = 0.5 * pitch_rad, 0.5 * yaw_rad
    q = (
        -sin(half_yaw) * sin(half_pitch),
        cos(half_yaw) * sin(half_pitch),
        sin(half_yaw) * cos(half_pitch),
        cos(half_yaw) * cos(half_pitch),
    )
    return OffboardSetpoint(0, int(SETPOINT_ATTITUDE), q_ned_from_frd=q, thrust=thrust)


def test_takeoff_stays_in_the_mode_and_holds():
    vehicle = guided(8.0)
    assert vehicle.state.mode is Mode.GUIDED
    assert vehicle.history == [LandedState.ON_GROUND, LandedState.TAKEOFF, LandedState.IN_AIR]
    vehicle.run(20.0)
    assert np.allclose(vehicle.pos, (0.0, 0.0, -8.0), atol=0.3)


def test_takeoff_needs_arming_and_a_height():
    vehicle = Kinematic().ready()
    vehicle.fc.request(ChangeMode(Mode.GUIDED))
    assert vehicle.fc.request(TakeOff(ORIGIN.alt_m + 10.0, nan)).reason == "not armed"
    vehicle.fc.arm(force=False)
    assert vehicle.fc.request(TakeOff(ORIGIN.alt_m, nan)).verdict is Verdict.DENIED
    assert vehicle.fc.request(TakeOff(ORIGIN.alt_m + 1.0, nan)).verdict == 0  # lower than MIS_TAKEOFF_ALT: it is meant
    vehicle.run(10.0)
    assert vehicle.pos[2] == pytest.approx(-1.0, abs=0.3)
    assert vehicle.fc.request(TakeOff(ORIGIN.alt_m + 10.0, nan)).reason == "in the air already"


def test_mode_needs_no_stream_but_a_position():
    vehicle = Kinematic()
    vehicle.flags = 0
    vehicle.run(2.0)
    assert vehicle.fc.request(ChangeMode(Mode.GUIDED)).reason == "no valid position"
    assert Kinematic().ready().fc.request(ChangeMode(Mode.GUIDED)).verdict == 0


def test_armed_without_a_takeoff_it_stays_on_the_ground_and_disarms():
    vehicle = Kinematic().ready()
    vehicle.fc.request(ChangeMode(Mode.GUIDED))
    vehicle.fc.arm(force=False)
    vehicle.fc.request(position_setpoint(10.0, 0.0, -10.0))
    vehicle.run(5.0)
    assert vehicle.state.landed_state is LandedState.ON_GROUND
    assert vehicle.recorder.has_text("a takeoff comes first")
    assert vehicle.disarmed() < 10.0
    assert vehicle.state.mode is Mode.GUIDED  # arming again in it is usual


def test_position_setpoint_stays_without_a_stream():
    vehicle = guided()
    vehicle.fc.request(position_setpoint(20.0, 5.0, -15.0))
    vehicle.run(30.0)
    assert np.allclose(vehicle.pos, (20.0, 5.0, -15.0), atol=0.3)
    assert vehicle.state.mode is Mode.GUIDED


def test_velocity_stops_after_the_timeout():
    vehicle = guided()
    vehicle.fc.request(velocity_setpoint(3.0, 0.0, 0.0))
    vehicle.run(2.5)
    assert vehicle.vel[0] == pytest.approx(3.0, abs=0.2)
    vehicle.run(4.0)
    assert abs(vehicle.vel[0]) < 0.1
    assert vehicle.state.mode is Mode.GUIDED
    assert 8.0 < vehicle.pos[0] < 13.0


def test_velocity_goes_on_while_it_is_renewed():
    vehicle = guided()
    for _ in range(10):
        vehicle.fc.request(velocity_setpoint(3.0, 0.0, 0.0))
        vehicle.run(1.0)
    assert vehicle.pos[0] > 25.0


def test_thrust_of_an_attitude_is_a_climb_rate():
    vehicle = guided()
    vehicle.fc.request(attitude_setpoint(radians(-20.0), 0.7, 0.75))
    vehicle.frame()
    assert vehicle.sp("kind") == SETPOINT_LEAN
    assert vehicle.sp("vel_ned")[2] == pytest.approx(-0.5 * vehicle.table["MPC_Z_V_AUTO_UP"])
    assert vehicle.sp("yaw") == pytest.approx(0.7)
    vehicle.run(3.2)
    assert vehicle.sp("kind") == SETPOINT_TRAJECTORY  # stopped


def test_thrust_of_an_attitude_is_a_thrust_if_the_options_say_so():
    vehicle = guided()
    vehicle.table.set("GUID_OPTIONS", 8)
    vehicle.fc.request(attitude_setpoint(0.0, 0.0, 0.6))
    vehicle.frame()
    assert vehicle.sp("kind") == SETPOINT_ATTITUDE
    assert vehicle.sp("thrust") == pytest.approx(0.6)


def test_goto_is_flown_and_changes_the_mode_first():
    vehicle = Kinematic().flying()
    lat, lon, alt = geo(30.0, 0.0, 12.0)
    assert vehicle.fc.request(GoTo(lat, lon, alt, nan, nan, mode=Mode.GUIDED)).verdict == 0
    assert vehicle.state.mode is Mode.GUIDED
    vehicle.run(30.0)
    assert np.allclose(vehicle.pos, (30.0, 0.0, -12.0), atol=0.3)
    assert vehicle.fc.request(GoTo(nan, nan, ORIGIN.alt_m + 20.0, nan, nan, mode=Mode.GUIDED)).verdict == 0
    vehicle.run(20.0)
    assert np.allclose(vehicle.pos, (30.0, 0.0, -20.0), atol=0.3)


def test_goto_that_was_refused_is_not_flown_later():
    vehicle = Kinematic(COM_FLT_TIME_MAX=30.0, COM_FLT_TIME_ACT=1).flying()  # over: holds
    vehicle.run(30.0)
    refused = vehicle.fc.request(GoTo(*geo(30.0, 0.0, 12.0), nan, nan, mode=Mode.GUIDED))
    assert refused.reason == "the flight time is over: only Return and Land"
    vehicle.table.set("COM_FLT_TIME_MAX", -1.0)
    vehicle.run(1.0)
    assert vehicle.fc.request(ChangeMode(Mode.GUIDED)).verdict == 0
    vehicle.run(10.0)
    assert abs(vehicle.pos[0]) < 1.0


def test_goto_on_the_ground_is_refused():
    vehicle = Kinematic().ready()
    vehicle.fc.request(ChangeMode(Mode.GUIDED))
    assert vehicle.fc.request(GoTo(*geo(30.0, 0.0, 12.0), nan, nan, mode=Mode.GUIDED)).reason == "not in the air"


def test_all_free_goto_is_a_pause():
    vehicle = guided()
    vehicle.fc.request(GoTo(*geo(100.0, 0.0, 10.0), nan, nan, mode=Mode.GUIDED))
    vehicle.run(6.0)
    north = vehicle.pos[0]
    assert vehicle.fc.request(GoTo(nan, nan, nan, nan, nan, mode=Mode.GUIDED)).verdict == 0
    vehicle.run(15.0)
    assert vehicle.pos[0] < north + 15.0
    assert abs(vehicle.vel[0]) < 0.05


@pytest.mark.parametrize(
    ("angle_deg", "direction", "is_relative", "heading_deg"),
    [(90.0, 0.0, False, 90.0), (90.0, -1.0, False, 90.0), (45.0, 1.0, True, 62.2), (45.0, -1.0, True, -27.8)],
)
def test_turn_goes_the_way_it_is_told(angle_deg, direction, is_relative, heading_deg):
    vehicle = guided()
    start = vehicle.yaw
    reply = vehicle.fc.guidance.turn(angle_deg, 30.0, direction, is_relative=is_relative)
    assert reply.verdict == 0
    vehicle.run(1.0)
    sign = -1.0 if direction < 0.0 else 1.0
    assert sin(sign * (vehicle.yaw - start)) > 0.2
    vehicle.run(15.0)
    assert heading_error(vehicle.yaw, radians(heading_deg)) < radians(1.0)


def test_heading_is_kept_by_setpoints_that_leave_it_free():
    vehicle = guided()
    vehicle.fc.guidance.turn(180.0, nan, 0.0, is_relative=False)
    vehicle.run(5.0)
    vehicle.fc.request(velocity_setpoint(2.0, 0.0, 0.0))
    vehicle.run(2.0)
    assert heading_error(vehicle.yaw, pi) < radians(1.0)
    assert vehicle.sp("yaw") == pytest.approx(-pi, abs=1e-3) or vehicle.sp("yaw") == pytest.approx(pi, abs=1e-3)


def test_setpoints_are_not_flown_in_other_modes():
    vehicle = Kinematic().flying()
    vehicle.fc.request(position_setpoint(20.0, 5.0, -15.0))
    vehicle.fc.request(ChangeMode(Mode.GUIDED))
    vehicle.run(10.0)
    assert np.allclose(vehicle.pos, (0.0, 0.0, -10.0), atol=0.3)


def test_landing_by_velocity_ends_on_the_ground_and_disarms():
    vehicle = guided(4.0)
    for _ in range(60):
        vehicle.fc.request(velocity_setpoint(0.0, 0.0, 0.7))
        vehicle.run(0.25)
    assert vehicle.state.landed_state is LandedState.ON_GROUND
    assert not vehicle.state.is_armed
