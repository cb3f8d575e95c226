"""Networks that see images, and PPO that learns from them; the task is `squares.py`."""

import copy
import math

import pytest
import torch

from policies.learn.algorithms.ppo import Ppo
from policies.learn.config.behavior import Behavior, PpoHyperparameters
from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.networks.observations import Observation
from policies.learn.networks.policy import Policy
from policies.learn.networks.vision import LEAST_SIDES, ImageEncoder
from policies.learn.signals.extrinsic import ExtrinsicSignal
from tests.unit.policies.learn.squares import Squares

MEMORY = Memory(sequence_length=4, memory_size=8)


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def observation(rows, side=32, seed=0):
    image = torch.randint(0, 256, (rows, side, side, 3), dtype=torch.uint8, generator=generator(seed))
    return Observation(torch.randn(rows, 1, generator=generator(seed)), image)


def learner(task=None, seed=1, network=None, learning_rate_schedule="constant", **params):
    task = task or Squares(16)
    params = {"batch_size": 64, "buffer_size": 128, "learning_rate_schedule": learning_rate_schedule, **params}
    network = {"hidden_units": 16, "num_layers": 1, "vis_encode_type": "compact", **(network or {})}
    behavior = Behavior(
        hyperparameters=PpoHyperparameters(**params), network_settings=NetworkSettings(**network), max_steps=10**6
    )
    policy = Policy(task.layout, behavior.network_settings, generator(seed))
    return Ppo(task, policy, behavior, [ExtrinsicSignal(gamma=0.5)], seed=seed)


@pytest.mark.parametrize("kind", ["simple", "nature_cnn", "resnet"])
def test_no_image_has_no_features(kind):  # no episode ended in what was rolled out
    encoder = ImageEncoder(kind, (64, 64, 3), 8, generator())
    assert encoder(torch.zeros((0, 64, 64, 3), dtype=torch.uint8)).shape == (0, 8)


def test_simple_has_ml_agents_shapes():
    shapes = [tuple(p.shape) for p in ImageEncoder("simple", (64, 64, 3), 256, generator()).parameters()]
    assert shapes == [(16, 3, 8, 8), (16,), (32, 16, 4, 4), (32,), (256, 1152), (256,)]


@pytest.mark.parametrize(
    ("kind", "flat"), [("nature_cnn", 64 * 4 * 4), ("resnet", 32 * 7 * 7), ("match3", 144 * 60 * 60), ("compact", 288)]
)
def test_encoders_flatten_64_pixels_to_their_size(kind, flat):
    encoder = ImageEncoder(kind, (64, 64, 4), 8, generator())
    assert encoder.layers[-2].in_features == flat


@pytest.mark.parametrize("kind", LEAST_SIDES)
def test_an_encoder_takes_its_least_image_and_no_smaller_one(kind):
    least = LEAST_SIDES[kind]
    features = ImageEncoder(kind, (least, least, 3), 8, generator())(observation(5, least).image)
    assert features.shape == (5, 8)
    assert torch.isfinite(features).all()
    if least > 1:
        with pytest.raises(RuntimeError):
            ImageEncoder(kind, (least - 1, least - 1, 3), 8, generator())(observation(1, least - 1).image)


def test_weights_are_drawn_from_the_generator_as_torch_and_ml_agents_draw_them():
    first, second, other = (ImageEncoder("simple", (64, 64, 3), 64, generator(seed)) for seed in (0, 0, 1))
    assert all(torch.equal(a, b) for a, b in zip(first.parameters(), second.parameters(), strict=True))
    assert not torch.equal(first.layers[0].weight, other.layers[0].weight)
    weight = first.layers[2].weight
    bound = 1.0 / math.sqrt(16 * 4 * 4)
    assert 0.98 * bound < weight.abs().max() <= bound
    assert weight.std().item() == pytest.approx(bound / math.sqrt(3.0), rel=0.03)
    assert first.layers[-2].weight.std().item() == pytest.approx(1.41 / math.sqrt(1152), rel=0.03)


