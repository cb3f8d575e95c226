"""Planes over a plain, for the tests: a body alone, flown by commands that stay."""

from math import cos, sin

import numpy as np
import warp as wp

from common.airframe import load_airframe
from common.kernels import vec8
from sim.bodies.plane import PlaneState, plane_at_rest, plane_tick
from sim.bodies.plane_model import PlaneModel, plane_model
from sim.world.world import World, WorldConfig, build_world

wp.set_module_options({"enable_backward": False})

FLAT = WorldConfig(size_m=400.0, hill_height_m=0.0, trees_per_ha=0.0)
AIRFRAME = load_airframe("plane")


@wp.kernel
def _rest(model: PlaneModel, down: float, bodies: wp.array[PlaneState]):
    i = wp.tid()
    bodies[i] = plane_at_rest(model, wp.vec3(0.0, 0.0, down), 0.0)


@wp.kernel
def _fly(
    model: PlaneModel,
    commands: wp.array[vec8],
    world: World,
    wind_ned: wp.vec3,
    ticks: int,
    bodies: wp.array[PlaneState],
):
    i = wp.tid()
    body = bodies[i]
    for _ in range(ticks):
        body = plane_tick(model, body, commands[i], wind_ned, world)
    bodies[i] = body


class PlaneFleet:
    """Planes that stand at home; `state` is the live view of their rows."""

    def __init__(self, count=1, model=None, world=None) -> None:
        self.model = plane_model(AIRFRAME, 0.0) if model is None else model
        self.world = world or build_world(FLAT)
        self._commands = wp.zeros(count, dtype=vec8)
        self._bodies = wp.zeros(count, dtype=PlaneState)
        down = -float(self.world.height(0.0, 0.0)) - self.model.standing_m
        wp.launch(_rest, count, inputs=[self.model, down, self._bodies])
        self.state = self._bodies.numpy()

    def in_flight(self, speed_m_s, alpha_rad, elevator=0.0, height_m=500.0) -> None:
        """All level at a height, along north; the elevator where its command has it."""
        self.state["pos_ned"] = (0.0, 0.0, -height_m)
        self.state["vel_ned"] = (speed_m_s, 0.0, 0.0)
        self.state["q_ned_from_frd"] = (0.0, sin(0.5 * alpha_rad), 0.0, cos(0.5 * alpha_rad))
        self.state["surface"][:, 1] = -elevator * AIRFRAME.surfaces.elevator_max_rad

    def fly(self, seconds, command=(0.0,), wind_ned=(0.0, 0.0, 0.0)) -> np.ndarray:
        """Advances all with commands that broadcast to (vehicles, outputs); returns `state`."""
        rows = self._commands.numpy()
        command = np.atleast_1d(np.asarray(command, np.float32))
        rows[:, : command.shape[-1]] = command
        inputs = [self.model, self._commands, self.world.kernel, wp.vec3(*wind_ned), round(250 * seconds), self._bodies]
        wp.launch(_fly, len(self.state), inputs=inputs)
        return self.state

    def track(self, seconds, command, step_s=0.1) -> dict[str, np.ndarray]:
        """The same, with speed [m/s], position [m] and vertical speed of the first plane after each step."""
        speeds, places, climbs = [], [], []
        for _ in range(round(seconds / step_s)):
            row = self.fly(step_s, command)[0]
            speeds.append(np.linalg.norm(row["vel_ned"]))
            places.append(row["pos_ned"].copy())
            climbs.append(-row["vel_ned"][2])
        return {"speed": np.array(speeds), "pos": np.array(places), "climb": np.array(climbs)}
