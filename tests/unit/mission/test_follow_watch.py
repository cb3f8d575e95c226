"""The watch of a flight: even samples of the truth, and what ends a following."""

from math import dist

import pytest

from mission.flight import Flight, FlightConfig
from mission.follow.watch import FollowWatch
from tests.unit.mission.follow_flight import following


@pytest.fixture(scope="module")
def watched():
    """Six seconds of a flight that follows, and what was true at each sample."""
    flight, _ = following(phone_error=0.0)
    watch = FollowWatch(flight, 6.0)
    distances = []

    def is_over(_):
        watch.frame()
        if watch.sample_count > len(distances):
            pos = flight.rig.arrays.body.numpy()[0]["pos_ned"]
            distances.append(dist(tuple(map(float, pos)), flight.owner.chest_ned))
        return watch.is_complete

    flight.run(is_over)
    return watch.track(100.0, 2.0), distances


def test_samples_are_as_many_as_decisions_and_true(watched):
    track, distances = watched
    assert len(track.time_s) == 60
    assert track.is_whole
    assert track.distance_m == pytest.approx(distances, abs=1e-3)
    assert (track.trees_per_ha, track.owner_speed_max) == (100.0, 2.0)


def test_a_follower_sees_its_owner_ahead_and_touches_nothing(watched):
    track, _ = watched
    assert track.is_in_view.mean() > 0.8
    assert abs(track.bearing_rad).mean() < 0.5
    assert not track.is_collided.any()


def test_nobody_to_follow_is_refused():
    with pytest.raises(ValueError, match="nobody to follow"):
        FollowWatch(Flight(FlightConfig()), 1.0)
