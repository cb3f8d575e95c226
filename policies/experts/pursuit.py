"""ReachTarget's expert: pure pursuit of the target, slow enough for bends and edges, in reverse to turn round.

It steers on the arc that leads through the target (Coulter 1992, CMU-RI-TR-92-01). A target inside the turning circle,
or an edge close ahead, puts it into reverse until the nose has come round. It reads the task's world and numbers.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from policies.experts.expert import NewEpisodes
from policies.tasks.task import Task

Array = NDArray[Any]

_SPEED_M_S = 9.0  # guess: corner to corner, 133 m, in half an episode
_REVERSE_M_S = 4.0  # guess
_SIDE_ACCEL_M_S2 = 5.0  # guess: half of what the tyres hold
_BRAKE_M_S2 = 4.0  # guess: a third of what the brakes do
_MARGIN_M = 0.7  # guess: so far from the edges the wheels stay
_LOOK_AHEAD_M = 12.0  # guess: the nose is turned to a target further away than this within so many metres
_RESPONSE_HZ = 3.0  # guess: speed errors are corrected within a third of a second
_NOSE_ROUND_RAD = 0.9  # guess: reverse ends when the target is this close to dead ahead


@dataclass(frozen=True, slots=True)
class _View:
    """What the expert looks at, one entry per row; metres, radians, seconds."""

    bearing: Array  # of the target, clockwise from the nose
    distance: Array
    speed: Array  # forwards
    room_ahead: Array
    room_behind: Array
    turn_radius: Array  # the smallest
    wheelbase: Array
    steer_max: Array
    reach: Array
    accel_max: Array  # of the motors
    decel_max: Array  # of the brakes


class PursuitExpert:
    """Drives to the target."""

    def __init__(self) -> None:
        self._new = NewEpisodes()
        self._is_reversing: Array = np.zeros(0, dtype=np.bool_)

    def act(self, task: Task) -> None:
        view = _view(task)
        new = self._new.rows(task)
        if len(self._is_reversing) != task.env_count:
            self._is_reversing = np.zeros(task.env_count, dtype=np.bool_)
        self._is_reversing[new] = False
        self._is_reversing = _chosen_gear(view, self._is_reversing)
        curvature = 2.0 * np.sin(view.bearing) / np.clip(view.distance, 0.5, _LOOK_AHEAD_M)
        steer = np.arctan(view.wheelbase * curvature) / view.steer_max
        behind = np.abs(view.bearing) > np.pi / 2
        steer = np.where(behind, np.sign(view.bearing), steer)
        steer = np.clip(np.where(self._is_reversing, -np.sign(view.bearing), steer), -1.0, 1.0)
        accel = _RESPONSE_HZ * (_wanted_speed(view, steer, self._is_reversing) - view.speed)
        is_braking = accel * view.speed < 0.0
        throttle = np.where(is_braking, 0.0, np.clip(accel / view.accel_max, -0.6, 0.6))  # more only spins the wheels
        brake = np.where(is_braking, np.clip(np.abs(accel) / view.decel_max, 0.0, 1.0), -1.0)
        task.buffers.continuous.assign(np.stack([steer, throttle, brake], axis=1).astype(np.float32))


def _view(task: Task) -> _View:
    world: Any = task.world  # type: ignore[attr-defined]
    params = dict(zip(task.param_table.names, task.buffers.params.numpy().T, strict=True))
    x, y, z, w = world.q.numpy().T
    nose = np.stack([2.0 * (x * z + w * y), 1.0 - 2.0 * (x * x + y * y)], axis=1)  # x and z of the car's forward axis
    nose /= np.linalg.norm(nose, axis=1, keepdims=True)
    pos, vel = world.pos.numpy()[:, [0, 2]], world.vel.numpy()[:, [0, 2]]
    away = world.target.numpy()[:, [0, 2]] - pos
    ahead, right = (away * nose).sum(axis=1), away[:, 0] * nose[:, 1] - away[:, 1] * nose[:, 0]
    across = np.abs(nose[:, ::-1])
    wheels = 0.5 * (np.abs(nose) * params["wheelbase_m"][:, None] + across * params["track_m"][:, None])
    edge = params["half_platform_m"][:, None] - wheels - _MARGIN_M
    steer_max = np.radians(params["steer_max_deg"])
    mass_m = (params["mass_kg"] + 2.0 * params["wheel_mass_kg"]) * params["wheel_radius_m"] / 4.0
    return _View(
        bearing=np.arctan2(right, ahead),
        distance=np.hypot(ahead, right),
        speed=(vel * nose).sum(axis=1),
        room_ahead=_room(pos, nose, edge),
        room_behind=_room(pos, -nose, edge),
        turn_radius=1.1 * params["wheelbase_m"] / np.tan(steer_max),  # wheels slip a little
        wheelbase=params["wheelbase_m"],
        steer_max=steer_max,
        reach=params["reach_m"],
        accel_max=np.maximum(params["motor_torque_nm"] / mass_m, 0.1),
        decel_max=np.maximum(params["brake_torque_nm"] / mass_m, 0.1),
    )


def _room(pos: Array, direction: Array, edge: Array) -> Array:
    """How far the centre may go along a direction until it is at the edge, which is given per axis."""
    steps = np.where(np.abs(direction) < 1e-3, 1e-3, direction)
    room: Array = ((edge - pos * np.sign(steps)) / np.abs(steps)).min(axis=1)
    return room


def _chosen_gear(view: _View, is_reversing: Array) -> Array:
    """Whether to reverse; what was chosen before stays until its reason has gone."""
    ahead, right = view.distance * np.cos(view.bearing), view.distance * np.sin(view.bearing)
    to_circle = np.hypot(ahead, np.abs(right) - view.turn_radius)
    is_out_of_reach = to_circle < view.turn_radius - 0.5 * view.reach  # inside the circle of full steering
    is_edge_near = (view.room_ahead < 1.0) & (np.abs(view.bearing) > 0.5)
    begins = is_out_of_reach | is_edge_near
    is_round = (np.abs(view.bearing) < _NOSE_ROUND_RAD) & ~is_out_of_reach
    is_cornered = view.room_behind < 0.5
    return np.where(is_reversing, ~is_round & ~is_cornered, begins & ~is_cornered)


def _wanted_speed(view: _View, steer: Array, is_reversing: Array) -> Array:
    """Forwards positive: what the bend, the edge and the target's bearing allow [m/s]."""
    bend = np.abs(np.tan(steer * view.steer_max)) / view.wheelbase
    speed = np.minimum(_SPEED_M_S, np.sqrt(_SIDE_ACCEL_M_S2 / np.maximum(bend, 1e-3)))
    forwards = np.minimum(speed, np.sqrt(2.0 * _BRAKE_M_S2 * np.maximum(view.room_ahead, 0.0)))
    behind = np.sqrt(2.0 * _BRAKE_M_S2 * np.maximum(view.room_behind, 0.0))
    return np.where(is_reversing, -np.minimum(_REVERSE_M_S, behind), forwards)
