import torch

from policies.learn.rollout.replay_buffer import Replay, ReplayBatch


def a_round(number, env_count=2):
    """One transition per environment; everything in it tells its round, the observation also its environment."""
    envs = torch.arange(env_count)
    return ReplayBatch(
        observations=torch.stack([torch.full((env_count,), float(number)), envs.float()], dim=1),
        next_observations=torch.full((env_count, 2), number + 0.5),
        continuous=torch.full((env_count, 1), number / 100.0),
        branches=torch.full((env_count, 2), number, dtype=torch.int64),
        rewards=torch.full((env_count,), -float(number)),
        is_terminated=(envs == number % 2).float(),
        is_ended=envs == number % 2,
    )


def filled(capacity, rounds):
    replay = Replay(capacity, 2, 2, (1, 2))
    for number in range(rounds):
        replay.add(a_round(number))
    return replay


def test_what_was_written_comes_back():
    taken = filled(20, 3).take(torch.tensor([2 * 2 + 1]))
    assert taken.observations.tolist() == [[2.0, 1.0]]
    assert taken.next_observations.tolist() == [[2.5, 2.5]]
    assert taken.continuous.tolist() == [[torch.tensor(0.02).item()]]
    assert taken.branches.tolist() == [[2, 2]]
    assert taken.branches.dtype == torch.int64
    assert taken.rewards.tolist() == [-2.0]
    assert taken.is_terminated.tolist() == [0.0]
    assert taken.is_ended.tolist() == [False]


def test_the_newest_transitions_stay_when_the_ring_is_full():
    replay = filled(9, 11)  # four rounds of two; one transition of the capacity is left over
    assert len(replay) == 8
    observation = replay.take(replay.draw(1000, torch.Generator().manual_seed(1))).observations
    assert set(observation[:, 0].tolist()) == {7.0, 8.0, 9.0, 10.0}


def test_all_transitions_are_drawn_alike():
    replay = filled(20, 5)
    drawn = replay.draw(100_000, torch.Generator().manual_seed(1)).bincount()
    assert len(drawn) == len(replay) == 10
    assert (drawn - 10_000).abs().max() < 5 * 95  # five standard deviations of a binomial count


def test_a_restored_ring_goes_on_alike():
    for rounds in (3, 9):
        one, two = filled(9, rounds), filled(9, 0)
        two.load_state(one.state())
        for replay in (one, two):
            replay.add(a_round(50))
        assert torch.equal(one.rows, two.rows)
        assert len(one) == len(two)


def test_a_state_holds_no_more_than_what_was_written():
    assert filled(1000, 3).state()["rows"].shape == (3, 2, 2 + 2 + 3 + 3)
