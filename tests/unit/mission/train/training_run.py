"""The small run that the tests of `honeyguide train`, `eval` and `export` train, once per file."""

import os
import subprocess
import sys
from pathlib import Path

import yaml
from typer.testing import CliRunner

from mission.cli import app

PROGRAM = [sys.executable, "-c", "from mission.cli import main; main()"]
RUN = Path("results/run")


def write_config(path="config.yaml", *, env="RollerBall", parameters=None, **behavior):
    """A run of five iterations of 2,048 steps, with a checkpoint after each."""
    block = {
        "trainer_type": "ppo",
        "hyperparameters": {"batch_size": 256, "buffer_size": 2048, "learning_rate": 1e-3},
        "network_settings": {"hidden_units": 16, "num_layers": 1, "normalize": True},
        "max_steps": 10_000,
        "summary_freq": 2_000,
        "checkpoint_interval": 2_000,
        **behavior,
    }
    settings = {"num_areas": 128, "seed": 3} | ({"env_path": env} if env else {})
    whole = {"behaviors": {"Ball": block}, "env_settings": settings, "environment_parameters": parameters or {}}
    Path(path).write_text(yaml.safe_dump(whole), encoding="utf-8")


def honeyguide(*words):
    return CliRunner().invoke(app, [*map(str, words)])


def train(*words):
    return honeyguide("train", "config.yaml", "--run-id", "run", *words)


def in_process(*words, **options):
    """The command as a process of its own: it can be killed, and has its own limits."""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[4])}
    return subprocess.Popen([*PROGRAM, *words], env=environment, text=True, stderr=subprocess.PIPE, **options)
