import io

import pytest
import torch

from policies.learn.algorithms.ppo import Ppo
from policies.learn.algorithms.schedule import scheduled, sharpened
from policies.learn.config.behavior import Behavior, PpoHyperparameters
from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.networks.policy import Policy
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.tasks.catalogue import build_task
from policies.tasks.episode import Outcome


def learner(seed=1, memory=None, env_count=8, signals=None, width=16, max_steps=10**6, is_normalized=True, **params):
    params = {"batch_size": 64, "buffer_size": 256, **params}
    behavior = Behavior(
        hyperparameters=PpoHyperparameters(**params),
        network_settings=NetworkSettings(hidden_units=width, normalize=is_normalized, memory=memory),
        max_steps=max_steps,
    )
    task = build_task("RollerBall", env_count)
    policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(seed))
    return Ppo(task, policy, behavior, signals or [ExtrinsicSignal()], seed=seed)


def weights(ppo):
    return torch.cat([parameter.flatten() for parameter in ppo.policy.parameters()])


def test_the_same_seed_learns_the_same_weights():
    first, second, other = learner(seed=1), learner(seed=1), learner(seed=2)
    for ppo in (first, second, other):
        ppo.iterate()
        ppo.iterate()
    assert torch.equal(weights(first), weights(second))
    assert not torch.equal(weights(first), weights(other))


class Constant:
    """A signal that rewards every decision with one number and notes what it was taught."""

    name = "constant"

    def __init__(self, reward, gamma, is_episodic=True, strength=1.0):
        self.reward, self.gamma, self.is_episodic, self.strength = reward, gamma, is_episodic, strength
        self.taught = 0

    def rewards(self, transitions):
        return torch.full_like(transitions.rewards, self.reward)

    def update(self, batch):
        self.taught += len(batch.rewards)
        return {"Losses/Constant Loss": float(self.taught)}

    def state(self):
        return {"taught": self.taught}

    def load_state(self, state):
        self.taught = state["taught"]


def test_a_signal_has_its_own_value_head_and_is_taught_every_minibatch():
    constant = Constant(1.0, gamma=0.5)
    ppo = learner(signals=[ExtrinsicSignal(), constant], num_epoch=2)
    iteration = ppo.iterate()
    assert ppo.critic.heads.out_features == 2
    assert constant.taught == 2 * 256
    assert iteration.statistics["Losses/Constant Loss"] == 64 * (1 + 8) / 2  # the mean of eight minibatches
    assert {"Policy/Extrinsic Value Estimate", "Policy/Constant Value Estimate"} <= iteration.statistics.keys()


@pytest.mark.parametrize("memory", [None, Memory(sequence_length=8, memory_size=8)], ids=["feed-forward", "recurrent"])
def test_the_critic_learns_the_discounted_return_of_a_constant_reward(memory):
    # endless: 1 + 0.5 + 0.25 ... = 2, times the strength of 3; episode ends do not count for this signal
    ppo = learner(
        signals=[Constant(1.0, gamma=0.5, is_episodic=False, strength=3.0)],
        memory=memory,
        learning_rate=3e-3,
        learning_rate_schedule="constant",
        epsilon_schedule="constant",
        num_epoch=5,
    )
    for _ in range(25):
        iteration = ppo.iterate()
    assert iteration.statistics["Policy/Constant Value Estimate"] == pytest.approx(6.0, rel=0.1)


def test_normalized_returns_are_learned_in_few_updates_whatever_their_scale():
    ppo = learner(signals=[Constant(1000.0, gamma=0.5, is_episodic=False)], normalize_returns=True, learning_rate=3e-3)
    for _ in range(25):
        iteration = ppo.iterate()
    assert iteration.statistics["Policy/Constant Value Estimate"] == pytest.approx(2000.0, rel=0.1)


