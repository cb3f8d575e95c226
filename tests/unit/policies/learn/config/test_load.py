from pathlib import Path
from time import process_time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.config.yaml_locations import ConfigError, parse_yaml
from policies.learn.config.behavior import Behavior
from policies.learn.config.load import load_config
from policies.learn.config.signals import CuriositySettings, ExtrinsicSettings

CAR = """\
behaviors:
  Car:
    trainer_type: ppo
    hyperparameters:
      batch_size: 32
"""
MASS = CAR + "environment_parameters:\n  mass:\n"


def load(folder, text, *args, **kwargs):
    path = folder / "config.yaml"
    path.write_text(text, encoding="utf-8")
    return load_config(path, *args, **kwargs)


def refused(folder, text, *args, **kwargs):
    """The sentence, without the folder."""
    with pytest.raises(ConfigError) as error:
        load(folder, text, *args, **kwargs)
    sentence = str(error.value)
    assert "\n" not in sentence
    return sentence.removeprefix(f"{folder}/")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (CAR + "      batch_sice: 3\n", "6: @.hyper.batch_sice: unknown key; did you mean batch_size?"),
        (CAR + "      tau: 3\n", "6: @.hyper.tau: unknown key"),
        (CAR + "      beta: much\n", "6: @.hyper.beta: must be a number, not 'much'"),
        (CAR + "      beta: true\n", "6: @.hyper.beta: must be a number"),
        (CAR + "      beta: .nan\n", "6: @.hyper.beta: must be a finite number, not nan"),
        (CAR + "      beta: [1]\n", "6: @.hyper.beta: must be a number, not a list"),
        (CAR + "      num_epoch: 2.5\n", "6: @.hyper.num_epoch: must be a whole number"),
        (CAR + "      num_epoch: .inf\n", "6: @.hyper.num_epoch: must be a whole number"),
        (CAR + "      num_epoch:\n", "6: @.hyper.num_epoch: must be a whole number"),
        (CAR + "      epsilon: 0\n", "6: @.hyper.epsilon: must be above 0, not 0"),
        (CAR + "      lambd: 1.5\n", "6: @.hyper.lambd: must be at most 1, not 1.5"),
        (CAR + "      shared_critic: maybe\n", "6: @.hyper.shared_critic: must be true or false, not 'maybe'"),
        (
            CAR + "      learning_rate_schedule: cosine\n",
            "6: @.hyper.learning_rate_schedule: must be linear or constant, not 'cosine'",
        ),
        (
            CAR + "      buffer_size: 31\n",
            "4: @.hyper: batch_size 32 is larger than buffer_size 31: no batch would ever be full",
        ),
        (
            CAR.replace("ppo", "dagger") + "      teacher: t.pt\n      mixing: 2\n",
            "7: @.hyper.mixing: must be at most 1, not 2",
        ),
        (CAR.replace("ppo", "dagger"), "4: @.hyper.teacher: is required"),
        (CAR + "    max_step: 10\n", "6: @.max_step: unknown key; did you mean max_steps?"),
        (
            CAR + "    self_play: {window: 10}\n",
            "6: @.self_play: self-play is not supported: each environment has one agent",
        ),
        (CAR + "    network_settings: 3\n", "6: @.network_settings: must be a mapping of keys to values, not 3"),
        (
            CAR + "    network_settings: {memory: {memory_size: 127}}\n",
            "6: @.network_settings.memory.memory_size: must be even: half of it is the hidden state, half the cell",
        ),
        (
            CAR + "    network_settings: {memory: {sequence_length: 33}}\n",
            "2: @: memory: sequence_length 33 is larger than batch_size 32",
        ),
        (
            CAR + "    reward_signals: {extrinsik: {}}\n",
            "6: @.reward_signals.extrinsik: unknown key; did you mean extrinsic?",
        ),
        (
            CAR + "    reward_signals:\n      gail:\n        strength : 0.7\n",
            "7: @.reward_signals.gail.demo_path: is required",
        ),
        (CAR + "    behavioral_cloning: {steps: 3}\n", "6: @.behavioral_cloning.demo_path: is required"),
        (CAR + "behaviours: 3\n", "6: behaviours: unknown key; did you mean behaviors?"),
        (CAR + "env_settings:\n  num_areas: 0\n", "7: env_settings.num_areas: must be at least 1, not 0"),
        (CAR + "torch_settings: 3\n", "6: torch_settings: must be a mapping of keys to values, not 3"),
        (
            CAR + "environment_parameters: {mass: heavy}\n",
            "6: environment_parameters.mass: must be a number or a sampler",
        ),
        (
            MASS + "    sampler_type: normal\n    sampler_parameters: {}\n",
            "7: environment_parameters.mass: sampler_type 'normal' is not one of "
            "uniform, gaussian, multirangeuniform, constant",
        ),
        (
            MASS + "    sampler_type: uniform\n    sampler_parameters:\n      minimum: 1\n",
            "10: environment_parameters.mass.sampler_parameters.minimum: unknown key",
        ),
        (
            MASS + "    sampler_type: uniform\n    sampler_parameters: {min_value: 2, max_value: 1}\n",
            "9: environment_parameters.mass.sampler_parameters: min_value 2 is above max_value 1",
        ),
        (
            MASS + "    curriculum:\n    - {name: a, value: 1}\n    - {name: b, value: 2}\n",
            "7: environment_parameters.mass: lesson a has no completion_criteria and is not the last",
        ),
        (
            MASS + "    curriculum:\n    - name: a\n      valu: 1\n",
            "9: environment_parameters.mass.curriculum[0].value: is required",
        ),
        (
            "behaviors:\n  Car:\n    trainer_type: poca\n",
            "3: @.trainer_type: must be ppo, sac, dagger, bc, td3_bc, iql or awac, not 'poca'",
        ),
        ("behaviors:\n  Car:\n    hyperparameters: {}\n", "3: @.trainer_type: is required"),
        ("behaviors: {}\n", "1: behaviors: there is no behaviour to train"),
        ("behaviors: 7\n", "1: behaviors: must be a mapping of keys to values, not 7"),
        ("behaviors:\n  Car: [1]\n", "2: Car: must be a mapping of keys to values, not a list"),
        ("a: [1\nb: 2\n", "2: not YAML: expected ',' or ']', but got ':'"),
        ("a:\n\tb: 2\n", "2: not YAML: found character '\\t' that cannot start any token"),
        ("a: 1\n---\nb: 2\n", "2: not YAML: but found another document"),
        ("a: !name 1\n", "1: not YAML: could not determine a constructor for the tag '!name'"),
        ("behaviors: \x01\n", "1: not YAML: character 0x1 is not allowed"),
    ],
)
def test_a_refusal_names_file_line_and_key(tmp_path, text, sentence):
    location = sentence.replace("@.hyper", "@.hyperparameters").replace("@", "behaviors.Car")
    assert refused(tmp_path, text) == f"config.yaml:{location}"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "is empty"),
        ("# nothing\n", "is empty"),
        ("- 1\n", "must be a mapping of keys to values"),
        ("[" * 2000, "not a configuration: nested too deeply"),
        ("&a {b: *a}\n", "config.yaml:1: b: contains itself"),
    ],
)
def test_what_is_no_configuration_is_refused(tmp_path, text, sentence):
    assert refused(tmp_path, text).removeprefix("config.yaml: ") == sentence


