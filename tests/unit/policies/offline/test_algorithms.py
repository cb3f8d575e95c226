"""Each algorithm finds what paid in what was recorded, and goes on bit for bit; steps are those of plain autograd."""

import copy

import pytest
import torch

from policies.learn.config.behavior import Behavior
from policies.learn.networks.policy import Policy
from policies.offline.algorithm import OfflineError
from policies.offline.build_offline import build_algorithm
from policies.offline.draws import Draws, best_decisions
from tests.unit.policies.offline.datasets import PUSHED, store_of

MEMORIES = {
    "lstm": {"sequence_length": 4, "memory_size": 8},
    "transformer": {"memory_type": "transformer", "sequence_length": 4, "layers": 1, "heads": 2},
}


def behavior(trainer, network=None, **hyperparameters):
    return Behavior.model_validate(
        {
            "trainer_type": trainer,
            "hyperparameters": {"learning_rate": 2e-3, "batch_size": 128, **hyperparameters},
            "network_settings": {"hidden_units": 32, "num_layers": 2, **(network or {})},
            "offline": {"dataset": "nowhere"},
        }
    )


def built(settings, store):
    policy = Policy(
        store.layout,
        settings.network_settings,
        torch.Generator().manual_seed(0),
        is_squashed=settings.hyperparameters.is_squashed,
    )
    return policy, build_algorithm(settings, policy, store, seed=0)


def trained(settings, store, steps):
    policy, algorithm = built(settings, store)
    memory = settings.network_settings.memory
    draws = Draws(store, settings.hyperparameters.batch_size, memory.sequence_length if memory else 1, 1.0)
    for rows in draws.block(steps, torch.Generator().manual_seed(1)):
        algorithm.step(rows)
    return policy, algorithm


def actions_of(policy, observations):
    with torch.inference_mode():
        actions, _ = policy.act(observations, policy.start_memory(len(observations)))
        return policy.bounded(actions), actions.branches


@pytest.mark.parametrize("actions", ["squashed", "clipped"])
@pytest.mark.parametrize(
    ("trainer", "hyperparameters", "expected"),
    [
        ("bc", {}, 0.0),
        ("td3_bc", {"alpha": 10.0}, 0.5),
        ("iql", {"inverse_temperature": 5.0}, 0.5),
        ("awac", {"inverse_temperature": 20.0}, 0.5),
    ],
)
def test_the_push_that_paid_is_found(bandit, trainer, hyperparameters, expected, actions):
    policy, _ = trained(behavior(trainer, actions=actions, **hyperparameters), bandit, 600)
    observations = torch.randn(200, 2, generator=torch.Generator().manual_seed(3))
    pushes, _ = actions_of(policy, observations)
    assert pushes.mean().item() == pytest.approx(expected, abs=0.15)


@pytest.mark.parametrize("trainer", ["iql", "awac"])
def test_the_choice_that_paid_is_found(choices, trainer):
    policy, _ = trained(behavior(trainer, inverse_temperature=5.0), choices, 300)
    headings = torch.tensor([[-1.5], [-0.5], [0.5], [1.5]])
    _, chosen = actions_of(policy, headings)
    assert chosen[:, 0].tolist() == [0, 0, 2, 2]


def test_a_mixture_clones_either_of_two_ways_where_a_mean_would_be_neither():
    rng = torch.Generator().manual_seed(0)
    signs = torch.randint(2, (1000,), generator=rng) * 2 - 1
    rows = [row for sign in signs.tolist() for row in ([0, 0, 0.6 * sign, 0, 1, 1], [0] * 6)]
    store = store_of(PUSHED, rows)
    observation = torch.zeros(1, 2)
    plain, _ = actions_of(trained(behavior("bc"), store, 200)[0], observation)
    mixed, _ = actions_of(trained(behavior("bc", {"mixture": 2}), store, 400)[0], observation)
    assert abs(plain.item()) < 0.2
    assert abs(mixed.item()) == pytest.approx(0.6, abs=0.05)


@pytest.mark.parametrize("memory", list(MEMORIES))
def test_a_sequence_is_cloned_by_what_was_seen_before(memory):
    """The push is what was seen one decision ago, which only a policy with memory can know."""
    rng = torch.Generator().manual_seed(0)
    rows = []
    for _ in range(200):
        seen = (torch.randint(2, (9,), generator=rng) * 2.0 - 1.0).tolist()
        rows += [[seen[k], 0, 0.5 * seen[k - 1] if k else 0, 0, k == 7, k == 7] for k in range(8)]
        rows.append([seen[8], 0, 0, 0, 0, 0])
    store = store_of(PUSHED, rows)
    policy, _ = trained(behavior("bc", {"memory": MEMORIES[memory]}, learning_rate=2e-3), store, 400)
    before = torch.tensor([[-1.0, 0.0], [1.0, 0.0]])
    with torch.inference_mode():
        _, remembered = policy.act(before, policy.start_memory(2))
        actions, _ = policy.act(torch.ones(2, 2) * torch.tensor([1.0, 0.0]), remembered)
    assert policy.bounded(actions)[:, 0].tolist() == pytest.approx([-0.5, 0.5], abs=0.15)


@pytest.mark.parametrize("trainer", ["bc", "td3_bc", "iql", "awac"])
def test_what_was_saved_goes_on_bit_for_bit(bandit, trainer):
    settings = behavior(trainer)
    rows = Draws(bandit, 128, 1, 1.0).block(30, torch.Generator().manual_seed(1))
    policy, algorithm = built(settings, bandit)
    for each in rows[:15]:
        algorithm.step(each)
    saved = copy.deepcopy((policy.state_dict(), algorithm.state()))
    for each in rows[15:]:
        algorithm.step(each)
    other_policy, other = built(settings, bandit)
    other_policy.load_state_dict(saved[0])
    other.load_state(saved[1])
    for each in rows[15:]:
        other.step(each)
    for name, tensor in policy.state_dict().items():
        assert torch.equal(tensor, other_policy.state_dict()[name]), name


def test_the_best_episodes_are_those_of_the_greatest_returns():
    rows = []
    for length, reward in ((2, 1.0), (1, 5.0), (3, 0.5), (1, -1.0)):
        rows += [[0, 0, 0, reward, 0, k == length - 1] for k in range(length)] + [[0] * 6]
    store = store_of(PUSHED, rows)
    assert store.episode_returns().tolist() == [2.0, 5.0, 1.5, -1.0]
    assert best_decisions(store, 0.5).tolist() == [0, 1, 3]
    assert best_decisions(store, 0.01).tolist() == [3]
    drawn = Draws(store, 8, 1, 0.5).block(50, torch.Generator().manual_seed(0))
    assert set(drawn.flatten().tolist()) == {0, 1, 3}


def test_what_an_algorithm_does_not_do_is_refused_in_one_sentence(bandit, choices):
    with pytest.raises(OfflineError, match="td3_bc has continuous actions only, and Steered as it is set has choices"):
        built(behavior("td3_bc"), choices)
    memory = {"memory": MEMORIES["lstm"]}
    with pytest.raises(OfflineError, match="memory: is not supported with trainer_type iql; bc has it"):
        built(behavior("iql", memory), bandit)
    settings = behavior("iql")
    curious = settings.model_copy(
        update={"reward_signals": Behavior.model_validate({"reward_signals": {"curiosity": {}}}).reward_signals}
    )
    with pytest.raises(OfflineError, match="reward_signals: iql takes extrinsic alone, and there is curiosity"):
        built(curious, bandit)
