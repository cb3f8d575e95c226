"""`honeyguide train`: runs that end, are killed, go on and are left alone as the documentation says."""

import json
import os
import random
import signal
import subprocess
import threading
import time
from pathlib import Path

import pytest
import torch

from policies.learn.checkpoint import checkpoints, load
from policies.learn.config.load import load_config
from policies.learn.export.policy_file import load_policy
from policies.learn.export.provenance import code_record
from tests.small_files import files_of_at_most
from tests.unit.mission.train.training_run import RUN, honeyguide, in_process, train, write_config


def without_times(checkpoint):
    content = load(checkpoint, "checkpoint")
    content.pop("elapsed_s")
    content.pop("events")
    for entry in content["saved"]:
        entry.pop("elapsed_s")
        entry.pop("file_path")
    return content


def assert_same(one, other, place=""):
    if isinstance(one, dict):
        assert one.keys() == other.keys(), place
        for key, value in one.items():
            assert_same(value, other[key], f"{place}.{key}")
    elif isinstance(one, list | tuple):
        assert len(one) == len(other), place
        for k, value in enumerate(one):
            assert_same(value, other[k], f"{place}[{k}]")
    elif isinstance(one, torch.Tensor):
        assert torch.equal(one, other), place
    elif hasattr(one, "tobytes"):
        assert one.tobytes() == other.tobytes(), place
    else:
        assert one == other or (one != one and other != other), place


def assert_same_run(finished, other):
    assert (finished / "Ball.pt").read_bytes() == (other / "Ball.pt").read_bytes()
    assert (finished / "Ball.onnx").read_bytes() == (other / "Ball.onnx").read_bytes()
    ends = [checkpoints(run / "Ball", "Ball")[-1] for run in (finished, other)]
    assert_same(*(without_times(end) for end in ends))


def curve(run, tag="Losses/Policy Loss"):
    from tensorboard.backend.event_processing.event_file_loader import EventFileLoader

    (file,) = (run / "Ball").glob("events.out.tfevents.*")
    events = EventFileLoader(str(file)).Load()
    return [
        (event.step, value.tensor.float_val[0]) for event in events for value in event.summary.value if value.tag == tag
    ]


def test_run_is_laid_out_as_ml_agents_lays_it_out(finished):
    steps = [2048 * k for k in range(1, 6)]
    assert sorted(path.relative_to(finished).as_posix() for path in finished.rglob("*") if path.is_file()) == sorted(
        [
            "Ball.onnx",
            "Ball.pt",
            *(f"Ball/Ball-{step}.{kind}" for step in steps for kind in ("pt", "onnx")),
            *(path.relative_to(finished).as_posix() for path in (finished / "Ball").glob("events.out.tfevents.*")),
            "configuration.yaml",
            "run_logs/training_status.json",
        ]
    )
    assert load_config(finished / "configuration.yaml").config.behavior.max_steps == 10_000
    status = json.loads((finished / "run_logs/training_status.json").read_text())
    assert [entry["steps"] for entry in status["Ball"]["checkpoints"]] == steps
    assert status["end"] == "max_steps"


def test_curves_have_ml_agents_tags(finished):
    assert [step for step, _ in curve(finished)] == [2048 * k for k in range(1, 6)]
    for tag in ("Environment/Cumulative Reward", "Environment/Episode Length", "Policy/Entropy", "Is Training"):
        assert len(curve(finished, tag)) == 5, tag


def test_card_says_where_the_policy_comes_from(finished):
    _, card = load_policy(finished / "Ball.pt")
    assert (card.task, card.seed, card.steps) == ("RollerBall", 3, 10_240)
    assert card.settings["split"] == "train"
    figures = card.figures
    low, high = figures["training_success_low"], figures["training_success_high"]
    assert 0.0 <= low < figures["training_success_rate"] < high <= 1.0
    assert figures["training_episodes"] > 100
    assert card.code == code_record()
    assert (card.teacher, card.data, card.parents) == ({}, [], [])


def test_same_seed_trains_the_same_policy(finished):
    write_config()
    assert train().exit_code == 0
    assert_same_run(finished, RUN)


def test_training_killed_at_a_random_moment_and_resumed_ends_with_the_same_bytes(finished):
    write_config()
    kill_and_resume(1, random.Random(), finished)


@pytest.mark.slow
def test_training_killed_many_times_ends_with_the_same_bytes(tmp_path_factory):
    write_config(max_steps=60_000)
    assert honeyguide("train", "config.yaml", "--run-id", "whole").exit_code == 0
    kill_and_resume(8, random.Random(), Path("results/whole"))


def kill_and_resume(kill_count, chance, finished):
    words = ["train", "config.yaml", "--run-id", "run"]
    for _ in range(kill_count):
        resume = ["--resume"] if checkpoints(RUN / "Ball", "Ball") else ["--force"]
        known = len(list(RUN.glob("Ball/*.pt")))
        process = in_process(*words, *resume, stdout=subprocess.DEVNULL)
        while process.poll() is None and len(list(RUN.glob("Ball/*.pt"))) <= known:
            time.sleep(0.005)
        time.sleep(chance.uniform(0.0, 0.15))
        process.send_signal(signal.SIGKILL)
        process.communicate()
    result = train("--resume")
    assert result.exit_code == 0, result.output
    assert_same_run(finished, RUN)
    assert curve(RUN) == curve(finished)


def test_interrupted_training_saves_and_goes_on_to_the_same_end(finished):
    write_config()

    def interrupt():
        while not list(RUN.glob("Ball/*.pt")):
            time.sleep(0.005)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    result = train()
    thread.join()
    assert result.exit_code == 0, result.output
    assert "stopped by the user" in result.output
    assert (RUN / "Ball.onnx").exists()
    assert train("--resume").exit_code == 0
    assert_same_run(finished, RUN)


