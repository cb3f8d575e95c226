"""Flights that followed, judged from their recordings."""

import dataclasses

import numpy as np
import pytest

from autopilot.vehicle import Mode
from mission.flight import flight_world
from mission.follow.judge import track_of
from policies.tasks.follow_me.scorecard import scorecard
from policies.tasks.follow_me.track import Ranges
from tests.unit.mission.view.rows import CONFIG, hovering


@pytest.fixture(scope="module")
def world():
    return flight_world(CONFIG)


def test_a_vehicle_that_hovers_behind_its_owner_follows(world):
    track = track_of(hovering(4.0), world, planned_s=4.0)
    card = scorecard([track])
    assert track.is_whole
    assert track.bearing_rad == pytest.approx(0.0, abs=1e-6)
    assert (card.success.value, card.tracking.value, card.collision.value) == (1.0, 1.0, 0.0)


def test_what_lies_before_offboard_and_after_the_planned_time_does_not_count(world):
    recording = hovering(10.0)
    recording.rows["mode"][:100] = Mode.TAKEOFF
    track = track_of(recording, world, planned_s=3.0)
    assert len(track.time_s) == 30
    assert track.time_s[0] == 0.0


def test_a_flight_that_left_offboard_early_is_not_whole(world):
    recording = hovering(4.0)
    recording.rows["mode"][100:] = Mode.HOLD
    track = track_of(recording, world, planned_s=4.0)
    assert len(track.time_s) == 20
    assert not track.is_whole


def test_a_flight_that_never_followed_has_no_track(world):
    assert track_of(hovering(mode=Mode.HOLD), world, planned_s=2.0) is None


def test_ground_and_owner_are_collided_with(world):
    on_ground = hovering()
    on_ground.rows["is_on_ground"][-10:] = True
    near = hovering(distance_m=0.1)
    near.rows["pos_ned"][:, 2] = -1.2
    for recording in (on_ground, near):
        assert track_of(recording, world, planned_s=2.0).has_collision(Ranges())


def test_an_owner_to_the_right_has_a_positive_bearing(world):
    recording = hovering()
    rows = recording.rows.copy()
    rows["owner"]["pos_ned"] = (0.0, 2.0, 0.0)
    track = track_of(dataclasses.replace(recording, rows=rows), world, planned_s=2.0)
    assert track.bearing_rad == pytest.approx(np.pi / 2, abs=1e-6)
    assert not track.is_in_view.any()  # 90 degrees of view
