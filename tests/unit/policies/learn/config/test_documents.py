from pathlib import Path

import pytest

from common.config.yaml_locations import ConfigError
from policies.learn.config.behavior import Behavior, PpoHyperparameters, SacHyperparameters
from policies.learn.config.load import load_config
from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.config.run import RunConfig
from policies.learn.config.signals import ExtrinsicSettings, GailSettings, RewardSignals

DATA = Path(__file__).parent / "data"

REACH_TARGET = {
    "network_settings": NetworkSettings(normalize=True, num_layers=3, hidden_units=512, vis_encode_type="simple"),
    "reward_signals": RewardSignals(extrinsic=ExtrinsicSettings(strength=1.0, gamma=0.99)),
    "max_steps": 2_000_000,
    "time_horizon": 1000,
    "summary_freq": 30_000,
}
PARKING_PPO = PpoHyperparameters(
    batch_size=256,
    buffer_size=20480,
    learning_rate=1e-5,
    learning_rate_schedule="linear",
    beta=0.03,
    epsilon=0.1,
    lambd=0.92,
    num_epoch=5,
)
PARKING_NETWORK = NetworkSettings(hidden_units=64, num_layers=2, normalize=False, vis_encode_type="simple")
PARKING = {
    "keep_checkpoints": 5,
    "checkpoint_interval": 500_000,
    "time_horizon": 256,
    "summary_freq": 10_000,
    "threaded": True,
}
EXTRINSIC = ExtrinsicSettings(gamma=0.8, strength=1.0)


def with_memory(network: NetworkSettings) -> NetworkSettings:
    return network.model_copy(update={"memory": Memory(sequence_length=64, memory_size=256)})


@pytest.mark.parametrize("variant", range(5))
def test_reach_target_ppo_means_the_same_in_every_way_of_naming_a_block(variant):
    loaded = load_config(DATA / "reach_target_ppo.yaml", f"ReachTarget_{variant}")
    params = PpoHyperparameters(
        batch_size=2048,
        buffer_size=20480,
        beta=5e-3,
        epsilon=0.2,
        lambd=0.95,
        learning_rate=3e-4,
        learning_rate_schedule="linear",
        num_epoch=3,
    )
    assert loaded.config.behavior == Behavior(trainer_type="ppo", hyperparameters=params, **REACH_TARGET)
    assert loaded.config.behavior_name == f"ReachTarget_{variant}"
    assert loaded.warnings == ()


def test_a_flat_behaviour_without_a_block_takes_the_default_one():
    behavior = load_config(DATA / "reach_target_ppo.yaml", "Another").config.behavior
    expected = Behavior(
        hyperparameters=PpoHyperparameters(batch_size=1024, buffer_size=10240, beta=5e-3, num_epoch=3),
        network_settings=NetworkSettings(hidden_units=128, num_layers=2),
        max_steps=500_000,
        summary_freq=10_000,
        time_horizon=64,
    )
    assert behavior == expected


def test_five_flat_behaviours_must_be_chosen_from():
    with pytest.raises(ConfigError, match="there are 5 behaviours, choose one: ReachTarget_0, ReachTarget_1"):
        load_config(DATA / "reach_target_ppo.yaml")


def test_reach_target_sac():
    loaded = load_config(DATA / "reach_target_sac.yaml")
    params = SacHyperparameters(
        batch_size=256,
        buffer_size=500_000,
        buffer_init_steps=60_000,
        learning_rate=3e-4,
        learning_rate_schedule="constant",
        init_entcoef=1.0,
        tau=0.005,
        steps_per_update=1.0,
    )
    assert loaded.config == RunConfig(
        behavior_name="ReachTarget", behavior=Behavior(trainer_type="sac", hyperparameters=params, **REACH_TARGET)
    )
    assert loaded.warnings == ()


@pytest.mark.parametrize(
    ("file", "max_steps", "demo_path", "memory_line", "framework_line"),
    [
        ("parking_ppo.yaml", 1_000_000, None, 16, 27),
        ("parking_gail.yaml", 5_000_000, "../../ILL21S1G/", 16, 30),
        ("parking_gail_rays.yaml", 1_000_000, "../../ILL21S1G-RayPerceptron3D/", 16, 30),
    ],
)
def test_parking_builds_the_memory_that_its_authors_meant(file, max_steps, demo_path, memory_line, framework_line):
    loaded = load_config(DATA / file)
    gail = GailSettings(strength=0.7, gamma=0.99, demo_path=demo_path, use_actions=False) if demo_path else None
    meant = Behavior(
        hyperparameters=PARKING_PPO,
        network_settings=with_memory(PARKING_NETWORK),
        reward_signals=RewardSignals(extrinsic=EXTRINSIC, gail=gail),
        max_steps=max_steps,
        **PARKING,
    )
    assert loaded.config == RunConfig(behavior_name="MoveToGoalAgent", behavior=meant)
    memory, framework = sorted(loaded.warnings, key=lambda warning: "framework" in warning)
    keys = "behaviors.MoveToGoalAgent.network_settings.use_recurrent, sequence_length, memory_size"
    assert memory.startswith(f"{DATA / file}:{memory_line}: {keys}: ML-Agents drops these keys in silence")
    assert framework.startswith(f"{DATA / file}:{framework_line}: behaviors.MoveToGoalAgent.framework: deprecated")


def test_strictly_parking_has_no_memory_as_in_ml_agents():
    loaded = load_config(DATA / "parking_gail.yaml", is_strict=True)
    assert loaded.config.behavior.network_settings == PARKING_NETWORK
    assert any("dropped, as ML-Agents does in silence" in warning for warning in loaded.warnings)


def test_parking_defaults():
    loaded = load_config(DATA / "parking_defaults.yaml")
    assert loaded.config.behavior == Behavior(
        hyperparameters=PpoHyperparameters(beta=0.001), threaded=True, summary_freq=50_000
    )
    assert [warning.split(": ", 1)[1] for warning in loaded.warnings] == [
        "behaviors.MoveToGoalAgent.framework: deprecated, has no effect"
    ]


def test_parking_sac():
    params = SacHyperparameters(
        batch_size=256,
        buffer_size=50_000,
        learning_rate=1e-5,
        buffer_init_steps=1000,
        init_entcoef=0.05,
        tau=0.005,
        steps_per_update=1.0,
    )
    assert load_config(DATA / "parking_sac.yaml").config.behavior == Behavior(
        trainer_type="sac",
        hyperparameters=params,
        network_settings=PARKING_NETWORK,  # as it was in ML-Agents: our SAC has no memory either
        reward_signals=RewardSignals(extrinsic=EXTRINSIC),
        max_steps=5_000_000,
        **PARKING,
    )


def test_follow_me_asks_for_a_hyper_network():
    loaded = load_config(DATA / "follow_me.yaml")
    assert loaded.config.behavior == Behavior(
        hyperparameters=PpoHyperparameters(
            batch_size=256, buffer_size=2560, learning_rate=3e-4, beta=5e-3, epsilon=0.2, lambd=0.95, num_epoch=3
        ),
        network_settings=NetworkSettings(hidden_units=256, num_layers=1, goal_conditioning_type="hyper"),
        max_steps=10_000_000,
        time_horizon=64,
    )
    assert loaded.warnings == ()
