"""Offline runs through the same training loop as all others, and what goes on from them in the simulator."""

import json

import pytest
import torch
from pydantic import ValidationError

from policies.learn.checkpoint import checkpoints, load, save
from policies.learn.config.run import RunConfig
from policies.learn.evaluate import Evaluation, evaluate
from policies.learn.export.policy_file import CHECKPOINT, load_policy
from policies.learn.export.policy_path import CheckpointError
from policies.learn.rollout.demonstrations import DemonstrationError
from policies.learn.trainer import Training, train
from policies.tasks.catalogue import task_settings

NETWORK = {"hidden_units": 16, "num_layers": 2, "normalize": True}
TRANSFORMER = {**NETWORK, "memory": {"memory_type": "transformer", "sequence_length": 4, "layers": 1, "heads": 2}}
KINDS = {
    "bc": {"trainer_type": "bc", "hyperparameters": {"best_fraction": 0.5}},
    "bc with a mixture and a transformer": {"trainer_type": "bc", "network_settings": {**TRANSFORMER, "mixture": 2}},
    "td3_bc": {"trainer_type": "td3_bc"},
    "iql": {"trainer_type": "iql", "hyperparameters": {"learning_rate_schedule": "linear"}},
    "awac": {"trainer_type": "awac"},
}
FOR_PPO = {"trainer_type": "iql", "hyperparameters": {"actions": "clipped"}}


class StopAfter:
    """Watches, and stops after so many iterations."""

    def __init__(self, iterations=None):
        self.iterations, self.shown, self.notes = iterations, [], []

    @property
    def is_stopped(self):
        return len(self.shown) == self.iterations

    def show(self, progress):
        self.shown.append(progress)

    def note(self, line):
        self.notes.append(line)


def config(folder, dataset, kind, *, run="run", offline=None, **settings):
    named = {"dataset": dataset, "evaluation_interval": 400, "evaluation_episodes": 8, "reference_returns": [-1, 1]}
    behavior = {
        "max_steps": 900,
        "summary_freq": 400,
        "checkpoint_interval": 10**9,
        "network_settings": NETWORK,
        "offline": named | (offline or {}) if dataset else None,
        **(KINDS[kind] if isinstance(kind, str) else kind),
    }
    return RunConfig.model_validate(
        {
            "behavior_name": "B",
            "behavior": behavior,
            "env_settings": {"env_path": "RollerBall", "num_areas": 8, "seed": 5},
            "checkpoint_settings": {"results_dir": str(folder), "run_id": run, **settings},
        }
    )


def same(a, b):
    if isinstance(a, torch.Tensor):
        return torch.equal(a, b)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return a == b


@pytest.mark.parametrize("kind", list(KINDS))
def test_an_offline_run_goes_on_bit_for_bit(tmp_path, roller_ball, kind):
    whole = train(config(tmp_path / "a", roller_ball, kind), StopAfter())
    assert whole.progress.steps == 900
    assert whole.progress.scores.episode_count == 8  # of the last evaluation
    train(config(tmp_path / "b", roller_ball, kind), StopAfter(2))
    train(config(tmp_path / "b", roller_ball, kind, resume=True), StopAfter())
    (a,), (b,) = (checkpoints(tmp_path / run / "run" / "B", "B")[-1:] for run in "ab")
    one, other = load(a, CHECKPOINT), load(b, CHECKPOINT)
    assert same(one["learner"], other["learner"])
    status = json.loads((tmp_path / "a" / "run" / "run_logs" / "training_status.json").read_text())
    assert status["end"] == "max_steps"


def test_a_trained_policy_is_a_policy_as_all_others(tmp_path, roller_ball):
    result = train(config(tmp_path, roller_ball, "iql"), StopAfter())
    policy, card = load_policy(result.policy)
    assert result.network.exists()
    assert (card.task, card.steps) == ("RollerBall", 900)
    played = evaluate(policy, "RollerBall", task_settings("RollerBall", {}), episodes=100, seed=3)
    assert played.success_rate > 0.3
    curves = next((tmp_path / "run" / "B").glob("events.out.tfevents.*")).read_bytes()
    for tag in (b"Losses/Critic Loss", b"Offline/Normalized Score", b"Environment/Cumulative Reward"):
        assert tag in curves


class Returns:
    """Judges in place of the simulator: returns in this order, and what was judged."""

    def __init__(self, *returns):
        self.returns, self.seen = iter(returns), []

    def __call__(self, policy):
        self.seen.append({name: value.clone() for name, value in policy.state_dict().items()})
        return Evaluation({"success": 1, "timeout": 7}, next(self.returns), 10.0)


