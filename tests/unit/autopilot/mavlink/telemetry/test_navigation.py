from dataclasses import replace
from math import nan

import pytest

from autopilot.mavlink.telemetry.navigation import nav_controller_output
from autopilot.mavlink.wire.codec import known_type
from tests.unit.autopilot.mavlink.rig import flying_state


def reported(state):
    payload = nav_controller_output(state)
    return None if payload is None else known_type("NAV_CONTROLLER_OUTPUT").unpack(payload)


def test_place_is_told_from_where_the_vehicle_is():
    fields = reported(replace(flying_state(), goal_ned=(10.0, 50.0, -35.0)))  # it is at (10, 20, -30)
    assert (fields.target_bearing, fields.wp_dist, fields.alt_error) == (90, 30, 5.0)
    assert fields.nav_bearing == 63  # it moves to (1, 2)
    assert fields.xtrack_error == 0.0


def test_cross_track_error_is_positive_to_the_right_of_the_way():
    state = replace(flying_state(), goal_ned=(100.0, 15.0, -30.0), path_start_ned=(0.0, 15.0, -30.0))
    assert reported(state).xtrack_error == pytest.approx(5.0)


def test_nothing_is_told_without_a_place():
    assert reported(replace(flying_state(), goal_ned=(nan, nan, -30.0))) is None
    assert reported(replace(flying_state(), goal_ned=(1.0, 1.0, 1.0), is_armed=False)) is None
