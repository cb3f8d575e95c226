"""The vehicle's own track, made short: within its accuracy, without its loops, and within the time of a frame."""

import numpy as np
import pytest

from autopilot.navigator.paths.breadcrumbs import with_steps, without_loops, without_straights
from tests.machine import cost_s, frame_s


def tidied(points, accuracy_m=2.0):
    return without_straights(without_loops(with_steps(points, accuracy_m), accuracy_m), 0.5 * accuracy_m)


@pytest.mark.parametrize("step_m", [3.0, 30.0, 4000.0])
def test_longest_track_is_tidied_within_a_frame(step_m):
    track = np.cumsum(np.random.default_rng(1).normal(0.0, step_m, (300, 3)), axis=0)
    costs_s, frames_s = [], []
    for _ in range(5):
        costs_s.append(cost_s(lambda: tidied(track)))
        frames_s.append(frame_s())
    assert min(costs_s) < min(frames_s)


def test_steps_between_are_even_and_end_where_the_track_ends():
    dense = with_steps(np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 1.0, 0.0]]), 2.5)
    assert dense[:, 0].tolist() == [0.0, 2.5, 5.0, 7.5, 10.0, 10.0]
    assert dense[-1].tolist() == [10.0, 1.0, 0.0]


def test_a_loop_far_from_the_origin_is_cut_as_one_near_it():
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    loop = np.stack([20.0 * np.sin(angle), 20.0 - 20.0 * np.cos(angle), 0.0 * angle], axis=1)
    track = np.concatenate([[[-30.0, 0.0, 0.0]], loop, [[30.0, 0.0, 0.0]]])
    near, far = tidied(track), tidied(track + 100_000.0)
    assert np.abs(near[:, 1]).max() < 3.0
    np.testing.assert_allclose(near, far - 100_000.0, atol=1e-3)
