"""What every task's kernel shares: the buffers exchanged with the learner, and the book-keeping of steps and episodes.

A task's step kernel, one thread per environment, reads its action from the buffers, moves the world, and then:

    at = open_frame(buffers, i)                       # older frames shift; the newest is written from column `at`
    ... buffers.observations[i, at + k] = ...
    if close_step(buffers, i, reward, outcome):       # the episode ended: what it saw last is kept, a new one begins
        begin_episode(buffers, i)                     # draws the numbers of the new episode
        ... place the vehicle, write the first frame

so that one launch is one decision of all environments, resets included (Gymnasium's same-step auto-reset). A task that
shows images has launches of its own: it moves and draws what came of it, judges (`close_step`), calls
`Task.keep_last_images`, begins the episodes that follow, and draws those.
"""

from enum import IntEnum

import warp as wp

from policies.tasks.task_params import draw_params

wp.set_module_options({"enable_backward": False})


class Outcome(IntEnum):
    """How an episode ended."""

    RUNNING = 0
    SUCCESS = 1
    TIMEOUT = 2  # a truncation
    HIT_WALL = 3
    HIT_OBSTACLE = 4
    FELL = 5
    HIT_OTHER = 6  # rolled over, struck an edge, came too near a person
    LOST = 7  # what was to be followed
    ENDED = 8  # by an outside environment, which does not say how


RUNNING = wp.constant(int(Outcome.RUNNING))
SUCCESS = wp.constant(int(Outcome.SUCCESS))
TIMEOUT = wp.constant(int(Outcome.TIMEOUT))
HIT_WALL = wp.constant(int(Outcome.HIT_WALL))
HIT_OBSTACLE = wp.constant(int(Outcome.HIT_OBSTACLE))
FELL = wp.constant(int(Outcome.FELL))
HIT_OTHER = wp.constant(int(Outcome.HIT_OTHER))
LOST = wp.constant(int(Outcome.LOST))

OUTCOME_COUNT = len(Outcome)
SCORE_COLUMNS = OUTCOME_COUNT + 2  # episodes by outcome, then the sums of their returns and of their lengths
_RETURN_SCORE = wp.constant(OUTCOME_COUNT)
_LENGTH_SCORE = wp.constant(OUTCOME_COUNT + 1)


@wp.struct
class StepBuffers:
    """What learner and task exchange; one row per environment."""

    continuous: wp.array2d(dtype=float)  # in: [-1, 1], (envs, continuous actions)
    branches: wp.array2d(dtype=int)  # in: the choice of each branch, (envs, branches)
    observations: wp.array2d(dtype=float)  # out: what the next decision sees, (envs, frames x elements)
    final_observations: wp.array2d(dtype=float)  # out: what the last ended episode saw last
    images: wp.array4d(dtype=wp.uint8)  # out: the image of the next decision, (envs, height, width, channels)
    final_images: wp.array4d(dtype=wp.uint8)  # out: what the last ended episode saw last
    privileged: wp.array2d(dtype=float)  # out: for critics only, (envs, elements)
    final_privileged: wp.array2d(dtype=float)  # out: of the last ended episode's end
    rewards: wp.array(dtype=float)  # out: since the last decision
    outcomes: wp.array(dtype=int)  # out: of this step's end, or RUNNING
    is_terminated: wp.array(dtype=wp.bool)  # out: ended by what happened
    is_truncated: wp.array(dtype=wp.bool)  # out: ended by its step limit
    steps: wp.array(dtype=int)  # decisions of the running episode
    returns: wp.array(dtype=float)  # sum of its rewards
    episodes: wp.array(dtype=int)  # episodes begun; keys the draws
    scores: wp.array2d(dtype=float)  # of ended episodes since they were last taken, (envs, SCORE_COLUMNS)
    seed: wp.array(dtype=int)  # of the draws, with the row and the episode
    samplers: wp.array2d(dtype=float)  # what numbers are drawn from
    params: wp.array2d(dtype=float)  # of the running episode, (envs, numbers)
    frame_size: int


@wp.func
def open_frame(buffers: StepBuffers, i: int) -> int:
    """Shifts the stacked frames by one and returns the column where the newest begins."""
    size = buffers.frame_size
    older = buffers.observations.shape[1] - size
    for k in range(older):
        buffers.observations[i, k] = buffers.observations[i, k + size]
    return older


@wp.func
def close_step(buffers: StepBuffers, i: int, reward: float, outcome: int) -> bool:
    """Books one decision; true if the episode ended with it. What it saw last must have been written before."""
    buffers.rewards[i] = reward
    buffers.outcomes[i] = outcome
    buffers.returns[i] += reward
    buffers.steps[i] += 1
    is_over = outcome != RUNNING
    buffers.is_truncated[i] = outcome == TIMEOUT
    buffers.is_terminated[i] = is_over and outcome != TIMEOUT
    if is_over:
        for k in range(buffers.observations.shape[1]):
            buffers.final_observations[i, k] = buffers.observations[i, k]
        for k in range(buffers.privileged.shape[1]):
            buffers.final_privileged[i, k] = buffers.privileged[i, k]
        buffers.scores[i, outcome] += 1.0
        buffers.scores[i, _RETURN_SCORE] += buffers.returns[i]
        buffers.scores[i, _LENGTH_SCORE] += float(buffers.steps[i])
    return is_over


@wp.func
def close_step_in_time(buffers: StepBuffers, i: int, reward: float, outcome: int) -> bool:
    """As `close_step`, of a task whose success is to last until time is up: that end is a truncation as well."""
    is_over = close_step(buffers, i, reward, outcome)
    if outcome == SUCCESS:
        buffers.is_truncated[i] = True
        buffers.is_terminated[i] = False
    return is_over


@wp.func
def begin_episode(buffers: StepBuffers, i: int) -> int:
    """Clears the row for a new episode, draws its numbers and returns its index, which keys its draws."""
    episode = buffers.episodes[i]
    buffers.episodes[i] = episode + 1
    buffers.steps[i] = 0
    buffers.returns[i] = 0.0
    for k in range(buffers.observations.shape[1]):
        buffers.observations[i, k] = 0.0
    draw_params(buffers.samplers, buffers.params, buffers.seed[i], i, episode)
    return episode


@wp.kernel(enable_backward=False)
def keep_last_image_rows(buffers: StepBuffers) -> None:
    """Copies one row of pixels of each image whose episode ended with this decision; one thread each."""
    i, y = wp.tid()
    if buffers.outcomes[i] != RUNNING:
        for x in range(buffers.images.shape[2]):
            for c in range(buffers.images.shape[3]):
                buffers.final_images[i, y, x, c] = buffers.images[i, y, x, c]
