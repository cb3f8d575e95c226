"""The modes flown by sticks, over the kinematic stand-in."""

from math import asin, cos, degrees, hypot, pi, radians, sin

import pytest

from autopilot.interface.client_requests import ChangeMode
from autopilot.interface.vehicle_state import LandedState, Mode, Verdict
from autopilot.ports import (
    HEIGHT_VALID,
    POSITION_VALID,
    SETPOINT_ATTITUDE,
    SETPOINT_IDLE,
    SETPOINT_LEAN,
    SETPOINT_RATE,
    SETPOINT_TRAJECTORY,
    VELOCITY_VALID,
)
from tests.unit.autopilot.kinematic import Kinematic

STICK_MODES = [Mode.MANUAL, Mode.STABILIZED, Mode.ACRO, Mode.ALTITUDE, Mode.POSITION]
THRUST_MODES = STICK_MODES[:3]


def flown(mode, height_m=20.0, **params):
    """In the air, in a mode flown by sticks."""
    rig = Kinematic(**params)
    rig.battery_v = 16.8
    rig.flying(height_m)
    rig.piloted(0.1)
    assert rig.fc.request(ChangeMode(mode)).verdict is Verdict.ACCEPTED
    rig.piloted(1.0)
    return rig


@pytest.mark.parametrize("mode", STICK_MODES)
def test_without_sticks_it_is_refused(mode):
    rig = Kinematic().flying()
    reply = rig.fc.request(ChangeMode(mode))
    assert reply.verdict is Verdict.TEMPORARILY_REJECTED
    assert reply.reason == "needs a pilot's sticks"


@pytest.mark.parametrize("mode", STICK_MODES)
def test_throttle_takes_off_and_lands(mode):
    rig = Kinematic(MPC_THR_HOVER=0.4).ready()
    low = -1.0 if mode in THRUST_MODES else 0.0
    rig.piloted(0.1, throttle=low)
    assert rig.fc.request(ChangeMode(mode)).verdict is Verdict.ACCEPTED
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    rig.piloted(2.0, throttle=low)
    assert rig.state.landed_state is LandedState.ON_GROUND
    assert rig.sp("kind") == SETPOINT_IDLE
    rig.piloted(3.0, throttle=0.6)
    assert rig.state.landed_state is LandedState.IN_AIR
    assert rig.pos[2] < -1.0
    for _ in range(2000):
        rig.piloted(0.02, throttle=-0.3 if mode in THRUST_MODES and rig.pos[2] < 0.0 else -1.0)
    assert rig.state.landed_state is LandedState.ON_GROUND
    assert not rig.state.is_armed
    assert rig.state.mode is mode


@pytest.mark.parametrize("mode", THRUST_MODES)
def test_arming_needs_a_low_throttle_where_the_throttle_is_thrust(mode):
    rig = Kinematic().ready()
    rig.piloted(0.1)
    rig.fc.request(ChangeMode(mode))
    assert rig.fc.arm(force=False).reason == "throttle is not low"
    rig.piloted(0.1, throttle=-1.0)
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED


@pytest.mark.parametrize("mode", [Mode.ALTITUDE, Mode.POSITION])
def test_arming_needs_a_throttle_below_the_middle_where_it_is_climb_rate(mode):
    rig = Kinematic().ready()
    rig.piloted(0.1, throttle=0.5)
    rig.fc.request(ChangeMode(mode))
    assert rig.fc.arm(force=False).reason == "throttle above the middle"


def test_a_pilot_who_leaves_a_vehicle_on_the_ground_leaves_it_in_hold():
    rig = Kinematic().ready()
    rig.piloted(0.1)
    rig.fc.request(ChangeMode(Mode.POSITION))
    rig.run(1.0)
    assert rig.state.mode is Mode.HOLD


