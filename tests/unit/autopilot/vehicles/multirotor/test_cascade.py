"""The closed loop on a small rigid body: figures, limits and the ways in and out of control."""

from typing import Any

import numpy as np
import pytest

from autopilot.ports import SETPOINT_ATTITUDE, SETPOINT_IDLE, SETPOINT_LEAN, SETPOINT_RATE
from common.geodesy import GRAVITY_M_S2
from tests.unit.autopilot.vehicles.multirotor.rig import Rig, turbulence

NAN = float("nan")
NO_WIND, WIND = 0.0, 8.0


def blown_rig(wind_m_s: float, airframe_name: str = "x500", **options: Any) -> Rig:
    rig = Rig(airframe_name=airframe_name, **options)
    if wind_m_s > 0.0:
        rig.blow(turbulence(100.0, wind_m_s, seed=3))
    rig.run(8.0)
    return rig


def hold_error_95_m(rig: Rig) -> float:
    bodies, _ = rig.run(60.0)
    return float(np.percentile(np.linalg.norm(bodies["pos_ned"][0] - rig.start_ned, axis=1), 95))


@pytest.mark.parametrize("airframe_name", ["x500", "f450"])
@pytest.mark.parametrize(("wind_m_s", "bound_m"), [(NO_WIND, 0.01), (WIND, 0.05)])
def test_hold_stays_within_centimetres(airframe_name: str, wind_m_s: float, bound_m: float) -> None:
    assert hold_error_95_m(blown_rig(wind_m_s, airframe_name)) < bound_m


def test_disturbance_observer_is_what_holds_in_turbulence() -> None:
    with_observer = hold_error_95_m(blown_rig(WIND))
    without = hold_error_95_m(blown_rig(WIND, params={"disturbance_cutoff_hz": 0.0}))
    assert without > 3.0 * with_observer


@pytest.mark.parametrize("thrust_scale", [0.8, 1.25])
def test_hold_bears_thrust_that_differs_from_the_model(thrust_scale: float) -> None:
    assert hold_error_95_m(blown_rig(WIND, thrust_scale=thrust_scale)) < 0.06


def test_hold_bears_a_battery_at_its_end() -> None:
    assert hold_error_95_m(blown_rig(WIND, voltage_fraction=0.8)) < 0.05


@pytest.mark.parametrize("wind_m_s", [NO_WIND, WIND])
def test_step_of_five_metres_is_quick_without_overshoot(wind_m_s: float) -> None:
    rig = blown_rig(wind_m_s)
    rig.set(pos_ned=(5.0, 0.0, -10.0), yaw=0.0)
    bodies, _ = rig.run(6.0)
    pos = bodies["pos_ned"][0]
    outside = np.flatnonzero(np.linalg.norm(pos - (5.0, 0.0, -10.0), axis=1) > 0.3)
    assert outside[-1] * 0.004 < 2.4
    assert pos[:, 0].max() < 5.1
    assert np.abs(pos[:, 2] + 10.0).max() < 0.05


@pytest.mark.parametrize(("wind_m_s", "bound_m"), [(NO_WIND, 0.05), (WIND, 0.1)])
def test_square_at_cruise_speed_is_tracked(wind_m_s: float, bound_m: float) -> None:
    rig = blown_rig(wind_m_s)
    corners = np.array([(0.0, 0.0, -10.0), (20.0, 0.0, -10.0), (20.0, 20.0, -10.0), (0.0, 20.0, -10.0)])
    errors = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        rig.set(pos_ned=end, path_start_ned=start, yaw=0.0)
        along = (end - start) / 20.0
        for _ in range(500):
            pos = rig.run(0.02)[0]["pos_ned"][0]
            way = (pos - start) @ along
            cross = np.linalg.norm(pos - start - np.outer(way, along), axis=1)
            errors.append(cross[(way > 5.0) & (way < 15.0)])
            if np.linalg.norm(pos[-1] - end) < 2.0:
                break
    assert np.percentile(np.concatenate(errors), 95) < bound_m


def test_velocity_setpoint_is_reached_and_zero_brings_a_stop() -> None:
    rig = blown_rig(NO_WIND)
    rig.set(vel_ned=(3.0, -2.0, -1.0))
    bodies, _ = rig.run(4.0)
    np.testing.assert_allclose(bodies["vel_ned"][0, -1], (3.0, -2.0, -1.0), atol=0.05)
    rig.set(vel_ned=(0.0, 0.0, 0.0))
    rig.run(4.0)
    bodies, _ = rig.run(10.0)
    assert np.linalg.norm(bodies["pos_ned"][0] - bodies["pos_ned"][0, -1], axis=1).max() < 0.1


