"""Frames at the border to Foxglove, against SciPy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mission.foxglove.frames import enu_from_ned, enu_points, flu_from_frd, flu_points, q_enu_from_flu, q_flu_from_rdf

ENU_FROM_NED = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
FRD_FROM_FLU = Rotation.from_matrix(np.diag([1, -1, -1]))


def is_same(q, expected):
    return (Rotation.from_quat(q) * expected.inv()).magnitude() < 1e-6


@pytest.mark.parametrize("seed", range(20))
def test_an_attitude_is_turned_on_both_sides(seed):
    rotation = Rotation.random(random_state=seed)
    assert is_same(q_enu_from_flu(rotation.as_quat()), ENU_FROM_NED * rotation * FRD_FROM_FLU)


@pytest.mark.parametrize("seed", range(20))
def test_a_point_ahead_of_the_body_stays_ahead_of_it(seed):
    rotation, point_frd = Rotation.random(random_state=seed), np.random.default_rng(seed).normal(size=3)
    there = Rotation.from_quat(q_enu_from_flu(rotation.as_quat())).apply(flu_from_frd(point_frd))
    assert there == pytest.approx(enu_from_ned(rotation.apply(point_frd)), abs=1e-9)


def test_a_level_vehicle_that_looks_north_looks_along_y():
    assert Rotation.from_quat(q_enu_from_flu((0, 0, 0, 1))).apply((1, 0, 0)) == pytest.approx((0, 1, 0), abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_a_mount_is_turned_into_flu(seed):
    mount = Rotation.random(random_state=seed)
    assert is_same(q_flu_from_rdf(mount.as_quat()), FRD_FROM_FLU.inv() * mount)


def test_many_points_are_turned_as_one_is():
    points = np.random.default_rng(1).normal(size=(5, 3)).astype(np.float32)
    assert enu_points(points) == pytest.approx(np.array([enu_from_ned(point) for point in points]))
    assert flu_points(points) == pytest.approx(np.array([flu_from_frd(point) for point in points]))
