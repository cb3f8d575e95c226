"""Landing detection: quick on the ground, never in the air."""

from types import SimpleNamespace

import numpy as np
import pytest

from autopilot.ports import TERRAIN_VALID, VELOCITY_VALID
from autopilot.vehicles.multirotor.landing_detector import LANDING_DETECTOR_PARAMETERS, LandingDetector
from autopilot.vehicles.multirotor.params import CONTROL_PARAMETERS
from common.params import ParameterTable

HOVER = 0.43
DT_S = 0.02


def detector():
    return LandingDetector(ParameterTable([*LANDING_DETECTOR_PARAMETERS, *CONTROL_PARAMETERS]), HOVER)


def estimate(vel=(0.0, 0.0, 0.0), omega=(0.0, 0.0, 0.0), flags=VELOCITY_VALID, down=0.0, accel_z=-9.8):
    return SimpleNamespace(
        vel_ned=vel,
        omega_frd=omega,
        flags=flags,
        pos_ned=(0.0, 0.0, down),
        terrain_d=0.0,
        accel_frd=(0.0, 0.0, accel_z),
    )


def seconds_until_landed(landing, thrust, limit_s=20.0, **kwargs):
    for i in range(round(limit_s / DT_S)):
        if landing.update(estimate(**kwargs), thrust, 0.3, DT_S):
            return (i + 1) * DT_S
    return None


def test_resting_vehicle_with_low_thrust_is_landed_after_the_trigger_time():
    assert seconds_until_landed(detector(), 0.09) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    ("thrust", "kwargs"),
    [
        (0.40, {}),
        (0.17, {}),  # contact, but not low enough to be landed
        (0.09, {"vel": (0.0, 0.0, 0.4)}),
        (0.09, {"vel": (2.0, 0.0, 0.0)}),
        (0.09, {"omega": (0.5, 0.0, 0.0)}),
        (0.09, {"flags": 0, "accel_z": -2.0}),
    ],
)
def test_vehicle_that_moves_or_carries_itself_is_not_landed(thrust, kwargs):
    assert seconds_until_landed(detector(), thrust, **kwargs) is None


def test_without_velocity_the_ground_is_felt_by_the_accelerometer():
    assert seconds_until_landed(detector(), 0.09, flags=0) == pytest.approx(1.0, abs=0.05)


def test_range_finder_that_sees_air_delays_the_answer_only():
    flags = VELOCITY_VALID | TERRAIN_VALID
    assert seconds_until_landed(detector(), 0.09, flags=flags, down=-3.0) == pytest.approx(5.0, abs=0.1)


def test_descent_in_strong_turbulence_is_never_taken_for_a_landing():
    """Thrust and velocity of a point mass in vertical gusts of 3 m/s, braked and dropped by an aggressive pilot."""
    rng = np.random.default_rng(4)
    landing = detector()
    vel_d, gust, thrust = 0.7, 0.0, HOVER
    for _ in range(50 * 3600):
        gust += (-gust * DT_S / 1.0) + 3.0 * np.sqrt(2.0 * DT_S) * rng.standard_normal()
        wanted = np.clip(HOVER * (1.0 + (vel_d - 0.7) * 0.6), 0.08, 1.0)
        thrust += (wanted - thrust) * DT_S / 0.1
        vel_d += (9.8 * (1.0 - thrust / HOVER) - 0.4 * (vel_d + gust)) * DT_S
        assert not landing.update(estimate(vel=(0.0, 0.0, vel_d), down=-20.0), thrust, 0.7, DT_S)


@pytest.mark.parametrize(
    ("height", "sink", "descent_sp", "is_felt"),
    [
        (0.25, 0.0, 0.3, True),
        (0.25, 0.3, 0.3, False),  # still sinking
        (0.60, 0.0, 0.3, False),  # stalled by a gust, well above the ground
        (0.25, 0.0, 0.0, False),  # a low hover
    ],
)
def test_descent_that_stalls_just_above_the_ground_is_contact_though_the_thrust_is_still_high(
    height, sink, descent_sp, is_felt
):
    landing = LandingDetector(ParameterTable([*LANDING_DETECTOR_PARAMETERS, *CONTROL_PARAMETERS]), HOVER, 0.22)
    row = estimate(vel=(0.0, 0.0, sink), flags=VELOCITY_VALID | TERRAIN_VALID, down=-height)
    for _ in range(10):
        landing.update(row, HOVER, descent_sp, DT_S)
    assert landing.has_contact == is_felt
    assert not landing.is_landed


def test_contact_outlasts_a_bounce_and_ends_with_a_fall():
    landing = detector()
    seconds_until_landed(landing, 0.09, limit_s=0.5)
    assert landing.has_contact
    landing.update(estimate(vel=(0.0, 0.0, -0.5)), 0.09, 0.0, DT_S)
    assert landing.has_contact
    landing.update(estimate(vel=(0.0, 0.0, 1.2)), 0.06, 0.0, DT_S)
    assert not landing.has_contact


def test_range_finder_that_tells_of_ground_where_there_is_none_is_not_believed_for_long():
    landing = LandingDetector(ParameterTable([*LANDING_DETECTOR_PARAMETERS, *CONTROL_PARAMETERS]), HOVER, 0.22)
    flags = VELOCITY_VALID | TERRAIN_VALID
    stalled = estimate(flags=flags, down=-0.2)

    def is_felt():
        for _ in range(10):
            landing.update(stalled, HOVER, 0.7, DT_S)
        return landing.has_contact

    for _ in range(3):
        assert is_felt()
        for _ in range(20):
            landing.update(estimate(vel=(0.0, 0.0, 1.5), flags=flags, down=-0.2), 0.06, 0.7, DT_S)
    assert not is_felt()
    landing.reset()
    assert is_felt()


@pytest.mark.parametrize(
    ("accel_z", "sink", "roll_rate", "is_down"),
    [
        (-9.8, 0.0, 0.0, True),
        (9.8, 3.0, 0.0, True),  # on its back, and the impact has upset the estimate of its speed
        (-1.0, 3.0, 0.0, False),  # falls
        (-9.8, 15.0, 0.0, False),  # falls at its terminal velocity
        (-9.8, 0.0, 1.0, False),  # rolls down a slope
    ],
)
def test_vehicle_that_is_down_without_thrust_is_down(accel_z, sink, roll_rate, is_down):
    landing = detector()
    row = estimate(vel=(0.0, 0.0, sink), omega=(roll_rate, 0.0, 0.0), accel_z=accel_z)
    for _ in range(52):
        landing.update(row, 0.0, 0.0, DT_S)
    assert landing.is_down == is_down
    landing.update(row, 0.1, 0.0, DT_S)
    assert not landing.is_down
