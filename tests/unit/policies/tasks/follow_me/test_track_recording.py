"""Recorded tracks: the first episode of each environment, as the task itself saw it."""

import numpy as np
import pytest

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.follow_me.track_recording import Recording


@pytest.fixture(scope="module")
def recorded():
    """Twelve decisions' episodes of vehicles that stay where they are."""
    task = build_task("FollowMe", 4, task_settings("FollowMe", {"observation": "state", "has_estimator": False}))
    task.set_params({"decision_limit": 12.0})
    task.reset(3)
    recording = Recording(task)
    rewards = np.zeros(4)
    distances = []
    while not recording.is_complete:
        task.step()
        recording.record()
        distances.append(task.measures.numpy()[:, 0].copy())
        if len(distances) <= 12:
            rewards += task.buffers.rewards.numpy()
    return recording, np.array(distances), rewards


def test_a_track_is_one_episode_long(recorded):
    recording, distances, _ = recorded
    for i, track in enumerate(recording.tracks()):
        assert len(track.time_s) == 12
        assert track.is_whole
        assert track.planned_s == pytest.approx(1.2)
        assert track.distance_m == pytest.approx(distances[:12, i])
        assert track.interval_s == pytest.approx(0.1)


def test_returns_are_those_of_the_first_episodes(recorded):
    recording, _, rewards = recorded
    assert recording.returns == pytest.approx(rewards, abs=1e-4)


def test_a_crash_ends_its_track_early_and_marks_it():
    task = build_task("FollowMe", 2, task_settings("FollowMe", {"observation": "state", "has_estimator": False}))
    task.reset(3)
    recording = Recording(task)
    while not recording.is_complete:
        task.buffers.continuous.numpy()[:] = (0.0, 0.0, 1.0, 0.0)  # into the ground
        task.step()
        recording.record()
    for track in recording.tracks():
        assert not track.is_whole
        assert track.is_collided[-1]
        assert not track.is_collided[:-1].any()
        assert track.time_s[-1] < 10.0
