import pytest

from common.config.yaml_locations import ConfigError
from policies.learn.config.environment import (
    CompletionCriteria,
    Curriculum,
    GaussianParameters,
    GaussianSampler,
    Lesson,
    MultiRangeUniformParameters,
    MultiRangeUniformSampler,
    UniformParameters,
    UniformSampler,
)
from policies.learn.config.load import load_config
from policies.learn.config.network import Memory

FLAT = """\
default:
  trainer: ppo
  batch_size: 1024
  beta: 5.0e-3
  buffer_size: 10240
  epsilon: 0.2
  hidden_units: 128
  lambd: 0.95
  learning_rate: 3.0e-4
  max_steps: 5.0e5
  memory_size: 256
  normalize: false
  num_epoch: 3
  num_layers: 2
  time_horizon: 64
  sequence_length: 32
  summary_freq: 10000
  use_recurrent: false
  reward_signals:
    extrinsic: {strength: 1.0, gamma: 0.99}
Car:
  use_recurrent: true
"""
CURRICULUM = """\
Car:
  measure: progress
  thresholds: [0.1, 0.3]
  parameters:
    height: [0.0, 4.0, 6.0]
    width: [1.0, 2.0, 3.0]
"""
SAMPLERS = """\
resampling-interval: 5000
mass: {sampler-type: uniform, min_value: 0.5, max_value: 10}
gravity: {sampler-type: multirange_uniform, intervals: [[7, 10], [15, 20]]}
wind: {sampler-type: gaussian, mean: 1, st_dev: 2}
"""
MASS = UniformSampler(sampler_type="uniform", sampler_parameters=UniformParameters(min_value=0.5, max_value=10.0))
GRAVITY = MultiRangeUniformSampler(
    sampler_type="multirangeuniform",
    sampler_parameters=MultiRangeUniformParameters(intervals=((7.0, 10.0), (15.0, 20.0))),
)
WIND = GaussianSampler(sampler_type="gaussian", sampler_parameters=GaussianParameters(mean=1.0, st_dev=2.0))


def curriculum_of(values: list[float]) -> Curriculum:
    def criteria(threshold: float) -> CompletionCriteria:
        return CompletionCriteria(
            behavior="Car", measure="progress", threshold=threshold, min_lesson_length=1, signal_smoothing=False
        )

    ends = [criteria(0.1), criteria(0.3), None]
    return Curriculum(
        curriculum=tuple(
            Lesson(name=f"Lesson{k}", value=value, completion_criteria=end)
            for k, (value, end) in enumerate(zip(values, ends, strict=True))
        )
    )


def write(folder, name, text):
    (folder / name).write_text(text)
    return folder / name


def test_flat_memory_keys_make_a_memory_if_it_is_used(tmp_path):
    path = write(tmp_path, "flat.yaml", FLAT)
    assert load_config(path, "Car").config.behavior.network_settings.memory == Memory(
        sequence_length=32, memory_size=256
    )
    assert load_config(path, "Truck").config.behavior.network_settings.memory is None


def test_intervals_of_sac_become_steps_per_update(tmp_path):
    path = write(tmp_path, "flat.yaml", "Car: {trainer: sac, num_update: 2, train_interval: 8, batch_size: 4}\n")
    assert load_config(path).config.behavior.hyperparameters.steps_per_update == 4.0


def test_signals_of_a_block_replace_those_of_the_default(tmp_path):
    path = write(tmp_path, "flat.yaml", FLAT + "  reward_signals: {curiosity: {strength: 0.02, encoding_size: 64}}\n")
    loaded = load_config(path)
    assert list(loaded.config.behavior.reward_signals.in_use) == ["curiosity"]
    assert loaded.config.behavior.reward_signals.curiosity.network_settings.hidden_units == 64
    assert [warning.split(": ", 1)[1] for warning in loaded.warnings] == [
        "behaviors.Car.reward_signals.curiosity.encoding_size: deprecated, taken as network_settings: {hidden_units}"
    ]


