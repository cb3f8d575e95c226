"""`python -m bench.follow.run STAGE SEED FOLDER`: trains one stage, judges what came of it, writes it as JSON.

A training that was stopped goes on from its newest checkpoint; a stage that was trained but not judged is judged.
"""

import os
import sys
from pathlib import Path
from typing import Any

import torch

from bench.cars.run import Curve, changed
from bench.follow.judge import judge_in_batch
from bench.follow.result import Result, write
from bench.follow.stages import STAGES, Stage
from bench.row import machine
from policies.learn.config.load import load_config
from policies.learn.config.recipes import recipe
from policies.learn.config.run import RunConfig
from policies.learn.export.policy_file import load_policy, save_policy
from policies.learn.trainer import train
from policies.learn.training_run_folder import RunError, RunFolder
from policies.tasks.catalogue import build_task, settings_of
from policies.tasks.follow_me.settings import FollowSettings


def configured(stage: Stage, seed: int, folder: Path) -> RunConfig:
    """The recipe as a run of its own, after the stages that it needs; one that was stopped is to go on.

    Args:
        stage: what is trained.
        seed: of the training; stages before it are those of the same seed.
        folder: of all results.
    """
    config = load_config(recipe(stage.recipe)).config
    changes: dict[str, Any] = dict(stage.changes)
    changes["env_settings.seed"] = seed
    changes["checkpoint_settings.run_id"] = f"{stage.name}-{seed}"
    changes["checkpoint_settings.results_dir"] = str(folder / "runs")
    if stage.teacher is not None:
        changes["behavior.hyperparameters.teacher"] = str(policy_path(folder, stage.teacher, seed))
    if stage.start is not None:
        changes["behavior.init_path"] = str(policy_path(folder, stage.start, seed))
    config = changed(config, changes)
    return changed(config, {f"checkpoint_settings.{'resume' if _has_checkpoint(config) else 'force'}": True})


def policy_path(folder: Path, stage: str, seed: int) -> Path:
    """Where a stage's policy is kept."""
    return folder / f"{stage}-{seed}.pt"


def result_path(folder: Path, stage: str, seed: int) -> Path:
    """Where a stage's result is kept."""
    return folder / f"{stage}-{seed}.json"


def run(stage: Stage, seed: int, folder: Path) -> Result:
    """Trains and judges."""
    torch.set_num_threads(1)
    config = configured(stage, seed, folder)
    settings = settings_of("FollowMe", config.env_settings.env_args)
    if not isinstance(settings, FollowSettings):
        raise TypeError("stages train FollowMe")
    build_task("FollowMe", 1, settings).reset(0)  # compiles the kernels, not on the clock
    curve = Curve(config.behavior.max_steps)
    result = train(config, curve)
    kept = policy_path(folder, stage.name, seed)
    save_policy(kept, *load_policy(result.policy), is_half=True)
    policy, card = load_policy(kept)  # judged and flown as it ships
    return Result(
        stage.name,
        seed,
        result.progress.steps,
        result.progress.elapsed_s,
        len(os.sched_getaffinity(0)),
        machine(),
        kept.stat().st_size,
        curve.points,
        judge_in_batch(policy, settings.model_copy(update=stage.judged)),
        card.code["commit"],
    )


def _has_checkpoint(config: RunConfig) -> bool:
    try:
        return RunFolder.of(config).newest_checkpoint().is_file()
    except RunError:
        return False


def main(name: str, seed: str, folder: str) -> None:
    result = run(STAGES[name], int(seed), Path(folder))
    write(result_path(Path(folder), name, int(seed)), result)
    print(f"{result.steps:,} steps, {result.train_s:.0f} s, {result.steps_per_s:,.0f} steps/s")


if __name__ == "__main__":
    main(*sys.argv[1:])
