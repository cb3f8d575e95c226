"""The watch of a flight: even samples of the truth, and what ends a following."""

from math import dist

import numpy as np
import pytest

from mission.flight import Flight, FlightConfig
from mission.follow.follow_scoring import FollowWatch
from policies.companion.engagement import Phase
from policies.tasks.follow_me.scorecard import scorecard
from policies.tasks.follow_me.track import Ranges
from tests.unit.mission.follow.follow_flight import following

SECONDS = 6.0


def run(flight, watch, seconds=SECONDS, on_frame=lambda: None):
    """Flies on until the watch is over, or for so long."""
    end_us = flight.time_us + round(seconds * 1e6)

    def frame(_):
        on_frame()
        watch.frame()

    flight.run(lambda _: watch.is_over or flight.time_us >= end_us, on_frame=frame)


def watched_flight(planned_s=SECONDS, **config):
    """A flight that follows, and a watch that has just begun."""
    flight, companion = following(numbers={"phone_error": 0.0}, **config)
    watch = FollowWatch(flight, lambda: companion.phase is Phase.FLYING, planned_s)
    watch.frame()
    return flight, watch


@pytest.fixture(scope="module")
def watched():
    """Six seconds of a flight that follows, and what was true at each sample."""
    flight, watch = watched_flight()
    distances, motion = [], []

    def is_over(_):
        watch.frame()
        if watch.sample_count > len(distances):
            pos = flight.rig.rows["truth"][0]["pos_ned"]
            distances.append(dist(tuple(map(float, pos)), flight.owner.chest_ned))
            motion.append(_motion(flight))
        return watch.is_over

    flight.run(is_over)
    return watch, distances, motion


def _motion(flight):
    """True velocity north and east [m/s], and yaw rate [deg/s]."""
    truth = flight.rig.rows["truth"][0]
    return (*truth["vel_ned"][:2].tolist(), float(np.degrees(truth["omega_frd"][2])))


def test_samples_are_as_many_as_decisions_and_true(watched):
    watch, distances, _ = watched
    track = watch.track()
    assert len(track.time_s) == 60
    assert track.is_whole
    assert track.distance_m == pytest.approx(distances, abs=1e-3)


def test_a_follower_sees_its_owner_ahead_and_touches_nothing(watched):
    track = watched[0].track()
    assert track.is_in_view.mean() > 0.8
    assert abs(track.bearing_rad).mean() < 0.5
    assert not track.is_collided.any()


def test_how_smoothly_it_flew_is_the_rms_of_true_acceleration_and_yaw_rate(watched):
    watch, _, motion = watched
    north, east, yaw_rate = np.array(motion).T
    accel = np.hypot(np.diff(north), np.diff(east)) / 0.1
    smoothness = watch.smoothness()
    assert smoothness.accel_rms == pytest.approx(np.sqrt(np.mean(accel**2)), rel=1e-3)
    assert smoothness.yaw_rate_rms == pytest.approx(np.sqrt(np.mean(yaw_rate**2)), rel=1e-3)
    assert 0.1 < smoothness.accel_rms < 5.0


def test_a_touch_softer_than_the_ground_at_take_off_is_a_collision():
    flight, watch = watched_flight()
    trees = flight.world.trees
    tree = trees[np.argmin(np.hypot(trees["north"], trees["east"]))]
    run(flight, watch, 0.5)
    body = flight.rig.rows["body"]
    body["pos_ned"][0] = [tree["north"] - tree["trunk_radius"] - 0.3, tree["east"], -tree["root_height"] - 2.0]
    body["vel_ned"][0] = [0.05, 0.0, 0.0]
    run(flight, watch, 0.1)
    assert watch.is_over
    card = scorecard([watch.track()])
    assert card.collision.value == 1.0
    assert card.in_band.value < 0.1  # of the six seconds it was to follow


def test_an_owner_brushed_between_two_samples_is_a_collision():
    flight, watch = watched_flight()
    owner, body = flight.owner.people.numpy(), flight.rig.rows["truth"]
    run(flight, watch, 0.54)
    place = owner["pos_ned"].copy()
    owner["pos_ned"][0] = body["pos_ned"][0] + [0.0, 0.0, 2.0]
    watch.frame()
    owner["pos_ned"][:] = place
    track = watch.track()
    assert watch.is_over
    assert track.has_collision(Ranges())
    assert list(track.is_collided) == [False] * 5 + [True]


def test_a_following_that_stops_at_once_is_not_followed_for_the_rest():
    flight, _ = following()
    is_following = True
    watch = FollowWatch(flight, lambda: is_following, 60.0)
    watch.frame()
    is_following = False
    run(flight, watch, 0.1)
    track = watch.track()
    assert watch.is_over
    assert not track.is_whole
    assert scorecard([track]).tracking.value < 0.01


def test_what_was_never_followed_has_no_track():
    flight, _ = following()
    watch = FollowWatch(flight, lambda: False, 60.0)
    run(flight, watch, 0.2)
    assert watch.track() is None


def test_nobody_to_follow_is_refused():
    with pytest.raises(ValueError, match="nobody to follow"):
        FollowWatch(Flight(FlightConfig()), lambda: True, 1.0)
