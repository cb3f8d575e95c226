"""Rovers over a world, for the tests: many vehicles, many ticks, one launch."""

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from common.airframe import load_airframe
from common.kernels import vec8
from sim.bodies.rover import RoverState, rover_at_rest, rover_tick
from sim.bodies.rover_model import RoverModel, rover_model
from sim.world.world import World, WorldConfig, WorldMap, build_world

wp.set_module_options({"enable_backward": False})

FLAT = WorldConfig(size_m=400.0, hill_height_m=0.0, trees_per_ha=0.0)


@wp.kernel
def _rest(
    models: wp.array[RoverModel], places: wp.array[wp.vec3], yaws: wp.array[wp.float32], bodies: wp.array[RoverState]
):
    i = wp.tid()
    bodies[i] = rover_at_rest(models[i], places[i], yaws[i])


@wp.kernel
def _drive(
    models: wp.array[RoverModel],
    commands: wp.array[vec8],
    world: World,
    wind_ned: wp.vec3,
    ticks: int,
    bodies: wp.array[RoverState],
):
    i = wp.tid()
    body = bodies[i]
    for _ in range(ticks):
        body = rover_tick(models[i], body, commands[i], wind_ned, world)
    bodies[i] = body


class RoverFleet:
    """Rovers that start at rest on the ground; `state` is the live view of their rows.

    Args:
        places: north and east [m] of each.
        models: one, or one per vehicle; None: the airframe `rover`.
        world: None: a plain.
        yaws: headings [rad].
    """

    def __init__(self, places: ArrayLike, models=None, world: WorldMap | None = None, yaws: ArrayLike = 0.0) -> None:
        places = np.atleast_2d(np.asarray(places, float))
        count = len(places)
        models = rover_model(load_airframe("rover"), 0.0) if models is None else models
        rows = list(models) if isinstance(models, list) else [models] * count
        self.world = world or build_world(FLAT)
        down = -self.world.height(places[:, 0], places[:, 1]) - np.array([row.standing_m for row in rows])
        starts = np.column_stack([places, down]).astype(np.float32)
        self._models = wp.array(rows, dtype=RoverModel)
        self._commands = wp.zeros(count, dtype=vec8)
        self._bodies = wp.zeros(count, dtype=RoverState)
        yaws = wp.array(np.broadcast_to(np.asarray(yaws, np.float32), count), dtype=wp.float32)
        wp.launch(_rest, count, inputs=[self._models, wp.array(starts, dtype=wp.vec3), yaws, self._bodies])
        self.state = self._bodies.numpy()

    def drive(self, seconds: float, commands: ArrayLike, wind_ned=(0.0, 0.0, 0.0)) -> np.ndarray:
        """Advances all with commands that broadcast to (vehicles, 3); returns `state`."""
        rows = self._commands.numpy()
        rows[:, :3] = np.asarray(commands, np.float32)
        ticks = round(seconds * 250)
        inputs = [self._models, self._commands, self.world.kernel, wp.vec3(*wind_ned), ticks, self._bodies]
        wp.launch(_drive, len(self.state), inputs=inputs)
        return self.state

    def speeds(self) -> np.ndarray:
        """[m/s] along each nose."""
        nose = np.array([nose_ned(row["q_ned_from_frd"]) for row in self.state])
        return np.sum(nose * self.state["vel_ned"], axis=1)


def nose_ned(q) -> np.ndarray:
    x, y, z, w = (float(element) for element in q)
    return np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])


def up_ned(q) -> np.ndarray:
    x, y, z, w = (float(element) for element in q)
    return -np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
