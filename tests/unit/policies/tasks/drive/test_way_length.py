"""Lengths of ways in kernels, against the expert's Reeds-Shepp paths in NumPy."""

import numpy as np
import warp as wp

from policies.experts.reeds_shepp import shortest_lengths
from policies.tasks.drive.way_length import way_length_m

RADIUS_M = 0.9


@wp.kernel
def _lengths(starts: wp.array[wp.vec3], goals: wp.array[wp.vec3], lengths_m: wp.array[wp.float32]):
    i = wp.tid()
    lengths_m[i] = way_length_m(starts[i], goals[i], RADIUS_M)


def lengths(starts, goals):
    out = wp.zeros(len(starts), dtype=wp.float32)
    rows = [wp.array(poses.astype(np.float32), dtype=wp.vec3) for poses in (starts, goals)]
    wp.launch(_lengths, len(starts), [*rows, out])
    return out.numpy()


def poses(count, seed, spread_m):
    return np.random.default_rng(seed).uniform([-spread_m, -spread_m, -np.pi], [spread_m, spread_m, np.pi], (count, 3))


def test_a_way_is_as_long_as_the_shortest_reeds_shepp_path():
    for spread_m in (0.5, 2.0, 8.0):
        starts, goals = poses(400, 1, spread_m), poses(400, 2, spread_m)
        # the expert's frame is Unity's: x right, z forward, yaw clockwise from z, as east, north and a heading are
        swapped = [rows[:, [1, 0, 2]] for rows in (starts, goals)]
        np.testing.assert_allclose(lengths(starts, goals), shortest_lengths(*swapped, RADIUS_M), rtol=2e-3, atol=4e-3)


def test_a_way_straight_ahead_is_its_distance_and_none_is_shorter_than_that():
    starts = poses(200, 3, 5.0)
    ahead = starts + 3.0 * np.stack([np.cos(starts[:, 2]), np.sin(starts[:, 2]), np.zeros(200)], axis=1)
    np.testing.assert_allclose(lengths(starts, ahead), 3.0, rtol=1e-3)
    goals = poses(200, 4, 5.0)
    assert np.all(lengths(starts, goals) > np.hypot(*(goals - starts).T[:2]) - 1e-3)
