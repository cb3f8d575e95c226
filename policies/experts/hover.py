"""Hover's expert: a cascade by hand, from the point over acceleration and tilt to body rates."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from policies.tasks.hover.hover_kernels import RATE_MAX
from policies.tasks.task import Task

_PULL, _DAMPING = 1.5, 2.0  # [1/s²], [1/s] guess: to the point within two seconds, without overshoot
_ACCEL_MAX = 3.0  # [m/s²]
_TILT_GAIN = 6.0  # [1/s] guess
_GRAVITY = 9.80665
_THRUST = 0.47  # of the greatest, that carries the x500; measured

Floats = NDArray[np.float32]


def cascade(observations: Any) -> Floats:
    """Actions for observations, in frd: (rows, 16) or (16,)."""
    to_point, vel, down, _, _ = np.split(observations, [3, 6, 9, 12], axis=-1)
    lift_frd = np.clip(_PULL * to_point - _DAMPING * vel, -_ACCEL_MAX, _ACCEL_MAX) - _GRAVITY * down
    down_sp_frd = -lift_frd / np.linalg.norm(lift_frd, axis=-1, keepdims=True)
    omega_sp_frd = _TILT_GAIN * np.cross([0.0, 0.0, 1.0], down_sp_frd)
    thrust = -lift_frd[..., 2:] * _THRUST / _GRAVITY
    return np.concatenate([omega_sp_frd / np.array(RATE_MAX), 2.0 * thrust - 1.0], axis=-1).astype(np.float32)


class HoverExpert:
    """Flies to the point and stays there, by what a policy sees."""

    def act(self, task: Task) -> None:
        newest = task.buffers.observations.numpy()[:, -task.layout.frame_size :]
        task.buffers.continuous.assign(np.clip(cascade(newest), -1.0, 1.0))
