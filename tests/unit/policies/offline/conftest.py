import numpy as np
import pytest
import torch

from policies.experts.catalogue import build_expert
from policies.experts.demonstration_file import Origin, write_demonstrations
from policies.experts.episode_recording import record_episodes
from policies.tasks.catalogue import build_task, task_settings
from tests.unit.policies.offline.datasets import PUSHED, STEERED, store_of


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """Threads only get in each other's way in networks as small as these."""
    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def roller_ball(tmp_path_factory):
    """A dataset in which an expert of RollerBall was recorded."""
    folder = tmp_path_factory.mktemp("roller_ball") / "expert"
    task = build_task("RollerBall", 32)
    episodes = record_episodes(task, build_expert("RollerBall"), 32, seed=1)
    write_demonstrations(folder, Origin(task.layout, task_settings("RollerBall", {}), "scripted", 1), episodes)
    return str(folder)


@pytest.fixture(scope="session")
def bandit():
    """Episodes of one decision: the push pays best at 0.5; random ones were recorded, evenly from -1 to 1."""
    rng = np.random.default_rng(0)
    rows = []
    for _ in range(2000):
        seen, push = rng.normal(size=2), rng.uniform(-1.0, 1.0)
        rows += [[*seen, push, 1.0 - (push - 0.5) ** 2, 1.0, 1.0], [*seen, 0.0, 0.0, 0.0, 0.0]]
    return store_of(PUSHED, rows)


@pytest.fixture(scope="session")
def choices():
    """Episodes of one decision: the third choice pays where the heading is positive, the first elsewhere."""
    rng = np.random.default_rng(0)
    rows = []
    for _ in range(2000):
        heading, choice = rng.normal(), rng.integers(3)
        rows += [[heading, choice, float(choice == (2 if heading > 0.0 else 0)), 1.0, 1.0], [heading, 0, 0, 0, 0]]
    return store_of(STEERED, rows)
