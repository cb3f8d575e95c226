"""A rover that runs into a wall says so, and does what HG_RO_CRASH_ACT asks for."""

import pytest

from autopilot.interface.vehicle_state import Mode
from mission.flight import Flight, FlightConfig
from mission.script import ScriptError
from sim.world.world import WorldConfig

WALLED = WorldConfig(
    trees_per_ha=0.0, size_m=50.0, has_walls=True, wall_height_m=2.0, clearing_radius_m=5.0, clearing_blend_m=10.0
)
BEHIND_THE_WALL = (60.0, 0.0, 0.0)
SAID = "Stuck, it does not move"


def driven_at_a_wall(airframe="rover", action=1):
    """What is said on the way, and the history."""
    flight = Flight(FlightConfig(airframe=airframe, world=WALLED, parameters={"HG_RO_CRASH_ACT": action}))

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        with pytest.raises(ScriptError):
            await drone.goto_ned(*BEHIND_THE_WALL, timeout_s=20.0)
        return list(drone.texts)

    running = flight.fly(script, seconds=60.0)
    history = flight.close()
    if running.error is not None:
        raise running.error
    return running.result, history


@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
def test_it_holds_and_pushes_no_more(airframe):
    texts, history = driven_at_a_wall(airframe)
    assert texts[-1] == f"{SAID}: hold"
    assert history.mode[-1] == Mode.HOLD
    assert history.is_armed[-1]
    assert abs(history.vel_ned_true[-100:, :2]).max() < 0.1


def test_it_is_disarmed_where_that_is_asked_for():
    texts, history = driven_at_a_wall(action=6)
    assert f"{SAID}: motors stopped" in texts
    assert not history.is_armed[-1]


def test_it_is_only_told_where_that_is_asked_for():
    texts, history = driven_at_a_wall(action=0)
    assert SAID in texts
    assert history.is_armed[-1]
