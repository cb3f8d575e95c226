"""Hover: stay at a point two metres above home, by body rates and collective thrust, on the estimate alone.

In: an action at 50 Hz, held over five ticks. Out: an observation made from the flight controller's `Estimate`, and a
reward and an end made from the truth, as the teacher sees it. One vehicle (`HoverEnv`) and a batch (`HoverVectorEnv`)
run the same kernels. An episode starts from one of a bank of hovers flown once per process from power-on, so that
every estimator has converged, and flies on with noise of its own.
"""

from functools import cache
from typing import Any

import gymnasium
import numpy as np
import warp as wp
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from autopilot.params import parameter_table
from autopilot.ports import SETPOINT_RATE, Setpoint
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import FRAME_TICKS, TICK_S
from sim.advance import RigArrays
from sim.hovering import Hover, fly_to_hover
from sim.restore import RowRestore
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.wind import wind_model
from sim.world.world import build_world

wp.set_module_options({"enable_backward": False})

Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]

HOVER_NED = wp.constant(wp.vec3(0.0, 0.0, -2.0))  # [m]
BALL_M = wp.constant(3.0)  # farther away the episode ends
RATE_MAX = wp.constant(wp.vec3(3.0, 3.0, 2.0))  # [rad/s] of an action of 1
_RATE_COST = wp.constant(0.1)  # guess: reward lost at 1 rad/s

EPISODE_STEPS = 500  # 10 s
STEP_S = FRAME_TICKS * TICK_S
START_COUNT = 64  # hovers in the bank
_START_SPREAD_M = 0.5  # of the places they hover at, per axis

OBSERVATION_SIZE = 16
"""To the hover point [m] 0-2, velocity [m/s] 3-5, down 6-8, rate [rad/s] 9-11, all in frd; last action 12-15."""


@wp.func
def rate_setpoint(action: wp.vec4) -> Setpoint:
    """Body rates and collective thrust from an action in [-1, 1]: roll, pitch, yaw rate, thrust (-1 is none)."""
    setpoint = Setpoint()
    setpoint.kind = SETPOINT_RATE
    setpoint.is_armed = 1
    setpoint.omega_frd = wp.cw_mul(wp.vec3(action[0], action[1], action[2]), RATE_MAX)
    setpoint.thrust = 0.5 * (action[3] + 1.0)
    return setpoint


@wp.kernel(enable_backward=False)
def act(actions: wp.array(dtype=wp.vec4), setpoints: wp.array(dtype=Setpoint)) -> None:
    """Turns actions into setpoints."""
    i = wp.tid()
    setpoints[i] = rate_setpoint(actions[i])


@wp.kernel(enable_backward=False)
def observe(rig: RigArrays, actions: wp.array(dtype=wp.vec4), observations: wp.array2d(dtype=float)) -> None:
    """What the policy may know: the estimate and its own last action."""
    i = wp.tid()
    estimate = rig.autopilot.ekf.rows[i].estimate
    q = estimate.q_ned_from_frd
    to_go_frd = wp.quat_rotate_inv(q, HOVER_NED - estimate.pos_ned)
    vel_frd = wp.quat_rotate_inv(q, estimate.vel_ned)
    down_frd = wp.quat_rotate_inv(q, wp.vec3(0.0, 0.0, 1.0))
    for k in range(3):
        observations[i, k] = to_go_frd[k]
        observations[i, 3 + k] = vel_frd[k]
        observations[i, 6 + k] = down_frd[k]
        observations[i, 9 + k] = estimate.omega_frd[k]
    for k in range(4):
        observations[i, 12 + k] = actions[i][k]


@wp.kernel(enable_backward=False)
def judge(rig: RigArrays, rewards: wp.array(dtype=float), is_lost: wp.array(dtype=wp.bool)) -> None:
    """How well the vehicle stays at the point, 1 at best, and whether it left the ball or touched the ground."""
    i = wp.tid()
    truth = rig.truth[i]
    distance = wp.length(truth.pos_ned - HOVER_NED)
    rewards[i] = 1.0 - distance / BALL_M - _RATE_COST * wp.length(truth.omega_frd)
    is_lost[i] = distance > BALL_M or truth.is_on_ground == 1 or truth.is_crashed == 1


