"""The training loop goes on bit for bit, whatever learns; networks of other runs are a place to start from."""

import json

import pytest
import torch

from policies.learn.checkpoint import checkpoints, load, save
from policies.learn.config.run import RunConfig
from policies.learn.evaluate import Evaluation
from policies.learn.export.policy_file import CHECKPOINT, POLICY, load_policy
from policies.learn.export.policy_path import CheckpointError
from policies.learn.trainer import Training, train

PPO = {"hyperparameters": {"batch_size": 256, "buffer_size": 1024}}
NETWORK = {"hidden_units": 16, "num_layers": 1, "normalize": True}
RECURRENT = {**NETWORK, "memory": {"memory_size": 8, "sequence_length": 8}}
SAC = {"batch_size": 64, "buffer_size": 4000, "buffer_init_steps": 500, "steps_per_update": 50}
KINDS = {
    "ppo": {**PPO, "network_settings": NETWORK},
    "ppo with memory": {**PPO, "network_settings": RECURRENT},
    "ppo with curiosity and rnd": {
        **PPO,
        "network_settings": NETWORK,
        "reward_signals": {"extrinsic": {}, "curiosity": {"strength": 0.1}, "rnd": {"normalize_reward": True}},
    },
    "sac": {
        "trainer_type": "sac",
        "hyperparameters": {**SAC, "save_replay_buffer": True},
        "network_settings": NETWORK,
    },
    "sac with hindsight": {
        "trainer_type": "sac",
        "hyperparameters": {**SAC, "save_replay_buffer": True, "hindsight": 2},
        "network_settings": NETWORK,
    },
}


class StopAfter:
    """Watches, and stops after so many iterations."""

    def __init__(self, iterations=None):
        self.iterations = iterations
        self.shown = []
        self.notes = []

    @property
    def is_stopped(self):
        return len(self.shown) == self.iterations

    def show(self, progress):
        self.shown.append(progress)

    def note(self, line):
        self.notes.append(line)


def config(folder, kind="ppo", **settings):
    """A run of a kind, or of a behaviour's own block."""
    return RunConfig.model_validate(
        {
            "behavior_name": "B",
            "behavior": {
                "max_steps": 4_000,
                "summary_freq": 1_500,
                "checkpoint_interval": 10**9,
                **(kind if isinstance(kind, dict) else KINDS[kind]),
            },
            "env_settings": {"env_path": "RollerBall", "num_areas": 64, "seed": 5},
            "environment_parameters": {"force_n": {"sampler_type": "uniform", "sampler_parameters": UNIFORM}},
            "checkpoint_settings": {"results_dir": str(folder), "run_id": "run", **settings},
        }
    )


def imitating(kind, demonstrations):
    """The same, with GAIL (its code noisy) and cloning."""
    gail = {
        "demo_path": demonstrations,
        "use_vail": True,
        "use_actions": True,
        "network_settings": {"hidden_units": 16},
    }
    cloning = {"demo_path": demonstrations, "samples_per_update": 256, "steps": 4_000}
    return {**KINDS[kind], "reward_signals": {"extrinsic": {}, "gail": gail}, "behavioral_cloning": cloning}


UNIFORM = {"min_value": 8.0, "max_value": 12.0}


@pytest.mark.parametrize("kind", KINDS)
def test_stopped_and_resumed_training_ends_with_the_same_bytes(tmp_path, kind):
    goes_on_bit_for_bit(tmp_path, KINDS[kind])


@pytest.mark.parametrize("kind", ["ppo", "ppo with memory", "sac"])
def test_so_does_one_that_imitates(tmp_path, kind, demonstrations):
    goes_on_bit_for_bit(tmp_path, imitating(kind, demonstrations))


def goes_on_bit_for_bit(tmp_path, behavior):
    whole = train(config(tmp_path / "whole", behavior), StopAfter())
    for iterations in (1, 1):
        is_first = not (tmp_path / "parts").exists()
        train(config(tmp_path / "parts", behavior, resume=not is_first), StopAfter(iterations))
    parts = train(config(tmp_path / "parts", behavior, resume=True), StopAfter())
    assert whole.end == parts.end == "max_steps"
    assert whole.policy.read_bytes() == parts.policy.read_bytes()
    ends = [checkpoints(tmp_path / name / "run" / "B", "B")[-1] for name in ("whole", "parts")]
    learners = [load(end, "checkpoint")["learner"] for end in ends]
    torch.testing.assert_close(*(_tensors(learner) for learner in learners), rtol=0.0, atol=0.0, equal_nan=True)