def test_black_is_0_and_white_is_1():
    encoder = ImageEncoder("fully_connected", (1, 1, 3), 4, generator())
    white = encoder.layers[0](torch.full((1, 3, 1, 1), 255, dtype=torch.uint8).float())
    assert white.tolist() == [[255.0] * 3]
    black, bright = encoder(torch.tensor([[[[0, 0, 0]]], [[[255, 255, 255]]]], dtype=torch.uint8))
    layer = encoder.layers[1]
    expected = torch.nn.functional.leaky_relu(layer.weight.sum(1) + layer.bias)
    assert torch.allclose(bright, expected, atol=1e-6)
    assert torch.equal(black, torch.zeros(4))


@pytest.mark.parametrize("memory", [None, MEMORY], ids=["feed-forward", "recurrent"])
def test_a_row_acts_as_it_would_alone(memory):
    settings = NetworkSettings(hidden_units=16, vis_encode_type="simple", memory=memory)
    policy = Policy(Squares(1).layout, settings, generator())
    many = observation(20)
    with torch.inference_mode():
        together, _ = policy.act(many, policy.start_memory(20))
        for i in range(20):
            alone, _ = policy.act(many[i : i + 1], policy.start_memory(1))
            assert torch.allclose(alone.continuous[0], together.continuous[i], atol=1e-6)


def test_goal_elements_drive_the_hyper_network_beside_an_image():
    settings = NetworkSettings(hidden_units=16, goal_signal=True, vis_encode_type="simple")
    policy = Policy(Squares(1).layout, settings, generator())
    assert policy.body.hyper is not None
    one, other = observation(4), observation(4)
    other.vector.neg_()
    assert not torch.equal(policy(one).mean, policy(other).mean)


def test_a_policy_that_sees_an_image_refuses_floats_alone():
    policy = Policy(Squares(1).layout, NetworkSettings(), generator())
    with pytest.raises(ValueError, match="sees an image, and was given none"):
        policy(torch.zeros(2, 1))


@pytest.mark.parametrize("memory", [None, MEMORY], ids=["feed-forward", "recurrent"])
@pytest.mark.parametrize("critic", ["own", "shared", "privileged"])
def test_gradients_reach_every_encoder(critic, memory):
    ppo = learner(
        network={"memory": memory}, shared_critic=critic == "shared", privileged_critic=critic == "privileged"
    )
    bodies = {id(body): body for body in (ppo.policy.body, ppo.critic.body)}
    encoders = [body.encoder for body in bodies.values() if body.encoder is not None]
    assert len(encoders) == {"own": 2, "shared": 1, "privileged": 1}[critic]
    before = [[p.detach().clone() for p in encoder.parameters()] for encoder in encoders]
    ppo.iterate()
    for encoder, old in zip(encoders, before, strict=True):
        for parameter, was in zip(encoder.parameters(), old, strict=True):
            assert not torch.equal(parameter, was)


@pytest.mark.parametrize("memory", [None, MEMORY], ids=["feed-forward", "recurrent"])
@pytest.mark.parametrize("is_privileged", [False, True], ids=["own", "privileged"])
def test_learning_from_images_goes_on_bit_for_bit(memory, is_privileged):
    network = {"memory": memory, "normalize": True}
    first = learner(seed=1, network=network, privileged_critic=is_privileged)
    first.iterate()
    state = first.state()
    second = learner(seed=2, network=network, privileged_critic=is_privileged)
    second.load_state(state)
    for ppo in (first, second):
        ppo.iterate()
        ppo.iterate()
    for a, b in zip(first.state()["policy"].values(), second.state()["policy"].values(), strict=True):
        assert torch.equal(a, b)
    for a, b in zip(first.critic.parameters(), second.critic.parameters(), strict=True):
        assert torch.equal(a, b)


