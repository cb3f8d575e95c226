"""Take-off, hold, goto, return, land and offboard, flown over the kinematic stand-in."""

from math import hypot, nan, pi, radians

import pytest

from autopilot.interface.client_requests import ChangeMode, ChangeSpeed, GoTo, LandAt, OffboardSetpoint, TakeOff
from autopilot.interface.vehicle_state import LandedState, Mode, Verdict
from autopilot.ports import (
    HEIGHT_VALID,
    POSITION_VALID,
    SETPOINT_ATTITUDE,
    SETPOINT_IDLE,
    SETPOINT_TRAJECTORY,
    VELOCITY_VALID,
)
from tests.unit.autopilot.kinematic import ORIGIN, Kinematic, geo, heading_error, position_setpoint


def test_whole_flight_goes_through_every_landed_state_in_order():
    rig = Kinematic().flying(12.0)
    assert rig.pos[2] == pytest.approx(-12.0, abs=0.3)
    lat, lon, _ = geo(40.0, 30.0)
    assert rig.fc.request(GoTo(lat, lon, ORIGIN.alt_m + 15.0, nan, nan)).verdict is Verdict.ACCEPTED
    rig.run(30.0)
    assert rig.pos == pytest.approx((40.0, 30.0, -15.0), abs=0.1)
    assert rig.fc.request(ChangeMode(Mode.RETURN)).verdict is Verdict.ACCEPTED
    rig.disarmed()
    assert hypot(rig.pos[0], rig.pos[1]) < 0.4
    assert rig.history == [
        LandedState.ON_GROUND,
        LandedState.TAKEOFF,
        LandedState.IN_AIR,
        LandedState.LANDING,
        LandedState.ON_GROUND,
    ]
    assert rig.state.mode is Mode.HOLD


def test_takeoff_climbs_vertically_at_the_takeoff_speed():
    rig = Kinematic(MPC_TKO_SPEED=1.5)
    rig.ready()
    rig.fc.request(TakeOff(ORIGIN.alt_m + 10.0, nan))
    rig.fc.arm(force=False)
    rig.run_until(lambda: rig.state.landed_state is LandedState.TAKEOFF)
    took_s = rig.run_until(lambda: rig.state.mode is Mode.HOLD)
    assert took_s > 10.0 / 1.5
    assert max(abs(p[0]) + abs(p[1]) for p in rig.track) < 0.01
    assert rig.pos[2] == pytest.approx(-10.0, abs=0.31)


def test_setpoint_says_landed_until_the_rotors_had_their_spool_up_time():
    rig = Kinematic(COM_SPOOLUP_TIME=2.0)
    rig.ready()
    rig.fc.request(TakeOff())
    rig.fc.arm(force=False)
    rig.run(1.9)
    assert rig.sp("is_armed") == 1
    assert rig.sp("is_landed") == 1
    assert rig.sp("kind") == SETPOINT_IDLE
    rig.run(0.2)
    assert rig.sp("is_landed") == 0


def test_takeoff_below_the_least_height_is_raised_and_told():
    rig = Kinematic(MIS_TAKEOFF_ALT=4.0).flying(height_m=-478.0)  # MAVProxy's "takeoff 10" above sea level
    rig.run(3.0)
    assert rig.pos[2] == pytest.approx(-4.0, abs=0.1)
    assert rig.recorder.has_text("Takeoff altitude raised to 4.0 m")


def test_takeoff_in_flight_never_descends():
    rig = Kinematic().flying(20.0)
    assert rig.fc.request(TakeOff(ORIGIN.alt_m + 5.0, nan)).verdict is Verdict.ACCEPTED
    rig.run(5.0)
    assert rig.pos[2] == pytest.approx(-20.0, abs=0.4)
    assert rig.state.mode is Mode.HOLD


def test_hold_brakes_ahead_and_stays():
    rig = Kinematic().flying()
    lat, lon, _ = geo(200.0, 0.0)
    rig.fc.request(GoTo(lat, lon, nan, nan, nan))
    rig.run(10.0)
    north = rig.pos[0]
    assert rig.vel[0] == pytest.approx(5.0, abs=0.1)
    rig.fc.request(GoTo())
    rig.frame()
    target = rig.sp("pos_ned")
    assert 2.0 < target[0] - north < 6.0
    rig.run(10.0)
    assert rig.pos[0] == pytest.approx(target[0], abs=0.05)


