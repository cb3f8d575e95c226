"""What `honeyguide train` is asked: refusals with their place, flags of ML-Agents, settings of the task."""

import re
import shutil
from pathlib import Path

import pytest

from policies.learn.export.policy_file import load_policy
from tests.unit.mission.train.training_run import RUN, honeyguide, train, write_config


def test_unknown_number_is_refused():
    write_config(parameters={"reech_m": 2.0})
    result = train()
    assert result.exit_code == 2
    assert "environment_parameters.reech_m: this task has no such number" in result.stderr
    assert not RUN.exists()


@pytest.mark.parametrize(
    ("change", "words", "sentence"),
    [
        ({"env": "Roller"}, (), r"config\.yaml:\d+: env_settings\.env_path: Roller: no such task; there are "),
        ({}, ("--env", "Roller"), r"--env: Roller: no such task"),
        ({}, ("--env-args", "colour=red"), r"--env-args: RollerBall: colour: no such setting; there are preset, split"),
        ({}, ("--env-args", "preset=best"), r"preset: must be as-documented, as-coded or improved, not best"),
        (
            {"parameters": {"reach_m": {"curriculum": [
                {"name": "near", "value": 3, "completion_criteria": {"behavior": "Ball", "threshold": 0.5}},
                {"name": "far", "value": 1e-3},
            ]}}},
            (),
            r"config\.yaml:\d+: environment_parameters\.reach_m\.curriculum\[1\]\.value: 0\.001 is not between",
        ),
        (
            {"reward_signals": {"gail": {"demo_path": "demo"}}},
            (),
            r"config\.yaml:\d+: behaviors\.Ball\.reward_signals\.gail\.demo_path: demo: no such file",
        ),
        (
            {"behavioral_cloning": {"demo_path": "demo"}},
            (),
            r"config\.yaml:\d+: behaviors\.Ball\.behavioral_cloning\.demo_path: demo: no such file",
        ),
    ],
)  # fmt: skip
def test_what_the_task_has_not_is_refused_with_its_place(change, words, sentence):
    write_config(**change)
    result = train(*words)
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert re.search(sentence, line), line
    assert not RUN.exists()


def test_overwriting_and_resuming_are_not_kept_in_the_configuration(finished):
    shutil.copytree(finished, RUN)
    write_config()
    for flag in ("--resume", "--force"):
        assert train(flag).exit_code == 0
        assert honeyguide("train", RUN / "configuration.yaml").exit_code == 2  # there is a run of this name


def test_configuration_without_a_task_asks_for_one():
    write_config(env=None, max_steps=2_000)
    result = train()
    assert result.exit_code == 2
    assert "config.yaml: names no task in env_settings.env_path: give --env, one of RollerBall" in result.stderr
    assert train("--env", "RollerBall").exit_code == 0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("train", "Nothing"), "Nothing: there is no recipe of this name"),
        (("train", "none.yaml"), "none.yaml"),
        (("train", "config.yaml", "--env", "Nothing"), "Nothing: no such task"),
        (("train", "config.yaml", "--env-args", "preset"), "--env-args preset: must be KEY=VALUE"),
        (("train", "config.yaml", "--env-args", "speed=3"), "RollerBall: speed"),
        (("train", "config.yaml", "surplus"), "surplus: not expected"),
        (("train", "config.yaml", "--num-areas", "0"), "--num-areas"),
        (("train", "config.yaml", "--torch-device", "warp"), "torch_settings.device warp: torch finds no such device"),
        (("train", "config.yaml", "--torch-device", "cuda:7"), "torch_settings.device cuda:7: torch finds no such"),
        (("eval", "nothing"), "nothing: no such policy file, and no such run in results/"),
        (("eval", "config.yaml"), "config.yaml: not a policy or checkpoint of honeyguide, or damaged"),
        (("export", "nothing"), "nothing: no such policy file"),
    ],
)
def test_wrong_words_get_one_sentence(words, sentence):
    write_config()
    result = honeyguide(*words)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not Path("results").exists()


def test_flags_of_ml_agents_are_accepted_and_say_so():
    write_config(max_steps=1)
    result = train("--train", "--width", "84", "--base-port", "5005", "--no-graphics", "--time-scale", "20")
    assert result.exit_code == 0
    for option in ("--width", "--base-port", "--no-graphics", "--time-scale"):
        assert f"{option}: accepted, has no effect here" in result.output
    assert "--train" not in result.output


def test_all_settings_after_env_args_belong_to_it():
    write_config(max_steps=1)
    assert train("--env-args", "preset=as-coded", "stack=2").exit_code == 0
    assert load_policy(RUN / "Ball.pt")[1].settings["stack"] == 2