@pytest.mark.parametrize("memory", [None, Memory(sequence_length=8, memory_size=8)], ids=["feed-forward", "recurrent"])
@pytest.mark.parametrize("is_shared", [False, True], ids=["own critic", "shared critic"])
def test_a_restored_learner_goes_on_bit_for_bit(memory, is_shared):
    options = {"memory": memory, "shared_critic": is_shared, "normalize_returns": True}
    straight = learner(**options, signals=[ExtrinsicSignal(), Constant(0.1, gamma=0.9)])
    straight.iterate()
    file = io.BytesIO()
    torch.save(straight.state(), file)
    expected = [straight.iterate() for _ in range(2)]
    file.seek(0)
    restored = learner(seed=5, **options, signals=[ExtrinsicSignal(), Constant(0.1, gamma=0.9)])
    restored.iterate()
    restored.load_state(torch.load(file, weights_only=False))
    assert [restored.iterate() for _ in range(2)] == expected
    assert torch.equal(weights(restored), weights(straight))
    assert restored.steps == straight.steps == 3 * 256


def test_the_actor_remembers_until_its_episode_ends():
    ppo = learner(memory=Memory(sequence_length=8, memory_size=8))
    rollout = ppo._rollout
    ppo.iterate()
    for k in range(1, len(rollout.memories)):
        is_fresh = rollout.is_over[8 * k - 1]
        assert rollout.memories[k][is_fresh].abs().sum() == 0.0
        assert rollout.memories[k][~is_fresh].abs().amin() > 0.0


def test_a_restart_begins_all_episodes_anew_without_memory_of_the_old_ones():
    ppo = learner(memory=Memory(sequence_length=8, memory_size=8))
    ppo.iterate()
    running = [ppo._memory, ppo._critic_memory, ppo.task.task.buffers.steps.numpy()]
    assert all(values.any() for values in running)
    ppo.restart()
    fresh = [ppo._memory, ppo._critic_memory, ppo.task.task.buffers.steps.numpy(), ppo.state()["running_sums"]]
    assert not any(values.any() for values in fresh)


@pytest.mark.parametrize("memory", [None, Memory(sequence_length=8, memory_size=8)], ids=["feed-forward", "recurrent"])
def test_before_learning_the_ratio_of_new_to_old_probability_is_one(memory):
    ppo = learner(memory=memory, is_normalized=False)
    rollout = ppo._rollout
    ppo._collect(rollout)
    for batch in rollout.minibatches(64, torch.Generator().manual_seed(0)):
        log_probs = ppo.policy.heads(ppo._features(ppo.policy.body, batch)).log_probs(batch.actions)
        assert torch.allclose(log_probs, batch.log_probs, atol=1e-5)


@pytest.mark.parametrize("memory", [None, Memory(sequence_length=8, memory_size=8)], ids=["feed-forward", "recurrent"])
def test_values_of_the_rollout_are_those_of_its_minibatches(memory):
    ppo = learner(memory=memory)
    rollout = ppo._rollout
    for _ in range(2):  # the second begins with memory
        ppo._collect(rollout)
        ppo._estimate(rollout, rollout.rewards[..., None])
    for batch in rollout.minibatches(64, torch.Generator().manual_seed(0)):
        values = ppo.critic.heads(ppo._features(ppo.critic.body, batch))
        assert torch.allclose(values, batch.values, atol=1e-5)


def test_learning_stops_when_the_policy_has_moved_far_enough():
    def taught(target_kl):
        constant = Constant(0.0, gamma=0.9)
        signals = [ExtrinsicSignal(), constant]
        learner(signals=signals, num_epoch=6, learning_rate=1e-2, target_kl=target_kl).iterate()
        return constant.taught

    assert taught(None) == 6 * 256
    assert 256 <= taught(1e-3) < 6 * 256


def test_rates_fall_to_their_floors():
    ppo = learner(max_steps=512)
    ppo.iterate()
    statistics = ppo.iterate().statistics
    assert statistics["Policy/Learning Rate"] == pytest.approx(1e-10)
    assert statistics["Policy/Beta"] == pytest.approx(1e-5)
    assert statistics["Policy/Epsilon"] == pytest.approx(0.1)
    assert scheduled(0.2, 0.1, "linear", 0.5) == pytest.approx(0.15)
    assert scheduled(0.2, 0.1, "constant", 0.5) == 0.2