BEST = {"trainer_type": "bc", "keep_best": True, "max_steps": 600, "summary_freq": 200}
EVERY_200 = {"evaluation_interval": 200, "evaluation_episodes": 8}


def test_the_policy_that_returned_most_is_what_training_ends_with(tmp_path, roller_ball):
    training = Training(config(tmp_path, roller_ball, BEST, offline=EVERY_200), StopAfter())
    training.learner._judge = judge = Returns(1.0, 3.0, 2.0)
    result = training.run()
    policy, card = load_policy(result.policy)
    assert same(dict(policy.state_dict()), judge.seen[1])
    assert (card.steps, card.figures["training_reward"]) == (400, 3.0)
    assert result.judged is None  # the evaluation that chose it is no judgement of it


def test_the_best_of_all_evaluations_is_known_after_a_stop(tmp_path, roller_ball):
    stopped = Training(config(tmp_path, roller_ball, BEST, offline=EVERY_200), StopAfter(2))
    stopped.learner._judge = before = Returns(1.0, 3.0)
    stopped.run()
    resumed = Training(config(tmp_path, roller_ball, BEST, offline=EVERY_200, resume=True), StopAfter())
    resumed.learner._judge = Returns(2.0)
    assert same(dict(load_policy(resumed.run().policy)[0].state_dict()), before.seen[1])


def test_the_best_takes_evaluations(tmp_path, roller_ball):
    with pytest.raises(ValidationError, match="evaluation_episodes of offline are 0"):
        config(tmp_path, roller_ball, BEST, offline={"evaluation_episodes": 0})


def test_with_a_target_the_policy_that_reached_it_is_kept(tmp_path, roller_ball):
    training = Training(config(tmp_path, roller_ball, BEST | {"success_target": 0.5}, offline=EVERY_200), StopAfter())
    training.learner._judge = Returns(3.0, 1.0, 2.0)
    training._target = target = Reached()
    result = training.run()
    assert result.end == "success_target"
    assert same(dict(load_policy(result.policy)[0].state_dict()), target.judged[-1])


class Reached:
    """A target that the second policy reaches that is held against it."""

    def __init__(self):
        self.judged = []

    def judge(self, policy, *_):
        self.judged.append({name: value.clone() for name, value in policy.state_dict().items()})
        return Evaluation({"success": len(self.judged), "timeout": 2}, 0.0, 10.0)

    def is_reached(self, judged):
        return judged.outcomes["success"] == 2


def test_a_run_is_not_gone_on_with_on_other_data(tmp_path, roller_ball):
    train(config(tmp_path, roller_ball, "bc"), StopAfter(1))
    twice = config(tmp_path, [roller_ball, roller_ball], "bc", resume=True)
    with pytest.raises(CheckpointError, match=r"offline.dataset: is not the one that the run began with: decisions is"):
        Training(twice, StopAfter())


def test_a_dataset_too_large_for_memory_is_mapped_from_the_cache(tmp_path, roller_ball, monkeypatch):
    monkeypatch.setattr("policies.offline.build_offline.MEMORY_LIMIT", 0)
    offline = {"cache": str(tmp_path / "cache")}
    train(config(tmp_path, roller_ball, "bc", offline=offline), StopAfter(1))
    assert len(list((tmp_path / "cache").glob("rows-*.npy"))) == 1


def test_sac_goes_on_with_policy_critics_and_data(tmp_path, roller_ball):
    train(config(tmp_path, roller_ball, "iql", run="offline"), StopAfter())
    hyperparameters = {
        "batch_size": 32,
        "buffer_size": 1600,
        "init_entcoef": 0.01,
        "steps_per_update": 20,
        "prefill": 0.5,
        "hold": 1.0,
        "hold_steps": 2000,
        "save_replay_buffer": True,
    }
    sac = {"trainer_type": "sac", "hyperparameters": hyperparameters, "max_steps": 2000}
    training = Training(config(tmp_path, roller_ball, sac, run="online", initialize_from="offline"), StopAfter())
    offline = load(checkpoints(tmp_path / "offline" / "B", "B")[-1], CHECKPOINT)
    assert same(dict(training.learner.policy.state_dict()), offline["policy"]["weights"])
    critics = training.learner.networks.critics.state_dict()
    assert same(dict(critics), offline["learner"]["networks"]["critics"])
    assert len(training.learner.replay) == 800
    result = training.run()
    assert (result.progress.steps, len(training.learner.replay)) == (2000, 1600)
    # It goes on bit for bit, too.
    train(config(tmp_path, roller_ball, sac, run="halved", initialize_from="offline"), StopAfter(1))
    train(config(tmp_path, roller_ball, sac, run="halved", resume=True), StopAfter())
    (a,), (b,) = (checkpoints(tmp_path / run / "B", "B")[-1:] for run in ("online", "halved"))
    assert same(load(a, CHECKPOINT)["policy"], load(b, CHECKPOINT)["policy"])