def test_goto_turns_to_its_target_and_keeps_what_is_nan():
    rig = Kinematic().flying(10.0)
    lat, lon, _ = geo(0.0, -50.0)
    rig.fc.request(GoTo(lat, lon, nan, nan, 3.0))
    rig.run(5.0)
    assert heading_error(rig.yaw, -pi / 2) < 0.05
    assert abs(rig.vel[1]) == pytest.approx(3.0, abs=0.1)
    rig.run(20.0)
    rig.fc.request(GoTo(nan, nan, ORIGIN.alt_m + 18.0, nan, nan))
    rig.run(10.0)
    assert rig.pos == pytest.approx((0.0, -50.0, -18.0), abs=0.1)
    rig.fc.request(GoTo(nan, nan, nan, radians(100.0), nan))
    rig.run(5.0)
    assert heading_error(rig.yaw, radians(100.0)) < 0.05


@pytest.mark.parametrize(
    ("position", "reason"),
    [
        ((47.0, nan, 500.0), "both latitude and longitude"),
        ((95.0, 8.0, 500.0), "no such latitude"),
        ((48.4, 8.5, 500.0), "km away"),
        ((nan, nan, 90_000.0), "altitude"),
        ((nan, nan, ORIGIN.alt_m - 5.0), "below the ground"),
    ],
)
def test_goto_refuses_what_it_cannot_reach(position, reason):
    rig = Kinematic().flying()
    reply = rig.fc.request(GoTo(*position, nan, nan))
    assert reply.verdict is Verdict.DENIED
    assert reason in reply.reason


def test_goto_on_the_ground_is_refused():
    rig = Kinematic().ready()
    reply = rig.fc.request(GoTo(*geo(5.0, 5.0, 5.0), nan, nan))
    assert (reply.verdict, reply.reason) == (Verdict.TEMPORARILY_REJECTED, "not in the air")


def test_return_climbs_first_flies_home_and_lands():
    rig = Kinematic(RTL_RETURN_ALT=25.0).flying(10.0)
    rig.fc.request(GoTo(*geo(60.0, 0.0, 10.0), nan, nan))
    rig.run(25.0)
    start = len(rig.track)
    rig.fc.request(ChangeMode(Mode.RETURN))
    rig.disarmed()
    back = rig.track[start:]
    assert min(p[2] for p in back) == pytest.approx(-25.0, abs=0.6)
    assert all(p[2] < -24.0 for p in back if 3.0 < p[0] < 55.0)
    assert all(p[0] > 58.0 for p in back[:100] if p[2] > -20.0)


def test_return_near_home_does_not_climb():
    rig = Kinematic().flying(6.0)
    start = len(rig.track)
    rig.fc.request(ChangeMode(Mode.RETURN))
    rig.disarmed()
    assert min(p[2] for p in rig.track[start:]) > -6.5


def test_return_waits_before_landing_if_told_to():
    rig = Kinematic(RTL_LAND_DELAY=-1.0, RTL_DESCEND_ALT=8.0).flying(20.0)
    rig.fc.request(ChangeMode(Mode.RETURN))
    rig.run(60.0)
    assert rig.pos[2] == pytest.approx(-8.0, abs=0.5)
    assert rig.state.is_armed


def test_landing_slows_down_near_the_ground():
    rig = Kinematic().flying(20.0)
    rig.fc.request(LandAt())
    rig.run(2.0)
    assert rig.sp("vel_ned")[2] == pytest.approx(1.5)
    rig.run_until(lambda: rig.pos[2] > -4.5)
    assert rig.sp("vel_ned")[2] == pytest.approx(0.7)
    rig.run_until(lambda: rig.pos[2] > -0.9)
    assert rig.sp("vel_ned")[2] == pytest.approx(0.3)
    rig.disarmed()


def test_vehicle_that_touches_the_ground_settles_level_under_little_thrust():
    rig = Kinematic().flying(5.0)
    rig.fc.request(ChangeMode(Mode.LAND))
    rig.run_until(lambda: rig.state.has_ground_contact)
    rig.frame()
    assert rig.sp("kind") == SETPOINT_ATTITUDE
    assert rig.sp("q_ned_from_frd")[:2] == [0.0, 0.0]
    assert rig.sp("thrust") < 0.1
    rig.disarmed()


def test_land_command_with_a_place_goes_there_first():
    rig = Kinematic().flying(10.0)
    lat, lon, _ = geo(30.0, -20.0)
    assert rig.fc.request(LandAt(lat, lon, nan)).verdict is Verdict.ACCEPTED
    rig.disarmed()
    assert rig.pos[:2] == pytest.approx((30.0, -20.0), abs=0.4)


