import pytest
import torch

from policies.learn.algorithms.behavioural_cloning import Cloning
from policies.learn.algorithms.sac import Sac, SacError
from policies.learn.config.behavior import Behavior
from policies.learn.networks.policy import Policy
from policies.learn.signals.build_signals import build_signals
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.learn.signals.signal import Transitions
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from tests.unit.policies.learn.signs import Signs

FAST = {"batch_size": 256, "buffer_size": 100_000, "learning_rate": 1e-3, "steps_per_update": 8, "tau": 0.02}


def learner(task, *, network=(), seed=1, gamma=0.95, **hyperparameters):
    behavior = Behavior.model_validate(
        {
            "trainer_type": "sac",
            "hyperparameters": {**FAST, "buffer_init_steps": 1000, "init_entcoef": 0.02, **hyperparameters},
            "network_settings": {"hidden_units": 64, "normalize": True, **dict(network)},
        }
    )
    policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(seed), is_squashed=True)
    return Sac(task, policy, behavior, [ExtrinsicSignal(gamma)], seed=seed)


def small(**hyperparameters):
    """RollerBall with little of everything."""
    task = build_task("RollerBall", 8)
    task.set_params({"step_limit": 20.0})
    sizes = {"batch_size": 32, "buffer_size": 1600, "buffer_init_steps": 400, "steps_per_update": 25}
    return learner(task, network={"hidden_units": 16}, **sizes | hyperparameters)


def flat(value):
    """All leaves of a nested state."""
    if isinstance(value, dict):
        return [leaf for key in value for leaf in flat(value[key])]
    if isinstance(value, (list, tuple)):
        return [leaf for item in value for leaf in flat(item)]
    return [value.numpy().tobytes() if isinstance(value, torch.Tensor) else getattr(value, "tobytes", lambda: value)()]


def mean_reward(task, policy, rounds=20):
    """Of the most probable actions."""
    no_memory = policy.start_memory(task.env_count)
    task.take_scores()
    for _ in range(rounds):
        with torch.no_grad():
            actions, _ = policy.act(torch.from_numpy(task.buffers.observations.numpy().copy()), no_memory)
        if actions.continuous.shape[1]:
            task.buffers.continuous.numpy()[:] = policy.bounded(actions).numpy()
        if actions.branches.shape[1]:
            task.buffers.branches.numpy()[:] = actions.branches.numpy()
        task.step()
    scores = task.take_scores()
    return scores.return_sum / scores.episode_count


@pytest.mark.parametrize(
    ("branches", "is_pointing"), [((3,), False), ((3, 2), False), ((), True), ((3, 2), True)], ids=str
)
def test_it_learns_choices_points_and_both_together(branches, is_pointing):
    task = Signs(16, branches, is_pointing)
    sac = learner(task, steps_per_update=6, gamma=0.0)
    while sac.steps < 3000:
        sac.iterate()
    assert mean_reward(task, sac.policy) > 0.5 * len(branches) - 0.06


@pytest.mark.parametrize("hindsight", [0, 4])
def test_a_restored_learner_goes_on_bit_for_bit(hindsight):
    one = small(save_replay_buffer=True, hindsight=hindsight)
    for _ in range(2):
        one.iterate()
    state = one.state()
    ends = [flat(one.iterate().statistics)]
    two = small(save_replay_buffer=True, hindsight=hindsight, seed=9)
    two.load_state(state)
    ends.append(flat(two.iterate().statistics))
    assert ends[0] == ends[1]
    assert flat(one.state()) == flat(two.state())


def test_learning_on_does_not_change_a_state_that_was_taken():
    sac = small(save_replay_buffer=True, hindsight=4)
    sac.iterate()
    state = sac.state()
    before = flat(state)
    sac.iterate()
    assert flat(state) == before


