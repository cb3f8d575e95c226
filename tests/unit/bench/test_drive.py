"""Drive's shipped policies, judged as their results page judges them."""

import numpy as np
import pytest

from bench.drive import judged
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.tasks.episode import Outcome


@pytest.mark.slow
def test_the_shipped_policy_reaches_poses_on_hills_among_movers_walls_and_trees():
    policy, _ = load_policy(find_policy("drive-reach"))
    assert np.mean(judged(policy, "reach", 200).outcomes == Outcome.SUCCESS) >= 0.94