def _tensors(state):
    """Nested plain values with arrays as tensors of their bytes."""
    if isinstance(state, dict):
        return {key: _tensors(value) for key, value in state.items()}
    if isinstance(state, list | tuple):
        return [_tensors(value) for value in state]
    if hasattr(state, "tobytes"):
        return torch.frombuffer(bytearray(state.tobytes()) or bytearray(1), dtype=torch.uint8)
    if isinstance(state, bool | int | float):
        return torch.tensor(state, dtype=torch.float64)
    return state if isinstance(state, torch.Tensor) else torch.zeros(0)


def test_preparing_a_training_writes_nothing(tmp_path):
    Training(config(tmp_path), StopAfter())
    assert list(tmp_path.iterdir()) == []


def test_progress_counts_steps_and_episodes(tmp_path):
    watcher = StopAfter()
    train(config(tmp_path), watcher)
    assert [progress.steps for progress in watcher.shown] == [1024, 2048, 3072, 4096]
    assert watcher.shown[-1].scores.episode_count > 0
    assert watcher.shown[-1].left_s == 0.0
    assert watcher.shown[0].left_s > 0.0
    assert "RollerBall" in watcher.notes[0]


def test_status_lists_the_checkpoints_that_are_there(tmp_path):
    given = config(tmp_path, {**KINDS["ppo"], "checkpoint_interval": 1_000, "keep_checkpoints": 2})
    train(given, StopAfter())
    status = json.loads((tmp_path / "run" / "run_logs" / "training_status.json").read_text())
    listed = [entry["file_path"] for entry in status["B"]["checkpoints"]]
    assert listed == [str(path) for path in checkpoints(tmp_path / "run" / "B", "B")]
    assert len(listed) == 2


def test_a_lesson_that_asks_for_it_begins_with_new_episodes_and_no_memory(tmp_path):
    criteria = {"behavior": "B", "measure": "progress", "threshold": 0.2, "require_reset": True}
    lessons = [{"name": "a", "value": 1.0, "completion_criteria": criteria}, {"name": "b", "value": 2.0}]
    given = config(tmp_path, "ppo with memory")
    given = RunConfig.model_validate(
        given.model_dump() | {"environment_parameters": {"reach_m": {"curriculum": lessons}}}
    )
    training = Training(given, StopAfter(1))
    training.run()
    state = training.learner.state()
    assert not state["task"]["steps"].any()
    assert not state["memory"].any()
    assert not state["critic_memory"].any()


def test_sequences_that_the_buffer_is_too_short_for_are_told_of(tmp_path):
    given = config(tmp_path, {**KINDS["ppo"], "network_settings": {"hidden_units": 16, "memory": {"memory_size": 8}}})
    watcher = StopAfter(1)
    train(given, watcher)
    assert watcher.notes[1].startswith("network_settings.memory.sequence_length 64: is 16 here, as buffer_size 1024 is")


def test_seed_is_chosen_and_kept_where_none_is_given(tmp_path):
    given = config(tmp_path)
    given = given.model_copy(update={"env_settings": given.env_settings.model_copy(update={"seed": -1})})
    first = Training(given, StopAfter())
    assert first.seed != Training(given, StopAfter()).seed
    first.watcher = StopAfter(1)
    first.run()
    resume = given.checkpoint_settings.model_copy(update={"resume": True})
    again = Training(given.model_copy(update={"checkpoint_settings": resume}), StopAfter())
    assert again.seed == first.seed == load_policy(first.folder.policy)[1].seed


@pytest.mark.parametrize("kind", ["ppo", "sac"])
def test_networks_of_another_run_are_where_a_new_one_starts(tmp_path, kind):
    train(config(tmp_path, kind), StopAfter(2))
    start = Training(config(tmp_path, kind, initialize_from="run", run_id="next"), StopAfter()).learner.state()
    there = load(checkpoints(tmp_path / "run" / "B", "B")[-1], "checkpoint")["learner"]
    if kind == "sac":
        start, there = start | start["networks"], there | there["networks"]
    for name in ("policy", "critic") if kind == "ppo" else ("policy", "critics", "targets"):
        torch.testing.assert_close(_tensors(start[name]), _tensors(there[name]), rtol=0.0, atol=0.0)
    assert start["steps"] == 0


def test_a_policy_saved_before_a_setting_of_networks_was_there_is_where_a_new_run_starts(tmp_path):
    old = tmp_path / "old.pt"
    content = load(train(config(tmp_path), StopAfter(1)).policy, POLICY)
    del content["policy"]["network"]["perceives"]
    save(old, content, POLICY)
    start = Training(config(tmp_path, KINDS["ppo"] | {"init_path": str(old)}, run_id="next"), StopAfter()).learner
    torch.testing.assert_close(start.policy.state_dict(), load_policy(old)[0].state_dict(), rtol=0.0, atol=0.0)