def test_sharpening_is_whole_after_three_quarters_however_it_is_divided():
    assert sharpened(4.0, 0.0, 0.5) == sharpened(4.0, 0.75, 1.0) == 1.0
    assert sharpened(4.0, 0.4, 0.9) == pytest.approx(4.0)
    assert sharpened(4.0, 0.4, 0.6) * sharpened(4.0, 0.6, 0.7) * sharpened(4.0, 0.7, 1.2) == pytest.approx(4.0)


def test_a_shared_body_is_trained_once():
    ppo = learner(shared_critic=True)
    assert ppo.critic.body is ppo.policy.body
    own = learner()
    shared_count = sum(p.numel() for p in ppo._parameters)
    assert shared_count == sum(p.numel() for p in own._parameters) - sum(
        p.numel() for p in own.critic.body.parameters()
    )


def test_scores_are_those_of_the_episodes_that_ended():
    iteration = learner(buffer_size=2048).iterate()
    count = iteration.scores.episode_count
    assert count > 0
    assert iteration.statistics["Policy/Extrinsic Reward"] == pytest.approx(iteration.scores.return_sum / count)


def success_rate(ppo, decision_count=100):
    """Of the most probable actions, on episodes that were not trained on."""
    task = ppo.task.task
    task.reset(999)
    task.take_scores()
    memory = ppo.policy.start_memory(task.env_count)
    with torch.inference_mode():
        for _ in range(decision_count):
            actions, memory = ppo.policy.act(ppo.task.observations, memory)
            ppo.task.step(ppo.policy.bounded(actions), actions.branches)
    scores = task.take_scores()
    return scores.count(Outcome.SUCCESS) / scores.episode_count


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_it_learns_to_push_the_ball_to_the_cube(seed):
    ppo = learner(
        seed=seed,
        signals=[ExtrinsicSignal(gamma=0.995)],
        env_count=512,
        buffer_size=512 * 16,
        batch_size=2048,
        learning_rate=3e-3,
        learning_rate_schedule="constant",
        beta=0.0,
        num_epoch=2,
        width=64,
    )
    while ppo.steps < 200_000:
        ppo.iterate()
    assert success_rate(ppo) > 0.98


@pytest.mark.parametrize("memory", [None, Memory(sequence_length=8, memory_size=8)], ids=["feed-forward", "recurrent"])
def test_a_timeout_bootstraps_and_a_true_end_does_not(memory):
    ppo = learner(memory=memory, signals=[Constant(0.0, gamma=0.5), Constant(0.0, gamma=0.5, is_episodic=False)])
    rollout = ppo._rollout
    ppo._collect(rollout)
    rollout.is_truncated.zero_()
    rollout.is_terminated.zero_()
    rollout.is_truncated[-1, 0] = True
    rollout.is_terminated[-1, 1] = True
    rollout.final_observations.fill_(2.0)
    with torch.no_grad():
        ppo.critic.heads.weight.zero_()
        ppo.critic.heads.bias.copy_(torch.tensor([10.0, 20.0]))  # whatever is seen
    ppo._estimate(rollout, torch.zeros(*rollout.rewards.shape, 2))
    last = rollout.returns[-1]
    assert last[0].tolist() == [5.0, 10.0]
    assert last[1].tolist() == [0.0, 10.0]
    assert last[2].tolist() == [5.0, 10.0]


def test_a_timeout_is_valued_by_what_its_episode_saw_last():
    ppo = learner(is_normalized=False)
    rollout = ppo._rollout
    ppo._collect(rollout)
    rollout.is_truncated[5, 0] = True
    rollout.final_observations[5, 0] = 3.0
    with torch.no_grad():
        _, next_values = ppo._values(rollout)
        assert torch.allclose(next_values[5, 0], ppo.critic(torch.full((8,), 3.0)))
        is_going_on = ~rollout.is_over[7]
        assert torch.allclose(next_values[7][is_going_on], ppo.critic(rollout.observations[8][is_going_on]), atol=1e-6)
