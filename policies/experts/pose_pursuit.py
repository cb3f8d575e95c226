"""ReachTarget's expert where a pose is asked for: a Reeds-Shepp path, driven piece by piece.

It plans for the middle of the rear axle, which moves along the nose, with bends a little wider than the car can do, and
follows the path by pure pursuit (Coulter 1992), in reverse too, stopping where the direction changes. Where it stops
beside the goal it plans again from there.
"""

from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from policies.experts.expert import NewEpisodes
from policies.experts.reeds_shepp import paths_by_length
from policies.tasks.task import Task

Array = NDArray[np.float64]

_BEND = 1.25  # guess: planned radius over the car's smallest; the rest corrects errors, and slip
_SPACING_M = 0.1
_SPEED_M_S = 7.0  # guess
_SIDE_ACCEL_M_S2 = 3.0  # guess: a third of what the tyres hold
_BRAKE_M_S2 = 1.5  # guess: gentle, so that 0.2 s between decisions do not matter
_RESPONSE_HZ = 3.0  # guess, as in pursuit.py
_MARGIN_M = 1.2  # guess: from the axles' middles to the edge: half the track, 1.25, over the edge tips no wheel yet
_STRAYED_M = 1.0  # guess: further from its path the car plans again
_WORDS_TRIED = 12  # guess: of the words, the shortest first, until one stays on the platform
_PATIENCE = 4  # decisions at a path's end before it is planned again


@dataclass(slots=True)
class _Route:
    """What one row follows."""

    poses: Array  # (n, 3) of the rear axle: x, z, yaw
    directions: NDArray[np.int64]  # (n,)
    at: int = 0  # the pose that was passed last
    idle: int = 0  # decisions spent at the end

    def stop(self) -> int:
        """The last pose before the direction changes."""
        changes = np.flatnonzero(self.directions[self.at + 1 :] != self.directions[min(self.at + 1, self.last)])
        return self.at + int(changes[0]) if len(changes) else self.last

    @property
    def last(self) -> int:
        return len(self.poses) - 1


@dataclass(frozen=True, slots=True)
class _Car:
    """One row's car."""

    rear: Array  # (3,) x, z, yaw of the rear axle's middle
    speed: float  # forwards
    wheelbase: float
    steer_max: float
    accel_max: float
    decel_max: float


class PosePursuitExpert:
    """Drives into the pose."""

    def __init__(self) -> None:
        self._new = NewEpisodes()
        self._routes: dict[int, _Route] = {}

    def act(self, task: Task) -> None:
        """Writes the actions of every row."""
        world: Any = task.world  # type: ignore[attr-defined]
        columns = task.buffers.params.numpy().T.astype(float)
        params = dict(zip(task.param_table.names, columns, strict=True))
        for i in self._new.rows(task):
            self._routes.pop(int(i), None)
        x, y, z, w = world.q.numpy().T.astype(float)
        yaws = np.arctan2(2.0 * (x * z + w * y), 1.0 - 2.0 * (x * x + y * y))
        positions = world.pos.numpy()[:, [0, 2]].astype(float)
        speeds = (world.vel.numpy()[:, [0, 2]] * np.stack([np.sin(yaws), np.cos(yaws)], axis=1)).sum(axis=1)
        mass_m = (params["mass_kg"] + 2.0 * params["wheel_mass_kg"]) * params["wheel_radius_m"] / 4.0
        goals = np.column_stack([world.target.numpy()[:, [0, 2]], world.target_yaw.numpy()]).astype(float)
        actions = np.zeros((task.env_count, 3), dtype=np.float32)
        for i in range(task.env_count):
            half_base = 0.5 * params["wheelbase_m"][i]
            car = _Car(
                rear=_shifted(np.array([*positions[i], yaws[i]]), -half_base),
                speed=float(speeds[i]),
                wheelbase=2.0 * half_base,
                steer_max=float(np.radians(params["steer_max_deg"][i])),
                accel_max=max(float(params["motor_torque_nm"][i] / mass_m[i]), 0.1),
                decel_max=max(float(params["brake_torque_nm"][i] / mass_m[i]), 0.1),
            )
            goal = _shifted(goals[i], -half_base)
            actions[i] = self._driven(i, car, goal, float(params["half_platform_m"][i]) - _MARGIN_M)
        task.buffers.continuous.assign(actions)

    def _driven(self, i: int, car: _Car, goal: Array, room_m: float) -> tuple[float, float, float]:
        """Steering, throttle and brake of a row."""
        route = self._routes.get(i)
        if route is None or _is_lost(route, car):
            route = self._routes[i] = _planned(car, goal, room_m)
        stop = _passed(route, car)
        left_m = float(np.hypot(*(route.poses[stop] - car.rear)[:2])) if stop - route.at <= 5 else 0.0
        left_m = max(left_m, (stop - route.at) * _SPACING_M)
        if stop == route.last and left_m < 2.0 * _SPACING_M:
            route.idle += 1
            return 0.0, 0.0, 1.0
        direction = int(route.directions[min(route.at + 1, route.last)])
        steer = _steering(route, car, stop, direction)
        bend = abs(np.tan(steer * car.steer_max)) / car.wheelbase
        speed = min(
            _SPEED_M_S, float(np.sqrt(_SIDE_ACCEL_M_S2 / max(bend, 1e-3))), float(np.sqrt(2 * _BRAKE_M_S2 * left_m))
        )
        accel = _RESPONSE_HZ * (direction * speed - car.speed)
        if accel * car.speed < 0.0:
            return steer, 0.0, min(abs(accel) / car.decel_max, 1.0)
        return steer, float(np.clip(accel / car.accel_max, -0.6, 0.6)), -1.0


