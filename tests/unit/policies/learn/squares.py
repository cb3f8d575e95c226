"""A task that is seen in an image: a square is to be pointed at, or away from it, as the only float says.

Red, green and blue of pixel (0, 0) are row, episode and decision, so that an image tells where it belongs.
"""

import warp as wp

from common.rng import draw_key
from policies.tasks.episode import RUNNING, TIMEOUT, StepBuffers, begin_episode, close_step, open_frame
from policies.tasks.layout import Element, ImageElement, Layout
from policies.tasks.task import Task
from policies.tasks.task_params import TaskParam, typed_rows

SIDE = 32  # [px]
HALF = wp.constant(4)  # [px] half a side of the square


@wp.struct
class SquaresParams:
    length: float


@wp.struct
class SquaresState:
    place: wp.array(dtype=float)  # of the square, -1 (left edge) to 1
    side: wp.array(dtype=float)  # 1: point at it, -1: away from it
    params: wp.array(dtype=SquaresParams)


@wp.func
def show(buffers: StepBuffers, state: SquaresState, i: int):
    """Puts the square somewhere, and shows it."""
    key = draw_key(buffers.seed[i], i, 100 * buffers.episodes[i] + buffers.steps[i], 1)
    state.place[i] = wp.randf(key, -0.75, 0.75)
    state.side[i] = wp.where(wp.randf(key) < 0.5, 1.0, -1.0)
    buffers.observations[i, open_frame(buffers, i)] = state.side[i]
    if buffers.privileged.shape[1] > 0:
        buffers.privileged[i, 0] = state.place[i]
    size = buffers.images.shape[2]
    middle = int(0.5 * (1.0 + state.place[i]) * float(size))
    for y in range(buffers.images.shape[1]):
        for x in range(size):
            is_inside = wp.abs(y - size // 2) <= HALF and wp.abs(x - middle) <= HALF
            buffers.images[i, y, x, 0] = wp.uint8(wp.where(is_inside, 250, 20))
            buffers.images[i, y, x, 1] = wp.uint8(60)
            buffers.images[i, y, x, 2] = wp.uint8(wp.where(is_inside, 30, 120))
    buffers.images[i, 0, 0, 0] = wp.uint8(i)
    buffers.images[i, 0, 0, 1] = wp.uint8(buffers.episodes[i])
    buffers.images[i, 0, 0, 2] = wp.uint8(buffers.steps[i])


@wp.kernel(enable_backward=False)
def begin(buffers: StepBuffers, is_chosen: wp.array(dtype=wp.bool), state: SquaresState):
    i = wp.tid()
    if is_chosen[i]:
        begin_episode(buffers, i)
        show(buffers, state, i)


@wp.kernel(enable_backward=False)
def step(buffers: StepBuffers, state: SquaresState):
    i = wp.tid()
    reward = -wp.abs(buffers.continuous[i, 0] - state.place[i] * state.side[i])
    is_over = float(buffers.steps[i] + 1) >= state.params[i].length
    buffers.steps[i] += 1
    show(buffers, state, i)
    buffers.steps[i] -= 1
    close_step(buffers, i, reward, wp.where(is_over, TIMEOUT, RUNNING))


@wp.kernel(enable_backward=False)
def begin_ended(buffers: StepBuffers, state: SquaresState):
    i = wp.tid()
    if buffers.outcomes[i] != RUNNING:
        begin_episode(buffers, i)
        show(buffers, state, i)


class Squares(Task):
    """Each decision costs its distance from where the square is, or from the opposite side."""

    params = (TaskParam("length", 4.0, 1.0, 100.0, "1", "decisions of an episode", "guess"),)
    decision_s = 0.1

    def __init__(self, env_count, *, has_privileged=True, side=SIDE):
        layout = Layout(
            "Squares",
            1,
            (Element("side", "1", is_goal=True),),
            continuous=(Element("point", "1"),),
            image=ImageElement(side, side, ("red", "green", "blue")),
            privileged=(Element("place", "1"),) if has_privileged else (),
        )
        super().__init__(layout, env_count, number_defaults={})
        state = SquaresState()
        state.place = self._zeros("place", env_count, float)
        state.side = self._zeros("side", env_count, float)
        state.params = typed_rows(self.buffers.params, SquaresParams)
        self.world = state
        self._record(begin, step, [state])
        self._begin_ended = wp.launch(begin_ended, env_count, [self.buffers, state], record_cmd=True)

    def step(self):
        super().step()
        self.keep_last_images()
        self._begin_ended.launch()
