"""`honeyguide demonstrate`: a scripted expert drives, and its episodes are written as a Minari dataset."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from mission.train.task_arguments import task_of
from policies.experts.catalogue import build_expert
from policies.experts.demonstration_file import Origin, check_is_free, write_demonstrations
from policies.experts.episode_recording import MAX_ROWS, Episode, record_episodes


@dataclass(frozen=True, slots=True)
class DemonstrateOptions:
    """What the command is given."""

    task: str
    out: Path
    episodes: int
    seed: int
    env_args: tuple[str, ...] = ()
    has_failures: bool = False


def demonstrate_task(options: DemonstrateOptions, console: Console) -> None:
    """Records and writes; prints what it came to.

    Raises:
        UnknownTask: no such task or setting.
        NoExpert: no scripted expert for it.
        RecordingError: the expert hardly ever succeeds.
        DemonstrationFileError: the dataset cannot be written.
    """
    check_is_free(options.out)
    task, settings = task_of(options.task, options.env_args, min(options.episodes, MAX_ROWS))
    expert = build_expert(options.task)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as bar:
        line = bar.add_task(options.task, total=options.episodes)
        episodes = record_episodes(
            task,
            expert,
            options.episodes,
            options.seed,
            has_failures=options.has_failures,
            progress=lambda recorded: bar.update(line, completed=recorded),
        )
    write_demonstrations(options.out, Origin(task.layout, settings, "scripted", options.seed), episodes)
    console.print(f"{options.out}: {described(episodes)}", highlight=False, markup=False, soft_wrap=True)


def described(episodes: Sequence[Episode]) -> str:
    """What was recorded, in words."""
    steps = sum(len(episode.rewards) for episode in episodes)
    mean_return = sum(float(episode.rewards.sum()) for episode in episodes) / max(len(episodes), 1)
    successes = sum(episode.is_success for episode in episodes)
    return f"{len(episodes)} episodes, {successes} of them successful, {steps} decisions, mean return {mean_return:.3f}"
