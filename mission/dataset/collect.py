"""`honeyguide dataset collect`: episodes of the batch simulator as a dataset, by a policy, an expert or chance."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from mission.console.terminal import print_line
from mission.train.play import PlayOptions, cast
from policies.datasets.collecting import NoisyDriver, collected
from policies.datasets.episodes import DatasetError, DatasetOrigin
from policies.datasets.writer import DatasetWriter
from policies.experts.demonstration_file import check_is_free
from policies.experts.episode_recording import MAX_ROWS
from policies.tasks.catalogue import settings_of

EXPERT, RANDOM = "expert", "random"


@dataclass(frozen=True, slots=True)
class CollectOptions:
    """What the command is given."""

    task: str
    policy: str
    episodes: int
    out: Path
    noise: float = 0.0
    seed: int = 0
    env_args: tuple[str, ...] = ()


def collect_dataset(options: CollectOptions, console: Console) -> None:
    """Collects and writes; prints what it came to.

    Raises:
        UnknownTask, NoExpert, PlayError, LayoutError: the task, its settings or the policy cannot be used.
        DatasetError: the task shows images, or the dataset cannot be written.
        DemonstrationFileError: the same.
    """
    check_is_free(options.out)
    is_named = options.policy not in (EXPERT, RANDOM)
    rows = min(options.episodes, MAX_ROWS)
    played = PlayOptions(
        options.task,
        options.episodes,
        rows,
        options.seed,
        options.env_args,
        options.policy if is_named else None,
        options.policy == RANDOM,
        options.policy == EXPERT,
        None,
    )
    task, driver, name = cast(played)
    if task.layout.image is not None:
        raise DatasetError(f"{task.layout.task}: shows images as it is set, and datasets of episodes hold none")
    settings = getattr(task, "settings", None) or settings_of(options.task, options.env_args)
    pilot = (Path(name).stem if is_named else options.policy) + (f"-noise-{options.noise:g}" if options.noise else "")
    origin = DatasetOrigin(task.layout, settings.model_dump(mode="json"), pilot, options.seed)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as bar, DatasetWriter(options.out, origin) as writer:
        line = bar.add_task(options.task, total=options.episodes)
        noisy = NoisyDriver(driver, options.noise, options.seed)
        writer.add_all(
            collected(task, noisy, options.episodes, options.seed, lambda count: bar.update(line, completed=count))
        )
    words = f"{writer.episodes} episodes, {writer.successes} of them successful, {writer.steps} decisions"
    print_line(console, f"{options.out}: {words}")
