"""A task that takes eyes and a memory: a bright square is shown in an episode's first image only, then the dark.

Each decision costs its distance from where the square was; where that is, a teacher is told all along.
"""

import torch
import warp as wp

from common.rng import draw_key
from policies.learn.config.network import NetworkSettings
from policies.learn.networks.action_distributions import CLIP
from policies.learn.networks.policy import Policy
from policies.tasks.episode import RUNNING, TIMEOUT, StepBuffers, begin_episode, close_step
from policies.tasks.layout import Element, ImageElement, Layout
from policies.tasks.task import Task
from policies.tasks.task_params import TaskParam, typed_rows

SIDE = 20  # [px]
POINT = (Element("point", "1"),)
PRIVILEGED = (Element("place", "1"), Element("is_shown", "1"))


@wp.struct
class GlimpsesParams:
    length: float


@wp.struct
class GlimpsesState:
    place: wp.array(dtype=float)  # of the square, -1 (left edge) to 1
    params: wp.array(dtype=GlimpsesParams)


@wp.func
def show(buffers: StepBuffers, state: GlimpsesState, i: int, step: int):
    """The square in the first image, nothing later."""
    buffers.observations[i, 0] = 1.0
    buffers.privileged[i, 0] = state.place[i]
    buffers.privileged[i, 1] = wp.where(step == 0, 1.0, 0.0)
    size = buffers.images.shape[2]
    middle = int(0.5 * (1.0 + state.place[i]) * float(size))
    for y in range(buffers.images.shape[1]):
        for x in range(size):
            is_bright = step == 0 and wp.abs(x - middle) <= 2
            for c in range(buffers.images.shape[3]):
                buffers.images[i, y, x, c] = wp.uint8(wp.where(is_bright, 250, 20))


@wp.func
def start(buffers: StepBuffers, state: GlimpsesState, i: int):
    episode = begin_episode(buffers, i)
    state.place[i] = wp.randf(draw_key(buffers.seed[i], i, episode, 1), -0.8, 0.8)
    show(buffers, state, i, 0)


@wp.kernel(enable_backward=False)
def begin(buffers: StepBuffers, is_chosen: wp.array(dtype=wp.bool), state: GlimpsesState):
    i = wp.tid()
    if is_chosen[i]:
        start(buffers, state, i)


@wp.kernel(enable_backward=False)
def step(buffers: StepBuffers, state: GlimpsesState):
    i = wp.tid()
    reward = -wp.abs(buffers.continuous[i, 0] - state.place[i])
    count = buffers.steps[i] + 1
    show(buffers, state, i, count)
    if close_step(buffers, i, reward, wp.where(float(count) >= state.params[i].length, TIMEOUT, RUNNING)):
        start(buffers, state, i)


class Glimpses(Task):
    """Episodes of a few decisions. Final images are not kept: nothing here looks at them."""

    params = (TaskParam("length", 4.0, 1.0, 100.0, "1", "decisions of an episode", "guess"),)
    decision_s = 0.1

    def __init__(self, env_count, *, privileged=PRIVILEGED):
        image = ImageElement(SIDE, SIDE, ("red", "green", "blue"))
        frame = (Element("one", "1"),)
        layout = Layout("Glimpses", 1, frame, continuous=POINT, image=image, privileged=privileged)
        super().__init__(layout, env_count, number_defaults={})
        state = GlimpsesState()
        state.place = self._zeros("place", env_count, float)
        state.params = typed_rows(self.buffers.params, GlimpsesParams)
        self.world = state
        self._record(begin, step, [state])


def teacher_policy(frame=PRIVILEGED, *, gain=1.0):
    """What points `gain` times where the square is: swish(x) - swish(-x) = x makes it exact."""
    policy = Policy(
        Layout("Glimpses", 1, frame, continuous=POINT),
        NetworkSettings(hidden_units=2, num_layers=1),
        torch.Generator().manual_seed(0),
    )
    with torch.no_grad():
        policy.body.layers[0].weight.copy_(torch.tensor([[1.0, 0.0], [-1.0, 0.0]]))
        policy.body.layers[0].bias.zero_()
        policy.heads.mean.weight.copy_(CLIP * gain * torch.tensor([[1.0, -1.0]]))
        policy.heads.mean.bias.zero_()
    return policy
