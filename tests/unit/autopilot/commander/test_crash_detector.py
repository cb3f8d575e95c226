"""The attitude watch: quick when control is gone, silent in every flight that was asked for."""

from math import cos, radians, sin
from types import SimpleNamespace

import pytest

from autopilot.commander.crash_detector import AttitudeWatch
from autopilot.commander.failsafe import ATTITUDE_LOST, CRASHED
from autopilot.commander.params import COMMANDER_PARAMETERS
from autopilot.ports import TILT_ALIGNED
from common.params import ParameterTable

DT_S = 0.02


def rolled(angle_deg):
    return (sin(0.5 * radians(angle_deg)), 0.0, 0.0, cos(0.5 * radians(angle_deg)))


def pitched(angle_deg):
    return (0.0, sin(0.5 * radians(angle_deg)), 0.0, cos(0.5 * radians(angle_deg)))


def vehicle(roll=0.0, pitch=0.0, wanted=(0.0, 0.0, 0.0, 1.0), age_us=0, flags=TILT_ALIGNED):
    """State of a vehicle that leans by roll or pitch [deg]."""
    q_ned_from_frd = rolled(roll) if roll else pitched(pitch)
    return SimpleNamespace(
        time_us=10_000_000,
        estimate=SimpleNamespace(time_us=10_000_000 - age_us, flags=flags, q_ned_from_frd=q_ned_from_frd),
        actuators=SimpleNamespace(q_sp_ned_from_frd=wanted),
        roll_rad=radians(roll),
        pitch_rad=radians(pitch),
    )


def seconds_until(failure, state, limit_s=20.0, *, leans=True, **params):
    table = ParameterTable(COMMANDER_PARAMETERS)
    for name, value in params.items():
        table.set(name, value)
    watch = AttitudeWatch(table, leans=leans)
    for i in range(round(limit_s / DT_S)):
        if watch.update(state, DT_S) == failure:
            return (i + 1) * DT_S
    return None


@pytest.mark.parametrize("state", [vehicle(roll=65.0), vehicle(roll=-170.0), vehicle(pitch=80.0)])
def test_lean_beyond_the_limit_is_a_crash_after_its_time(state):
    assert seconds_until(CRASHED, state) == pytest.approx(0.3, abs=0.03)
    assert seconds_until(CRASHED, state, FD_FAIL_R_TTRI=0.5, FD_FAIL_P_TTRI=0.5) == pytest.approx(0.5, abs=0.03)


def test_lean_that_control_does_not_undo_is_a_crash_after_two_seconds():
    assert seconds_until(CRASHED, vehicle(roll=50.0)) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize(
    "state",
    [
        vehicle(roll=45.0, wanted=rolled(40.0)),
        vehicle(pitch=-55.0, wanted=pitched(-45.0)),
        vehicle(roll=100.0, wanted=rolled(100.0)),  # flown by rates
        vehicle(pitch=75.0, wanted=pitched(70.0)),  # asked for by attitude
        vehicle(roll=25.0),
    ],
)
def test_lean_that_is_asked_for_is_none(state):
    assert seconds_until(CRASHED, state) is None


@pytest.mark.parametrize("roll", [65.0, -170.0])
def test_what_stays_on_the_ground_has_tipped_over_whatever_its_setpoint_is(roll):
    state = vehicle(roll=roll, wanted=rolled(roll))
    assert seconds_until(CRASHED, state, leans=False) == pytest.approx(0.3, abs=0.03)


def test_what_stays_on_the_ground_may_stand_on_a_steep_slope():
    assert seconds_until(CRASHED, vehicle(pitch=45.0, wanted=pitched(45.0)), leans=False) is None


def test_short_overshoot_is_none():
    watch = AttitudeWatch(ParameterTable(COMMANDER_PARAMETERS))
    for i in range(200):
        state = vehicle(roll=70.0) if i % 20 < 10 else vehicle(roll=10.0)  # 0.2 s each
        assert watch.update(state, DT_S) == 0


@pytest.mark.parametrize("state", [vehicle(age_us=120_000), vehicle(flags=0)])
def test_old_or_missing_attitude_is_lost_at_once(state):
    assert seconds_until(ATTITUDE_LOST, state) == pytest.approx(DT_S)


def test_estimate_as_old_as_a_slow_imu_makes_it_is_none():
    assert seconds_until(ATTITUDE_LOST, vehicle(age_us=60_000)) is None