@pytest.mark.parametrize(
    ("airframe_name", "limits", "back_m_s"),
    [
        ("x500", {}, 0.1),
        ("f450", {}, 0.1),
        ("f550", {}, 0.1),
        ("x500", {"accel_max_xy": 7.0, "jerk_direct": 40.0}, 0.15),
    ],
)
@pytest.mark.parametrize("speed_m_s", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("course_rad", [0.0, 2.0])
def test_asked_to_stop_it_stops_and_does_not_go_back(
    airframe_name: str, limits: dict[str, float], back_m_s: float, speed_m_s: float, course_rad: float
) -> None:
    """What the feed-forward is about to make up for is not made up for twice, wherever it goes and looks."""
    rig = blown_rig(NO_WIND, airframe_name, params=limits)
    way = np.array([np.cos(course_rad), np.sin(course_rad), 0.0])
    rig.set(vel_ned=tuple(speed_m_s * way), yaw=0.5 * course_rad)
    rig.run(5.0)
    rig.set(vel_ned=(0.0, 0.0, 0.0), yaw=0.5 * course_rad)
    bodies, _ = rig.run(4.0)
    assert (bodies["vel_ned"][0] @ way).min() > -back_m_s


def test_acceleration_setpoint_is_flown() -> None:
    rig = blown_rig(NO_WIND)
    rig.set(pos_ned=(NAN, NAN, -10.0), accel_ned=(1.5, 0.0, NAN))
    bodies, _ = rig.run(2.0)
    vel = bodies["vel_ned"][0]
    assert (vel[-1, 0] - vel[-126, 0]) / 0.5 == pytest.approx(1.5, abs=0.1)
    assert abs(bodies["pos_ned"][0, -1, 2] + 10.0) < 0.05


def test_yaw_turns_while_the_position_is_held() -> None:
    rig = blown_rig(NO_WIND)
    rig.set(pos_ned=rig.start_ned, yaw=np.radians(-150.0))
    bodies, _ = rig.run(6.0)
    q = bodies["q_ned_from_frd"][0, -1].astype(float)
    yaw = 2.0 * np.arctan2(q[2], q[3])
    assert np.degrees(np.arctan2(np.sin(yaw), np.cos(yaw))) == pytest.approx(-150.0, abs=1.0)
    assert np.linalg.norm(bodies["pos_ned"][0] - rig.start_ned, axis=1).max() < 0.05


def test_reset_of_the_estimate_does_not_kick_the_vehicle() -> None:
    rig = blown_rig(NO_WIND)
    rig.set(vel_ned=(0.0, 0.0, 0.0))
    rig.run(3.0)
    rig.jump_estimate((2.0, -1.0, 0.5))
    bodies, _ = rig.run(2.0)
    assert np.abs(bodies["vel_ned"][0]).max() < 0.02


def test_attitude_setpoint_with_yaw_rate() -> None:
    rig = blown_rig(NO_WIND)
    lean = np.radians(10.0)
    hover = rig.hover_share
    rig.set(
        kind=SETPOINT_ATTITUDE,
        q_ned_from_frd=(0.0, np.sin(-lean / 2.0), 0.0, np.cos(lean / 2.0)),
        yaw_rate=0.5,
        thrust=hover / np.cos(lean),
    )
    bodies, states = rig.run(2.0)
    q = bodies["q_ned_from_frd"][0, -1].astype(float)
    tilt = np.arccos(1.0 - 2.0 * (q[0] ** 2 + q[1] ** 2))
    assert tilt == pytest.approx(lean, abs=np.radians(0.5))
    assert bodies["omega_frd"][0, -1, 2] == pytest.approx(0.5 * np.cos(lean), abs=0.05)
    assert states["actuators"]["thrust_sp"][0, -1] == pytest.approx(hover / np.cos(lean), rel=1e-3)


@pytest.mark.parametrize("lean_deg", [20.0, 45.0, 60.0])
def test_lean_setpoint_holds_the_height_while_it_leans_and_turns(lean_deg: float) -> None:
    rig = blown_rig(NO_WIND)
    rig.set(vel_ned=(0.0, 0.0, 0.0))
    rig.run(2.0)
    half = np.radians(lean_deg) / 2.0
    rig.set(
        kind=SETPOINT_LEAN,
        accel_ned=(0.0, 0.0, np.nan),
        vel_ned=(np.nan, np.nan, 0.0),
        q_ned_from_frd=(np.sin(half), 0.0, 0.0, np.cos(half)),
        yaw_rate=0.5,
    )
    bodies, _ = rig.run(2.0)
    q = bodies["q_ned_from_frd"][0, -1].astype(float)
    tilt = np.arccos(1.0 - 2.0 * (q[0] ** 2 + q[1] ** 2))
    assert np.degrees(tilt) == pytest.approx(lean_deg, abs=1.0)
    roll = np.arctan2(2.0 * (q[3] * q[0] + q[1] * q[2]), 1.0 - 2.0 * (q[0] ** 2 + q[1] ** 2))
    assert np.degrees(roll) == pytest.approx(lean_deg, abs=1.5)  # to the right, whatever the heading
    yaw = np.arctan2(2.0 * (q[3] * q[2] + q[0] * q[1]), 1.0 - 2.0 * (q[1] ** 2 + q[2] ** 2))
    assert yaw == pytest.approx(0.5 * 2.0, abs=0.1)
    assert np.abs(bodies["pos_ned"][0, :, 2] - bodies["pos_ned"][0, 0, 2]).max() < 0.5


def test_lean_setpoint_climbs_at_the_rate_asked_for() -> None:
    rig = blown_rig(NO_WIND)
    rig.set(kind=SETPOINT_LEAN, accel_ned=(0.0, 0.0, np.nan), vel_ned=(np.nan, np.nan, -2.0), yaw_rate=0.0)
    bodies, _ = rig.run(4.0)
    assert bodies["vel_ned"][0, -1, 2] == pytest.approx(-2.0, abs=0.05)


def test_level_lean_setpoint_drifts_with_the_wind_instead_of_leaning_against_it() -> None:
    rig = blown_rig(WIND)
    rig.set(kind=SETPOINT_LEAN, accel_ned=(0.0, 0.0, np.nan), vel_ned=(np.nan, np.nan, 0.0), yaw_rate=0.0)
    bodies, _ = rig.run(5.0)
    q = bodies["q_ned_from_frd"][0, -1].astype(float)
    assert np.degrees(np.arccos(1.0 - 2.0 * (q[0] ** 2 + q[1] ** 2))) < 1.0
    assert bodies["vel_ned"][0, -1, 1] > 0.5  # the wind comes from the west


def test_rate_setpoint_is_flown() -> None:
    rig = blown_rig(NO_WIND)
    rig.set(kind=SETPOINT_RATE, omega_frd=(0.0, 0.0, 0.4), thrust=rig.hover_share)
    bodies, _ = rig.run(1.5)
    np.testing.assert_allclose(bodies["omega_frd"][0, -1], (0.0, 0.0, 0.4), atol=0.02)


def test_disarmed_rotors_stop_and_armed_ones_idle() -> None:
    rig = Rig()
    rig.set(kind=SETPOINT_IDLE, is_armed=0)
    _, states = rig.run(0.02)
    np.testing.assert_array_equal(states["actuators"]["command"][0, -1], np.zeros(8))
    rig.set(kind=SETPOINT_IDLE, is_armed=1)
    _, states = rig.run(0.02)
    np.testing.assert_allclose(states["actuators"]["command"][0, -1], [rig.idle_command] * 4 + [0.0] * 4)


def test_landed_vehicle_idles_and_take_off_ramps_up_without_a_jump() -> None:
    rig = Rig(has_ground=True, start_ned=(0.0, 0.0, 0.0))
    rig.set(is_landed=1, vel_ned=(0.0, 0.0, -1.0))
    _, states = rig.run(1.0)
    np.testing.assert_allclose(states["actuators"]["command"][0, :, :4], rig.idle_command)
    assert not states["rate"]["integral_frd"].any()
    rig.set(pos_ned=(0.0, 0.0, -2.5))
    bodies, states = rig.run(5.0)
    thrust = states["actuators"]["thrust_sp"][0]
    assert np.diff(thrust).max() < 0.05  # of the greatest; the velocity loop steps at 50 Hz
    assert np.diff(thrust[:50]).max() < 0.007  # 0.6 s from nothing to all, in ticks of 4 ms
    lift_off_s = np.flatnonzero(bodies["pos_ned"][0, :, 2] < -0.01)[0] * 0.004
    assert lift_off_s < 0.8
    accel = bodies["accel_frd"][0]
    assert np.abs(accel[:, 2] + GRAVITY_M_S2).max() < 5.0  # about MPC_ACC_UP_MAX
    assert bodies["pos_ned"][0, :, 2].min() > -2.6
    assert bodies["pos_ned"][0, -1, 2] == pytest.approx(-2.5, abs=0.03)


def test_integrals_do_not_wind_up_against_a_wind_that_is_too_strong() -> None:
    rig = blown_rig(NO_WIND)
    rig.set(pos_ned=rig.start_ned)
    calm = rig.wind
    rig.blow(np.array([[40.0, 0.0, 0.0]]))
    rig.run(3.0)
    rig.wind = calm
    back, _ = rig.run(40.0)
    pos = back["pos_ned"][0]
    assert pos[0, 0] > 5.0  # it was blown away
    assert pos[:, 0].min() > -1.0  # and does not shoot past the place on its return
    np.testing.assert_allclose(pos[-1], rig.start_ned, atol=0.05)


@pytest.mark.parametrize("push_ned", [(10.0, 0.0, 0.0), (-10.0, 0.0, 0.0), (0.0, 10.0, 0.0), (15.0, -5.0, 0.0)])
def test_push_on_a_leg_is_recovered(push_ned: tuple[float, float, float]) -> None:
    rig = blown_rig(NO_WIND)
    leg = {"pos_ned": (150.0, 0.0, -10.0), "path_start_ned": (0.0, 0.0, -10.0), "cruise_speed": 8.0}
    rig.set(**leg)
    rig.run(6.0)
    rig.bodies.numpy()["vel_ned"] += np.array(push_ned, dtype=np.float32)
    bodies, states = rig.run(6.0)
    pos = bodies["pos_ned"][0]
    assert np.abs(pos[:, 1]).max() < 10.0
    assert np.linalg.norm(pos - states["trajectory"]["pos_ned"][0], axis=1).max() < 2.5  # drawn along
    assert np.abs(pos[-1] - states["trajectory"]["pos_ned"][0, -1]).max() < 0.3  # and back on it
    bodies, _ = rig.run(25.0)
    np.testing.assert_allclose(bodies["pos_ned"][0, -1], leg["pos_ned"], atol=0.1)


def test_wind_beyond_the_limits_carries_the_vehicle_downwind_at_its_height() -> None:
    rig = blown_rig(NO_WIND)
    rig.set(pos_ned=rig.start_ned)
    rig.blow(np.array([[25.0, 0.0, 0.0]]))  # 18.75 m/s² of drag
    bodies, states = rig.run(10.0)
    pos = bodies["pos_ned"][0]
    assert (np.diff(pos[250:, 0]) > 0.0).all()
    assert np.abs(pos[:, 2] + 10.0).max() < 0.5
    assert np.linalg.norm(states["velocity"]["integral_ned"][0, :, :2], axis=1).max() <= 4.001
    assert np.linalg.norm(states["velocity"]["disturbance_ned"][0, :, :2], axis=1).max() <= 6.001


def test_height_is_kept_before_the_place_when_thrust_is_short() -> None:
    rig = blown_rig(NO_WIND, voltage_fraction=0.665)  # greatest thrust 1.03 times the weight
    rig.set(pos_ned=rig.start_ned)
    rig.blow(np.array([[8.0, 0.0, 0.0]]))
    bodies, _ = rig.run(10.0)
    assert bodies["pos_ned"][0, -1, 0] > 5.0
    assert np.abs(bodies["pos_ned"][0, :, 2] + 10.0).max() < 0.5


def test_large_upset_is_recovered() -> None:
    rig = blown_rig(NO_WIND)
    rows = rig.bodies.numpy()
    half = np.radians(170.0) / 2.0
    rows["q_ned_from_frd"] = (np.sin(half), 0.0, 0.0, np.cos(half))
    bodies, _ = rig.run(8.0)
    np.testing.assert_allclose(bodies["pos_ned"][0, -1], rig.start_ned, atol=0.1)


def test_a_vehicle_alone_flies_as_in_a_fleet() -> None:
    alone, fleet = Rig(), Rig(vehicle_count=5)
    for rig in (alone, fleet):
        rig.set(pos_ned=(3.0, 1.0, -11.0), yaw=1.0)
    one, _ = alone.run(2.0)
    many, _ = fleet.run(2.0)
    for i in range(5):
        np.testing.assert_array_equal(one[0], many[i])
