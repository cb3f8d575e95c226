"""Offline training by several processes: what one does on the same minibatches, and what a killed one leaves."""

import multiprocessing
import os
import signal

import pytest
import torch

from policies.learn.checkpoint import checkpoints, load
from policies.learn.config.run import TorchSettings
from policies.learn.export.policy_file import CHECKPOINT, load_policy
from policies.learn.trainer import train
from policies.learn.training_run_folder import RunError
from tests.unit.policies.offline.test_training import BEST, EVERY_200, KINDS, StopAfter, config, same


def by(processes, *given, **settings):
    """A configuration for so many processes."""
    return config(*given, **settings).model_copy(update={"torch_settings": TorchSettings(processes=processes)})


def learnt(folder):
    """What the newest checkpoint of a run holds."""
    return load(checkpoints(folder / "run" / "B", "B")[-1], CHECKPOINT)["learner"]


def greatest_difference(a, b):
    """Between the numbers of two states of the same shape."""
    if isinstance(a, torch.Tensor):
        return float((a.double() - b.double()).abs().max()) if a.numel() else 0.0
    if isinstance(a, dict):
        return max((greatest_difference(a[key], b[key]) for key in a), default=0.0)
    return 0.0


class Killer(StopAfter):
    """Kills the other process after so many iterations."""

    def __init__(self, after):
        super().__init__()
        self.after = after

    def show(self, progress):
        super().show(progress)
        if len(self.shown) == self.after:
            (other,) = multiprocessing.active_children()
            os.kill(other.pid, signal.SIGKILL)


SHORT = {"max_steps": 5, "network_settings": {"hidden_units": 16, "num_layers": 2, "normalize": True}}


@pytest.mark.parametrize(
    "kind", ["td3_bc", *(pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS if kind != "td3_bc")]
)
def test_two_processes_learn_what_one_does(tmp_path, roller_ball, kind):
    offline = {"evaluation_episodes": 0}
    for name, count in (("one", 1), ("two", 2)):
        train(by(count, tmp_path / name, roller_ball, SHORT | KINDS[kind], offline=offline), StopAfter())
    one, two = learnt(tmp_path / "one"), learnt(tmp_path / "two")
    assert torch.equal(one["generator"], two["generator"])
    # Five steps of Adam at 3e-4 move a weight by up to 1.5e-3; sums in another order differ in the last bits.
    assert greatest_difference(one["policy"], two["policy"]) < 2e-5
    assert greatest_difference(one["networks"], two["networks"]) < 1e-4


@pytest.mark.slow
def test_of_two_processes_as_well_the_policy_that_returned_most_is_kept(tmp_path, roller_ball):
    watcher = StopAfter()
    result = train(by(2, tmp_path, roller_ball, BEST, offline=EVERY_200), watcher)
    returns = {each.steps: each.mean_reward for each in watcher.shown if each.steps % 200 == 0}
    _, card = load_policy(result.policy)
    assert set(returns) == {200, 400, 600}
    assert card.figures["training_reward"] == max(returns.values()) == returns[card.steps]


@pytest.mark.slow
def test_a_run_whose_process_was_killed_goes_on_bit_for_bit(tmp_path, roller_ball):
    kind = {**KINDS["iql"], "checkpoint_interval": 200}
    train(by(2, tmp_path / "whole", roller_ball, kind), StopAfter())
    with pytest.raises(RunError, match=r"process 2 of 2 was ended by SIGKILL, and the others with it; --resume"):
        train(by(2, tmp_path / "killed", roller_ball, kind), Killer(3))
    assert not multiprocessing.active_children()
    assert not torch.distributed.is_initialized()
    assert learnt(tmp_path / "killed")["steps"] < 900
    train(by(2, tmp_path / "killed", roller_ball, kind, resume=True), StopAfter())
    assert same(learnt(tmp_path / "whole"), learnt(tmp_path / "killed"))


@pytest.mark.parametrize(
    ("kind", "processes", "sentence"),
    [
        ({"trainer_type": "ppo"}, 2, "torch_settings.processes 2: trainer_type ppo trains in one"),
        ({"trainer_type": "iql"}, 3, "torch_settings.processes 3: batch_size 256 cannot be divided evenly among 3"),
    ],
)
def test_what_several_processes_cannot_train_is_refused(tmp_path, roller_ball, kind, processes, sentence):
    dataset = None if kind["trainer_type"] == "ppo" else roller_ball
    with pytest.raises(RunError, match=sentence):
        train(by(processes, tmp_path, dataset, kind), StopAfter())
    assert not (tmp_path / "run").exists()