def test_aliases_that_multiply_are_refused(tmp_path):
    bomb = "a0: &a0 [1, 1]\n" + "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 9))
    assert "more than 100000 values" in refused(tmp_path, bomb)


def test_merges_that_multiply_are_refused_before_they_are_written_out(tmp_path):
    lines = ["a0: &a0 {k: 1}"]
    lines += [f"a{i}: &a{i}\n  <<: [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 30)]
    for text in ("\n".join(lines), "behaviors:\n  <<: *z\n" + "\n".join(lines).replace("a29: &a29", "z: &z")):
        before_s = process_time()
        assert "values, aliases written out" in refused(tmp_path, text) or "alias" in refused(tmp_path, text)
        assert process_time() - before_s < 2.0


def test_a_merge_is_still_a_merge(tmp_path):
    text = "base: &base {batch_size: 64, buffer_size: 640}\nbehaviors:\n  Car:\n    hyperparameters:\n"
    text += "      <<: [*base, {batch_size: 1}]\n      buffer_size: 1280\n"
    placed = parse_yaml(text, "config.yaml", [])
    assert placed["behaviors"]["Car"]["hyperparameters"] == {"batch_size": 64, "buffer_size": 1280}


def test_a_missing_file_and_a_folder_are_refused_in_one_sentence(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.yaml: no such file or directory$"):
        load_config(tmp_path / "none.yaml")
    with pytest.raises(ConfigError, match=r"is a directory$"):
        load_config(tmp_path)


def test_a_file_in_another_encoding_is_refused(tmp_path):
    (tmp_path / "latin.yaml").write_bytes(b"behaviors: {Voiture: {init_path: \xe9t\xe9}}\n")
    with pytest.raises(ConfigError, match="is not UTF-8 text"):
        load_config(tmp_path / "latin.yaml")


def test_the_only_behaviour_is_taken_and_another_one_is_refused(tmp_path):
    assert load(tmp_path, CAR).config.behavior_name == "Car"
    assert refused(tmp_path, CAR, "Truck") == "config.yaml:1: behaviors: there is no behaviour Truck, only Car"


def test_of_several_behaviours_one_is_named(tmp_path):
    two = CAR + "  Truck:\n    max_steps: 7\n"
    assert load(tmp_path, two, "Truck").config.behavior == Behavior(max_steps=7)
    assert refused(tmp_path, two) == "config.yaml:1: behaviors: there are 2 behaviours, choose one: Car, Truck"


def test_a_faulty_behaviour_does_not_bar_another(tmp_path):
    two = CAR + "  Truck:\n    max_step: 7\n"
    assert load(tmp_path, two, "Car").config.behavior.hyperparameters.batch_size == 32


def test_default_settings_lie_under_every_behaviour(tmp_path):
    text = (
        "default_settings: {trainer_type: sac, hyperparameters: {tau: 0.1, batch_size: 8}, max_steps: 5}\n"
        "behaviors: {Car: {hyperparameters: {batch_size: 9}, reward_signals: {curiosity: {}}}}\n"
    )
    car = load(tmp_path, text).config.behavior
    assert (car.trainer_type, car.max_steps) == ("sac", 5)
    assert (car.hyperparameters.batch_size, car.hyperparameters.tau) == (9, 0.1)
    assert car.reward_signals.in_use == {"extrinsic": ExtrinsicSettings(), "curiosity": CuriositySettings()}
    assert load(tmp_path, text, "Truck").config.behavior.hyperparameters.batch_size == 8


def test_a_signal_that_is_not_named_is_off(tmp_path):
    signals = load(tmp_path, CAR + "    reward_signals: {curiosity: {strength: 0.02}}\n").config.behavior.reward_signals
    assert list(signals.in_use) == ["curiosity"]


def test_numbers_are_taken_as_people_type_them(tmp_path):
    text = CAR + "      learning_rate: 1e-5\n      buffer_size: 2e4\n    max_steps: 2e6\n    success_target: none\n"
    behavior = load(tmp_path, text).config.behavior
    assert behavior.hyperparameters.learning_rate == 1e-5
    assert behavior.hyperparameters.buffer_size == 20_000
    assert (behavior.max_steps, behavior.success_target) == (2_000_000, None)


def test_schedules_of_beta_and_epsilon_follow_the_learning_rates(tmp_path):
    params = load(tmp_path, CAR + "      learning_rate_schedule: constant\n      beta_schedule: linear\n").config
    assert params.behavior.hyperparameters.beta_schedule == "linear"
    assert params.behavior.hyperparameters.epsilon_schedule == "constant"


def test_a_run_may_be_called_by_a_number_or_a_date(tmp_path):
    for name in ("7", "2021-03-08"):
        assert (
            load(tmp_path, CAR + f"checkpoint_settings: {{run_id: {name}}}\n").config.checkpoint_settings.run_id == name
        )


def test_a_key_that_stands_twice_is_warned_about_and_the_last_one_counts(tmp_path):
    loaded = load(tmp_path, CAR + "      batch_size: 64\n")
    assert loaded.config.behavior.hyperparameters.batch_size == 64
    assert loaded.warnings == (
        f"{tmp_path}/config.yaml:6: behaviors.Car.hyperparameters.batch_size: stands here twice; the last one counts",
    )


def test_what_ml_agents_writes_of_its_own_runs_is_read_without_a_warning(tmp_path):
    network = "{normalize: false, hidden_units: 64, num_layers: 2, vis_encode_type: simple, memory: null, "
    network += "goal_conditioning_type: hyper, deterministic: false}"
    signal = f"gamma: 0.9, strength: 1.0, network_settings: {network}"
    text = (
        "default_settings: null\nbehaviors:\n  Car:\n    trainer_type: ppo\n"
        "    hyperparameters: {batch_size: 64, beta_schedule: linear, epsilon_schedule: linear, shared_critic: false}\n"
        f"    checkpoint_interval: 500\n    network_settings: {network}\n"
        f"    reward_signals:\n      extrinsic: {{{signal}}}\n"
        f"      gail: {{{signal}, learning_rate: 0.0003, encoding_size: null, use_actions: false, demo_path: a}}\n"
        "    init_path: null\n    self_play: null\n    behavioral_cloning: null\n    even_checkpoints: false\n"
        "env_settings: {env_path: null, env_args: null, seed: -1}\nenvironment_parameters: null\n"
        "checkpoint_settings: {run_id: a, initialize_from: null, load_model: false, results_dir: results}\n"
        "torch_settings: {device: null}\ndebug: false\n"
    )
    loaded = load(tmp_path, text)
    assert loaded.warnings == ()
    assert loaded.config.behavior.reward_signals.gail.network_settings.hidden_units == 64
    assert loaded.config.env_settings.env_args == ()


VALID = (Path(__file__).parent / "data" / "parking_gail.yaml").read_text().splitlines()
JUNK = [
    "",
    "~",
    "[]",
    "{}",
    "[1]",
    "{a: 1}",
    "-1",
    "0",
    "true",
    "1e400",
    ".nan",
    "'x'",
    "!t x",
    "*a",
    "&a b",
    "- 1",
    "<<",
]


@given(k=st.integers(1, len(VALID) - 1), junk=st.sampled_from(JUNK))
def test_a_junk_value_is_refused_with_file_and_line_or_taken_whole(k, junk, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "junk.yaml"
    line = VALID[k].split(":")[0] + ": " + junk
    path.write_text("\n".join([*VALID[:k], line, *VALID[k + 1 :]]) + "\n", encoding="utf-8")
    try:
        config = load_config(path).config
    except ConfigError as error:
        location, _, sentence = str(error).removeprefix(f"{path}:").partition(": ")
        assert location.isdigit()
        assert sentence
        assert "\n" not in sentence
    else:
        assert type(config).model_validate(dict(config)) == config


@given(text=st.text(alphabet="abehviors:{}[]&*!-#|>'\"\n\t 01,.<", max_size=80))
def test_any_text_gives_a_configuration_or_one_sentence(text, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    path.write_text(text, encoding="utf-8")
    try:
        load_config(path)
    except ConfigError as error:
        assert "\n" not in str(error)
