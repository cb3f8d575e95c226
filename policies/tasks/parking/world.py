"""What a row of either level is made of: car, goal and the memory of the rewards; and the arrays that hold them."""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from policies.tasks.parking.arena import pose_at
from policies.tasks.parking.drive import Motion
from policies.tasks.parking.parking_params import CarParams
from policies.tasks.parking.parking_top_view import top_view_of
from policies.tasks.parking.settings import Rules
from policies.tasks.task import Task
from policies.tasks.task_params import typed_rows

wp.set_module_options({"enable_backward": False})


@wp.struct
class CarState:
    """One row per environment."""

    pos: wp.array(dtype=wp.vec2)  # [m] of the car's origin
    vel: wp.array(dtype=wp.vec2)  # [m/s]
    yaw: wp.array(dtype=float)  # [rad]
    goal: wp.array(dtype=wp.vec4)  # pose of the pad
    best_m: wp.array(dtype=float)  # shortest distance of this episode
    last_m: wp.array(dtype=float)  # distance at the last applied action
    way_m: wp.array(dtype=float)  # what was left to go at the last decision
    params: wp.array(dtype=CarParams)


@wp.func
def motion_of(cars: CarState, i: int) -> Motion:
    """The car of a row."""
    motion = Motion()
    motion.pos = cars.pos[i]
    motion.vel = cars.vel[i]
    motion.yaw = cars.yaw[i]
    motion.pose = pose_at(motion.pos, motion.yaw)
    return motion


@wp.func
def keep_motion(cars: CarState, i: int, motion: Motion) -> None:
    """Writes the car back."""
    cars.pos[i] = motion.pos
    cars.vel[i] = motion.vel
    cars.yaw[i] = motion.yaw


class ParkingTask(Task):
    """What the two levels share on the host."""

    rules: Rules
    world: Any
    """The cars and goals, a `CarState`."""

    def _car_state(self) -> Any:
        state = CarState()
        for name in ("pos", "vel"):
            setattr(state, name, self._zeros(name, self.env_count, wp.vec2))
        for name in ("yaw", "best_m", "last_m", "way_m"):
            setattr(state, name, self._zeros(name, self.env_count, float))
        state.goal = self._zeros("goal", self.env_count, wp.vec4)
        state.params = typed_rows(self.buffers.params, CarParams)
        return state

    def top_view(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:
        """Storeys, obstacles, pad, portals, car and, where it has them, rays, from above."""
        return top_view_of(self, i_env, height_px)
