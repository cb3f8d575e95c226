"""How much faster than PyFlyt does the hover task step through Gymnasium, one vehicle, in the same run?

A cascade by hand (of ours the task's expert) flies an episode of ten seconds of each environment; then the recorded
actions are stepped again, against the clock. PyFlyt steps rigid-body physics at 240 Hz for 40 actions a second and lets
its policy see the truth; ours steps at 1,000 Hz, with sensors and an estimator, for 50 actions a second.
"""

import os
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import gymnasium
import numpy as np

import policies  # noqa: F401  (registers the task)
from bench.row import Row, best_of, require
from policies.experts.hover import cascade
from policies.tasks.hover.hover import Hover

Array = np.ndarray[Any, Any]

SECONDS = 10.0
PEER = "PyFlyt/QuadX-Hover"
PEER_STEP_S = 1.0 / 40.0
PEER_POINT = np.array([0.0, 0.0, 1.0])
GRAVITY = 9.81
PEER_THRUST = 0.35
COMMAND = "python -m bench hover"


def measure() -> list[Row]:
    ours = gymnasium.make("honeyguide/Hover-v0")
    rate = _rate(ours, cascade, Hover.decision_s, lambda observation: float(np.linalg.norm(observation[:3])))
    reset_ms = 1e3 * best_of(20, lambda: _seconds(ours.reset))
    with _quiet():
        peer_rate = _rate(
            _peer(),
            peer_action,
            PEER_STEP_S,
            lambda observation: float(np.linalg.norm(observation[10:13] - PEER_POINT)),
        )
    name = "hover task through Gymnasium, one vehicle"
    return [
        Row(name, rate, "simulated s/s", "higher", None, COMMAND),
        Row(f"{name}: {PEER}", peer_rate, "simulated s/s", "higher", None, COMMAND),
        Row(f"{name}: ours over PyFlyt", rate / peer_rate, "x", "higher", 10.0, COMMAND),
        Row(f"{name}: reset", reset_ms, "ms", "lower", 10.0, COMMAND),
    ]


def peer_action(observation: Array) -> Array:
    """As ours, for PyFlyt, whose world is z-up; its observation: rate, quaternion xyzw, velocity (body), position."""
    x, y, z, w = observation[3:7]
    world_from_body = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    to_go = world_from_body.T @ (PEER_POINT - observation[10:13])
    up = world_from_body.T @ np.array([0.0, 0.0, 1.0])
    lift = np.clip(1.5 * to_go - 2.0 * observation[7:10], -3.0, 3.0) + GRAVITY * up
    omega = 6.0 * np.cross([0.0, 0.0, 1.0], lift / np.linalg.norm(lift))
    thrust = float(lift[2]) * PEER_THRUST / GRAVITY
    return np.append(omega, np.clip(thrust, 0.0, 0.8))


def _rate(env: Any, policy: Callable[[Array], Array], step_s: float, distance: Callable[[Array], float]) -> float:
    """Simulated seconds per CPU second, stepping an episode known to hover."""
    actions: list[Array] = []
    observation, _ = env.reset(seed=0)
    for _ in range(round(SECONDS / step_s) - 1):
        actions.append(policy(observation))
        observation, _, is_terminated, is_truncated, _ = env.step(actions[-1])
        require(not is_terminated and not is_truncated, f"{env.spec.id}: the episode ended early")
    require(distance(observation) < 0.3, f"{env.spec.id}: {distance(observation):.2f} m from the point at the end")

    def replay_s() -> float:
        env.reset(seed=0)
        start = time.process_time()
        for action in actions:
            result = env.step(action)
        spent = time.process_time() - start
        require(np.array_equal(result[0], observation), f"{env.spec.id}: the replay went elsewhere")
        return spent

    return len(actions) * step_s / best_of(5, replay_s)


def _seconds(function: Callable[[], Any]) -> float:
    start = time.process_time()
    function()
    return time.process_time() - start


def _peer() -> Any:
    """PyFlyt's hover task, in the version that is installed."""
    import PyFlyt.gym_envs  # noqa: F401  (registers its tasks)

    return gymnasium.make(max(name for name in gymnasium.registry if name.startswith(PEER)))


@contextmanager
def _quiet() -> Iterator[None]:
    """PyBullet prints on every reset, from C."""
    kept = os.dup(1)
    sink = os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        os.dup2(kept, 1)
        os.close(sink)
        os.close(kept)
