"""Fitted Q evaluation against closed forms: a walk on a line whose rewards are its actions."""

import numpy as np
import pytest
import torch

from policies.learn.config.network import NetworkSettings
from policies.learn.networks.policy import Policy
from policies.offline.dataset_files import row_width
from policies.offline.fitted_q import FittedQ
from policies.offline.store import OfflineStore
from policies.tasks.layout import Element, Layout

LAYOUT = Layout("Line", 1, (Element("place", "m"),), (Element("step", "m"),), (), 1)
GAMMA, LENGTH, EPISODES = 0.8, 20, 60


def store():
    """Episodes of random steps; each pays its step, and the place does not matter."""
    rng = np.random.default_rng(1)
    rows = []
    for _ in range(EPISODES):
        places, steps = rng.uniform(-1, 1, LENGTH + 1), rng.uniform(-1, 1, LENGTH)
        episode = np.zeros((LENGTH + 1, row_width(LAYOUT)), np.float32)
        episode[:, 0], episode[:-1, 1], episode[:-1, 2] = places, steps, steps
        episode[LENGTH - 1, 4] = 1.0  # ended, since the time was up
        rows.append(episode)
    return OfflineStore(LAYOUT, np.concatenate(rows))


def always(step):
    policy = Policy(LAYOUT, NetworkSettings(hidden_units=8, num_layers=1), torch.Generator().manual_seed(0))
    with torch.no_grad():
        for parameter in policy.heads.mean.parameters():
            parameter.zero_()
        policy.heads.mean.bias.fill_(3.0 * step)  # PPO's actions are a third of what the network says
    actions, _ = policy.act(torch.zeros(1, 1), policy.start_memory(1))
    assert float(policy.bounded(actions).detach()) == pytest.approx(step, abs=1e-6)
    return policy


@pytest.mark.parametrize("step", [-0.5, 0.6])
def test_the_return_of_a_policy_that_never_flew_is_found(step):
    """Of a constant action for ever: step / (1 - gamma)."""
    fitted = FittedQ(store(), always(step), GAMMA, hidden=32)
    fitted.fit(1200)
    found = fitted.estimate()
    assert found.mean == pytest.approx(step / (1.0 - GAMMA), rel=0.15)
    assert found.low <= found.mean <= found.high


def test_how_far_a_policy_leaves_the_data_is_told():
    """Uniform steps in [-1, 1] are off a constant by the root of a third and its square."""
    fitted = FittedQ(store(), always(0.6), GAMMA, hidden=8)
    assert fitted.estimate().away == pytest.approx((1.0 / 3.0 + 0.36) ** 0.5, rel=0.05)


def test_policies_with_memory_are_refused():
    settings = NetworkSettings.model_validate({"hidden_units": 8, "memory": {"sequence_length": 4, "memory_size": 8}})
    with pytest.raises(ValueError, match="without memory"):
        FittedQ(store(), Policy(LAYOUT, settings, torch.Generator().manual_seed(0)), GAMMA)
