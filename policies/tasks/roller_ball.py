"""RollerBall: a ball is pushed to a cube on a floor without walls, ML-Agents' tutorial task and our smoke test.

Frames are Unity's: x right, z forward, y up, left-handed; the floor is 10 x 10 m with its centre at the origin. One
decision is ten physics steps of 20 ms with the force held. The ball rolls without slip: seven fifths of its mass are
to be accelerated (solid sphere), and what it turns against is the floor's friction, never the air. Whether it is there
is looked at once per decision; the tutorial looks at every physics step.
"""

from typing import Any, ClassVar

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.rng import draw_key
from policies.tasks.episode import FELL, RUNNING, SUCCESS, TIMEOUT, StepBuffers, begin_episode, close_step, open_frame
from policies.tasks.goals import PositionGoal
from policies.tasks.layout import Element, Layout
from policies.tasks.task import Task, TaskSettings
from policies.tasks.task_params import TaskParam, typed_rows
from policies.tasks.top_view import GOAL, VEHICLE, Canvas

wp.set_module_options({"enable_backward": False})

_STEP_S = 0.02
_STEPS = 10
_DT = wp.constant(_STEP_S)
_STEP_COUNT = wp.constant(_STEPS)
_PLACE_STREAM = wp.constant(1)
_SOURCE = "ML-Agents tutorial"


@wp.struct
class RollerBallParams:
    """One row per environment; declared in `PARAMS`."""

    mass_kg: float
    force_n: float
    half_floor_m: float
    half_spawn_m: float
    reach_m: float
    step_limit: float


PARAMS = (
    TaskParam("mass_kg", 1.0, 0.1, 10.0, "kg", "mass of the ball", _SOURCE),
    TaskParam("force_n", 10.0, 0.1, 100.0, "N", "force of an action of 1", _SOURCE),
    TaskParam("half_floor_m", 5.0, 1.0, 100.0, "m", "half the length of the floor's sides", _SOURCE),
    TaskParam("half_spawn_m", 4.0, 0.5, 100.0, "m", "how far from the middle the cube may appear, per axis", _SOURCE),
    TaskParam("reach_m", 1.42, 0.1, 10.0, "m", "distance of the centres at which the cube is reached", _SOURCE),
    TaskParam(
        "step_limit", 500.0, 1.0, 1e6, "1", "decisions until the episode is cut; the tutorial has no limit", "guess"
    ),
)


@wp.struct
class RollerBallState:
    """Where things are; one row per environment."""

    pos: wp.array(dtype=wp.vec3)  # [m] of the ball's centre
    vel: wp.array(dtype=wp.vec3)  # [m/s]
    target: wp.array(dtype=wp.vec3)  # [m]
    params: wp.array(dtype=RollerBallParams)


@wp.func
def rolled(pos: wp.vec3, vel: wp.vec3, force_n: wp.vec3, params: RollerBallParams) -> tuple[wp.vec3, wp.vec3]:
    """Position and velocity one physics step later (semi-implicit Euler, as PhysX integrates)."""
    accel = force_n * (5.0 / (7.0 * params.mass_kg))
    if wp.abs(pos[0]) > params.half_floor_m or wp.abs(pos[2]) > params.half_floor_m:
        accel = force_n / params.mass_kg + wp.vec3(0.0, -9.81, 0.0)  # over the edge
    vel_next = vel + accel * _DT
    return pos + vel_next * _DT, vel_next


@wp.func
def observe(buffers: StepBuffers, state: RollerBallState, i: int) -> None:
    """The eight floats of the tutorial, into the newest frame."""
    at = open_frame(buffers, i)
    for k in range(3):
        buffers.observations[i, at + k] = state.target[i][k]
        buffers.observations[i, at + 3 + k] = state.pos[i][k]
    buffers.observations[i, at + 6] = state.vel[i][0]
    buffers.observations[i, at + 7] = state.vel[i][2]


