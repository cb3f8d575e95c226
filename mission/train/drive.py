"""`honeyguide drive`: a person drives a task in a window, at its real pace, and may keep that as demonstrations."""

from collections import Counter
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from common.clock import Pacer
from mission.train.keyboard_window import Request, Window
from mission.train.task_arguments import task_of
from policies.experts.demonstration_file import Origin, check_is_free, write_demonstrations
from policies.experts.episode_recording import Episode, Recorder
from policies.experts.keyboard import KeyboardDriver
from policies.tasks.episode import Outcome
from policies.tasks.task import Task


@dataclass(frozen=True, slots=True)
class DriveOptions:
    """What the command is given."""

    task: str
    seed: int
    env_args: tuple[str, ...] = ()
    episodes: int | None = None
    record: Path | None = None
    has_failures: bool = False
    speed: float = 1.0


@dataclass(slots=True)
class Drive:
    """What a person has done so far."""

    episodes: list[Episode] = field(default_factory=list)
    outcomes: Counter[Outcome] = field(default_factory=Counter)

    def __str__(self) -> str:
        ends = ", ".join(f"{count} {outcome.name.lower()}" for outcome, count in sorted(self.outcomes.items()))
        return ends or "no episode ended"


def drive_task(options: DriveOptions) -> str:
    """Lets a person drive until they end it, and says how it went.

    Raises:
        UnknownTask: no such task or setting.
        NoKeys: it has an action that no key is known for.
        WindowError: no display.
        DemonstrationFileError: the recording cannot be written.
    """
    if options.record is not None:
        check_is_free(options.record)
    task, settings = task_of(options.task, options.env_args, 1)
    driver = KeyboardDriver(task.layout)
    with closing(task), Window(options.task) as window:
        drive = driven(task, driver, window, options)
    if options.record is None:
        return str(drive)
    kept = [episode for episode in drive.episodes if episode.is_success or options.has_failures]
    if not kept:
        return f"{drive}; nothing to record"
    write_demonstrations(options.record, Origin(task.layout, settings, "keyboard", options.seed), kept)
    return f"{drive}; {options.record}: {len(kept)} episodes"


def driven(task: Task, driver: KeyboardDriver, window: Window, options: DriveOptions) -> Drive:
    """Drives in the window. An episode waits for its first key, so that nobody is driven into a wall unawares."""
    drive = Drive()
    recorder = Recorder(task)
    pacer = Pacer(options.speed)
    decision_us = round(task.decision_s * 1e6)
    time_us = 0
    is_waiting = True
    task.reset(options.seed)
    while options.episodes is None or len(drive.episodes) < options.episodes:
        pacer.wait_until(time_us)
        time_us += decision_us
        hint = "  (arrows or WASD, space, R: restart, Esc: end)" if is_waiting else ""
        window.show(task.top_view(0), f"{options.task}: {drive}{hint}")
        requests = window.requests()
        if Request.END in requests:
            break
        if Request.RESTART in requests:
            task.begin(np.ones(1, dtype=np.bool_))
            recorder.drop(0)
            is_waiting = True
        is_waiting = is_waiting and not window.held
        if is_waiting:
            continue
        driver.held = window.held
        driver.act(task)
        recorder.note()
        task.step()
        for _, episode in recorder.ended():
            drive.episodes.append(episode)
            drive.outcomes[episode.outcome] += 1
            is_waiting = True
    return drive
