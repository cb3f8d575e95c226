"""The leaderboard's tutorial: what Stable-Baselines3 learns on FollowMe's batch, the benchmark takes as a pilot."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from bench.follow import sb3_entry
from mission.follow.benchmark.pilots import any_pilot
from policies.tasks.follow_me.observe import EGO, vector_elements

pytestmark = pytest.mark.slow


def test_a_policy_of_stable_baselines3_is_a_pilot_of_the_benchmark(tmp_path, monkeypatch):
    monkeypatch.setattr(sb3_entry, "SAVED", tmp_path / "results" / "sb3.zip")
    for name, value in {"ENVS": 2, "ROLLOUT": 4, "BATCH": 4}.items():
        monkeypatch.setattr(sb3_entry, name, value)
    sb3_entry.main(steps=8, seed=1)
    pilot = any_pilot("bench.follow.sb3_entry:Sb3Follower")
    pilot.reset()
    action = pilot.act(np.zeros(len(vector_elements(int(EGO))), np.float32), np.zeros(pilot.image_shape, np.uint8))
    assert action.shape == (4,)
    assert np.abs(action).max() <= 1.0


def test_the_last_observation_of_an_episode_has_its_image():
    envs = sb3_entry.BatchVecEnv("FollowMe", 2, 1, terrain="kept")
    envs.reset()
    for _ in range(700):  # an episode has 600 decisions at most
        *_, is_over, infos = envs.step(np.ones((2, 4), np.float32))
        if is_over.any():
            break
    i = int(np.flatnonzero(is_over)[0])
    last = infos[i]["terminal_observation"]
    assert last["image"].shape == sb3_entry.Sb3Follower.image_shape
    assert last["vector"].shape == (len(vector_elements(int(EGO))),)
