from math import isnan, nan, pi

import numpy as np
import pytest

from autopilot.interface.client_requests import OffboardSetpoint
from autopilot.ports import SETPOINT_ATTITUDE, SETPOINT_RATE, SETPOINT_TRAJECTORY
from common.geodesy import geodetic_from_ned
from tests.unit.autopilot.mavlink.rig import HOME, Rig, texts

POS, VEL, ACCEL, FORCE, YAW, YAW_RATE = 7, 7 << 3, 7 << 6, 512, 1024, 2048
ONLY_POS = VEL | ACCEL | YAW_RATE
ONLY_VEL = POS | ACCEL | YAW_RATE


def local(rig: Rig, mask: int, frame: int = 1, **fields: float) -> OffboardSetpoint | str:
    """The setpoint taken, or the text of the refusal."""
    values = {"x": 1.0, "y": 2.0, "z": -3.0, "vx": 4.0, "vy": 5.0, "vz": 6.0, "afx": 7.0, "afy": 8.0, "afz": 9.0}
    values |= {"yaw": 0.5, "yaw_rate": 0.25} | fields
    rig.client.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=frame, type_mask=mask, **values)
    return outcome(rig)


def outcome(rig: Rig) -> OffboardSetpoint | str:
    count = len(rig.vehicle.setpoints)
    reported = texts(rig.frame())
    return rig.vehicle.setpoints[-1] if len(rig.vehicle.setpoints) > count else reported[0]


def position(rig: Rig, frame: int, mask: int = ONLY_POS, **fields: float) -> OffboardSetpoint | str:
    values = {"lat_int": 473977420, "lon_int": 85455940, "alt": 500.0} | fields
    rig.client.send("SET_POSITION_TARGET_GLOBAL_INT", coordinate_frame=frame, type_mask=mask, **values)
    return outcome(rig)


def attitude(rig: Rig, mask: int, **fields: object) -> OffboardSetpoint | str:
    values = {"q": (1.0, 0.0, 0.0, 0.0), "body_roll_rate": 0.1, "body_pitch_rate": 0.2, "body_yaw_rate": 0.3}
    values |= {"thrust": 0.5} | fields
    rig.client.send("SET_ATTITUDE_TARGET", target_component=1, type_mask=mask, **values)
    return outcome(rig)


def expected_of(mask: int) -> list[float] | str:
    """The eleven elements of the setpoint, or the text of the refusal."""
    elements = (1.0, 2.0, -3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)
    expected = [nan if mask & 1 << i else element for i, element in enumerate(elements)]
    if mask & FORCE and mask & ACCEL != ACCEL:
        return "Offboard: forces are not supported"
    if all(isnan(element) for element in expected):
        return "Offboard: position, velocity and acceleration are all ignored"
    return [*expected, nan if mask & YAW else 0.5, nan if mask & YAW_RATE else 0.25]


def test_every_mask_is_taken_element_by_element_or_refused():
    rig = Rig()
    for mask in range(4096):
        rig.time_us += 10_000_000  # the same refusal is told again after 10 s
        answer = local(rig, mask)
        if isinstance(answer, OffboardSetpoint):
            assert answer.kind == SETPOINT_TRAJECTORY
            flat = [*answer.pos_ned, *answer.vel_ned, *answer.accel_ned, answer.yaw, answer.yaw_rate]
            np.testing.assert_array_equal(flat, expected_of(mask))
        else:
            assert answer == expected_of(mask)


def test_setpoint_carries_simulated_time():
    rig = Rig()
    assert local(rig, ONLY_POS).time_us == rig.time_us


def test_offset_counts_from_the_vehicle():
    setpoint = local(Rig(), ONLY_POS, frame=7)
    assert setpoint.pos_ned == pytest.approx((11.0, 22.0, -33.0))


@pytest.mark.parametrize("frame", [8, 9, 12])
def test_body_frames_turn_with_the_heading(frame):
    rig = Rig()
    rig.update(yaw_rad=pi / 2)
    velocity = local(rig, ONLY_VEL, frame=frame)
    assert velocity.vel_ned == pytest.approx((-5.0, 4.0, 6.0))
    assert all(isnan(element) for element in velocity.pos_ned)
    offset = local(rig, ONLY_POS, frame=frame)
    assert offset.pos_ned == pytest.approx((10.0 - 2.0, 20.0 + 1.0, -33.0))


def test_body_frame_needs_both_horizontal_elements():
    assert "together" in local(Rig(), ONLY_VEL | 8, frame=8)
    climb = local(Rig(), ONLY_VEL | 8 | 16, frame=8)
    assert climb.vel_ned[2] == 6.0


def test_body_frame_needs_a_heading():
    rig = Rig()
    rig.update(estimate=rig.vehicle.state.estimate._replace(flags=0))
    assert "heading" in local(rig, ONLY_VEL, frame=8)
    assert "position" in local(rig, ONLY_POS, frame=7)
    assert local(rig, ONLY_VEL, frame=7).vel_ned == (4.0, 5.0, 6.0)


