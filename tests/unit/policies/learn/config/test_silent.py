import pytest

from policies.learn.config.load import load_config
from policies.learn.config.network import Memory, NetworkSettings

CAR = "behaviors:\n  Car:\n"
DROPPED = "(dropped, as ML-Agents does in silence)"


def load(folder, text, **kwargs):
    """The configuration, and the warnings from their line on."""
    path = folder / "config.yaml"
    path.write_text(text)
    loaded = load_config(path, **kwargs)
    return loaded.config, [warning.removeprefix(f"{path}:") for warning in loaded.warnings]


@pytest.mark.parametrize(
    ("block", "warning"),
    [
        (
            "    network_settings: {hidden_unit: 7}\n",
            f"3: behaviors.Car.network_settings.hidden_unit: unknown key; did you mean hidden_units? {DROPPED}",
        ),
        (
            "    network_settings: {memory: {size: 7}}\n",
            f"3: behaviors.Car.network_settings.memory.size: unknown key {DROPPED}",
        ),
        (
            "    behavioral_cloning:\n      demo_path: a\n      step: 3\n",
            f"5: behaviors.Car.behavioral_cloning.step: unknown key; did you mean steps? {DROPPED}",
        ),
        (
            "    reward_signals: {extrinsic: {network_settings: {layers: 3}}}\n",
            "3: behaviors.Car.reward_signals.extrinsic.network_settings.layers: "
            f"unknown key; did you mean num_layers? {DROPPED}",
        ),
        (
            "    reward_signals: {rnd: {network_settings: {memory: {}}}}\n",
            "3: behaviors.Car.reward_signals.rnd.network_settings.memory: reward signals have no memory: dropped",
        ),
        (
            "    reward_signals: {rnd: {network_settings: {use_recurrent: true, memory_size: 8}}}\n",
            "3: behaviors.Car.reward_signals.rnd.network_settings.use_recurrent, memory_size: "
            "reward signals have no memory: dropped",
        ),
        ("    framework: tensorflow\n", "3: behaviors.Car.framework: deprecated, has no effect"),
        ("torch_settings: {dev: cpu}\n", f"3: torch_settings.dev: unknown key; did you mean device? {DROPPED}"),
        (
            "environment_parameters:\n  mass:\n    curriculum:\n"
            "    - {name: a, value: 1, completion_criteria: {behavior: Car, treshold: 3}}\n    - {name: b, value: 1}\n",
            "6: environment_parameters.mass.curriculum[0].completion_criteria.treshold: "
            f"unknown key; did you mean threshold? {DROPPED}",
        ),
        (
            "environment_parameters:\n  mass:\n    curriculum:\n"
            "    - {name: a, value: 1, completion_criteria: {behavior: Car}}\n",
            "6: environment_parameters.mass.curriculum[0].completion_criteria: "
            "the last lesson never ends: dropped, as ML-Agents does",
        ),
        (
            "environment_parameters:\n  mass:\n    curriculum:\n"
            "    - {name: a, value: 1, completion_criteria: {behavior: Cart}}\n    - {name: b, value: 1}\n",
            "6: environment_parameters.mass.curriculum[0].completion_criteria.behavior: "
            "Cart is not trained in this run: the lesson never ends",
        ),
    ],
)
def test_what_ml_agents_drops_is_warned_about_with_file_line_and_key(tmp_path, block, warning):
    above = CAR if block.startswith(" ") else "behaviors:\n  Car: {}\n"
    assert load(tmp_path, above + block)[1] == [warning]


def test_a_memory_block_counts_more_than_flat_keys_beside_it(tmp_path):
    config, warnings = load(
        tmp_path, CAR + "    network_settings: {use_recurrent: true, memory_size: 8, memory: {memory_size: 16}}\n"
    )
    assert config.behavior.network_settings.memory == Memory(memory_size=16)
    assert warnings == [
        "3: behaviors.Car.network_settings.use_recurrent, memory_size: dropped, as ML-Agents does in silence"
    ]


def test_flat_memory_keys_without_use_recurrent_make_no_memory(tmp_path):
    for keys in ("{memory_size: 8}", "{use_recurrent: false, memory_size: 8}"):
        config, warnings = load(tmp_path, CAR + f"    network_settings: {keys}\n")
        assert config.behavior.network_settings == NetworkSettings()
        assert len(warnings) == 1


def test_a_meant_memory_takes_ml_agents_sizes_where_none_are_given(tmp_path):
    config, _ = load(tmp_path, CAR + "    network_settings: {use_recurrent: true}\n")
    assert config.behavior.network_settings.memory == Memory(sequence_length=64, memory_size=128)


def test_a_faulty_size_of_a_meant_memory_is_refused_where_it_stands(tmp_path):
    text = CAR + "    network_settings:\n      use_recurrent: true\n      memory_size: 7\n"
    with pytest.raises(ValueError, match=r"5: behaviors\.Car\.network_settings\.memory\.memory_size: must be even"):
        load(tmp_path, text)
    assert load(tmp_path, text, is_strict=True)[0].behavior.network_settings.memory is None


def test_encoding_size_counts_only_without_network_settings(tmp_path):
    signal = "    reward_signals: {curiosity: {encoding_size: 64%s}}\n"
    alone, _ = load(tmp_path, CAR + signal % "")
    beside, warnings = load(tmp_path, CAR + signal % ", network_settings: {num_layers: 1}")
    assert alone.behavior.reward_signals.curiosity.network_settings.hidden_units == 64
    assert beside.behavior.reward_signals.curiosity.network_settings.hidden_units == 128
    assert warnings == [
        "3: behaviors.Car.reward_signals.curiosity.encoding_size: deprecated, has no effect beside network_settings"
    ]


def test_use_recurrent_is_true_or_false(tmp_path):
    with pytest.raises(
        ValueError, match=r"3: behaviors\.Car\.network_settings\.use_recurrent: must be true or false, not 1"
    ):
        load(tmp_path, CAR + "    network_settings: {use_recurrent: 1}\n")
