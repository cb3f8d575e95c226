"""Reeds-Shepp paths: they end at the goal, and no other path is shorter."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policies.experts.reeds_shepp import moved, shortest_lengths, shortest_path

RADIUS_M = 3.0
POSES = st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.floats(-np.pi, np.pi)).map(np.array)


def angle(radians):
    return (radians + np.pi) % (2 * np.pi) - np.pi


@given(POSES, POSES)
def test_path_ends_at_the_goal(start, goal):
    poses, _ = shortest_path(start, goal, RADIUS_M).poses(start, 0.1)
    np.testing.assert_allclose(poses[-1][:2], goal[:2], atol=1e-5)
    assert abs(angle(poses[-1][2] - goal[2])) < 1e-6


@given(POSES, POSES)
def test_way_there_is_as_long_as_the_way_back(start, goal):
    there, back = shortest_lengths(np.array([start, goal]), np.array([goal, start]), RADIUS_M)
    assert there == pytest.approx(back, abs=1e-5)


@given(POSES, POSES)
def test_mirrored_way_is_as_long(start, goal):
    mirror = np.array([-1.0, 1.0, -1.0])
    both = shortest_lengths(np.array([start, start * mirror]), np.array([goal, goal * mirror]), RADIUS_M)
    assert both[0] == pytest.approx(both[1], abs=1e-5)


@given(POSES, st.lists(st.tuples(st.sampled_from([-1, 0, 1]), st.floats(-9.0, 9.0)), min_size=1, max_size=6))
def test_no_driven_path_is_shorter(start, pieces):
    end = start
    for turn, length in pieces:
        end = moved(end, turn, length, RADIUS_M)
    assert shortest_lengths(start, end, RADIUS_M) <= sum(abs(length) for _, length in pieces) + 1e-5


@given(POSES, POSES, POSES)
def test_detour_is_not_shorter(start, way_point, goal):
    direct, first, second = shortest_lengths(
        np.array([start, start, way_point]), np.array([goal, way_point, goal]), RADIUS_M
    )
    assert direct <= first + second + 1e-5


@pytest.mark.parametrize(
    ("goal", "length_m"),
    [
        ((0.0, 5.0, 0.0), 5.0),  # straight ahead
        ((0.0, -5.0, 0.0), 5.0),  # straight back
        ((3.0, 3.0, np.pi / 2), 3.0 * np.pi / 2),  # a quarter to the right
        ((-3.0, 3.0, -np.pi / 2), 3.0 * np.pi / 2),  # a quarter to the left
        ((0.0, 0.0, np.pi), 3.0 * np.pi),  # turned round on the spot, in three moves of 60 deg
    ],
)
def test_known_lengths(goal, length_m):
    assert shortest_path(np.zeros(3), np.array(goal), RADIUS_M).length_m == pytest.approx(length_m)


def test_poses_follow_one_another_by_the_spacing():
    path = shortest_path(np.zeros(3), np.array([4.0, -2.0, 2.0]), RADIUS_M)
    poses, directions = path.poses(np.zeros(3), 0.2)
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert steps.max() <= 0.2 + 1e-9
    ahead = np.sin(poses[:-1, 2]) * np.diff(poses[:, 0]) + np.cos(poses[:-1, 2]) * np.diff(poses[:, 1])
    assert (np.sign(ahead) == directions[1:]).all()
