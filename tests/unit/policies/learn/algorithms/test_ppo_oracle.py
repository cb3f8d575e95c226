"""One update of Stable-Baselines3's PPO against ours, from the same weights and decisions, where both mean the same.

They do with the ratio of the whole action, plain advantages and one epoch of one minibatch. Their entropy is the sum of
the continuous dimensions, ours the mean.
"""

import gymnasium
import numpy as np
import pytest
import torch

import policies  # noqa: F401  (registers the tasks)
from policies.learn.algorithms.ppo import Ppo
from policies.learn.config.behavior import Behavior, PpoHyperparameters
from policies.learn.config.network import NetworkSettings
from policies.learn.networks.policy import Policy
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.tasks.catalogue import build_task

pytestmark = pytest.mark.filterwarnings("ignore")  # theirs
stable_baselines3 = pytest.importorskip("stable_baselines3")

STEPS, ENVS, BETA = 32, 4, 0.01


def ours():
    behavior = Behavior(
        hyperparameters=PpoHyperparameters(
            batch_size=STEPS * ENVS,
            buffer_size=STEPS * ENVS,
            num_epoch=1,
            beta=2.0 * BETA,
            learning_rate_schedule="constant",
            joint_ratio=True,
            normalize_advantages="none",
        ),
        network_settings=NetworkSettings(hidden_units=16),
    )
    task = build_task("RollerBall", ENVS)
    policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(0))
    return Ppo(task, policy, behavior, [ExtrinsicSignal(0.9)], seed=0)


def theirs(ppo):
    """Their PPO with our weights."""
    model = stable_baselines3.PPO(
        "MlpPolicy",
        stable_baselines3.common.vec_env.DummyVecEnv([lambda: gymnasium.make("honeyguide/RollerBall-v0")] * ENVS),
        n_steps=STEPS,
        batch_size=STEPS * ENVS,
        n_epochs=1,
        gamma=0.9,
        ent_coef=BETA,
        max_grad_norm=float("inf"),
        normalize_advantage=False,
        device="cpu",
        policy_kwargs={"net_arch": [16, 16], "activation_fn": torch.nn.SiLU, "optimizer_kwargs": {"eps": 1e-8}},
    )
    model._setup_learn(1)
    with torch.no_grad():
        for mine, other in zip(parts(ppo), their_parts(model), strict=True):
            other.copy_(mine)
    return model


def parts(ppo):
    actor, critic = ppo.policy.body.layers.parameters(), ppo.critic.body.layers.parameters()
    heads = ppo.policy.heads
    return [*actor, *critic, *heads.mean.parameters(), *ppo.critic.heads.parameters(), heads.log_sigma]


def their_parts(model):
    net = model.policy
    extractor = net.mlp_extractor
    modules = (extractor.policy_net, extractor.value_net, net.action_net, net.value_net)
    return [*(parameter for module in modules for parameter in module.parameters()), net.log_std]


def test_one_update_moves_all_weights_as_stable_baselines3_does():
    ppo = ours()
    model = theirs(ppo)
    rollout = ppo._rollout
    before = [parameter.detach().clone() for parameter in parts(ppo)]
    ppo._collect(rollout)
    rollout.is_truncated.zero_()  # theirs values timeouts otherwise
    ppo._estimate(rollout, rollout.rewards[..., None])
    is_over = rollout.is_over.numpy()
    values = ppo._values(rollout)[0]
    buffer = model.rollout_buffer
    starts = np.ones(ENVS)
    for t in range(STEPS):
        buffer.add(
            rollout.observations[t].numpy(),
            rollout.actions.continuous[t].numpy(),
            rollout.rewards[t].numpy(),
            starts,
            values[t].detach(),
            rollout.log_probs[t].sum(-1),
        )
        starts = is_over[t]
    with torch.no_grad():
        buffer.compute_returns_and_advantage(ppo.critic(rollout.observations[-1]), starts)
    assert is_over.any()
    assert np.allclose(buffer.advantages, rollout.advantages.numpy(), atol=1e-5)
    assert np.allclose(buffer.returns, rollout.returns[..., 0].numpy(), atol=1e-5)

    ppo._improve(rollout, None)
    model.train()
    for old, mine, other in zip(before, parts(ppo), their_parts(model), strict=True):
        assert (mine - old).abs().max() > 1e-5
        assert torch.allclose(mine, other, atol=2e-6)  # a hundredth of the first step of Adam, 3e-4
