"""`honeyguide play`: a task seen while something drives it, in a window at its real pace or as an mp4.

What drives is a trained policy, the task's scripted expert, or chance.
"""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from math import ceil, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.clock import Pacer
from mission.task_settings import task_of
from mission.video import Mp4
from mission.window import Request, Window
from policies.experts.catalogue import build_expert
from policies.experts.expert import Expert, RandomDriver
from policies.tasks.catalogue import CATALOGUE, build_task, settings_of
from policies.tasks.episode import Outcome
from policies.tasks.task import Scores, Task


class PlayError(ValueError):
    """A file that is not a policy's; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class PlayOptions:
    """What the command is given."""

    what: str  # a task's name, or a policy's file
    episodes: int
    envs: int
    seed: int
    env_args: tuple[str, ...] = ()
    policy: Path | None = None
    is_random: bool = False
    mp4: Path | None = None


def play_task(options: PlayOptions) -> str:
    """Shows episodes until enough have ended, and says how they did.

    Raises:
        UnknownTask: no such task, file or setting.
        NoExpert: no scripted expert for the task.
        PlayError: the file is not a policy's.
        LayoutError: the policy was made for another task or preset.
        WindowError: no display.
        VideoError: the film cannot be written.
    """
    task, driver = _cast(options)
    with ExitStack() as stack:
        if options.mp4 is not None:
            film = stack.enter_context(Mp4(options.mp4, task.decision_s))
            return in_words(_shown(task, driver, options, _filming(film)))
        window = stack.enter_context(Window(task.layout.task))
        return in_words(_shown(task, driver, options, _showing(window, task.decision_s)))


def _cast(options: PlayOptions) -> tuple[Task, Expert]:
    """The task and whoever drives it."""
    is_task = options.what in CATALOGUE
    policy_file = options.policy if is_task else Path(options.what)
    if policy_file is None or (not is_task and not policy_file.exists()):
        task, _ = task_of(options.what, options.env_args, options.envs)
        return task, RandomDriver(options.seed) if options.is_random else build_expert(options.what)
    from policies.learn.checkpoint import CheckpointError
    from policies.learn.policy_driver import PolicyDriver
    from policies.learn.policy_file import load_policy

    try:
        policy, card = load_policy(policy_file)
    except CheckpointError as error:
        raise PlayError(str(error)) from None
    name = options.what if is_task else card.task
    task = build_task(
        name, options.envs, settings_of(name, options.env_args, card.settings if name == card.task else {})
    )
    task.layout.require(policy.layout, str(policy_file))
    return task, PolicyDriver(policy)


def _shown(task: Task, driver: Expert, options: PlayOptions, show: Callable[[NDArray[np.uint8]], bool]) -> Scores:
    """Drives until enough episodes have ended or `show` says that it is enough."""
    task.reset(options.seed)
    scores = task.take_scores()
    while show(tiled(task)) and scores.episode_count < options.episodes:
        driver.act(task)
        task.step()
        scores += task.take_scores()
    return scores


def _filming(film: Mp4) -> Callable[[NDArray[np.uint8]], bool]:
    def show(picture: NDArray[np.uint8]) -> bool:
        film.show(picture)
        return True

    return show


def _showing(window: Window, decision_s: float) -> Callable[[NDArray[np.uint8]], bool]:
    pacer = Pacer(1.0)
    shown = 0

    def show(picture: NDArray[np.uint8]) -> bool:
        nonlocal shown
        pacer.wait_until(round(shown * decision_s * 1e6))
        shown += 1
        window.show(picture)
        return Request.END not in window.requests()

    return show


def tiled(task: Task) -> NDArray[np.uint8]:
    """The pictures of all environments of a task side by side, as near to a square as they go."""
    pictures = [task.picture(i) for i in range(task.env_count)]
    columns = ceil(sqrt(len(pictures)))
    pictures += [np.zeros_like(pictures[0])] * (-len(pictures) % columns)
    rows = [np.concatenate(pictures[k : k + columns], axis=1) for k in range(0, len(pictures), columns)]
    return np.concatenate(rows, axis=0)


def in_words(scores: Scores) -> str:
    """How many episodes ended, and how."""
    ends = [f"{count} {outcome.name.lower()}" for outcome in Outcome if (count := scores.count(outcome))]
    return f"{scores.episode_count} episodes: {', '.join(ends)}" if ends else "no episode ended"
