import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from autopilot.vehicles.multirotor.attitude import attitude_error, attitude_from_thrust, thrust_turn_rate, turned


def quat(rotation: Rotation) -> wp.quat:
    return wp.quat(*rotation.as_quat().tolist())


def test_error_is_the_same_for_a_quaternion_and_its_negative() -> None:
    here, there = quat(Rotation.from_euler("ZYX", [1.0, 0.2, -0.1])), quat(Rotation.from_euler("ZYX", [0.4, -0.3, 0.2]))
    expected = np.array(attitude_error(here, there))
    for q, q_sp in ((-here, there), (here, -there), (-here, -there)):
        np.testing.assert_allclose(np.array(attitude_error(q, q_sp)), expected, atol=1e-6)


@pytest.mark.parametrize("heading_deg", [-170.0, -60.0, 0.0, 60.0, 175.0])
def test_heading_error_takes_the_short_way(heading_deg: float) -> None:
    here = quat(Rotation.from_euler("Z", 170.0, degrees=True))
    there = quat(Rotation.from_euler("Z", 170.0 + heading_deg, degrees=True))
    np.testing.assert_allclose(np.array(attitude_error(here, there)), (0.0, 0.0, np.radians(heading_deg)), atol=1e-5)


def test_error_signs_are_those_of_frd() -> None:
    level = wp.quat(0.0, 0.0, 0.0, 1.0)
    for axis in range(3):
        vector = np.eye(3)[axis] * 0.3
        error = np.array(attitude_error(level, quat(Rotation.from_rotvec(vector))))
        np.testing.assert_allclose(error, vector, atol=1e-6)


def test_tilt_is_corrected_the_short_way_whatever_the_heading_error() -> None:
    here = Rotation.from_euler("ZYX", [2.5, 0.4, -0.3])
    there = Rotation.from_euler("ZYX", [-1.0, -0.2, 0.1])
    error = np.array(attitude_error(quat(here), quat(there)))
    after_tilt = here * Rotation.from_rotvec([error[0], error[1], 0.0])
    np.testing.assert_allclose(after_tilt.apply([0, 0, 1]), there.apply([0, 0, 1]), atol=1e-5)
    after_both = after_tilt * Rotation.from_rotvec([0.0, 0.0, error[2]])
    assert (after_both.inv() * there).magnitude() < 1e-4


def test_upside_down_asks_for_half_a_turn() -> None:
    error = np.array(attitude_error(wp.quat(1.0, 0.0, 0.0, 0.0), wp.quat(0.0, 0.0, 0.0, 1.0)))
    assert np.linalg.norm(error[:2]) == pytest.approx(np.pi, abs=1e-4)


def test_thrust_up_with_heading_is_level() -> None:
    q = np.array(attitude_from_thrust(wp.vec3(0.0, 0.0, -9.8), 0.7))
    assert abs(q @ Rotation.from_euler("Z", 0.7).as_quat()) == pytest.approx(1.0, abs=1e-6)


def test_thrust_northward_leans_the_nose_down_when_heading_north() -> None:
    q = np.array(attitude_from_thrust(wp.vec3(2.0, 0.0, -9.8), 0.0))
    yaw, pitch, roll = Rotation.from_quat(q).as_euler("ZYX")
    assert pitch == pytest.approx(-np.arctan2(2.0, 9.8), abs=1e-6)
    assert abs(roll) < 1e-6
    assert abs(yaw) < 1e-6


def test_thrust_turn_rate_is_the_derivative_of_its_direction() -> None:
    thrust, jerk, dt = np.array([1.0, -2.0, -9.0]), np.array([3.0, 5.0, -1.0]), 1e-4
    omega = np.array(thrust_turn_rate(wp.vec3(*thrust), wp.vec3(*jerk)))
    before, after = thrust / np.linalg.norm(thrust), thrust + jerk * dt
    np.testing.assert_allclose(np.cross(omega, before), (after / np.linalg.norm(after) - before) / dt, atol=1e-3)


def test_turned_attitude_is_the_exponential_for_a_tick() -> None:
    start, omega = Rotation.from_euler("ZYX", [1.0, 0.2, 0.3]), np.array([0.4, -1.0, 0.8])
    expected = Rotation.from_rotvec(omega * 0.004) * start
    after = np.array(turned(quat(start), wp.vec3(*omega), 0.004))
    assert abs(after @ expected.as_quat()) == pytest.approx(1.0, abs=1e-7)
