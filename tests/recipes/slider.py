"""A learning task, as CONTRIBUTING.md tells to add one: a cart on a rail is pushed to a mark and stopped there."""

from typing import ClassVar

import warp as wp

from common.rng import draw_key
from policies.tasks.episode import RUNNING, SUCCESS, TIMEOUT, StepBuffers, begin_episode, close_step, open_frame
from policies.tasks.layout import Element, Layout
from policies.tasks.task import Task, TaskSettings
from policies.tasks.task_params import TaskParam, typed_rows

wp.set_module_options({"enable_backward": False})

DECISION_S = 0.1
_DT = wp.constant(DECISION_S)
_PLACE_STREAM = wp.constant(1)


@wp.struct
class SliderParams:
    """One row per environment; declared in `PARAMS`."""

    half_rail_m: float
    accel_m_s2: float
    step_limit: float


PARAMS = (
    TaskParam("half_rail_m", 2.0, 0.5, 10.0, "m", "how far from the middle marks are drawn", "guess"),
    TaskParam("accel_m_s2", 4.0, 0.1, 50.0, "m/s²", "acceleration of an action of 1", "guess"),
    TaskParam("step_limit", 100.0, 1.0, 1e6, "1", "decisions until the episode is cut", "guess"),
)


@wp.struct
class SliderState:
    """One row per environment."""

    pos: wp.array(dtype=float)  # [m] of the cart
    vel: wp.array(dtype=float)  # [m/s]
    mark: wp.array(dtype=float)  # [m]
    params: wp.array(dtype=SliderParams)


@wp.func
def observe(buffers: StepBuffers, state: SliderState, i: int):
    at = open_frame(buffers, i)
    buffers.observations[i, at] = state.mark[i] - state.pos[i]
    buffers.observations[i, at + 1] = state.vel[i]


@wp.func
def place(buffers: StepBuffers, state: SliderState, i: int):
    """Begins an episode: the cart in the middle, the mark elsewhere."""
    episode = begin_episode(buffers, i)
    rng = draw_key(buffers.seed[i], i, episode, _PLACE_STREAM)
    state.pos[i] = 0.0
    state.vel[i] = 0.0
    state.mark[i] = state.params[i].half_rail_m * (2.0 * wp.randf(rng) - 1.0)
    observe(buffers, state, i)


@wp.kernel(enable_backward=False)
def begin(buffers: StepBuffers, is_chosen: wp.array(dtype=wp.bool), state: SliderState):
    i = wp.tid()
    if is_chosen[i]:
        place(buffers, state, i)


@wp.kernel(enable_backward=False)
def step(buffers: StepBuffers, state: SliderState):
    i = wp.tid()
    params = state.params[i]
    push = wp.clamp(buffers.continuous[i, 0], -1.0, 1.0)
    state.vel[i] = state.vel[i] + push * params.accel_m_s2 * _DT
    state.pos[i] = state.pos[i] + state.vel[i] * _DT
    outcome = int(RUNNING)
    if wp.abs(state.mark[i] - state.pos[i]) < 0.1 and wp.abs(state.vel[i]) < 0.5:
        outcome = SUCCESS
    elif float(buffers.steps[i] + 1) >= params.step_limit:
        outcome = TIMEOUT
    observe(buffers, state, i)
    if close_step(buffers, i, wp.where(outcome == SUCCESS, 1.0, -0.01), outcome):
        place(buffers, state, i)


class Slider(Task):
    """The task. Layout version 1."""

    params: ClassVar = PARAMS
    decision_s = DECISION_S

    def __init__(self, settings: TaskSettings, env_count: int, device: str = "cpu") -> None:
        frame = (Element("mark_pos_x", "m", is_goal=True), Element("vel_x", "m/s"))
        layout = Layout("Slider", 1, frame, continuous=(Element("push_x", "1"),), stack=settings.stack or 1)
        super().__init__(layout, env_count, number_defaults={}, device=device)
        state = SliderState()
        state.pos = self._zeros("pos", env_count, float)
        state.vel = self._zeros("vel", env_count, float)
        state.mark = self._zeros("mark", env_count, float)
        state.params = typed_rows(self.buffers.params, SliderParams)
        self._record(begin, step, [state])