def test_a_state_without_the_buffer_goes_on_when_a_batch_has_been_collected_anew():
    one = small()
    for _ in range(2):
        one.iterate()
    state = one.state()
    assert "replay" not in state
    two = small(batch_size=1024)
    two.load_state(state)
    before = flat(two.state()["networks"]["critics"])
    two.iterate()
    assert len(two.replay) == 1000
    assert flat(two.state()["networks"]["critics"]) == before
    two.iterate()
    assert flat(two.state()["networks"]["critics"]) != before


def test_there_is_one_update_per_steps_per_update_on_average():
    sac = small(steps_per_update=13, reward_signal_steps_per_update=13)
    for _ in range(3):
        sac.iterate()
    assert sac.steps == 3000
    assert sac.state()["update_counts"] == [(3000 - 400) // 13] * 2


def test_first_actions_are_spread_evenly_over_all_that_are_possible():
    task = Signs(100, (3, 2), is_pointing=True)
    sac = learner(task, buffer_init_steps=1000)
    sac.iterate()
    batch = sac.replay.take(torch.arange(len(sac.replay)))
    assert (batch.branches[:, 0].bincount() - 333).abs().max() < 75  # five standard deviations
    assert (batch.branches[:, 1].bincount() - 500).abs().max() < 80
    assert batch.continuous.mean().item() == pytest.approx(0.0, abs=0.1)
    assert batch.continuous.std().item() == pytest.approx(3.0**-0.5, abs=0.05)


def test_a_timeout_is_kept_as_no_end_and_with_what_the_episode_saw_last():
    sac = small()
    sac.iterate()
    batch = sac.replay.take(torch.arange(len(sac.replay)))
    is_cut = batch.is_ended & (batch.is_terminated == 0.0)
    assert is_cut.any()
    moved = (batch.next_observations - batch.observations)[:, 3:6].norm(dim=1)
    assert moved[is_cut].max() < 5.0
    assert torch.equal(batch.next_observations[is_cut, :3], batch.observations[is_cut, :3])  # of the same goal


def test_rewards_are_those_of_the_episodes_that_ended():
    iteration = small().iterate()
    mean = iteration.scores.return_sum / iteration.scores.episode_count
    assert iteration.statistics["Policy/Extrinsic Reward"] == pytest.approx(mean)


def test_a_restart_begins_all_episodes_anew_and_parts_them_from_the_old_ones_in_hindsight():
    sac = small(hindsight=4)
    sac.iterate()
    task, hindsight = sac.task.task, sac._hindsight
    assert task.buffers.steps.numpy().any()
    running = hindsight._episode.clone()
    sac.restart()
    assert not task.buffers.steps.numpy().any()
    assert (hindsight._episode != running).any()
    sac._collect()
    before, after = hindsight._episodes[sac.replay.rounds - 2], hindsight._episodes[sac.replay.rounds - 1]
    assert (before != after).all()


def test_a_clone_of_demonstrations_acts_as_they_did_and_goes_on_bit_for_bit():
    def cloned(seed):
        task = Signs(50, (3, 2), is_pointing=True)
        behavior = Behavior.model_validate(
            {
                "trainer_type": "sac",
                "hyperparameters": {**FAST, "init_entcoef": 0.02, "learning_rate": 3e-3},
                "network_settings": {"hidden_units": 64, "normalize": True},
                "behavioral_cloning": {"demo_path": "unused", "samples_per_update": 256},
            }
        )
        policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(seed), is_squashed=True)
        settings = behavior.behavioral_cloning
        cloning = Cloning(policy, settings, shown(task.layout), (3e-3, 256, 1), seed)
        silent = ExtrinsicSignal(0.0, strength=0.0)  # what is learnt comes from the demonstrations alone
        return Sac(task, policy, behavior, [silent], seed=seed, cloning=cloning)

    one, two = cloned(1), cloned(2)
    for _ in range(2):
        statistics = one.iterate().statistics
    assert statistics["Losses/Pretraining Loss"] > 0.0
    assert mean_reward(one.task.task, one.policy) > 0.9
    state = one.state()
    two.load_state(state)
    assert flat(two.state()["cloning"]) == flat(state["cloning"])
    two.replay.load_state(one.replay.state())
    assert one.iterate().statistics == two.iterate().statistics


