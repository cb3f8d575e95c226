"""A rover that runs into a wall says so, and does what HG_RO_CRASH_ACT asks for."""

import pytest

from autopilot.interface.vehicle_state import Mode
from tests.system.rover.walled import driven, to_behind_the_wall

SAID = "Stuck, it does not move"


@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
def test_it_holds_and_pushes_no_more(airframe):
    texts, history = driven(to_behind_the_wall, airframe=airframe, HG_RO_CRASH_ACT=1)
    assert texts[-1] == f"{SAID}: hold"
    assert history.mode[-1] == Mode.HOLD
    assert history.is_armed[-1]
    assert abs(history.vel_ned_true[-100:, :2]).max() < 0.1


def test_it_is_disarmed_where_that_is_asked_for():
    texts, history = driven(to_behind_the_wall, HG_RO_CRASH_ACT=6)
    assert f"{SAID}: motors stopped" in texts
    assert not history.is_armed[-1]


def test_it_is_only_told_where_that_is_asked_for():
    texts, history = driven(to_behind_the_wall, HG_RO_CRASH_ACT=0)
    assert SAID in texts
    assert history.is_armed[-1]