@pytest.mark.parametrize("frame", [0, 2, 3, 4, 13, 20, 21, 255])
def test_other_frames_are_refused(frame):
    assert f"frame {frame} is not supported" in local(Rig(), ONLY_POS, frame=frame)


def test_infinite_element_is_refused_and_nan_is_free():
    rig = Rig()
    assert "out of range" in local(rig, ONLY_POS, x=float("inf"))
    assert isnan(local(rig, ONLY_POS, x=nan).pos_ned[0])


def test_refusals_are_told_once_in_10_s():
    rig = Rig()
    reported = []
    for _ in range(100):
        rig.client.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=99, type_mask=ONLY_POS)
        reported += texts(rig.frame(10))
    assert len(reported) == 2


def test_global_position_above_sea_level():
    setpoint = position(Rig(), frame=0)
    assert setpoint.pos_ned == pytest.approx((0.0, 0.0, -12.0), abs=0.02)
    assert position(Rig(), frame=5).pos_ned == setpoint.pos_ned


def test_global_position_above_home_and_above_ground():
    rig = Rig()
    rig.update(home=HOME.__class__(HOME.lat_deg, HOME.lon_deg, HOME.alt_m + 5.0))
    assert position(rig, frame=6, alt=20.0).pos_ned[2] == pytest.approx(-25.0)
    assert position(rig, frame=11, alt=20.0).pos_ned[2] == pytest.approx(-21.0)  # the ground is 1 m above the origin
    rig.update(home=None)
    assert "home" in position(rig, frame=3, alt=20.0)
    rig.update(estimate=rig.vehicle.state.estimate._replace(flags=0))
    assert "ground" in position(rig, frame=10, alt=20.0)


def test_global_position_round_trip():
    lat_deg, lon_deg, alt_m = geodetic_from_ned(120.0, -80.0, -30.0, HOME)
    setpoint = position(Rig(), 0, lat_int=round(lat_deg * 1e7), lon_int=round(lon_deg * 1e7), alt=alt_m)
    assert setpoint.pos_ned == pytest.approx((120.0, -80.0, -30.0), abs=0.02)


def test_global_altitude_alone_and_place_alone():
    rig = Rig()
    altitude = position(rig, frame=0, mask=ONLY_POS | 3)
    assert altitude.pos_ned == pytest.approx((nan, nan, -12.0), nan_ok=True)
    level = position(rig, frame=0, mask=ONLY_POS | 4)
    assert level.pos_ned == pytest.approx((0.0, 0.0, nan), nan_ok=True, abs=0.02)


def test_half_a_place_or_none_on_earth_is_refused():
    rig = Rig()
    assert "together" in position(rig, frame=0, mask=ONLY_POS | 1)
    assert "no such" in position(rig, frame=0, lat_int=910_000_000)
    assert "frame 1 " in position(rig, frame=1)


def test_attitude_and_thrust():
    setpoint = attitude(Rig(), 7, q=(0.8, 0.0, 0.0, 0.6))
    assert setpoint.kind == SETPOINT_ATTITUDE
    assert setpoint.q_ned_from_frd == pytest.approx((0.0, 0.0, 0.6, 0.8))
    assert setpoint.thrust == 0.5
    assert isnan(setpoint.yaw_rate)
    assert attitude(Rig(), 3).yaw_rate == pytest.approx(0.3)


def test_rates_and_thrust():
    setpoint = attitude(Rig(), 128)
    assert setpoint.kind == SETPOINT_RATE
    assert setpoint.omega_frd == pytest.approx((0.1, 0.2, 0.3))


def test_every_attitude_mask_gets_an_answer():
    rig = Rig()
    for mask in range(256):
        rig.time_us += 10_000_000
        answer = attitude(rig, mask)
        if mask & 32 or mask & 64:
            assert "thrust" in answer
        elif mask & 128:
            assert isinstance(answer, str) == bool(mask & 7)
        else:
            assert answer.kind == SETPOINT_ATTITUDE


@pytest.mark.parametrize(
    "q", [(0.0, 0.0, 0.0, 0.0), (nan, 0.0, 0.0, 0.0), (float("inf"), 0.0, 0.0, 0.0), (9.0, 0, 0, 0)]
)
def test_attitude_that_is_none_is_refused(q):
    assert "quaternion" in attitude(Rig(), 7, q=q)


def test_thrust_is_bounded():
    assert attitude(Rig(), 7, thrust=2.0).thrust == 1.0
    assert attitude(Rig(), 7, thrust=-1.0).thrust == 0.0
    assert "thrust" in attitude(Rig(), 7, thrust=nan)


def test_actuator_control_is_refused():
    rig = Rig()
    rig.client.send("SET_ACTUATOR_CONTROL_TARGET", target_component=1)
    assert "not supported" in texts(rig.frame())[0]