def test_landing_without_position_brakes_while_the_velocity_is_good():
    rig = Kinematic().flying(10.0)
    rig.flags &= ~POSITION_VALID
    rig.run(1.0)
    assert rig.state.mode is Mode.LAND
    assert [0.0 < abs(vel) < 0.05 for vel in rig.sp("vel_ned")[:2]] == [True, True]  # 0 would hold a place
    assert rig.sp("vel_ned")[2] > 0.6
    rig.run_until(lambda: rig.pos[2] > -0.9)
    rig.frame()
    assert rig.sp("vel_ned")[2] == pytest.approx(0.3)
    rig.disarmed()


def test_blind_landing_is_level_and_ends_on_the_ground():
    rig = Kinematic().flying(10.0)
    rig.flags &= ~(POSITION_VALID | VELOCITY_VALID)
    rig.vel_std = 3.0
    rig.run_until(lambda: rig.state.mode is Mode.LAND, 1.0)
    rig.run(0.1)
    assert rig.state.is_failsafe
    assert rig.sp("accel_ned")[:2] == [0.0, 0.0]
    assert rig.sp("vel_ned")[2] > 0.6
    assert rig.recorder.has_text("Position lost: land")
    rig.disarmed()
    assert rig.pos[2] == 0.0


def test_blind_landing_without_height_hangs_level_below_hover_thrust():
    rig = Kinematic().flying(10.0)
    rig.flags &= ~(POSITION_VALID | VELOCITY_VALID | HEIGHT_VALID)
    rig.run(1.0)
    assert rig.sp("kind") == SETPOINT_ATTITUDE
    assert 0.8 * rig.hover < rig.sp("thrust") < rig.hover
    assert rig.sp("q_ned_from_frd")[:2] == [0.0, 0.0]
    rig.disarmed(120.0)
    assert rig.pos[2] == 0.0


def test_landing_asked_for_before_the_vehicle_has_lifted_ends_at_once():
    rig = Kinematic().ready()
    rig.fc.request(TakeOff())
    rig.fc.arm(force=False)
    rig.run_until(lambda: rig.state.landed_state is LandedState.TAKEOFF)
    rig.frame()
    assert rig.fc.request(ChangeMode(Mode.LAND)).verdict is Verdict.ACCEPTED
    assert rig.disarmed() < 5.0
    assert not rig.recorder.has_text("failed")


def test_takeoff_that_does_not_leave_the_ground_is_given_up():
    rig = Kinematic(MPC_TKO_SPEED=0.5, MPC_Z_V_AUTO_UP=0.5)
    rig.ready()
    rig.gust_ned[2] = 5.0
    rig.fc.request(TakeOff())
    rig.fc.arm(force=False)
    assert rig.disarmed() == pytest.approx(11.0, abs=0.2)
    assert rig.recorder.has_text("Takeoff failed")


def test_position_found_again_during_a_blind_landing_is_held():
    rig = Kinematic().flying(15.0)
    flags = rig.flags
    rig.flags &= ~POSITION_VALID
    rig.run(3.0)
    rig.flags = flags
    rig.run(0.1)
    assert rig.sp("pos_ned")[:2] == pytest.approx([0.0, 0.0], abs=0.1)


# ---- offboard ----


def stream(rig, setpoint, seconds):
    for _ in range(round(seconds / 0.1)):
        rig.fc.request(setpoint)
        rig.run(0.1)


def test_offboard_needs_a_stream_before_entry():
    rig = Kinematic().flying()
    reply = rig.fc.request(ChangeMode(Mode.OFFBOARD))
    assert reply.verdict is Verdict.TEMPORARILY_REJECTED
    assert "2 Hz" in reply.reason
    rig.fc.request(position_setpoint(0.0, 0.0, -10.0))
    rig.run(0.8)
    assert rig.fc.request(ChangeMode(Mode.OFFBOARD)).verdict is Verdict.TEMPORARILY_REJECTED
    rig.fc.request(position_setpoint(0.0, 0.0, -10.0))
    assert rig.fc.request(ChangeMode(Mode.OFFBOARD)).verdict is Verdict.ACCEPTED


def test_offboard_takes_off_flies_and_lands_by_velocity():
    rig = Kinematic().ready()
    stream(rig, position_setpoint(0.0, 0.0, -2.0), 0.3)
    assert rig.fc.request(ChangeMode(Mode.OFFBOARD)).verdict is Verdict.ACCEPTED
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    stream(rig, position_setpoint(5.0, 0.0, -2.0, yaw=1.0), 8.0)
    assert rig.pos == pytest.approx((5.0, 0.0, -2.0), abs=0.1)
    assert heading_error(rig.yaw, 1.0) < 0.05
    down = OffboardSetpoint(0, 1, vel_ned=(0.0, 0.0, 1.0), yaw=1.0)
    stream(rig, down, 8.0)
    assert not rig.state.is_armed


