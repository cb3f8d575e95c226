import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from policies.learn.config.behavior import Behavior, BehavioralCloning, PpoHyperparameters, SacHyperparameters
from policies.learn.config.dump import dump
from policies.learn.config.environment import (
    CompletionCriteria,
    Curriculum,
    EngineSettings,
    EnvSettings,
    GaussianParameters,
    GaussianSampler,
    Lesson,
    MultiRangeUniformParameters,
    MultiRangeUniformSampler,
    UniformParameters,
    UniformSampler,
)
from policies.learn.config.load import load_config
from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.config.run import CheckpointSettings, RunConfig, TorchSettings
from policies.learn.config.signals import (
    CuriositySettings,
    ExtrinsicSettings,
    GailSettings,
    RewardSignals,
    RndSettings,
)

texts = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8).filter(lambda text: text.strip())
counts = st.integers(1, 10**9)
positives = st.floats(1e-12, 1e12)
reals = st.floats(allow_nan=False, allow_infinity=False)
fractions = st.floats(0.0, 1.0)
schedules = st.sampled_from(["linear", "constant"])


def maybe(strategy):
    return st.none() | strategy


memories = st.builds(Memory, sequence_length=st.integers(1, 64), memory_size=st.integers(1, 99).map(lambda k: 2 * k))
networks = st.builds(NetworkSettings, hidden_units=counts, normalize=st.booleans(), deterministic=st.booleans())
signals = st.builds(
    RewardSignals,
    extrinsic=maybe(st.builds(ExtrinsicSettings, gamma=fractions, strength=positives)),
    gail=maybe(
        st.builds(
            GailSettings,
            demo_path=texts,
            network_settings=networks,
            learning_rate=positives,
            use_vail=st.booleans(),
            reward_form=st.sampled_from(["ml-agents", "logit", "log"]),
        )
    ),
    curiosity=maybe(st.builds(CuriositySettings, strength=positives, network_settings=networks)),
    rnd=maybe(st.builds(RndSettings, learning_rate=positives, normalize_reward=st.booleans())),
)
ppo = st.builds(
    PpoHyperparameters,
    batch_size=st.integers(64, 4096),
    buffer_size=st.integers(4096, 10**6),
    learning_rate=positives,
    learning_rate_schedule=schedules,
    beta=positives,
    beta_schedule=schedules,
    epsilon=positives,
    lambd=fractions,
    max_grad_norm=maybe(positives),
    target_kl=maybe(positives),
    joint_ratio=st.booleans(),
    normalize_advantages=st.sampled_from(["buffer", "minibatch", "none"]),
)
sac = st.builds(
    SacHyperparameters,
    batch_size=st.integers(64, 4096),
    buffer_size=st.integers(4096, 10**6),
    tau=fractions,
    steps_per_update=positives,
    hindsight=st.integers(0, 8),
)
behaviors = st.one_of(
    *(
        st.builds(
            Behavior,
            trainer_type=st.just(name),
            hyperparameters=params,
            network_settings=networks.flatmap(
                lambda network: maybe(memories).map(lambda memory: network.model_copy(update={"memory": memory}))
            ),
            reward_signals=signals,
            behavioral_cloning=maybe(st.builds(BehavioralCloning, demo_path=texts, num_epoch=maybe(counts))),
            max_steps=counts,
            init_path=maybe(texts),
            success_target=maybe(fractions),
        )
        for name, params in (("ppo", ppo), ("sac", sac))
    )
)
bounds = st.tuples(reals, reals).map(lambda pair: (min(pair), max(pair)))
seeds = st.integers(-1, 99)
samplers = st.one_of(
    st.builds(
        UniformSampler,
        sampler_type=st.just("uniform"),
        sampler_parameters=st.builds(
            lambda pair, seed: UniformParameters(min_value=pair[0], max_value=pair[1], seed=seed), bounds, seeds
        ),
    ),
    st.builds(
        GaussianSampler,
        sampler_type=st.just("gaussian"),
        sampler_parameters=st.builds(GaussianParameters, mean=reals, st_dev=positives, seed=seeds),
    ),
    st.builds(
        MultiRangeUniformSampler,
        sampler_type=st.just("multirangeuniform"),
        sampler_parameters=st.builds(
            MultiRangeUniformParameters, intervals=st.lists(bounds, min_size=1, max_size=3).map(tuple)
        ),
    ),
)


@st.composite
def curricula(draw):
    count = draw(st.integers(1, 3))
    criteria = st.builds(CompletionCriteria, behavior=texts, threshold=reals, signal_smoothing=st.booleans())
    return Curriculum(
        curriculum=tuple(
            Lesson(
                name=draw(texts),
                value=draw(reals | samplers),
                completion_criteria=None if k == count - 1 else draw(criteria),
            )
            for k in range(count)
        )
    )


configs = st.builds(
    RunConfig,
    behavior_name=texts,
    behavior=behaviors,
    environment_parameters=st.dictionaries(texts, reals | samplers | curricula(), max_size=3),
    env_settings=st.builds(EnvSettings, env_path=maybe(texts), env_args=st.lists(texts, max_size=3), num_areas=counts),
    engine_settings=st.builds(EngineSettings, time_scale=positives, no_graphics=st.booleans()),
    checkpoint_settings=st.builds(CheckpointSettings, run_id=texts, initialize_from=maybe(texts), resume=st.booleans()),
    torch_settings=st.builds(TorchSettings, device=maybe(texts), processes=st.integers(1, 64)),
    debug=st.booleans(),
)


@settings(max_examples=60, deadline=None)
@given(config=configs)
def test_a_configuration_written_and_read_again_is_equal(config, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "dumped.yaml"
    path.write_text(dump(config), encoding="utf-8", newline="")
    assert load_config(path).config == config


def test_every_key_with_a_value_is_written_out_in_ml_agents_form():
    written = yaml.safe_load(dump(RunConfig(behavior_name="Car")))
    assert list(written) == [
        "behaviors",
        "environment_parameters",
        "env_settings",
        "engine_settings",
        "checkpoint_settings",
        "torch_settings",
        "debug",
    ]
    car = written["behaviors"]["Car"]
    assert car["hyperparameters"]["beta_schedule"] == "linear"
    assert set(Behavior.model_fields) - set(car) == {
        *("behavioral_cloning", "offline", "self_play", "init_path", "success_target"),
    }
