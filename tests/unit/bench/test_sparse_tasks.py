"""Many mountain cars at once go as Gymnasium's one does."""

import gymnasium
import numpy as np

from bench.cars.sparse_tasks import MountainCar, MountainCars
from policies.tasks.catalogue import build_task
from policies.tasks.episode import Outcome


def test_many_cars_go_as_gymnasiums_one():
    cars, random = MountainCars(20), np.random.default_rng(1)
    cars.reset(seed=[3] * 20)
    ones = [gymnasium.make("MountainCar-v0") for _ in range(20)]
    for one, state in zip(ones, cars.state, strict=True):
        one.reset()
        one.unwrapped.state = tuple(state)
    pumped = np.arange(20) % 2 == 0  # these push the way they go, and come up
    for _ in range(200):
        actions = np.where(pumped, 1 + np.where(cars.state[:, 1] < 0.0, -1, 1), random.integers(3, size=20))
        seen, rewards, is_up, is_cut, _ = cars.step(actions)
        for i, one in enumerate(ones):
            expected = one.step(int(actions[i]))
            np.testing.assert_array_equal(seen[i], expected[0])
            assert (rewards[i], is_up[i], is_cut[i]) == expected[1:4]
        if (is_up | is_cut).any():
            break
    assert is_up.any()


def test_the_top_is_a_success():
    task = build_task(MountainCar, 4)
    task.reset(1)
    outcomes = []
    while not (outcomes and outcomes[-1].any()):
        velocity = task.buffers.observations.numpy()[:, 1]
        task.buffers.branches.numpy()[:, 0] = np.where(velocity < 0.0, 0, 2)
        task.step()
        outcomes.append(task.buffers.outcomes.numpy().copy())
    assert set(outcomes[-1]) <= {Outcome.RUNNING, Outcome.SUCCESS}
    assert 50 < len(outcomes) < 200
