"""`honeyguide play`: a task seen while something drives it, in a window at its real pace or as an mp4.

What drives is a trained policy, the task's scripted expert, or chance. A task's bare name takes the policy that ships
for it, and its expert where there is none or where settings were asked for that the policy was not made for.
"""

from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass
from math import ceil, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from common.clock import Pacer
from mission.console.terminal import Say, busy
from mission.train.keyboard_window import Request, Window, WindowError
from mission.train.task_arguments import task_of
from mission.video.video_file import Mp4
from policies.experts.catalogue import build_expert
from policies.experts.expert import Expert, RandomDriver
from policies.learn.export.policy_path import CheckpointError, find_policy
from policies.pretrained.pretrained_policies import pretrained
from policies.tasks.catalogue import build_task, is_task_name, settings_of, task_names
from policies.tasks.episode import Outcome
from policies.tasks.layout import LayoutError
from policies.tasks.task import Scores, Task


class PlayError(ValueError):
    """A file that is not a policy's; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class PlayOptions:
    """What the command is given."""

    what: str  # a task's name, or a policy: a file, a run's folder, or the name of a run
    episodes: int
    envs: int
    seed: int
    env_args: tuple[str, ...] = ()
    policy: str | None = None
    is_random: bool = False
    is_expert: bool = False
    mp4: Path | None = None


def play_task(options: PlayOptions, console: Console) -> str:
    """Shows episodes until enough have ended, and says how they did and where the film lies.

    Raises:
        UnknownTask: no such setting.
        NoExpert: no scripted expert for the task.
        PlayError: no such task or policy, or a file that is none.
        LayoutError: the policy was made for another task or preset.
        WindowError: no display.
        VideoError: the film cannot be written.
    """
    task, driver, who = cast(options)
    with ExitStack() as stack:
        stack.enter_context(closing(task))
        _check_view(task)
        if options.mp4 is not None:
            say = stack.enter_context(busy(console, f"filming {options.episodes} episodes of {task.layout.task}"))
            film = stack.enter_context(Mp4(options.mp4, task.decision_s))
            scores = _shown(task, driver, options, _filming(film, task.decision_s, say))
            return f"{who}: {in_words(scores)}\nfilm: {options.mp4}"
        try:
            window = stack.enter_context(Window(task.layout.task))
        except WindowError as error:
            raise WindowError(f"{error}; --mp4 FILE writes a film") from None
        return f"{who}: {in_words(_shown(task, driver, options, _showing(window, task.decision_s)))}"


def _check_view(task: Task) -> None:
    """Refuses a task that nothing can be seen of, before a window or a film is begun."""
    try:
        task.reset(0)
        task.top_view(0)
    except NotImplementedError as error:
        raise PlayError(str(error)) from None


def cast(options: PlayOptions) -> tuple[Task, Expert, str]:
    """The task, whoever drives it, and what they are called."""
    is_task = is_task_name(options.what)
    if is_task and options.is_random:
        return task_of(options.what, options.env_args, options.envs)[0], RandomDriver(options.seed), "chance"
    if not is_task or options.policy is not None:
        return _with_policy(options, options.policy or options.what)
    has_preset = any(pair.startswith("preset=") for pair in options.env_args)  # it makes another task of it
    shipped = None if options.is_expert or has_preset else pretrained(options.what)
    if shipped is not None:
        try:
            return _with_policy(options, str(shipped))
        except LayoutError:
            pass  # other settings were asked for than the policy was made for: the expert knows them all
    return task_of(options.what, options.env_args, options.envs)[0], build_expert(options.what), "expert"


def _with_policy(options: PlayOptions, name: str) -> tuple[Task, Expert, str]:
    """A trained policy, in its own task and settings where no others are asked for."""
    from policies.learn.export.policy_driver import PolicyDriver
    from policies.learn.export.policy_file import load_policy

    is_task = is_task_name(options.what)
    try:
        path = find_policy(name)
        policy, card = load_policy(path)
        task_name = options.what if is_task else card.trusted_task(path, f"play {card.task} --policy {name}")
    except CheckpointError as error:
        raise PlayError(str(error) if is_task else f"{error}; the tasks are {', '.join(task_names())}") from None
    is_own = task_name == card.task
    settings = settings_of(task_name, options.env_args, card.settings if is_own else {})
    task = build_task(task_name, options.envs, settings)
    task.layout.require(policy.layout, str(path))
    if is_own:
        task.set_params(card.samplers())
    return task, PolicyDriver(policy), str(path)


def _shown(task: Task, driver: Expert, options: PlayOptions, show: Callable[[NDArray[np.uint8]], bool]) -> Scores:
    """Drives until enough episodes have ended or `show` says that it is enough."""
    task.reset(options.seed)
    scores = task.take_scores()
    while show(tiled(task)) and scores.episode_count < options.episodes:
        driver.act(task)
        task.step()
        scores += task.take_scores()
    return scores


def _filming(film: Mp4, image_s: float, say: Say) -> Callable[[NDArray[np.uint8]], bool]:
    count = 0

    def show(image: NDArray[np.uint8]) -> bool:
        nonlocal count
        film.show(image)
        count += 1
        say(f"filming: picture {count}, {count * image_s:.1f} s of film")
        return True

    return show


def _showing(window: Window, decision_s: float) -> Callable[[NDArray[np.uint8]], bool]:
    pacer = Pacer(1.0)
    shown = 0

    def show(image: NDArray[np.uint8]) -> bool:
        nonlocal shown
        pacer.wait_until(round(shown * decision_s * 1e6))
        shown += 1
        window.show(image)
        return Request.END not in window.requests()

    return show


def tiled(task: Task) -> NDArray[np.uint8]:
    """The images of all environments of a task side by side, as near to a square as they go."""
    images = [task.top_view(i) for i in range(task.env_count)]
    columns = ceil(sqrt(len(images)))
    images += [np.zeros_like(images[0])] * (-len(images) % columns)
    rows = [np.concatenate(images[k : k + columns], axis=1) for k in range(0, len(images), columns)]
    return np.concatenate(rows, axis=0)


def in_words(scores: Scores) -> str:
    """How many episodes ended, and how."""
    ends = [f"{count} {outcome.name.lower()}" for outcome in Outcome if (count := scores.count(outcome))]
    return f"{scores.episode_count} episodes: {', '.join(ends)}" if ends else "no episode ended"