def test_stabilized_asks_for_lean_yaw_rate_and_thrust():
    rig = flown(Mode.STABILIZED, MPC_THR_HOVER=0.4, MPC_THR_MAX=1.0, MPC_MANTHR_MIN=0.1)
    rig.piloted(0.1, roll=1.0, yaw=1.0, throttle=0.5)
    assert rig.sp("kind") == SETPOINT_ATTITUDE
    x, y, z, _ = rig.sp("q_ned_from_frd")
    assert degrees(2.0 * asin(x)) == pytest.approx(35.0, abs=0.01)
    assert (y, z) == (0.0, 0.0)
    assert degrees(rig.sp("yaw_rate")) == pytest.approx(150.0)
    assert rig.sp("thrust") == pytest.approx(0.7)
    rig.piloted(0.1, throttle=-1.0)
    assert rig.sp("thrust") == pytest.approx(0.1)
    rig.piloted(0.1)
    assert rig.sp("thrust") == pytest.approx(0.4)


def test_throttle_in_the_middle_carries_the_vehicle_on_a_battery_that_is_not_full():
    rig = flown(Mode.STABILIZED, MPC_THR_HOVER=0.4)
    rig.battery_v = 0.9 * 16.8
    rig.piloted(8.0)
    assert rig.sp("thrust") == pytest.approx(0.4 / 0.81, rel=1e-3)


def test_straight_throttle_curve():
    rig = flown(Mode.STABILIZED, MPC_THR_CURVE=1, MPC_MANTHR_MIN=0.1)
    rig.piloted(0.1)
    assert rig.sp("thrust") == pytest.approx(0.55)


def test_lean_in_a_corner_is_no_more_than_along_an_axis():
    rig = flown(Mode.STABILIZED)
    rig.piloted(0.1, roll=-1.0, pitch=1.0)
    x, y, _, _ = rig.sp("q_ned_from_frd")
    assert degrees(2.0 * asin(hypot(x, y))) == pytest.approx(35.0, abs=0.01)
    assert x < 0.0  # left
    assert y < 0.0  # nose down


def test_acro_asks_for_body_rates():
    rig = flown(Mode.ACRO, MC_ACRO_R_MAX=200.0, MC_ACRO_P_MAX=100.0, MC_ACRO_Y_MAX=50.0)
    rig.piloted(0.1, roll=0.5, pitch=1.0, yaw=-1.0)
    assert rig.sp("kind") == SETPOINT_RATE
    assert [degrees(rate) for rate in rig.sp("omega_frd")] == pytest.approx([100.0, -100.0, -50.0])


def test_altitude_asks_for_lean_and_climb_rate():
    rig = flown(Mode.ALTITUDE, MPC_Z_VEL_MAX_UP=3.0)
    rig.piloted(0.1, pitch=1.0, throttle=1.0)
    assert rig.sp("kind") == SETPOINT_LEAN
    assert rig.sp("vel_ned")[2] == pytest.approx(-3.0)
    assert degrees(2.0 * asin(rig.sp("q_ned_from_frd")[1])) == pytest.approx(-35.0, abs=0.01)


@pytest.mark.parametrize("mode", [Mode.ALTITUDE, Mode.POSITION])
def test_dead_zone_of_the_throttle_holds_the_height(mode):
    rig = flown(mode)
    rig.piloted(1.0, throttle=0.09)
    assert rig.sp("vel_ned")[2] == 0.0


def test_descent_is_slower_near_the_ground():
    rig = flown(Mode.ALTITUDE, MPC_Z_VEL_MAX_DN=1.5, MPC_LAND_SPEED=0.7)
    rig.piloted(1.0, throttle=-1.0)
    assert rig.sp("vel_ned")[2] == pytest.approx(1.5)
    while rig.pos[2] < -4.0:
        rig.piloted(0.1, throttle=-1.0)
    assert rig.sp("vel_ned")[2] == pytest.approx(0.7)


def test_altitude_needs_a_height_but_no_position():
    rig = Kinematic().flying()
    rig.pilot()
    rig.flags &= ~(POSITION_VALID | VELOCITY_VALID)
    rig.piloted(0.2)
    assert rig.fc.request(ChangeMode(Mode.ALTITUDE)).verdict is Verdict.ACCEPTED
    rig.flags &= ~HEIGHT_VALID
    rig.piloted(0.1)
    assert rig.fc.request(ChangeMode(Mode.STABILIZED)).verdict is Verdict.ACCEPTED
    assert rig.fc.request(ChangeMode(Mode.ALTITUDE)).reason == "no valid height"


