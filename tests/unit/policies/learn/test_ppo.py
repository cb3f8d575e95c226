import torch

from policies.learn.config.behavior import Behavior, PpoHyperparameters
from policies.learn.config.network import NetworkSettings
from policies.learn.policy import Policy
from policies.learn.ppo import Ppo
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.tasks.catalogue import build_task


def learner(seed=1, memory=None, env_count=8, **numbers):
    numbers = {"batch_size": 64, "buffer_size": 256, **numbers}
    behavior = Behavior(
        hyperparameters=PpoHyperparameters(**numbers),
        network_settings=NetworkSettings(hidden_units=16, normalize=True, memory=memory),
    )
    task = build_task("RollerBall", env_count)
    policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(seed))
    return Ppo(task, policy, behavior, [ExtrinsicSignal()], seed=seed)


def weights(ppo):
    return torch.cat([parameter.flatten() for parameter in ppo.policy.parameters()])


def test_the_same_seed_learns_the_same_weights():
    first, second, other = learner(seed=1), learner(seed=1), learner(seed=2)
    for ppo in (first, second, other):
        ppo.iterate()
        ppo.iterate()
    assert torch.equal(weights(first), weights(second))
    assert not torch.equal(weights(first), weights(other))
