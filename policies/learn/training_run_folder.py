"""The files of a training run, laid out as ML-Agents lays them out.

results/RUN_ID/configuration.yaml              what the run was configured by
results/RUN_ID/BEHAVIOR/BEHAVIOR-STEPS.pt      checkpoints, with what they export beside them (.onnx)
results/RUN_ID/BEHAVIOR/events.out.tfevents…   training curves
results/RUN_ID/BEHAVIOR.pt, BEHAVIOR.onnx      the trained policy
results/RUN_ID/run_logs/training_status.json   checkpoints, times and figures
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from common.files import write_whole
from policies.learn.checkpoint import checkpoints
from policies.learn.config.dump import dump
from policies.learn.config.run import RunConfig
from policies.learn.export.policy_path import find_policy


class RunError(ValueError):
    """A run that cannot begin or go on; the message is one sentence for the user."""


class RunFolder:
    """Where the files of one run are."""

    def __init__(self, path: Path, behavior: str) -> None:
        self.path = path
        self.behavior = behavior
        self.training = path / behavior
        self.policy = path / f"{behavior}.pt"
        self.network = path / f"{behavior}.onnx"
        self.status = path / "run_logs" / "training_status.json"
        self.configuration = path / "configuration.yaml"

    @staticmethod
    def of(config: RunConfig) -> "RunFolder":
        """The folder that a configuration names."""
        settings = config.checkpoint_settings
        return RunFolder(Path(settings.results_dir) / settings.run_id, config.behavior_name)

    def newest_checkpoint(self) -> Path:
        """The checkpoint to go on from.

        Raises:
            RunError: there is none.
        """
        found = checkpoints(self.training, self.behavior)
        if not found:
            raise RunError(f"{self.training}: there is no checkpoint of {self.behavior} in it")
        return found[-1]

    def check(self, *, is_resumed: bool, is_forced: bool) -> None:
        """Refuses to overwrite a run, and to go on with one that is not there.

        Raises:
            RunError: as ML-Agents would say.
        """
        if is_resumed and not self.path.is_dir():
            raise RunError(f"{self.path}: no data of this run was found; leave --resume away to train a new run")
        if self.path.is_dir() and not is_resumed and not is_forced:
            raise RunError(
                f"{self.path}: data of a run of this name was found; give another --run-id, --resume to go on with it, "
                "or --force to overwrite it"
            )

    def begin(self, config: RunConfig, *, is_resumed: bool) -> None:
        """Makes the folders and writes the configuration; what an overwritten run had left is removed.

        Raises:
            OSError: it cannot be written.
        """
        for folder in (self.training, self.status.parent):
            folder.mkdir(parents=True, exist_ok=True)
        if not is_resumed:
            for file in self._files():
                file.unlink(missing_ok=True)
        write_whole(self.configuration, dump(_to_train_again(config)).encode())

    def write_status(self, status: dict[str, Any]) -> None:
        """Writes checkpoints, times and figures for people and scripts.

        Raises:
            OSError: it cannot be written.
        """
        write_whole(self.status, (json.dumps(status, indent=2) + "\n").encode())

    def _files(self) -> Iterator[Path]:
        yield from (self.policy, self.network, self.status)
        for pattern in (f"{self.behavior}-*.pt", f"{self.behavior}-*.onnx", "*.part", "events.out.tfevents.*"):
            yield from self.training.glob(pattern)


def _to_train_again(config: RunConfig) -> RunConfig:
    """Without what was said of this once only: who trains from the file anew neither resumes nor overwrites."""
    once = dict.fromkeys(("resume", "load_model", "force"), False)
    return config.model_copy(update={"checkpoint_settings": config.checkpoint_settings.model_copy(update=once)})


def starting_point(config: RunConfig) -> Path | None:
    """The checkpoint or policy whose networks a run starts from, by `init_path` or by `initialize_from`.

    Raises:
        CheckpointError: there is no such policy.
        RunError: there is no such run, or nothing in it.
    """
    settings = config.checkpoint_settings
    if config.behavior.init_path:
        return find_policy(config.behavior.init_path)
    if not settings.initialize_from:
        return None
    folder = RunFolder(Path(settings.results_dir) / settings.initialize_from, config.behavior_name)
    if not folder.path.is_dir():
        raise RunError(f"--initialize-from: {folder.path}: there is no such run")
    return folder.newest_checkpoint()