def shown(layout):
    """What whoever reads the signs does."""
    task = Signs(2000, layout.branch_sizes, is_pointing=True)
    task.reset(77)
    signs = torch.from_numpy(task.buffers.observations.numpy().copy())
    ends = torch.ones(2000, dtype=torch.bool)
    return Transitions(signs, signs, signs[:, 2:], signs[:, :2].long(), torch.ones(2000), ends)


def test_temperatures_and_losses_have_ml_agents_tags():
    sac = learner(Signs(50, (3, 2), is_pointing=True))
    sac.iterate()
    statistics = sac.iterate().statistics
    assert set(statistics) == {
        "Losses/Policy Loss",
        "Losses/Q1 Loss",
        "Losses/Q2 Loss",
        "Policy/Extrinsic Reward",
        "Policy/Extrinsic Value",
        "Policy/Learning Rate",
        "Policy/Continuous Entropy Coeff",
        "Policy/Discrete Entropy Coeff",
    }


def test_novelty_is_a_stream_of_its_own_and_learns_as_often_as_its_key_says():
    task = Signs(50, (3, 2), is_pointing=True)
    behavior = Behavior.model_validate(
        {
            "trainer_type": "sac",
            "hyperparameters": {**FAST, "reward_signal_steps_per_update": 100},
            "network_settings": {"hidden_units": 16},
            "reward_signals": {"extrinsic": {}, "rnd": {"gamma": 0.9}, "curiosity": {"strength": 0.01}},
        }
    )
    policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(1), is_squashed=True)
    sac = Sac(task, policy, behavior, build_signals(behavior.reward_signals, task.layout, 1, "cpu"), seed=1)
    statistics = sac.iterate().statistics
    assert {f"Policy/{name} Value" for name in ("Extrinsic", "Rnd", "Curiosity")} <= set(statistics)
    assert {f"Policy/{name} Reward" for name in ("Extrinsic", "Rnd", "Curiosity")} <= set(statistics)
    assert "Losses/RND Loss" in statistics
    assert sac.state()["update_counts"] == [1000 // 8, 1000 // 100]


def test_what_it_does_not_do_is_refused_in_one_sentence():
    with pytest.raises(SacError, match="memory: is not supported with trainer_type sac"):
        learner(build_task("RollerBall", 1), network={"memory": {"memory_size": 16, "sequence_length": 8}})
    with pytest.raises(SacError, match="buffer_size: 300 holds 200 steps in whole rounds of 200 environments: never a"):
        learner(Signs(200), buffer_size=300, batch_size=256)
    with pytest.raises(SacError, match="hindsight: is not possible with Signs as it is set"):
        learner(Signs(1), hindsight=4)
    with pytest.raises(SacError, match="hindsight: is not possible with RollerBall as it is set"):
        learner(build_task("RollerBall", 1, task_settings("RollerBall", {"stack": 2})), hindsight=4)


def success_rate(sac, steps):
    """Of the episodes in the last fifth of the training."""
    while sac.steps < 0.8 * steps:
        sac.iterate()
    scores = sac.iterate().scores
    while sac.steps < steps:
        scores += sac.iterate().scores
    return scores.count(Outcome.SUCCESS) / scores.episode_count


@pytest.mark.slow
def test_it_solves_roller_ball():
    rates = [success_rate(learner(build_task("RollerBall", 16), seed=seed), 20_000) for seed in (1, 2, 3)]
    assert min(rates) > 0.95


@pytest.mark.slow
def test_hindsight_finds_cubes_that_are_seldom_met_by_chance():
    rates = []
    for hindsight in (0, 4):
        task = build_task("RollerBall", 16)
        task.set_params({"reach_m": 0.5})
        rates.append(success_rate(learner(task, hindsight=hindsight), 20_000))
    assert rates[1] > 0.9
    assert rates[1] > rates[0] + 0.2
