"""A task whose best policy is known: a sign says which choice of each branch pays, and where to point."""

import warp as wp

from common.rng import draw_key
from policies.tasks.episode import SUCCESS, StepBuffers, begin_episode, close_step, open_frame
from policies.tasks.layout import Branch, Element, Layout
from policies.tasks.task import Task
from policies.tasks.task_params import TaskParam, typed_rows

SIZES = (3, 2)


@wp.struct
class SignsParams:
    pay: float


@wp.struct
class SignsState:
    sign: wp.array(dtype=wp.vec3)
    params: wp.array(dtype=SignsParams)


@wp.func
def show(buffers: StepBuffers, state: SignsState, i: int):
    """A new episode of one decision, and its sign."""
    episode = begin_episode(buffers, i)
    rng = draw_key(buffers.seed[i], i, episode, 1)
    state.sign[i] = wp.vec3(float(wp.randi(rng, 0, 3)), float(wp.randi(rng, 0, 2)), wp.randf(rng, -0.8, 0.8))
    at = open_frame(buffers, i)
    for k in range(3):
        buffers.observations[i, at + k] = state.sign[i][k]


@wp.kernel(enable_backward=False)
def begin(buffers: StepBuffers, is_chosen: wp.array(dtype=wp.bool), state: SignsState):
    i = wp.tid()
    if is_chosen[i]:
        show(buffers, state, i)


@wp.kernel(enable_backward=False)
def step(buffers: StepBuffers, state: SignsState):
    i = wp.tid()
    sign = state.sign[i]
    reward = float(0.0)
    for k in range(buffers.branches.shape[1]):
        if buffers.branches[i, k] == int(sign[k]):
            reward += 0.5
    if buffers.continuous.shape[1] > 0:
        reward -= wp.abs(buffers.continuous[i, 0] - sign[2])
    if close_step(buffers, i, reward * state.params[i].pay, SUCCESS):
        show(buffers, state, i)


class Signs(Task):
    """One decision per episode; right choices of both branches pay 1, pointing wrong costs its distance."""

    params = (TaskParam("pay", 1.0, 0.0, 10.0, "1", "factor of all rewards", "guess"),)
    decision_s = 1.0

    def __init__(self, env_count, branches=SIZES, is_pointing=False):
        layout = Layout(
            "Signs",
            1,
            tuple(Element(f"sign_{k}", "1") for k in range(3)),
            continuous=(Element("point", "1"),) if is_pointing else (),
            branches=tuple(Branch(f"branch_{size}", tuple("abc"[:size])) for size in branches),
        )
        super().__init__(layout, env_count, number_defaults={})
        state = SignsState()
        state.sign = self._zeros("sign", env_count, wp.vec3)
        state.params = typed_rows(self.buffers.params, SignsParams)
        self._record(begin, step, [state])