@wp.func
def place(buffers: StepBuffers, state: RollerBallState, i: int, is_ball_lost: bool) -> None:
    """Begins an episode: the cube elsewhere; the ball stays where it is unless it fell."""
    episode = begin_episode(buffers, i)
    if is_ball_lost:
        state.pos[i] = wp.vec3(0.0, 0.5, 0.0)
        state.vel[i] = wp.vec3(0.0, 0.0, 0.0)
    rng = draw_key(buffers.seed[i], i, episode, _PLACE_STREAM)
    half = state.params[i].half_spawn_m
    x = half * (2.0 * wp.randf(rng) - 1.0)
    z = half * (2.0 * wp.randf(rng) - 1.0)
    state.target[i] = wp.vec3(x, 0.5, z)
    observe(buffers, state, i)


@wp.kernel(enable_backward=False)
def begin(buffers: StepBuffers, is_chosen: wp.array(dtype=wp.bool), state: RollerBallState) -> None:
    """Starts an episode in the chosen rows."""
    i = wp.tid()
    if is_chosen[i]:
        place(buffers, state, i, True)


@wp.kernel(enable_backward=False)
def step(buffers: StepBuffers, state: RollerBallState) -> None:
    """One decision of every row."""
    i = wp.tid()
    params = state.params[i]
    push = wp.vec3(wp.clamp(buffers.continuous[i, 0], -1.0, 1.0), 0.0, wp.clamp(buffers.continuous[i, 1], -1.0, 1.0))
    pos = state.pos[i]
    vel = state.vel[i]
    for _tick in range(_STEP_COUNT):
        pos, vel = rolled(pos, vel, push * params.force_n, params)
    state.pos[i] = pos
    state.vel[i] = vel
    outcome = int(RUNNING)
    if wp.length(pos - state.target[i]) < params.reach_m:
        outcome = SUCCESS
    elif pos[1] < 0.0:
        outcome = FELL
    elif float(buffers.steps[i] + 1) >= params.step_limit:
        outcome = TIMEOUT
    observe(buffers, state, i)
    if close_step(buffers, i, wp.where(outcome == SUCCESS, 1.0, 0.0), outcome):
        place(buffers, state, i, outcome == FELL)


class RollerBall(Task):
    """The task. Layout version 1."""

    params: ClassVar = PARAMS
    decision_s = _STEPS * _STEP_S
    goal = PositionGoal(goal=(0, 1, 2), achieved=(3, 4, 5), radius="reach_m", reward=1.0)

    def __init__(self, settings: TaskSettings, env_count: int, device: str = "cpu") -> None:
        axes = ("x", "y", "z")
        frame = (
            *(Element(f"target_pos_{axis}", "m", is_goal=True) for axis in axes),
            *(Element(f"ball_pos_{axis}", "m") for axis in axes),
            Element("ball_vel_x", "m/s"),
            Element("ball_vel_z", "m/s"),
        )
        push = (Element("force_x", "1"), Element("force_z", "1"))
        layout = Layout("RollerBall", 1, frame, continuous=push, stack=settings.stack or 1)
        super().__init__(layout, env_count, number_defaults={}, device=device)
        state = RollerBallState()
        state.pos = self._zeros("pos", env_count, wp.vec3)
        state.vel = self._zeros("vel", env_count, wp.vec3)
        state.target = self._zeros("target", env_count, wp.vec3)
        state.params = typed_rows(self.buffers.params, RollerBallParams)
        self.world = state
        self._record(begin, step, [state])

    def top_view(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:
        """Floor, cube and ball from above."""
        canvas = Canvas((-6.0, 6.0), (-6.0, 6.0), height_px)
        half = float(self.buffers.params.numpy()[i_env, self.param_table.names.index("half_floor_m")])
        canvas.box((0.0, 0.0), (2.0 * half, 2.0 * half), 0.0, (255, 255, 255))
        target: Any = self.world.target.numpy()[i_env]
        ball: Any = self.world.pos.numpy()[i_env]
        canvas.box((target[0], target[2]), (1.0, 1.0), 0.0, GOAL)
        canvas.disc((ball[0], ball[2]), 0.5, VEHICLE)
        return canvas.pixels
