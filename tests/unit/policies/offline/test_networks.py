"""What offline training adds to networks: stacks, flat parameters, transformers, mixtures, and their exports."""

import pytest
import torch

from policies.learn.algorithms.sac_update import ActionCritic
from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.export.onnx_export import export_policy
from policies.learn.networks.history import History
from policies.learn.networks.policy import Policy
from policies.offline.flat_parameters import FlatOptimizer
from policies.offline.stacked_networks import twin_critics
from policies.tasks.layout import Branch, Element, Layout
from tests.unit.policies.offline.datasets import PUSHED

MIXED = Layout(
    "Mixed",
    1,
    tuple(Element(name, "1") for name in "abc"),
    continuous=(Element("push", "1"), Element("turn", "1")),
    branches=(Branch("gear", ("low", "high", "none")), Branch("horn", ("off", "on"))),
)
TRANSFORMER = Memory(memory_type="transformer", sequence_length=4, layers=2, heads=2)


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def test_stacked_critics_are_those_of_soft_actor_critic():
    settings = NetworkSettings(hidden_units=8)
    stacked = twin_critics(MIXED, settings, generator())
    policy = Policy(MIXED, settings, generator(), is_squashed=True)
    theirs = torch.nn.ModuleList(ActionCritic(policy, 1, generator(k)) for k in range(2))
    theirs.load_state_dict(stacked.sac_record())
    inputs = torch.randn(5, 5, generator=generator(3))
    expected = torch.stack([critic(inputs)[:, 0] for critic in theirs])
    torch.testing.assert_close(stacked(inputs), expected)
    torch.testing.assert_close(stacked(inputs, count=1), expected[:1])
    other = twin_critics(MIXED, settings, generator(9))
    other.load_sac_record(stacked.sac_record())
    assert torch.equal(other(inputs), stacked(inputs))


def test_a_flat_step_is_the_step_of_adam():
    def net():
        torch.manual_seed(0)
        return torch.nn.Sequential(torch.nn.Linear(3, 4), torch.nn.Tanh(), torch.nn.Linear(4, 1))

    flat, plain = net(), net()
    ours = FlatOptimizer(flat.parameters(), 0.01, max_grad_norm=0.5)
    theirs = torch.optim.Adam(plain.parameters(), lr=0.01)
    inputs = torch.randn(6, 3, generator=generator())
    for _ in range(5):
        ours.step(flat(inputs).square().sum())
        theirs.zero_grad()
        plain(inputs).square().sum().backward()
        torch.nn.utils.clip_grad_norm_(plain.parameters(), 0.5)
        theirs.step()
    for a, b in zip(flat.parameters(), plain.parameters(), strict=True):
        torch.testing.assert_close(a, b)
        assert a.untyped_storage().data_ptr() == ours.vector.untyped_storage().data_ptr()


def test_looking_back_step_by_step_is_looking_at_the_whole():
    history = History(8, 3, 1, 2, generator())
    with torch.no_grad():
        history.layers[0].ago.normal_(generator=generator(5))
    inputs = torch.randn(7, 2, 8, generator=generator(1))
    is_start = torch.zeros(7, 2, dtype=torch.bool)
    is_start[0], is_start[4, 1] = True, True
    whole = history(inputs, torch.zeros(2, history.memory_size), is_start)
    memory = torch.zeros(2, history.memory_size)
    for k in range(7):
        memory = memory.masked_fill(is_start[k][:, None], 0.0)
        outputs, memory = history.step(inputs[k], memory)
        torch.testing.assert_close(outputs, whole[k])


@pytest.mark.parametrize("layers", [1, 2])
def test_a_stretch_that_begins_amid_an_episode_goes_on_from_its_memory(layers):
    history = History(8, 4, layers, 2, generator())
    with torch.no_grad():
        for layer in history.layers:
            layer.ago.normal_(generator=generator(5))
            layer.nothing.normal_(generator=generator(6))
    inputs = torch.randn(12, 3, 8, generator=generator(1))
    is_start = torch.zeros(12, 3, dtype=torch.bool)
    is_start[0], is_start[2, 1], is_start[6, 1], is_start[4, 2] = True, True, True, True
    memory = torch.zeros(3, history.memory_size)
    memories, stepped = [], []
    for k in range(12):
        memory = memory.masked_fill(is_start[k][:, None], 0.0)
        memories.append(memory)
        outputs, memory = history.step(inputs[k], memory)
        stepped.append(outputs)
    for begin in (0, 4, 8):
        stretch = slice(begin, begin + 4)
        outputs = history(inputs[stretch], memories[begin], is_start[stretch])
        torch.testing.assert_close(outputs, torch.stack(stepped[stretch]))


def test_no_decision_looks_ahead_or_beyond_its_episode():
    history = History(8, 4, 2, 2, generator())
    inputs = torch.randn(6, 1, 8, generator=generator(1)).requires_grad_()
    is_start = torch.tensor([1, 0, 0, 1, 0, 0], dtype=torch.bool)[:, None]
    outputs = history(inputs, torch.zeros(1, history.memory_size), is_start)
    (slope,) = torch.autograd.grad(outputs[4].sum(), inputs)
    assert (slope.abs().sum((1, 2)) > 0).tolist() == [False, False, False, True, True, False]


@pytest.mark.parametrize(
    "settings",
    [
        NetworkSettings(hidden_units=8, normalize=True, memory=TRANSFORMER),
        NetworkSettings(hidden_units=8, mixture=3),
        NetworkSettings(hidden_units=8, mixture=3, memory=TRANSFORMER),
    ],
)
@pytest.mark.parametrize("layout", [PUSHED, MIXED])
@pytest.mark.parametrize("is_squashed", [True, False])
def test_exports_do_what_the_policy_does(tmp_path, settings, layout, is_squashed):
    policy = Policy(layout, settings, generator(), is_squashed=is_squashed)
    assert export_policy(policy, tmp_path / "policy.onnx") < 1e-5


def test_the_likeliest_component_acts():
    policy = Policy(PUSHED, NetworkSettings(hidden_units=8, mixture=3), generator())
    features = torch.randn(20, 8, generator=generator(2))
    logs, means, log_sigmas = policy.heads.components(features)
    assert logs.exp().sum(-1).tolist() == pytest.approx([1.0] * 20)
    distribution = policy.heads(features)
    best = logs.argmax(-1)
    rows = torch.arange(20)
    assert torch.equal(distribution.mean, means[rows, best])
    assert torch.equal(distribution.log_sigma, log_sigmas[rows, best])
    assert len(set(best.tolist())) > 1
