"""Offline training by two processes from the command line, of which one is killed; then it is gone on with."""

import os
import signal
import subprocess
import sys

import pytest
import torch
import yaml

from common.clock import wall_sleep_s
from policies.experts.catalogue import build_expert
from policies.experts.demonstration_file import Origin, write_demonstrations
from policies.experts.episode_recording import record_episodes
from policies.learn.checkpoint import checkpoints, load
from policies.learn.export.policy_file import CHECKPOINT
from policies.tasks.catalogue import build_task, task_settings
from tests.documents import ROOT
from tests.system.datasets.killing import children

MOST_S = 240.0
END_S = 20.0  # within which all have ended; a busy machine takes a second
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def configuration(tmp_path_factory):
    """Of a run on a few episodes of an expert."""
    folder = tmp_path_factory.mktemp("killed")
    task = build_task("RollerBall", 32)
    episodes = record_episodes(task, build_expert("RollerBall"), 32, seed=1)
    origin = Origin(task.layout, task_settings("RollerBall", {}), "scripted", 1)
    write_demonstrations(folder / "expert", origin, episodes)
    behavior = {
        "trainer_type": "td3_bc", "max_steps": 2000, "checkpoint_interval": 200, "keep_checkpoints": 20,
        "summary_freq": 400, "network_settings": {"hidden_units": 16, "num_layers": 2, "normalize": True},
        "offline": {"dataset": str(folder / "expert"), "evaluation_interval": 1000, "evaluation_episodes": 8},
    }  # fmt: skip
    content = {"behaviors": {"B": behavior}, "env_settings": {"env_path": "RollerBall", "seed": 5}}
    path = folder / "run.yaml"
    path.write_text(yaml.safe_dump(content | {"torch_settings": {"processes": 2}}))
    return path


def begun(configuration, folder, *more):
    program = "from mission.cli import main; main()"
    line = [sys.executable, "-c", program, "train", str(configuration), "--run-id", "run", "--results-dir", str(folder)]
    return subprocess.Popen([*line, *more], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def steps(folder):
    return [int(path.stem.partition("-")[2]) for path in checkpoints(folder / "run" / "B", "B")]


def same(a, b):
    if isinstance(a, torch.Tensor):
        return torch.equal(a, b)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return a == b


def learnt(folder):
    return load(checkpoints(folder / "run" / "B", "B")[-1], CHECKPOINT)["learner"]


@pytest.fixture(scope="module")
def undisturbed(configuration, tmp_path_factory):
    """What the run comes to."""
    folder = tmp_path_factory.mktemp("undisturbed")
    output, _ = begun(configuration, folder).communicate(timeout=MOST_S)
    assert steps(folder)[-1] == 2000, output
    return learnt(folder)


@pytest.mark.parametrize(
    ("is_first", "code", "sentence"),
    [
        (True, -signal.SIGKILL, "the first process has ended, and the others with it; --resume goes on"),
        (False, 2, "process 2 of 2 was ended by SIGKILL, and the others with it; --resume goes on from the newest"),
    ],
    ids=["the first", "the other"],
)
def test_all_end_with_a_sentence_and_the_run_goes_on_bit_for_bit(
    tmp_path, configuration, undisturbed, is_first, code, sentence
):
    process = begun(configuration, tmp_path)
    while process.poll() is None and not steps(tmp_path):
        wall_sleep_s(0.02)
    (other,) = children(process.pid)
    os.kill(process.pid if is_first else other, signal.SIGKILL)
    output, _ = process.communicate(timeout=END_S)  # until the last that writes there has ended
    assert process.returncode == code, output
    assert output.count(sentence) == 1
    assert "Traceback" not in output
    assert steps(tmp_path)[-1] < 2000
    output, _ = begun(configuration, tmp_path, "--resume").communicate(timeout=MOST_S)
    assert steps(tmp_path)[-1] == 2000, output
    assert same(learnt(tmp_path), undisturbed)