def test_full_disk_ends_with_one_sentence_and_leaves_the_last_checkpoint():
    """The limit on a file's size stands for a full disk; the second checkpoint does not fit any more."""
    write_config(max_steps=2_000)
    assert train().exit_code == 0
    before = {path: path.read_bytes() for path in RUN.rglob("*.pt")}
    write_config()
    size = max(len(content) for content in before.values()) - 1000
    with files_of_at_most(size):
        result = train("--resume")
    assert result.exit_code == 2
    assert result.stderr == "honeyguide: results/run/Ball/Ball-4096.pt: cannot be written: File too large\n"
    assert {path: path.read_bytes() for path in RUN.rglob("*.pt")} == before
    assert not list(RUN.rglob("*.part"))


def test_run_of_the_same_name_is_left_alone(finished):
    write_config()
    RUN.mkdir(parents=True)
    (RUN / "note.txt").write_text("mine")
    result = train()
    assert result.exit_code == 2
    assert "results/run: data of a run of this name was found; give another --run-id, --resume" in result.stderr
    assert [path.name for path in RUN.iterdir()] == ["note.txt"]
    write_config(max_steps=2_000)
    assert train("--force").exit_code == 0
    assert (RUN / "note.txt").read_text() == "mine"


def test_forced_run_leaves_no_checkpoint_of_the_one_before():
    write_config()
    assert train().exit_code == 0
    write_config(max_steps=2_000)
    assert train("--force").exit_code == 0
    assert [path.name for path in checkpoints(RUN / "Ball", "Ball")] == ["Ball-2048.pt"]


def test_resuming_what_is_not_there_is_refused():
    write_config()
    result = train("--resume")
    assert result.exit_code == 2
    assert "results/run: no data of this run was found" in result.stderr


def test_oldest_checkpoints_are_removed():
    write_config(keep_checkpoints=2)
    assert train().exit_code == 0
    assert sorted(path.name for path in (RUN / "Ball").glob("Ball-*")) == [
        *("Ball-10240.onnx", "Ball-10240.pt", "Ball-8192.onnx", "Ball-8192.pt")
    ]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            {"network_settings": {"hidden_units": 32, "num_layers": 1}},
            "network_settings.hidden_units is 16 there and 32",
        ),
        ({"hyperparameters": {"buffer_size": 2048, "shared_critic": True}}, "hyperparameters.shared_critic is False"),
        ({"reward_signals": {"extrinsic": {}, "rnd": {}}}, "made without reward_signals.rnd.network_settings"),
    ],
)
def test_checkpoint_of_other_settings_is_refused_with_the_first_difference(change, sentence):
    write_config(max_steps=2_000)
    assert train().exit_code == 0
    write_config(**change)
    result = train("--resume")
    assert result.exit_code == 2
    assert "results/run/Ball/Ball-2048.pt: " in result.stderr
    assert sentence in result.stderr


def test_checkpoint_of_another_task_is_refused():
    write_config(max_steps=2_000)
    assert train().exit_code == 0
    result = train("--resume", "--env", "ReachTarget")
    assert result.exit_code == 2
    assert (
        "Ball-2048.pt: made for another task or preset: task is RollerBall there and ReachTarget here" in result.stderr
    )


def test_damaged_checkpoint_is_refused():
    write_config(max_steps=2_000)
    assert train().exit_code == 0
    path = RUN / "Ball/Ball-2048.pt"
    path.write_bytes(path.read_bytes()[:5000])
    result = train("--resume")
    assert result.exit_code == 2
    assert "Ball-2048.pt: not a checkpoint of honeyguide, or damaged" in result.stderr


def test_new_run_starts_from_the_policy_of_another(finished):
    write_config(max_steps=1)
    for name, words in (("a", ()), ("b", ("--initialize-from", "a", "--seed", "9"))):
        assert honeyguide("train", "config.yaml", "--run-id", name, *words).exit_code == 0
    a, b, other = (
        load_policy(path)[0].state_dict()["body.layers.0.weight"]
        for path in (Path("results/a/Ball.pt"), Path("results/b/Ball.pt"), finished / "Ball.pt")
    )
    assert (a - b).abs().max() < 0.1 < (other - b).abs().max() + 0.1
    result = honeyguide("train", "config.yaml", "--run-id", "c", "--initialize-from", "none")
    assert result.exit_code == 2
    assert "--initialize-from: results/none: there is no such run" in result.stderr


def test_training_stops_when_episodes_it_did_not_train_on_succeed():
    write_config(max_steps=300_000, success_target=0.1, checkpoint_interval=500_000)
    result = train()
    assert "success target reached" in result.output
    _, card = load_policy(RUN / "Ball.pt")
    assert card.figures["success_low"] >= 0.1
    assert card.figures["episodes"] == 2000
    assert card.steps < 300_000


def test_training_says_that_it_draws_its_actions_whatever_the_configuration_asks_for():
    write_config(max_steps=1, network_settings={"hidden_units": 16, "deterministic": True})
    assert "deterministic: has an effect with --inference only" in train().output


def test_lessons_advance_and_are_shown():
    criteria = {"behavior": "Ball", "measure": "progress", "threshold": 0.5, "require_reset": True}
    lessons = [{"name": "easy", "value": 3.0, "completion_criteria": criteria}, {"name": "hard", "value": 1.0}]
    write_config(parameters={"reach_m": {"curriculum": lessons}})
    result = train()
    assert result.exit_code == 0, result.output
    assert "reach_m: lesson hard begins" in result.output
    assert [lesson for _, lesson in curve(RUN, "Environment/Lesson Number/reach_m")] == [0, 0, 1, 1, 1]
