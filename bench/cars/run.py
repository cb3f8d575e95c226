"""`python -m bench.cars.run NAME SEED FILE`: one training run of one experiment, judged and written as JSON.

The recipe is what `honeyguide train` would run; the experiment may change settings of its task. The kernels are
compiled first, so that the clock measures training.
"""

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import torch
from rich.console import Console

from bench.cars.experiment import Experiment
from bench.cars.experiments import EXPERIMENTS
from bench.cars.result import Evaluated, Point, Result, write
from bench.row import machine
from mission.train.demonstrate import DemonstrateOptions, demonstrate_task
from policies.learn.config.load import load_config
from policies.learn.config.recipes import recipe
from policies.learn.config.run import RunConfig
from policies.learn.curriculum import Curriculum
from policies.learn.evaluate import evaluate
from policies.learn.export.policy_file import load_policy
from policies.learn.trainer import Progress, train
from policies.tasks.catalogue import build_task, settings_of
from policies.tasks.episode import Outcome

HELD_OUT_SEED = 1_000_003  # no training run is given it
CHOOSING_SEED = 2_000_003  # nor this one
CURVE_POINTS = 300
DEMONSTRATIONS = 400  # episodes
_SUCCESS = Outcome.SUCCESS.name.lower()


class Curve:
    """Watches a training and keeps its curve."""

    is_stopped = False

    def __init__(self, max_steps: int) -> None:
        self.points: list[Point] = []
        self.progress: Progress | None = None
        self._spacing = max(1, max_steps // CURVE_POINTS)
        self._due = 0
        self._begin_s = time.process_time()

    @property
    def elapsed_s(self) -> float:
        """Since it began to watch, by the processor's clock."""
        return time.process_time() - self._begin_s

    def show(self, progress: Progress) -> None:
        """Keeps a point when one is due."""
        self.progress = progress
        if progress.steps < self._due or progress.success_rate is None or progress.mean_reward is None:
            return
        self._due = progress.steps + self._spacing
        self.points.append(Point(progress.steps, self.elapsed_s, progress.success_rate, progress.mean_reward))

    def note(self, line: str) -> None:
        """Lessons go to the log."""
        print(line, flush=True)


def configured(experiment: Experiment, seed: int, folder: str) -> RunConfig:
    """The recipe with the experiment's settings, as a run of its own."""
    config = changed(load_config(recipe(experiment.recipe)).config, experiment.changes)
    arguments = with_settings(config.env_settings.env_args, experiment.settings)
    environment = config.env_settings.model_copy(update={"env_args": arguments, "seed": seed})
    checkpoint = config.checkpoint_settings.model_copy(update={"run_id": experiment.name, "results_dir": folder})
    return config.model_copy(update={"env_settings": environment, "checkpoint_settings": checkpoint})


def changed(config: RunConfig, changes: dict[str, Any]) -> RunConfig:
    """The configuration with values put in place of others; a key is a path with dots, None takes a block away."""
    plain = config.model_dump(exclude_unset=True)
    for path, value in changes.items():
        *parents, key = path.split(".")
        block = plain
        for parent in parents:
            block = block.setdefault(parent, {})
        block[key] = value
    return RunConfig.model_validate(plain)


def with_settings(arguments: tuple[str, ...], settings: dict[str, Any]) -> tuple[str, ...]:
    """Task settings, some of them replaced."""
    known = dict(argument.split("=", 1) for argument in arguments) | {k: str(v) for k, v in settings.items()}
    return tuple(f"{name}={value}" for name, value in known.items())


def run(experiment: Experiment, seed: int, kept: Path | None) -> Result:
    """Trains and judges.

    Args:
        experiment: what is run.
        seed: of the training.
        kept: where the trained policy is copied to, if anywhere.
    """
    torch.set_num_threads(experiment.threads)
    with TemporaryDirectory() as folder:
        config = configured(experiment, seed, folder)
        task = config.env_settings.env_path or ""
        _compile(task, config)
        if imitates := _imitating(config):
            recorded = str(_demonstrated(config, folder))
            config = changed(config, {f"{block}.demo_path": recorded for block in imitates})
        curve = Curve(config.behavior.max_steps)
        result = train(config, curve)
        train_s = curve.elapsed_s
        policy, _ = load_policy(result.policy)
        size = result.policy.stat().st_size
        if kept is not None:
            kept.write_bytes(result.policy.read_bytes())
    params = Curriculum(config.environment_parameters).final_params()
    evaluations = []
    for judged in experiment.judged:
        settings = settings_of(task, with_settings(config.env_settings.env_args, judged.settings))
        held_out = CHOOSING_SEED if judged.chooses else HELD_OUT_SEED
        greedy, drawn = (
            evaluate(
                policy, task, settings, episodes=judged.episodes, seed=held_out, params=params, is_greedy=is_greedy
            )
            for is_greedy in (True, False)
        )
        evaluations.append(
            Evaluated(
                judged.label,
                greedy.outcomes[_SUCCESS],
                greedy.episodes,
                drawn.outcomes[_SUCCESS],
                greedy.mean_return,
                greedy.outcomes,
            )
        )
    progress = result.progress
    return Result(
        experiment.name,
        seed,
        progress.steps,
        train_s,
        experiment.threads,
        machine(),
        size,
        curve.points,
        evaluations,
        clock="processor",
    )


def _imitating(config: RunConfig) -> list[str]:
    """The blocks that name demonstrations."""
    behavior = config.behavior
    blocks = {"reward_signals.gail": behavior.reward_signals.gail, "behavioral_cloning": behavior.behavioral_cloning}
    return [f"behavior.{path}" for path, block in blocks.items() if block is not None]


def _demonstrated(config: RunConfig, folder: str) -> Path:
    """Demonstrations of the task's expert on its training spots, not on the clock."""
    path = Path(folder) / "demonstrations"
    environment = config.env_settings
    options = DemonstrateOptions(
        environment.env_path or "", path, DEMONSTRATIONS, environment.seed, env_args=environment.env_args
    )
    demonstrate_task(options, Console())
    return path


def _compile(task: str, config: RunConfig) -> None:
    """Loads the task's kernels."""
    build_task(task, 1, settings_of(task, config.env_settings.env_args)).reset(0)


def main(name: str, seed: str, path: str) -> None:
    result = run(EXPERIMENTS[name], int(seed), Path(path).with_suffix(".pt"))
    write(Path(path), result)
    for evaluated in result.evaluations:
        print(f"{evaluated.label}: {evaluated.successes} (drawn: {evaluated.drawn_successes}) of {evaluated.episodes}")
    print(f"{result.steps:,} steps, {result.train_s:.0f} s, {result.steps_per_s:,.0f} steps/s of the processor's time")


if __name__ == "__main__":
    main(*sys.argv[1:])
