"""Episodes of the batch simulator written as one dataset, by a policy, an expert or chance."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from mission.train.play import PlayOptions, cast
from policies.datasets.collecting import NoisyDriver, collected
from policies.datasets.episodes import NUMBER_NOTE, DatasetOrigin
from policies.datasets.writer import DatasetWriter
from policies.experts.episode_recording import IMAGE_ROWS_MAX, MAX_ROWS
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
    shards: int | None = None
    jobs: int | None = None
    ray: str | None = None
    numbers: Mapping[str, float] = field(default_factory=dict)
    """Of the task, in place of its own; not of shards."""


def write_episodes(options: CollectOptions, note: Callable[[int], None] = lambda _: None) -> None:
    """Collects and writes in one go.

    Raises:
        UnknownTask, NoExpert, PlayError, LayoutError: the task, its settings or the policy cannot be used.
        NumberError: a number that the task has not.
        DatasetError: the dataset cannot be written.
        DemonstrationFileError: the same.
    """
    is_named = options.policy not in (EXPERT, RANDOM)
    task, driver, name = cast(_played(options, IMAGE_ROWS_MAX))
    if task.layout.image is None and options.episodes > IMAGE_ROWS_MAX:
        task, driver, name = cast(_played(options, MAX_ROWS))
    task.set_params(options.numbers)
    notes = {f"{NUMBER_NOTE}{name}": drawn for name, drawn in task.param_table.changed().items()}
    settings = getattr(task, "settings", None) or settings_of(options.task, options.env_args)
    pilot = (Path(name).stem if is_named else options.policy) + (f"-noise-{options.noise:g}" if options.noise else "")
    origin = DatasetOrigin(task.layout, settings.model_dump(mode="json"), pilot, options.seed, notes=notes)
    noisy = NoisyDriver(driver, options.noise, options.seed)
    with DatasetWriter(options.out, origin) as writer:
        writer.add_all(collected(task, noisy, options.episodes, options.seed, note))


def _played(options: CollectOptions, rows_max: int) -> PlayOptions:
    """Who drives what, so many rows side by side at most."""
    return PlayOptions(
        options.task,
        options.episodes,
        min(options.episodes, rows_max),
        options.seed,
        options.env_args,
        options.policy if options.policy not in (EXPERT, RANDOM) else None,
        options.policy == RANDOM,
        options.policy == EXPERT,
        None,
    )