def test_the_hold_keeps_the_policy_near_what_was_recorded(tmp_path, roller_ball):
    train(config(tmp_path, roller_ball, "bc", run="offline"), StopAfter())
    before, _ = load_policy(tmp_path / "offline" / "B.pt")
    moved = {}
    for hold in (0.0, 100.0):
        hyperparameters = {"batch_size": 64, "buffer_size": 1600, "steps_per_update": 10, "prefill": 1.0, "hold": hold}
        sac = {"trainer_type": "sac", "hyperparameters": hyperparameters, "max_steps": 2000}
        run = config(tmp_path, roller_ball, sac, run=f"hold {hold}", initialize_from="offline")
        training = Training(run, StopAfter())
        training.run()
        observations = training.learner.replay.rows.flatten(0, 1)[:500, : before.layout.observation_size]
        with torch.inference_mode():
            apart = [policy(observations).mean.tanh() for policy in (before, training.learner.policy)]
        moved[hold] = (apart[0] - apart[1]).abs().mean().item()
    assert moved[100.0] < 0.5 * moved[0.0]


def test_ppo_goes_on_and_its_policy_waits_for_the_critic(tmp_path, roller_ball):
    train(config(tmp_path, roller_ball, FOR_PPO, run="offline"), StopAfter())
    hyperparameters = {"batch_size": 64, "buffer_size": 512, "critic_warm_up": 1000, "start_deviation": 0.1}
    ppo = {"trainer_type": "ppo", "hyperparameters": hyperparameters, "max_steps": 2000}
    training = Training(config(tmp_path, None, ppo, run="online", initialize_from="offline"), StopAfter())
    before = {name: tensor.clone() for name, tensor in training.learner.policy.state_dict().items()}
    training.learner.iterate()
    training.learner.iterate()
    assert same(before, dict(training.learner.policy.state_dict()))
    training.learner.iterate()
    assert not same(before, dict(training.learner.policy.state_dict()))
    squashed = config(tmp_path, roller_ball, "iql", run="squashed")
    train(squashed, StopAfter(1))
    with pytest.raises(CheckpointError, match="trainer_type is sac there and ppo here"):
        Training(config(tmp_path, None, ppo, run="other", initialize_from="squashed"), StopAfter())


@pytest.mark.parametrize(
    ("behavior", "sentence"),
    [
        ({"trainer_type": "iql", "offline": None}, "offline: is missing: trainer_type iql learns from a dataset"),
        ({"trainer_type": "ppo"}, "offline: has no effect with trainer_type ppo"),
        (
            {"trainer_type": "sac", "hyperparameters": {"prefill": 0.5}, "offline": None},
            "offline: is missing: hyperparameters prefill and hold take its dataset",
        ),
        (
            {"trainer_type": "iql", "network_settings": {"mixture": 2}},
            "network_settings: mixture: is for trainer_type bc, not for iql",
        ),
        (
            {"trainer_type": "ppo", "offline": None, "network_settings": TRANSFORMER},
            "network_settings: memory.memory_type transformer: is for trainer_type bc or dagger, not for ppo",
        ),
        (
            {"trainer_type": "bc", "network_settings": {**TRANSFORMER, "hidden_units": 15}},
            "hidden_units: 15 must be a multiple of memory.heads, which is 2",
        ),
        ({"trainer_type": "iql", "offline": {"dataset": []}}, "at least 1 item"),
        ({"trainer_type": "iql", "offline": {"dataset": "a", "reference_returns": [1, 1]}}, "must differ"),
    ],
)
def test_what_does_not_fit_together_is_refused(tmp_path, behavior, sentence):
    with pytest.raises(ValidationError, match=sentence):
        config(tmp_path, "nowhere", behavior)


def test_nothing_is_written_where_there_is_no_dataset(tmp_path):
    with pytest.raises(DemonstrationError, match="no such file or folder"):
        train(config(tmp_path / "runs", str(tmp_path / "none"), "iql"), StopAfter())
    assert not (tmp_path / "runs").exists()


def test_a_damaged_checkpoint_of_other_settings_is_refused(tmp_path, roller_ball):
    train(config(tmp_path, roller_ball, "iql"), StopAfter(1))
    path = checkpoints(tmp_path / "run" / "B", "B")[-1]
    content = load(path, CHECKPOINT)
    content["must_fit"]["hyperparameters.actions"] = "clipped"
    save(path, content, CHECKPOINT)
    with pytest.raises(CheckpointError, match=r"hyperparameters.actions is clipped there and squashed here"):
        Training(config(tmp_path, roller_ball, "iql", resume=True), StopAfter())
