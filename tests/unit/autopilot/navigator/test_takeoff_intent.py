"""What setpoints ask for near the ground, and where the ground is thought to be."""

from math import isnan, nan
from types import SimpleNamespace

import pytest

from autopilot.interface.client_requests import OffboardSetpoint, SetHome
from autopilot.interface.vehicle_state import Verdict
from autopilot.navigator.takeoff_intent import Ask, standing_d, vertical_ask
from autopilot.ports import SETPOINT_ATTITUDE, SETPOINT_IDLE, SETPOINT_RATE, SETPOINT_TRAJECTORY, TERRAIN_VALID
from tests.unit.autopilot.kinematic import Kinematic

HOVER = 0.43
STANDING_M = 0.2


def trajectory(pos_d=nan, vel_d=nan, accel_d=nan, north=0.0):
    return OffboardSetpoint(
        0,
        int(SETPOINT_TRAJECTORY),
        pos_ned=(north, 0.0, pos_d),
        vel_ned=(nan, nan, vel_d),
        accel_ned=(nan, nan, accel_d),
    )


@pytest.mark.parametrize(
    ("setpoint", "answer"),
    [
        (trajectory(pos_d=-5.0), Ask.UP),
        (trajectory(pos_d=-1.0), Ask.STAY),
        (trajectory(pos_d=-0.5), Ask.STAY),  # a low hover
        (trajectory(pos_d=-0.22), Ask.DOWN),
        (trajectory(pos_d=3.0), Ask.DOWN),
        (trajectory(pos_d=3.0, north=20.0), Ask.STAY),  # still far away
        (trajectory(pos_d=-5.0, vel_d=1.0), Ask.UP),  # the position counts
        (trajectory(vel_d=-0.5), Ask.UP),
        (trajectory(vel_d=0.0), Ask.STAY),
        (trajectory(vel_d=0.3), Ask.DOWN),
        (trajectory(accel_d=-1.0), Ask.UP),
        (trajectory(accel_d=1.0), Ask.DOWN),
        (trajectory(), Ask.STAY),
        (OffboardSetpoint(0, int(SETPOINT_ATTITUDE), thrust=0.5), Ask.UP),
        (OffboardSetpoint(0, int(SETPOINT_RATE), thrust=0.05), Ask.DOWN),
        (OffboardSetpoint(0, int(SETPOINT_IDLE)), Ask.STAY),
    ],
)
def test_ask_of_a_vehicle_one_metre_up(setpoint, answer):
    estimate = SimpleNamespace(pos_ned=(0.0, 0.0, -1.0))
    assert vertical_ask(setpoint, estimate, -STANDING_M, HOVER) is answer


def test_without_known_ground_no_place_is_on_it():
    estimate = SimpleNamespace(pos_ned=(0.0, 0.0, -1.0))
    assert vertical_ask(trajectory(pos_d=3.0), estimate, nan, HOVER) is Ask.STAY


@pytest.mark.parametrize(
    ("north", "flags", "terrain_d", "expected"),
    [
        (0.0, TERRAIN_VALID, 1.0, 0.8),  # measured
        (0.0, TERRAIN_VALID, -5.0, 0.0),  # not believed: where it stood
        (50.0, TERRAIN_VALID, -5.0, -5.2),
        (0.0, 0, 0.0, 0.0),
        (50.0, 0, 0.0, nan),
    ],
)
def test_ground_is_where_it_is_measured_unless_that_contradicts_where_it_stood(north, flags, terrain_d, expected):
    state = SimpleNamespace(
        estimate=SimpleNamespace(pos_ned=(north, 0.0, -5.0), flags=flags, terrain_d=terrain_d),
        stand_ned=(0.0, 0.0, 0.0),
    )
    found = standing_d(state, STANDING_M)
    assert found == pytest.approx(expected, nan_ok=True)
    assert isnan(found) == isnan(expected)


def test_home_set_in_the_air_is_not_taken_for_the_ground():
    """A held position at home's height would be one on the ground: the vehicle would sink to stand there."""
    rig = Kinematic().flying(10.0)
    rig.flags &= ~TERRAIN_VALID
    assert rig.fc.request(SetHome(nan, nan, nan)).verdict is Verdict.ACCEPTED
    rig.run(1.0)
    assert rig.fc.navigator.ask is Ask.STAY
    assert rig.state.home_ned[2] == pytest.approx(-10.0, abs=0.3)
