"""Drives between walls: a rover that is armed, a script, and what it said."""

import pytest

from mission.flight import Flight, FlightConfig
from mission.script import ScriptError
from sim.world.world import WorldConfig

WALL_M = 25.0
WALLED = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0, size_m=2 * WALL_M, has_walls=True, wall_height_m=2.0)


def driven(script, *, airframe="rover", world=WALLED, has_lidar=True, **parameters):
    """Texts and history of a script that begins when the rover is armed."""
    flight = Flight(FlightConfig(airframe=airframe, world=world, has_lidar=has_lidar, parameters=parameters))

    async def whole(drone):
        await drone.wait_ready()
        await drone.arm()
        await script(drone)
        return list(drone.texts)

    running = flight.fly(whole, seconds=120.0)
    history = flight.close()
    if running.error is not None:
        raise running.error
    return running.result, history


async def to_behind_the_wall(drone):
    """Goes to a place that nobody can reach."""
    with pytest.raises(ScriptError):
        await drone.goto_ned(60.0, 0.0, 0.0, timeout_s=30.0)