def test_position_flies_where_the_nose_points():
    rig = flown(Mode.POSITION, MPC_VEL_MANUAL=8.0)
    rig.piloted(0.1, pitch=1.0)
    north, east, down = rig.sp("vel_ned")
    assert rig.sp("kind") == SETPOINT_TRAJECTORY
    assert (north, east, down) == pytest.approx((8.0 * cos(rig.yaw), 8.0 * sin(rig.yaw), 0.0), abs=1e-5)
    rig.piloted(0.1, roll=-1.0)
    north, east, _ = rig.sp("vel_ned")
    assert (north, east) == pytest.approx((8.0 * cos(rig.yaw - pi / 2), 8.0 * sin(rig.yaw - pi / 2)), abs=1e-5)


def test_position_has_speeds_of_its_own_backwards_and_aside():
    rig = flown(Mode.POSITION, MPC_VEL_MANUAL=8.0, MPC_VEL_MAN_BACK=2.0, MPC_VEL_MAN_SIDE=4.0)
    rig.piloted(0.1, pitch=-1.0)
    assert hypot(*rig.sp("vel_ned")[:2]) == pytest.approx(2.0)
    rig.piloted(0.1, roll=1.0)
    assert hypot(*rig.sp("vel_ned")[:2]) == pytest.approx(4.0)


def test_position_in_a_corner_is_no_faster_than_along_an_axis():
    rig = flown(Mode.POSITION, MPC_VEL_MANUAL=8.0)
    rig.piloted(0.1, pitch=1.0, roll=1.0)
    assert hypot(*rig.sp("vel_ned")[:2]) == pytest.approx(8.0)


def test_position_with_the_sticks_let_go_asks_to_stand_still():
    rig = flown(Mode.POSITION)
    rig.piloted(1.0, pitch=0.5, yaw=0.5)
    rig.piloted(0.1, pitch=0.05, yaw=-0.05)
    assert rig.sp("vel_ned") == [0.0, 0.0, 0.0]
    assert rig.sp("yaw_rate") == 0.0


def test_brake_ignores_the_sticks():
    rig = flown(Mode.POSITION)
    rig.piloted(3.0, pitch=1.0)
    assert rig.fc.request(ChangeMode(Mode.BRAKE)).verdict is Verdict.ACCEPTED
    rig.piloted(3.0, pitch=1.0, yaw=1.0)
    assert rig.sp("vel_ned") == [0.0, 0.0, 0.0]
    assert rig.state.mode is Mode.BRAKE
    assert radians(1.0) > abs(rig.sp("yaw_rate"))


def test_hold_is_steered_by_sticks_in_ardupilot_and_stops_without_them():
    rig = Kinematic(NAV_RCL_ACT=0)
    rig.fc.follow_ardupilot()
    rig.flying(20.0)
    rig.run(2.0)
    rig.piloted(3.0, pitch=1.0)
    assert rig.state.mode is Mode.HOLD
    assert hypot(*rig.vel[:2]) > 5.0
    rig.run(8.0)
    stopped_at = rig.pos.copy()
    assert hypot(*rig.vel[:2]) < 0.1
    rig.run(5.0)
    assert rig.pos == pytest.approx(stopped_at, abs=0.1)


def test_hold_takes_off_and_lands_by_throttle_in_ardupilot():
    rig = Kinematic().ready()
    rig.fc.follow_ardupilot()
    rig.piloted(0.2, throttle=1.0)
    assert rig.fc.arm(force=False).reason == "throttle above the middle"
    rig.piloted(0.2, throttle=-1.0)
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    rig.piloted(4.0, throttle=1.0)
    assert rig.state.landed_state is LandedState.IN_AIR
    rig.piloted(60.0, throttle=-1.0)
    assert not rig.state.is_armed


def test_hold_ignores_sticks_in_px4_where_they_may_not_take_over():
    rig = Kinematic(COM_RC_OVERRIDE=0).flying(20.0)
    position = rig.pos.copy()
    rig.piloted(5.0, pitch=1.0, throttle=-1.0)
    assert rig.pos == pytest.approx(position, abs=0.5)