def test_offboard_attitude_needs_no_position():
    rig = Kinematic()
    rig.flags &= ~(POSITION_VALID | VELOCITY_VALID)
    rig.run(1.0)
    up = OffboardSetpoint(0, int(SETPOINT_ATTITUDE), thrust=0.6)
    stream(rig, up, 0.3)
    assert rig.fc.request(ChangeMode(Mode.OFFBOARD)).verdict is Verdict.ACCEPTED
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    stream(rig, up, 4.0)
    assert rig.state.landed_state is LandedState.IN_AIR
    assert rig.sp("thrust") == pytest.approx(0.6)


@pytest.mark.parametrize(("action", "mode"), [(3, Mode.RETURN), (4, Mode.LAND), (5, Mode.HOLD)])
def test_offboard_loss_takes_the_chosen_action(action, mode):
    rig = Kinematic(COM_OBL_RC_ACT=action).flying()
    stream(rig, position_setpoint(10.0, 0.0, -10.0), 0.5)
    rig.fc.request(ChangeMode(Mode.OFFBOARD))
    stream(rig, position_setpoint(10.0, 0.0, -10.0), 3.0)
    rig.run(0.85)
    assert rig.state.mode is Mode.OFFBOARD
    rig.run(0.3)
    assert rig.state.mode is mode
    assert rig.state.is_failsafe
    assert rig.recorder.has_text("Offboard setpoints lost")


def test_stopping_offboard_goes_to_hold():
    rig = Kinematic().flying()
    stream(rig, position_setpoint(10.0, 0.0, -10.0), 0.5)
    rig.fc.request(ChangeMode(Mode.OFFBOARD))
    assert rig.fc.request(ChangeMode(Mode.HOLD)).verdict is Verdict.ACCEPTED
    rig.run(3.0)
    assert not rig.state.is_failsafe
    assert rig.state.mode is Mode.HOLD


def test_change_of_speed_applies_at_once_and_is_forgotten_by_default():
    rig = Kinematic().flying()
    rig.fc.request(GoTo(*geo(300.0, 0.0, 10.0), nan, nan))
    rig.run(5.0)
    assert rig.fc.request(ChangeSpeed(2.0)).verdict is Verdict.ACCEPTED
    rig.run(3.0)
    assert rig.vel[0] == pytest.approx(2.0, abs=0.1)
    assert rig.fc.request(ChangeSpeed(nan)).verdict is Verdict.ACCEPTED
    rig.run(3.0)
    assert rig.vel[0] == pytest.approx(5.0, abs=0.1)
    assert rig.fc.request(ChangeSpeed(-3.0)).verdict is Verdict.DENIED


@pytest.mark.parametrize("down", [0.0, 0.8])
def test_offboard_position_on_the_ground_is_a_landing(down):
    rig = Kinematic().flying(3.0)
    stream(rig, position_setpoint(0.0, 0.0, -3.0), 0.5)
    rig.fc.request(ChangeMode(Mode.OFFBOARD))
    stream(rig, position_setpoint(0.0, 0.0, down), 10.0)
    assert not rig.state.is_armed
    assert rig.recorder.has_text("Landed")


def test_contact_gives_way_to_a_climb_at_once():
    rig = Kinematic().flying(3.0)
    stream(rig, position_setpoint(0.0, 0.0, -3.0), 0.5)
    rig.fc.request(ChangeMode(Mode.OFFBOARD))
    down = OffboardSetpoint(0, int(SETPOINT_TRAJECTORY), vel_ned=(0.0, 0.0, 1.0))
    while not rig.state.has_ground_contact:
        stream(rig, down, 0.1)
    assert rig.sp("kind") == SETPOINT_ATTITUDE
    stream(rig, position_setpoint(0.0, 0.0, -2.0), 0.1)
    assert rig.sp("kind") == SETPOINT_TRAJECTORY
    assert rig.sp("pos_ned") == pytest.approx([0.0, 0.0, -2.0])
    stream(rig, position_setpoint(0.0, 0.0, -2.0), 5.0)
    assert rig.pos[2] == pytest.approx(-2.0, abs=0.1)
    assert not rig.state.has_ground_contact