def _shifted(pose: Array, ahead_m: float) -> Array:
    return np.array([pose[0] + ahead_m * np.sin(pose[2]), pose[1] + ahead_m * np.cos(pose[2]), pose[2]])


def _planned(car: _Car, goal: Array, room_m: float) -> _Route:
    """The shortest path that keeps both axles on the platform; if there is none, the shortest."""
    radius_m = _BEND * car.wheelbase / np.tan(car.steer_max)
    shortest: _Route | None = None
    for path in islice(paths_by_length(car.rear, goal, radius_m), _WORDS_TRIED):
        route = _Route(*path.poses(car.rear, _SPACING_M))
        if _is_on_platform(route, car.wheelbase, room_m):
            return route
        shortest = shortest or route
    return shortest or _Route(car.rear[None], np.ones(1, dtype=np.int64))  # of no length: there is no other


def _is_on_platform(route: _Route, wheelbase: float, room_m: float) -> bool:
    nose = np.stack([np.sin(route.poses[:, 2]), np.cos(route.poses[:, 2])], axis=1)
    rear = route.poses[:, :2]
    return bool(np.abs(rear).max() < room_m and np.abs(rear + wheelbase * nose).max() < room_m)


def _is_lost(route: _Route, car: _Car) -> bool:
    """Whether the car stands at the path's end without being there, or has strayed."""
    return route.idle > _PATIENCE or bool(np.hypot(*(route.poses[route.at] - car.rear)[:2]) > _STRAYED_M)


def _passed(route: _Route, car: _Car) -> int:
    """Moves on along the path, past a stop once the car stands there; returns the next stop."""
    stop = route.stop()
    window = route.poses[route.at : min(stop, route.at + 30) + 1, :2]
    route.at += int(np.argmin(np.hypot(*(window - car.rear[:2]).T)))
    if stop < route.last and stop - route.at <= 2 and abs(car.speed) < 0.4:
        route.at = stop
        stop = route.stop()
    return stop


def _steering(route: _Route, car: _Car, stop: int, direction: int) -> float:
    """Towards a point ahead on the path, or beyond its stop in its direction; in fractions of full steering."""
    ahead_m = 1.5 + 0.35 * abs(car.speed)
    k = route.at + round(ahead_m / _SPACING_M)
    aim = route.poses[min(k, stop)]
    if k > stop:
        aim = _shifted(aim, direction * (k - stop) * _SPACING_M)
    gap = (aim - car.rear)[:2]
    right = gap[0] * np.cos(car.rear[2]) - gap[1] * np.sin(car.rear[2])
    curvature = 2.0 * right / max(float(gap @ gap), 0.25)
    return float(np.clip(np.arctan(car.wheelbase * curvature) / car.steer_max, -1.0, 1.0))
