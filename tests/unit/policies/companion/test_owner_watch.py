"""For how long the owner has been lost."""

from math import inf, pi

import pytest

from common.attitude import quat_of, rotated
from policies.companion.owner_watch import OwnerWatch, sighting_of
from policies.companion.telemetry import Own, Owner
from policies.tracker import sighting_axes_ned

NOBODY = Owner()
OWN = Own(pos_ned=(10.0, -4.0, -3.0), q_ned_from_frd=quat_of(0.5 * pi, 0.1))  # looks east


def report(count):
    return Owner(pos_ned=(10.0, 0.0, -2.0), count=count)


def observation(watch, at_s, position=(3.0, 1.0, 1.0)):
    watch.update(round(at_s * 1e6), OWN, NOBODY, position)


def test_a_sighting_is_where_the_pilot_saw_the_owner():
    sighting = sighting_of((3.0, 1.0, 1.5), OWN)
    ray = sighting_axes_ned(sighting)[0]
    assert sighting.range_m == pytest.approx(3.5)
    assert ray * 3.5 == pytest.approx(rotated(quat_of(0.5 * pi, 0.0), (3.0, 1.0, 1.5)))
    assert sighting.camera_pos_ned == OWN.pos_ned


def test_the_distance_is_that_of_what_was_seen():
    watch = OwnerWatch()
    for k in range(10):
        observation(watch, 0.1 * k, (2.0, 0.0, 0.0))
    assert watch.distance_m(OWN) == pytest.approx(2.0, abs=0.1)


def test_silence_grows_from_the_last_sight():
    watch = OwnerWatch()
    assert watch.silence_s(0) == inf
    observation(watch, 7.0)
    for k in range(20):
        watch.update(7_100_000 + 100_000 * k, OWN, NOBODY, None)
    assert watch.silence_s(9_500_000) == pytest.approx(2.5)


def test_the_phone_counts_unless_the_pilot_flies_by_sight_alone():
    watches = OwnerWatch(), OwnerWatch(hears=False)
    for watch in watches:
        watch.update(5_000_000, OWN, report(1), None)
    assert [watch.silence_s(5_000_000) for watch in watches] == [pytest.approx(0.0), inf]


def test_a_vehicle_that_has_restarted_is_watched_anew():
    watch = OwnerWatch()
    observation(watch, 600.0)
    observation(watch, 3.0)
    watch.update(9_000_000, OWN, NOBODY, None)
    assert watch.silence_s(9_000_000) == pytest.approx(6.0)
    watch.update(1_000_000, OWN, NOBODY, None)
    assert watch.silence_s(1_000_000) == inf