def test_an_unknown_flat_key_is_warned_about(tmp_path):
    loaded = load_config(write(tmp_path, "flat.yaml", FLAT + "  hidden_unit: 64\n"))
    assert loaded.warnings == (
        f"{tmp_path}/flat.yaml:23: Car.hidden_unit: unknown key; did you mean hidden_units? "
        "(dropped, as ML-Agents does in silence)",
    )


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (FLAT.replace("  lambd: 0.95\n", ""), "20: Car.lambd: is required in this old form of the file"),
        (FLAT.replace("trainer: ppo", "summary: 1"), "21: Car.trainer: is required"),
        (
            FLAT.replace("trainer: ppo", "trainer: offline_bc"),
            "2: @trainer_type: must be ppo, sac, dagger, bc, td3_bc, iql or awac, not 'offline_bc'",
        ),
        (FLAT.replace("beta: 5.0e-3", "beta: -1"), "4: @hyperparameters.beta: must be at least 0, not -1"),
        (FLAT.replace("num_layers: 2", "num_layers: two"), "14: @network_settings.num_layers: must be a whole number"),
        (FLAT + "Truck: Cart\n", "23: Truck: refers to 'Cart', which is no block of its own"),
        (FLAT + "Truck: Bus\nBus: Truck\n", "23: Truck: refers to 'Truck', which is no block of its own"),
        (FLAT + "Truck: 7\n", "23: Truck: must be a mapping or the name of another block, not 7"),
        (
            "Truck: {trainer: sac, num_update: 0}\n",
            "1: Truck.num_update: num_update and train_interval must be numbers above 0",
        ),
    ],
)
def test_a_flat_file_is_refused_with_file_line_and_key(tmp_path, text, sentence):
    with pytest.raises(ConfigError) as error:
        load_config(write(tmp_path, "flat.yaml", text), "Truck" if "Truck" in text else "Car")
    assert str(error.value) == f"{tmp_path}/flat.yaml:{sentence}".replace("@", "behaviors.Car.")


def test_old_curriculum_and_sampler_files_become_environment_parameters(tmp_path):
    loaded = load_config(
        write(tmp_path, "flat.yaml", FLAT),
        curriculum_path=write(tmp_path, "curriculum.yaml", CURRICULUM),
        sampler_path=write(tmp_path, "samplers.yaml", SAMPLERS),
    )
    assert loaded.config.environment_parameters == {
        "mass": MASS,
        "gravity": GRAVITY,
        "wind": WIND,
        "height": curriculum_of([0.0, 4.0, 6.0]),
        "width": curriculum_of([1.0, 2.0, 3.0]),
    }
    assert loaded.warnings == ()


def test_the_middle_form_means_the_same(tmp_path):
    def indented(text):
        return "".join(f"  {line}\n" for line in text.splitlines())

    text = (
        "behaviors: {Car: {}}\ncurriculum:\n" + indented(CURRICULUM) + "parameter_randomization:\n" + indented(SAMPLERS)
    )
    parameters = load_config(write(tmp_path, "middle.yaml", text)).config.environment_parameters
    assert parameters["height"] == curriculum_of([0.0, 4.0, 6.0])
    assert parameters["gravity"] == GRAVITY


def test_a_sampler_counts_more_than_a_curriculum_of_the_same_parameter(tmp_path):
    loaded = load_config(
        write(tmp_path, "flat.yaml", FLAT),
        curriculum_path=write(tmp_path, "curriculum.yaml", CURRICULUM.replace("height", "mass")),
        sampler_path=write(tmp_path, "samplers.yaml", SAMPLERS),
    )
    assert loaded.config.environment_parameters["mass"] == MASS
    assert loaded.warnings == (f"{tmp_path}/curriculum.yaml:5: curriculum.Car.mass: has a sampler too, which counts",)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("Car: 3\n", "1: Car: must be a mapping of keys to values, not 3"),
        ("Car:\n  measure: reward\n", "1: curriculum.Car.thresholds: is required"),
        (
            CURRICULUM.replace("[0.0, 4.0, 6.0]", "[0.0, 4.0]"),
            "5: curriculum.Car.parameters.height: must be a list of 3 values, one more than there are thresholds",
        ),
        (
            CURRICULUM.replace("[0.1, 0.3]", "[0.1, 3]"),
            "3: environment_parameters.height.curriculum[1].completion_criteria: "
            "threshold 3 of progress is not between 0 and 1",
        ),
    ],
)
def test_an_old_curriculum_is_refused_with_file_line_and_key(tmp_path, text, sentence):
    with pytest.raises(ConfigError) as error:
        load_config(write(tmp_path, "flat.yaml", FLAT), curriculum_path=write(tmp_path, "curriculum.yaml", text))
    assert str(error.value) == f"{tmp_path}/curriculum.yaml:{sentence}"
