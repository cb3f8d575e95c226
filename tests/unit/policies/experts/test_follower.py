"""The scripted follower's laws."""

import numpy as np
import pytest

from policies.experts.follower import DISTANCE_M, HEIGHT_M, ScriptedFollower
from policies.tasks.flight.own_state import ACTIONS
from policies.tasks.follow_me.observe import EGO, vector_elements

ELEMENTS = vector_elements(int(EGO))
NOBODY = np.full((64, 64, 4), 255, np.uint8)


def act(**values):
    """Velocity ahead, right, down and yaw rate, for a phone's report."""
    known = {"height": HEIGHT_M, "is_height_valid": 1.0, "is_owner_known": 1.0} | values
    vector = np.array([known.get(element.name, 0.0) / element.scale for element in ELEMENTS], np.float32)
    return ScriptedFollower().act(vector, NOBODY) * [element.scale for element in ACTIONS]


def test_stays_where_it_should_be():
    assert act(owner_pos_hfrd_x=DISTANCE_M) == pytest.approx([0.0] * 4, abs=1e-6)


@pytest.mark.parametrize(("ahead", "sign"), [(DISTANCE_M + 1.0, 1.0), (DISTANCE_M - 1.0, -1.0)])
def test_comes_nearer_or_goes_back_to_the_right_distance(ahead, sign):
    assert sign * act(owner_pos_hfrd_x=ahead)[0] > 0.5


def test_turns_towards_the_owner():
    assert act(owner_pos_hfrd_x=1.5, owner_pos_hfrd_y=1.5)[3] > 0.5
    assert act(owner_pos_hfrd_x=1.5, owner_pos_hfrd_y=-1.5)[3] < -0.5


def test_goes_along_with_the_owner():
    wanted = act(owner_pos_hfrd_x=DISTANCE_M, owner_vel_hfrd_x=1.0, owner_vel_hfrd_y=-2.0)
    assert wanted[:2] == pytest.approx([1.0, -2.0], abs=1e-5)


def test_keeps_its_height():
    assert act(height=HEIGHT_M + 1.0)[2] > 0.5
    assert act(height=HEIGHT_M + 1.0, is_height_valid=0.0)[2] == 0.0


def test_stays_where_it_is_when_nothing_is_known():
    assert act(is_owner_known=0.0, owner_pos_hfrd_x=9.0) == pytest.approx([0.0] * 4, abs=1e-6)
