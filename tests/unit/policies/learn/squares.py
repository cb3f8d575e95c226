"""A task that is seen in an image: a square is to be pointed at, or away from it, as the only float says.

Red, green and blue of pixel (0, 0) are row, episode and decision, so that an image tells where it belongs.
"""

import warp as wp

from common.rng import draw_key
from policies.tasks.episode import RUNNING, TIMEOUT, Border, begin_episode, close_step, open_frame
from policies.tasks.layout import Element, ImageElement, Layout
from policies.tasks.task import Task
from policies.tasks.task_params import Number, typed_rows

SIDE = 32  # [px]
HALF = wp.constant(4)  # [px] half a side of the square


@wp.struct
class SquaresNumbers:
    length: float


@wp.struct
class SquaresState:
    place: wp.array(dtype=float)  # of the square, -1 (left edge) to 1
    side: wp.array(dtype=float)  # 1: point at it, -1: away from it
    numbers: wp.array(dtype=SquaresNumbers)


@wp.func
def show(border: Border, state: SquaresState, i: int):
    """Puts the square somewhere, and shows it."""
    key = draw_key(border.seed[0], i, 100 * border.episodes[i] + border.steps[i], 1)
    state.place[i] = wp.randf(key, -0.75, 0.75)
    state.side[i] = wp.where(wp.randf(key) < 0.5, 1.0, -1.0)
    border.observations[i, open_frame(border, i)] = state.side[i]
    if border.privileged.shape[1] > 0:
        border.privileged[i, 0] = state.place[i]
    size = border.images.shape[2]
    middle = int(0.5 * (1.0 + state.place[i]) * float(size))
    for y in range(border.images.shape[1]):
        for x in range(size):
            is_inside = wp.abs(y - size // 2) <= HALF and wp.abs(x - middle) <= HALF
            border.images[i, y, x, 0] = wp.uint8(wp.where(is_inside, 250, 20))
            border.images[i, y, x, 1] = wp.uint8(60)
            border.images[i, y, x, 2] = wp.uint8(wp.where(is_inside, 30, 120))
    border.images[i, 0, 0, 0] = wp.uint8(i)
    border.images[i, 0, 0, 1] = wp.uint8(border.episodes[i])
    border.images[i, 0, 0, 2] = wp.uint8(border.steps[i])


@wp.kernel(enable_backward=False)
def begin(border: Border, is_chosen: wp.array(dtype=wp.bool), state: SquaresState):
    i = wp.tid()
    if is_chosen[i]:
        begin_episode(border, i)
        show(border, state, i)


@wp.kernel(enable_backward=False)
def step(border: Border, state: SquaresState):
    i = wp.tid()
    reward = -wp.abs(border.continuous[i, 0] - state.place[i] * state.side[i])
    is_over = float(border.steps[i] + 1) >= state.numbers[i].length
    border.steps[i] += 1
    show(border, state, i)
    border.steps[i] -= 1
    close_step(border, i, reward, wp.where(is_over, TIMEOUT, RUNNING))


@wp.kernel(enable_backward=False)
def begin_ended(border: Border, state: SquaresState):
    i = wp.tid()
    if border.outcomes[i] != RUNNING:
        begin_episode(border, i)
        show(border, state, i)


class Squares(Task):
    """Each decision costs its distance from where the square is, or from the opposite side."""

    numbers = (Number("length", 4.0, 1.0, 100.0, "1", "decisions of an episode", "guess"),)
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
        state.numbers = typed_rows(self.border.numbers, SquaresNumbers)
        self.world = state
        self._record(begin, step, [state])
        self._begin_ended = wp.launch(begin_ended, env_count, [self.border, state], record_cmd=True)

    def step(self):
        super().step()
        self.keep_last_images()
        self._begin_ended.launch()