def test_a_policys_card_has_those_of_the_legs_before_also_after_the_run_went_on(tmp_path):
    legs = [load_policy(train(config(tmp_path), StopAfter(1)).policy)[1]]
    for name, before in (("second", "run"), ("third", "second")):
        given = config(tmp_path, initialize_from=before, run_id=name)
        train(given, StopAfter(1))
        resume = given.checkpoint_settings.model_copy(update={"resume": True})
        resumed = train(given.model_copy(update={"checkpoint_settings": resume}), StopAfter(1))
        legs.append(load_policy(resumed.policy)[1])
    assert [len(leg.parents) for leg in legs] == [0, 1, 2]
    assert [parent["seed"] for parent in legs[2].parents] == [leg.seed for leg in legs[:2]]
    assert all("parents" not in parent for parent in legs[2].parents)


def test_networks_that_do_not_fit_are_refused_with_the_first_difference(tmp_path):
    train(config(tmp_path), StopAfter(1))
    with pytest.raises(CheckpointError, match=r"network_settings\.memory"):
        Training(config(tmp_path, "ppo with memory", initialize_from="run", run_id="next"), StopAfter())
    with pytest.raises(CheckpointError, match="trainer_type is ppo there and sac here"):
        Training(config(tmp_path, "sac", initialize_from="run", run_id="next"), StopAfter())


@pytest.mark.parametrize("change", ["without a row", "of another size"])
def test_a_state_that_another_version_saved_otherwise_is_refused_in_one_sentence(tmp_path, change):
    train(config(tmp_path), StopAfter(1))
    path = checkpoints(tmp_path / "run" / "B", "B")[-1]
    content = load(path, CHECKPOINT)
    rows = content["learner"]["task"]
    rows["target"] = rows["target"][:3]
    if change == "without a row":
        del rows["target"]
    save(path, content, CHECKPOINT)
    with pytest.raises(CheckpointError, match="another version of honeyguide; --initialize-from"):
        Training(config(tmp_path, resume=True), StopAfter())


def test_policy_starts_alone_where_the_critic_has_other_signals(tmp_path):
    train(config(tmp_path), StopAfter(1))
    kind = "ppo with curiosity and rnd"
    learner = Training(config(tmp_path, kind, initialize_from="run", run_id="next"), StopAfter()).learner
    there = load_policy(tmp_path / "run" / "B.pt")[0]
    torch.testing.assert_close(learner.policy.state_dict(), there.state_dict(), rtol=0.0, atol=0.0)


class Judgements:
    """Stands for a success target: gives the judgements of a list, one after the other."""

    def __init__(self, *successes):
        self.left = [Evaluation({"success": count, "timeout": 100 - count}, 0.0, 1.0) for count in successes]
        self.policies = []

    def judge(self, policy, *_):
        self.policies.append({name: tensor.clone() for name, tensor in policy.state_dict().items()})
        return self.left.pop(0)

    def is_reached(self, _judged):
        return False


def test_the_policy_that_was_judged_best_is_what_training_ends_with(tmp_path):
    best = KINDS["ppo"] | {"success_target": 0.99, "keep_best": True, "summary_freq": 1_000}
    training = Training(config(tmp_path, best), StopAfter(3))
    training._target = judgements = Judgements(40, 70, 60)
    result = training.run()
    policy, card = load_policy(result.policy)
    torch.testing.assert_close(dict(policy.state_dict()), judgements.policies[1], rtol=0.0, atol=0.0)
    assert result.judged.success_rate == card.figures["success_rate"] == 0.7
    assert card.steps == 2048
    resumed = Training(config(tmp_path, best, resume=True), StopAfter(1))
    resumed._target = Judgements(69)
    again = load_policy(resumed.run().policy)[0]
    torch.testing.assert_close(again.state_dict(), policy.state_dict(), rtol=0.0, atol=0.0)


def test_without_a_target_the_best_is_kept_too_and_training_goes_on_to_its_end(tmp_path):
    best = KINDS["ppo"] | {"keep_best": True, "summary_freq": 1_000, "max_steps": 3_000}
    training = Training(config(tmp_path, best), StopAfter(100))
    result = training.run()
    assert result.end == "max_steps"
    assert result.judged is not None
    assert load_policy(result.policy)[1].figures["episodes"] == result.judged.episodes