class HoverBatch:
    """Vehicles that hover, and what their policies see. The arrays are live views."""

    def __init__(self, vehicle_count: int) -> None:
        self.rig = _rig(vehicle_count, 0)
        actions = wp.zeros(vehicle_count, dtype=wp.vec4)
        observations = wp.zeros((vehicle_count, OBSERVATION_SIZE), dtype=float)
        rewards = wp.zeros(vehicle_count, dtype=float)
        is_lost = wp.zeros(vehicle_count, dtype=wp.bool)
        self.actions: Floats = actions.numpy()
        self.observations: Floats = observations.numpy()
        self.rewards: Floats = rewards.numpy()
        self.is_lost: Flags = is_lost.numpy()
        self.step_counts = np.zeros(vehicle_count, dtype=np.int64)
        arrays = self.rig.arrays
        self._act = _recorded(act, vehicle_count, [actions, self.rig.setpoints])
        self._observe = _recorded(observe, vehicle_count, [arrays, actions, observations])
        self._judge = _recorded(judge, vehicle_count, [arrays, rewards, is_lost])
        sources, seeds = wp.zeros(vehicle_count, dtype=int), wp.zeros(vehicle_count, dtype=int)
        is_chosen = wp.zeros(vehicle_count, dtype=wp.bool)
        self._sources, self._seeds, self._is_chosen = sources.numpy(), seeds.numpy(), is_chosen.numpy()
        self._restore = RowRestore(self.rig, _bank(), sources, is_chosen, seeds)

    def reset(self, rows: NDArray[np.int64], rng: np.random.Generator) -> None:
        """Starts episodes: chosen vehicles, shape (n,), from hovers drawn at random."""
        draws = rng.integers([START_COUNT, 2**31], size=(rows.size, 2))  # by row: a batch's first is a single vehicle's
        self._sources[rows], self._seeds[rows] = draws[:, 0], draws[:, 1]
        self._is_chosen[:] = False
        self._is_chosen[rows] = True
        self._restore.launch()
        self.actions[rows] = 0.0
        self.step_counts[rows] = 0
        self._observe.launch()

    def step(self, actions: Floats) -> None:
        """Flies 20 ms with the actions, shape (vehicles, 4) or, of a single vehicle, (4,)."""
        np.clip(actions, -1.0, 1.0, out=self.actions)
        self._act.launch()
        self.rig.advance(FRAME_TICKS)
        self._observe.launch()
        self._judge.launch()
        self.step_counts += 1


class HoverEnv(gymnasium.Env[Floats, Floats]):
    """One vehicle."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  (as Gymnasium declares it)

    def __init__(self) -> None:
        self.observation_space = _observation_space()
        self.action_space = _action_space()
        self._batch = HoverBatch(1)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Starts an episode; `options` are not used."""
        super().reset(seed=seed, options=options)
        self._batch.reset(np.zeros(1, dtype=np.int64), self.np_random)
        return self._batch.observations[0].copy(), {}

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Flies 20 ms."""
        batch = self._batch
        batch.step(action)
        is_truncated = bool(batch.step_counts[0] >= EPISODE_STEPS)
        return batch.observations[0].copy(), float(batch.rewards[0]), bool(batch.is_lost[0]), is_truncated, {}


class HoverVectorEnv(VectorEnv[Floats, Floats, NDArray[Any]]):
    """Many vehicles in one launch. An episode that ends is followed by the next in the same step."""

    metadata: dict[str, Any] = {  # noqa: RUF012  (as Gymnasium declares it)
        "render_modes": [],
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(self, num_envs: int = 1) -> None:
        self.num_envs = num_envs
        self.single_observation_space = _observation_space()
        self.single_action_space = _action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._batch = HoverBatch(num_envs)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Starts an episode of every vehicle; `options` are not used."""
        super().reset(seed=seed, options=options)
        self._batch.reset(np.arange(self.num_envs), self.np_random)
        return self._batch.observations.copy(), {}

    def step(self, actions: Floats) -> tuple[Floats, Floats, Flags, Flags, dict[str, Any]]:
        """Flies 20 ms; `final_obs` of the info holds what the ended episodes saw last."""
        batch = self._batch
        batch.step(actions)
        rewards = batch.rewards.copy()
        is_lost = batch.is_lost.copy()
        is_truncated = batch.step_counts >= EPISODE_STEPS
        is_over = is_lost | is_truncated
        info: dict[str, Any] = {}
        if is_over.any():
            info = {"final_obs": batch.observations.copy(), "_final_obs": is_over}
            batch.reset(np.flatnonzero(is_over), self.np_random)
        return batch.observations.copy(), rewards, is_lost, is_truncated, info


def _observation_space() -> Any:
    return Box(-np.inf, np.inf, shape=(OBSERVATION_SIZE,), dtype=np.float32)


def _action_space() -> Any:
    return Box(-1.0, 1.0, shape=(4,), dtype=np.float32)


def _rig(vehicle_count: int, seed: int) -> Rig:
    rig = Rig(
        load_airframe("x500"),
        build_world(),
        sensor_model(home=DEFAULT_HOME),
        wind_model(0.0),
        home=DEFAULT_HOME,
        vehicle_count=vehicle_count,
        seed=seed,
    )
    rig.load_parameters(parameter_table())
    return rig


def _recorded(kernel: Any, vehicle_count: int, inputs: list[Any]) -> Any:
    return wp.launch(kernel, dim=vehicle_count, inputs=inputs, record_cmd=True)


@cache
def _bank() -> Rig:
    """Vehicles that hover near the point, flown there from power-on by the flight controller itself."""
    rig = _rig(START_COUNT, 0)
    rng = np.random.default_rng(0)
    hovers: list[Hover] = []
    for _ in range(START_COUNT):
        north, east, down = np.array(HOVER_NED) + rng.uniform(-_START_SPREAD_M, _START_SPREAD_M, 3)
        hovers.append(((north, east, down), rng.uniform(-np.pi, np.pi)))
    fly_to_hover(rig, hovers)
    return rig
