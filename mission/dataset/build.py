"""`honeyguide dataset build`: logged flights become a dataset of a task.

In: logs, runs and folders of them. Out: a Minari folder, written an episode at a time; nothing of it if one log is
refused. Rewards are the task's own function's, on the truth where all logs hold it, else on the estimate.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from mission.console.terminal import print_line
from mission.dataset.source_logs import DAMAGED, damaged, logs_at, refuse_twice
from mission.dataset.sources import FlightSource, has_truth, read_flight
from mission.train.task_arguments import task_of
from policies.datasets.decisions import Judge, episodes_of, runs_of
from policies.datasets.episodes import NUMBER_NOTE, DatasetError, DatasetOrigin, EpisodeRows
from policies.datasets.judges import HOVER, judge_of, task_pairs
from policies.datasets.writer import DatasetWriter
from policies.experts.demonstration_file import check_is_free
from policies.tasks.layout import LayoutError


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """What the command is given."""

    sources: tuple[Path, ...]
    task: str
    out: Path
    env_args: tuple[str, ...] = ()
    has_truth: bool = True
    has_others: bool = False
    has_images: bool = False
    numbers: tuple[str, ...] = ()


def build_dataset(options: BuildOptions, console: Console) -> None:
    """Builds and writes; prints what it came to.

    Raises:
        DatasetError: a log cannot be used.
        UnknownTask: no such setting.
        NumberError: no such number of the task, or a value that it cannot have.
        DemonstrationFileError: the dataset cannot be written.
    """
    check_is_free(options.out)
    pairs = task_pairs(options.task, options.env_args)
    logs = [log for source in options.sources for log in logs_at(source)]
    refuse_twice(logs)
    task, settings = task_of(options.task, pairs, 1)
    numbers = _numbers(options.numbers)
    task.set_params(numbers)
    notes = {f"{NUMBER_NOTE}{name}": f"{value:g}" for name, value in numbers.items()}
    if options.task != HOVER:
        _refuse_telemetry(logs)
    for log in damaged(logs):
        print_line(console, f"{log}: {DAMAGED}")
        notes[f"log {log.absolute().parent.name}/{log.name}"] = DAMAGED
    if options.task == HOVER:
        from mission.dataset.build_hover import hover_episodes

        origin = DatasetOrigin(
            task.layout, settings.model_dump(mode="json"), "flights", rewards_by="estimate", notes=notes
        )
        episodes = hover_episodes(logs, task)
    else:
        judge = judge_of(task)
        by_truth = options.has_truth and all(map(has_truth, logs))
        origin = DatasetOrigin(
            task.layout,
            settings.model_dump(mode="json"),
            "flights",
            rewards_by="truth" if by_truth else "estimate",
            notes=notes,
        )
        episodes = _episodes(logs, judge, replace(options, has_truth=by_truth), console)
    with DatasetWriter(options.out, origin) as writer:
        writer.add_all(episodes)
    words = f"{writer.episodes} episodes, {writer.steps} decisions, rewards by the {origin.rewards_by}"
    print_line(console, f"{options.out}: {words}")


def _numbers(pairs: tuple[str, ...]) -> dict[str, float]:
    """Numbers of the task, as given.

    Raises:
        DatasetError: one is not NAME=VALUE.
    """
    numbers = {}
    for pair in pairs:
        name, _, value = pair.partition("=")
        try:
            numbers[name] = float(value)
        except ValueError as error:
            raise DatasetError(f"--number {pair}: give NAME=VALUE, as kept_m=3") from error
    return numbers


def _refuse_telemetry(logs: list[Path]) -> None:
    for log in logs:
        if log.suffix == ".tlog":
            raise DatasetError(f"{log}: a .tlog holds no topic policy_decision; build from the run's .ulg")


def _read(log: Path, judge: Judge, *, by_truth: bool) -> FlightSource:
    """A log of the judge's task.

    Raises:
        DatasetError: it cannot be read, or holds decisions of another task, version or setting.
    """
    source = read_flight(log, by_truth=by_truth, by_images=judge.layout.image is not None)
    try:
        replace(judge.layout, stack=1).require(source.rows.layout, f"{log}: policy_decision")
    except LayoutError as error:
        raise DatasetError(str(error)) from error
    return source


def _episodes(logs: list[Path], judge: Judge, options: BuildOptions, console: Console) -> Iterator[EpisodeRows]:
    has_images = options.has_images or judge.layout.image is not None
    for log in logs:
        source = _read(log, judge, by_truth=options.has_truth)
        gaps = runs_of(source.rows, has_others=options.has_others).gaps
        if gaps:
            (time_s, gap_s), more = gaps[0], f", and {len(gaps) - 1} more gaps" if len(gaps) > 1 else ""
            text = f"{log}: policy_decision: nothing for {gap_s:.2f} s at {time_s:.1f} s{more}: episodes are cut there"
            print_line(console, text)
        yield from episodes_of(
            source.rows,
            judge,
            source.truth,
            has_others=options.has_others,
            images=source.images if has_images else lambda _: None,
        )
