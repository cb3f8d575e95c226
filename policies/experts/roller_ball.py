"""RollerBall's expert: the cube pulls the ball like a damped spring."""

from typing import Any

import numpy as np

from policies.tasks.task import Task

_PULL = 2.0  # [1/s²] guess: over the floor within about two seconds
_DAMPING = 2.4  # [1/s] slightly under critical for _PULL, so that the edge is not overrun after the cube moved
_ROLLING = 7.0 / 5.0  # a solid sphere that rolls has seven fifths of its mass to accelerate


class RollerBallExpert:
    """Pushes the ball to the cube, and brakes before it gets there."""

    def act(self, task: Task) -> None:
        world: Any = task.world  # type: ignore[attr-defined]
        names = task.param_table.names
        params = task.buffers.params.numpy()
        away = world.target.numpy() - world.pos.numpy()
        accel = (_PULL * away - _DAMPING * world.vel.numpy())[:, [0, 2]]
        unit_accel = params[:, names.index("force_n")] / (params[:, names.index("mass_kg")] * _ROLLING)
        task.buffers.continuous.assign(np.clip(accel / unit_accel[:, None], -1.0, 1.0).astype(np.float32))