def test_a_privileged_critic_sees_no_image_and_the_policy_nothing_privileged():
    ppo = learner(privileged_critic=True, network={"normalize": True})
    assert ppo.critic.body.encoder is None
    assert ppo.policy.body.normalizer.mean.shape == (1,)
    assert ppo.critic.body.normalizer.mean.shape == (2,)
    ppo._collect(ppo._rollout)
    assert ppo.critic.body.normalizer.count == ppo.policy.body.normalizer.count > 1
    one = ppo._rollout.observation[0]
    other = Observation(one.vector, one.image, one.privileged + 1.0)
    assert torch.equal(ppo.policy(one).mean, ppo.policy(other).mean)
    assert not torch.equal(ppo.critic(one), ppo.critic(other))


def test_a_timeout_is_valued_by_the_image_its_episode_saw_last():
    ppo = learner(shared_critic=True)
    rollout = ppo._rollout
    ppo._collect(rollout)
    with torch.no_grad():
        _, next_values = ppo._values(rollout)
        assert rollout.is_over.any()
        for t in range(len(next_values)):
            assert torch.allclose(next_values[t], ppo.critic(rollout.next_observation(t)), atol=1e-5)
            assert torch.equal(rollout.next_observation(t).image[:, 0, 0, 2] == 4, rollout.is_over[t])


@pytest.mark.parametrize("memory", [None, MEMORY], ids=["feed-forward", "recurrent"])
def test_ppo_goes_on_teaching_what_a_policy_believes(memory):
    network = {"perceives": ("place",), "memory": memory}
    ppo, still = (learner(network=network, perception_strength=strength) for strength in (0.1, 0.0))
    before = ppo.policy.perception.layer.weight.detach().clone()
    ppo.iterate()
    still.iterate()
    assert not torch.equal(ppo.policy.perception.layer.weight, before)
    assert torch.equal(still.policy.perception.layer.weight, before)


def test_a_critic_that_warms_up_learns_alone_however_far_it_has_to_go():
    warm_up = {"privileged_critic": True, "buffer_size": 128, "critic_warm_up": 20 * 128}
    ppo = learner(network={"normalize": True}, learning_rate=0.03, **warm_up)
    ppo.signals = [ExtrinsicSignal(gamma=0.5, strength=30.0)]
    before = copy.deepcopy(ppo.policy.state_dict())
    for _ in range(20):
        ppo.iterate()
    assert ppo._rollout.returns.mean() < -15.0
    assert ppo._rollout.values.mean() < -8.0  # a clip of 0.2 would allow half of it
    assert all(torch.equal(value, before[name]) for name, value in ppo.policy.state_dict().items())
    ppo.iterate()
    assert not all(torch.equal(value, before[name]) for name, value in ppo.policy.state_dict().items())


def distance(ppo):
    """Mean cost of the most probable action, on squares that were not trained on."""
    task = ppo.task
    task.task.reset(999)
    total = 0.0
    memory = ppo.policy.start_memory(task.task.env_count)
    with torch.inference_mode():
        for _ in range(20):
            actions, _ = ppo.policy.act(task.observation, memory)
            task.step(ppo.policy.bounded(actions), actions.branches)
            total -= task.rewards.mean().item() / 20
    return total


@pytest.mark.parametrize("critic", ["own", "privileged"])
@pytest.mark.parametrize("seed", [1, 2])
def test_it_learns_from_pixels_where_to_point(seed, critic):
    ppo = learner(
        Squares(64),
        seed=seed,
        buffer_size=1024,
        batch_size=256,
        learning_rate=2e-3,
        beta=0.0,
        privileged_critic=critic == "privileged",
    )
    before = distance(ppo)
    while ppo.steps < 12_000:
        ppo.iterate()
    assert before > 0.35  # not pointing at all costs 0.375
    assert distance(ppo) < 0.2
