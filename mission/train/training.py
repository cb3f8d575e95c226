"""`honeyguide train`, `eval` and `export`: a configuration is chosen, its training watched, and figures are shown."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from datetime import timedelta
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
from rich.table import Table

from common.clock import wall_time_s
from common.config.yaml_locations import ConfigError
from common.files import write_to_nowhere
from mission.console.terminal import LINE_PERIOD_S, busy, print_line
from policies.learn.algorithms.sac import SacError
from policies.learn.config.command_line import CommandLine, flags, with_command_line
from policies.learn.config.load import Loaded, load_config
from policies.learn.config.recipes import recipe
from policies.learn.config.run import RunConfig
from policies.learn.config.task_check import check_against_task
from policies.learn.evaluate import Evaluation, evaluate
from policies.learn.export.onnx_export import ExportError, export_policy
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import CheckpointError, find_policy
from policies.learn.rollout.demonstrations import DemonstrationError
from policies.learn.trainer import Progress as TrainingProgress
from policies.learn.trainer import Result, train
from policies.learn.training_run_folder import RunError, RunFolder
from policies.offline.algorithm import OfflineError
from policies.tasks.catalogue import (
    CATALOGUE,
    GYM,
    UnknownTask,
    build_task,
    file_stem,
    is_task_name,
    settings_of,
    task_names,
)
from policies.tasks.layout import LayoutError
from policies.tasks.task_error import TaskError
from policies.tasks.task_params import NumberError

USER_ERRORS = (
    CheckpointError, ConfigError, DemonstrationError, ExportError, LayoutError, NumberError, OfflineError, RunError,
    SacError, TaskError, UnknownTask,
)  # fmt: skip
INFERENCE_EPISODES = 1000
_ENDS = {"max_steps": "all steps done", "success_target": "success target reached", "stopped": "stopped by the user"}


@dataclass(frozen=True, slots=True)
class TrainingRequest:
    """What `honeyguide train` is given."""

    task_or_config: str | None
    given: CommandLine
    behavior: str | None
    is_strict: bool


def train_run(request: TrainingRequest, console: Console) -> None:
    """Trains, or with --inference plays, and prints what came of it.

    Raises:
        One of USER_ERRORS.
    """
    loaded = chosen_config(request)
    config = loaded.config
    for warning in (*loaded.warnings, *_without_effect(request.given, config)):
        print_line(console, warning)
    check_against_task(loaded)
    if config.checkpoint_settings.inference:
        _play(config, console)
        return
    with _watched(console, config.behavior.max_steps) as watcher:
        result = train(config, watcher)
    print_line(console, _summary(result))


def chosen_config(request: TrainingRequest) -> Loaded:
    """The configuration: a file, or our recipe for a task, with the command line over it.

    Raises:
        ConfigError: no such recipe, or something wrong in the file or in a flag.
    """
    name, given = request.task_or_config or request.given.env or "", request.given
    if not name:
        raise ConfigError("give a task, a recipe, a .yaml file, or --gym")
    is_file = name.endswith((".yaml", ".yml")) or Path(name).is_file()
    is_own = not is_file and name not in CATALOGUE and is_task_name(name)
    if is_own and given.env is None:
        given = replace(given, env=name)
    path = Path(name) if is_file else recipe(_recipe_of(name) if is_own else name)
    loaded = load_config(
        path,
        request.behavior,
        is_strict=request.is_strict,
        curriculum_path=given.curriculum,
        sampler_path=given.sampler,
    )
    if not is_file and given.run_id is None and "run_id" not in loaded.config.checkpoint_settings.model_fields_set:
        given = replace(given, run_id=file_stem(name) if is_own else path.stem)
    loaded = with_command_line(loaded, given)
    settings = loaded.config.env_settings
    if not settings.env_path:
        raise ConfigError(
            f"{name}: names no task in env_settings.env_path: give --env, one of {', '.join(task_names())}, "
            "module:Class for your own, or --gym ID"
        )
    if is_own or (
        given.env is not None and given.env.startswith(GYM)
    ):  # what it lacks is told without naming a line of a recipe
        build_task(settings.env_path, 1, settings_of(settings.env_path, settings.env_args)).close()
    return loaded


def _recipe_of(name: str) -> str:
    """The recipe for a task that has none of its own."""
    return "gym" if name.startswith(GYM) else "own"


def evaluate_policy(
    name: str,
    task: str | None,
    pairs: tuple[str, ...],
    episodes_and_seed: tuple[int, int],
    console: Console,
    *,
    is_drawn: bool = False,
) -> None:
    """Plays a policy and prints how its episodes ended.

    Raises:
        One of USER_ERRORS.
    """
    path = find_policy(name)
    policy, card = load_policy(path)
    task_name = task or card.trusted_task(path, f"--task {card.task}")
    own, params = (card.settings, card.samplers()) if task_name == card.task else ({}, {})
    settings = settings_of(task_name, pairs, {**own, "split": "test"})
    episodes, seed = episodes_and_seed
    with busy(console, f"playing {episodes} episodes of {task_name}") as say:
        evaluation = evaluate(
            policy,
            task_name,
            settings,
            episodes=episodes,
            seed=seed,
            params=params,
            is_greedy=not is_drawn,
            source=str(path),
            progress=lambda ended: say(f"episode {ended} of {episodes} of {task_name}"),
        )
    shown = ", ".join(f"{key}={value}" for key, value in settings.model_dump().items() if value not in ("", None, ()))
    print_line(console, f"{path} on {task_name} ({shown}), seed {seed}")
    console.print(_evaluation_table(evaluation))


def export_network(name: str, output: Path | None, console: Console) -> None:
    """Writes a policy as an ONNX network.

    Raises:
        One of USER_ERRORS.
    """
    path = find_policy(name)
    target = output or path.with_suffix(".onnx")
    policy, _ = load_policy(path)
    difference = export_policy(policy, target)
    print_line(console, f"{target}: does what {path} does, to within {difference:.1e}")


def _play(config: RunConfig, console: Console) -> None:
    """The policy of a run, playing."""
    folder = RunFolder.of(config)
    folder.check(is_resumed=True, is_forced=False)
    policy, card = load_policy(folder.newest_checkpoint())
    name = config.env_settings.env_path or ""
    with busy(console, f"playing {INFERENCE_EPISODES} episodes of {name}") as say:
        evaluation = evaluate(
            policy,
            name,
            settings_of(name, config.env_settings.env_args),
            episodes=INFERENCE_EPISODES,
            seed=max(config.env_settings.seed, 0),
            params=card.samplers(),
            is_greedy=config.behavior.network_settings.deterministic,
            progress=lambda ended: say(f"episode {ended} of {INFERENCE_EPISODES} of {name}"),
        )
    console.print(_evaluation_table(evaluation))


class _Watcher:
    """Shows a training: a bar on a terminal, now and then a line elsewhere. Ctrl-C ends it after the iteration."""

    def __init__(self, console: Console, max_steps: int) -> None:
        self.is_stopped = False
        self._console = console
        self._line_s = wall_time_s()
        self._bar: Progress | None = None
        if console.is_terminal:
            steps = TextColumn("{task.completed:,.0f} steps,")
            columns = (BarColumn(bar_width=15), TaskProgressColumn(), steps, TextColumn("{task.description}"))
            self._bar = Progress(*columns, console=console, transient=True)
            self._task = self._bar.add_task("starting", total=max_steps)
            self._bar.start()

    def show(self, progress: TrainingProgress) -> None:
        if self._bar is not None:
            self._bar.update(self._task, completed=progress.steps, description=_figures(progress))
        elif wall_time_s() - self._line_s >= LINE_PERIOD_S:
            self._line_s = wall_time_s()
            print_line(self._console, f"{progress.steps:,} of {progress.max_steps:,} steps, {_figures(progress)}")

    def note(self, line: str) -> None:
        print_line(self._console, line)

    def stop(self, number: int, _: object) -> None:
        if number == signal.SIGHUP:
            write_to_nowhere(1, 2)
        if self.is_stopped:
            raise KeyboardInterrupt  # asked twice
        self.is_stopped = True
        print_line(self._console, "stopping after this iteration; once more to stop at once")

    def close(self) -> None:
        if self._bar is not None:
            self._bar.stop()


@contextmanager
def _watched(console: Console, max_steps: int) -> Iterator[_Watcher]:
    watcher = _Watcher(console, max_steps)
    before = {number: signal.signal(number, watcher.stop) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        yield watcher
    finally:
        watcher.close()
        for number, handler in before.items():
            signal.signal(number, handler)


def _figures(progress: TrainingProgress) -> str:
    parts = [f"{progress.steps_per_s:,.0f} steps/s"]
    if progress.mean_reward is not None:
        parts.append(f"reward {progress.mean_reward:.3f}")
    if progress.success_rate is not None:
        parts.append(f"success {100.0 * progress.success_rate:.1f} %")
    return ", ".join([*parts, f"{timedelta(seconds=round(progress.left_s))} left"])


def _summary(result: Result) -> str:
    progress = result.progress
    lines = [f"{_ENDS[result.end]}: {progress.steps:,} steps in {timedelta(seconds=round(progress.elapsed_s))}"]
    if progress.mean_reward is not None:
        success = f"success {100.0 * progress.success_rate:.1f} %, " if progress.success_rate is not None else ""
        lines.append(f"training: {success}reward {progress.mean_reward:.3f}")
    if result.judged is not None and result.judged.says_success:
        lines.append(f"judged: success {_rate(result.judged)} of {result.judged.episodes} episodes it did not train on")
    return "\n".join([*lines, f"policy: {result.policy}, {result.network}"])


def _rate(evaluation: Evaluation) -> str:
    low, high = (100.0 * bound for bound in evaluation.interval)
    return f"{100.0 * evaluation.success_rate:.2f} % (95 %: {low:.2f} to {high:.2f})"


def _evaluation_table(evaluation: Evaluation) -> Table:
    table = Table("figure", "value")
    table.add_row("episodes", str(evaluation.episodes))
    if evaluation.says_success:
        table.add_row("success rate", _rate(evaluation))
    for outcome, count in evaluation.outcomes.items():
        if count:
            table.add_row(outcome.replace("_", " "), str(count))
    table.add_row("mean reward", f"{evaluation.mean_return:.4f}")
    table.add_row("mean length", f"{evaluation.mean_length:.1f} decisions")
    return table


def _without_effect(given: CommandLine, config: RunConfig) -> list[str]:
    """A line for each flag, or key, that was given in vain."""
    silent = {"--train"}
    accepted = {flag.option for flag in flags() if flag.key and flag.meaning.startswith("Accepted")} | {"--debug"}
    said = {f"--{entry.name.replace('_', '-')}" for entry in fields(given) if getattr(given, entry.name)}
    lines = [f"{option}: accepted, has no effect here" for option in sorted(said & accepted - silent)]
    if config.behavior.network_settings.deterministic and not config.checkpoint_settings.inference:
        lines.append("deterministic: has an effect with --inference only; training draws its actions")
    return lines
