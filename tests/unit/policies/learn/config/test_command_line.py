import pytest

from common.config.yaml_locations import ConfigError
from policies.learn.config.behavior import Behavior
from policies.learn.config.command_line import CommandLine, flags, with_command_line
from policies.learn.config.environment import CompletionCriteria, Curriculum, EnvSettings, Lesson
from policies.learn.config.load import Loaded
from policies.learn.config.network import NetworkSettings
from policies.learn.config.run import CheckpointSettings, RunConfig, TorchSettings

FILE = RunConfig(
    behavior_name="Car",
    behavior=Behavior(network_settings=NetworkSettings(hidden_units=7)),
    env_settings=EnvSettings(env_path="RollerBall", num_areas=4, seed=3),
    checkpoint_settings=CheckpointSettings(run_id="file", initialize_from="another"),
)


def merged(**given):
    return with_command_line(Loaded(FILE), CommandLine(**given))


def test_nothing_said_changes_nothing():
    assert merged() == Loaded(FILE)


def test_the_command_line_beats_the_file_and_leaves_the_rest():
    config = merged(
        env="ReachTarget",
        env_args=("variant=3",),
        run_id="mine",
        seed=0,
        num_envs=2,
        num_areas=8,
        results_dir="there",
        torch_device="cuda:0",
        deterministic=True,
        inference=True,
        force=True,
        time_scale=5,
        no_graphics=True,
        debug=True,
    ).config
    assert config.env_settings == EnvSettings(
        env_path="ReachTarget", env_args=("variant=3",), num_envs=2, num_areas=8, seed=0
    )
    assert config.env_settings.env_count == 16
    assert config.checkpoint_settings == CheckpointSettings(
        run_id="mine", initialize_from="another", force=True, inference=True, results_dir="there"
    )
    assert config.torch_settings == TorchSettings(device="cuda:0")
    assert config.behavior.network_settings == NetworkSettings(hidden_units=7, deterministic=True)
    assert (config.engine_settings.time_scale, config.engine_settings.no_graphics, config.debug) == (5.0, True, True)


@pytest.mark.parametrize("flag", ["resume", "load"])
def test_resume_beats_initialize_from(flag):
    loaded = merged(initialize_from="yet-another", **{flag: True})
    assert loaded.config.checkpoint_settings == CheckpointSettings(run_id="file", resume=True)
    assert loaded.warnings == ("--initialize-from: yet-another is left alone, because the run is resumed",)


def test_load_model_in_the_file_resumes():
    file = FILE.model_copy(update={"checkpoint_settings": CheckpointSettings(load_model=True)})
    assert with_command_line(Loaded(file), CommandLine()).config.checkpoint_settings.resume


def test_old_flags_keep_their_meaning():
    loaded = merged(train=True, cpu=True, keep_checkpoints=9, save_freq=1000)
    assert loaded.config.torch_settings.device == "cpu"
    assert (loaded.config.behavior.keep_checkpoints, loaded.config.behavior.checkpoint_interval) == (9, 1000)
    assert loaded.warnings == ()
    assert merged(torch=True, tensorflow=True).warnings == (
        "--torch: removed from ML-Agents, has no effect",
        "--tensorflow: removed from ML-Agents, has no effect",
    )


def test_curricula_begin_with_the_lesson_asked_for():
    ends = CompletionCriteria(behavior="Car", threshold=1.0)
    lessons = tuple(Lesson(name=f"L{k}", value=k, completion_criteria=None if k == 2 else ends) for k in range(3))
    file = FILE.model_copy(update={"environment_parameters": {"a": Curriculum(curriculum=lessons), "b": 4.0}})
    for lesson, first in ((0, 0), (1, 1), (7, 2)):
        parameters = with_command_line(Loaded(file), CommandLine(lesson=lesson)).config.environment_parameters
        assert parameters == {"a": Curriculum(curriculum=lessons[first:]), "b": 4.0}


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"num_envs": 0}, "--num-envs: must be at least 1, not 0"),
        ({"run_id": ""}, "--run-id: must not be empty"),
        ({"time_scale": -1.0}, "--time-scale: must be above 0, not -1.0"),
        ({"seed": "x"}, "--seed: must be a whole number"),
        ({"keep_checkpoints": 0}, "--keep-checkpoints: must be at least 1, not 0"),
        ({"lesson": -1}, "--lesson: must be at least 0, not -1"),
    ],
)
def test_a_flag_that_cannot_be_is_refused_by_its_name(given, sentence):
    with pytest.raises(ConfigError) as error:
        merged(**given)
    assert str(error.value) == sentence


def test_every_flag_of_both_releases_is_known():
    current = """--env --run-id --resume --force --initialize-from --inference --deterministic --seed --num-envs
        --num-areas --base-port --env-args --results-dir --timeout-wait --debug --torch-device --width --height
        --quality-level --time-scale --target-frame-rate --capture-frame-rate --no-graphics --no-graphics-monitor
        --max-lifetime-restarts --restarts-rate-limit-n --restarts-rate-limit-period-s"""
    old = "--load --train --torch --tensorflow --curriculum --sampler --keep-checkpoints --lesson --save-freq --cpu"
    own = {"--processes"}
    assert {flag.option for flag in flags() if not flag.is_old} == own | set(current.split())
    assert {flag.option for flag in flags() if flag.is_old} == set(old.split())
