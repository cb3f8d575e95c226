"""Bodies in wind over a world, for the tests: many vehicles, many ticks, one launch."""

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from common.airframe import load_airframe
from common.kernels import TICK_S, vec8
from sim.bodies.multirotor import BodyState, body_at_rest, body_tick
from sim.bodies.multirotor_model import MultirotorModel, multirotor_model
from sim.wind import WindModel, WindState, wind_model, wind_step
from sim.world.world import World, WorldConfig, WorldMap, build_world

wp.set_module_options({"enable_backward": False})

FLAT = WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0)
SEA_LEVEL_M = 0.0


@wp.kernel
def _rest(models: wp.array[MultirotorModel], pos_ned: wp.array[wp.vec3], bodies: wp.array[BodyState]):
    i = wp.tid()
    bodies[i] = body_at_rest(models[i], pos_ned[i], 0.0)


@wp.kernel
def _fly(
    models: wp.array[MultirotorModel],
    winds: wp.array[WindModel],
    seeds: wp.array[wp.int32],
    commands: wp.array[vec8],
    world: World,
    first_tick: int,
    ticks: int,
    bodies: wp.array[BodyState],
    airs: wp.array[WindState],
):
    i = wp.tid()
    body = bodies[i]
    air = airs[i]
    for k in range(ticks):
        air = wind_step(winds[i], air, body.vel_ned, body.height_agl_m, seeds[i], i, first_tick + k, TICK_S)
        body = body_tick(models[i], body, commands[i], air.wind_ned, world)
    bodies[i] = body
    airs[i] = air


class Fleet:
    """Vehicles that start level and at rest at `pos_ned`; `state` is the live view of their rows."""

    def __init__(
        self,
        pos_ned: ArrayLike,
        models=None,  # one MultirotorModel, or one per vehicle
        wind=None,
        world: WorldMap | None = None,
        seeds: ArrayLike = 1,
    ) -> None:
        pos = np.atleast_2d(np.asarray(pos_ned, np.float32))
        count = len(pos)
        if models is None:
            models = multirotor_model(load_airframe("x500"), SEA_LEVEL_M)
        rows = list(models) if isinstance(models, list) else [models] * count
        self.model = rows[0]
        self.world = world or build_world(FLAT)
        self.tick = 0
        self._models = wp.array(rows, dtype=MultirotorModel)
        self._winds = wp.array([wind or wind_model(0.0)] * count, dtype=WindModel)
        self._seeds = wp.array(np.broadcast_to(np.asarray(seeds, np.int32), count), dtype=wp.int32)
        self._commands = wp.zeros(count, dtype=vec8)
        self._bodies = wp.zeros(count, dtype=BodyState)
        self._airs = wp.zeros(count, dtype=WindState)
        wp.launch(_rest, count, inputs=[self._models, wp.array(pos, dtype=wp.vec3), self._bodies])
        self.state = self._bodies.numpy()
        self.air = self._airs.numpy()

    def fly(self, ticks: int, command: ArrayLike = 0.0) -> np.ndarray:
        """Advances all by `ticks` with commands that broadcast to (vehicles, rotors); returns `state`."""
        command = np.asarray(command, np.float32)
        width = command.shape[-1] if command.ndim else 8
        self._commands.numpy()[:, :width] = command
        wp.launch(
            _fly,
            len(self.state),
            inputs=[
                self._models,
                self._winds,
                self._seeds,
                self._commands,
                self.world.kernel,
                self.tick,
                ticks,
                self._bodies,
                self._airs,
            ],
        )
        self.tick += ticks
        return self.state

    def history(self, ticks: int, command: ArrayLike = 0.0) -> np.ndarray:
        """States after each of `ticks`, shape (ticks, vehicles)."""
        return np.array([self.fly(1, command).copy() for _ in range(ticks)])


def rotated(q: ArrayLike, v: ArrayLike) -> np.ndarray:
    """Vectors turned by unit quaternions (x, y, z, w), float64."""
    q, v = np.asarray(q, np.float64), np.asarray(v, np.float64)
    axis, w = q[..., :3], q[..., 3:]
    return v + 2.0 * np.cross(axis, np.cross(axis, v) + w * v)
