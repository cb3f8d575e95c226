import numpy as np
import pytest

from bench.learning.tracker import DECISION_US, Walks, always, errors, normalised, not_the_last_3_s_of_10, track
from policies.tracker import OwnerTracker, PhoneReport, Sighting, sighting_axes_ned
from sim.world.people import RUN_SPEED_M_S

OWNERS = 20
Q_RDF_LEVEL = (0.5, 0.5, 0.5, 0.5)  # forward camera: right is east, down is down, forward is north


@pytest.fixture(scope="module")
def walks():
    return Walks(RUN_SPEED_M_S, OWNERS)


@pytest.fixture(scope="module")
def tracked(walks):
    return [track(walks, i, always, always) for i in range(OWNERS)]


def test_error_is_as_large_as_the_covariance_says(walks, tracked):
    both = [errors(walks, i, tracked[i]) for i in range(OWNERS)]
    pos = np.array([normalised(both[i][0], np.array([t.pos_cov for t in tracked[i]])) for i in range(OWNERS)])
    vel = np.array([normalised(both[i][1], np.array([t.vel_cov for t in tracked[i]])) for i in range(OWNERS)])
    for nees in (pos, vel):
        mean = nees[:, 10:].mean(axis=0)
        # chi-square of three degrees of freedom, mean of the owners: 99.9 % below
        limit = 3.0 + 3.1 * np.sqrt(6.0 / OWNERS)
        assert (mean < limit).mean() > 0.97  # people start and stop more suddenly than a normal distribution has it
        assert 1.0 < mean.mean() < 4.0


def test_owner_in_the_picture_is_placed_within_centimetres(walks, tracked):
    off = [np.linalg.norm(errors(walks, i, tracked[i])[0], axis=1)[10:] for i in range(OWNERS)]
    assert np.sqrt(np.mean(np.square(off))) < 0.25


def end_of_gap(walks, is_seen, is_heard, owners=10):
    off = [np.linalg.norm(errors(walks, i, track(walks, i, is_seen, is_heard))[0], axis=1) for i in range(owners)]
    return np.array(off)[:, 99::100]


def test_phone_carries_the_track_while_the_owner_is_hidden_for_3_s(walks):
    off = end_of_gap(walks, not_the_last_3_s_of_10, always)
    assert np.median(off) < 1.0  # the phone alone is 2 m off on average, and taught by the camera less


def test_camera_carries_the_track_while_the_phone_is_silent_for_3_s(walks):
    assert end_of_gap(walks, always, not_the_last_3_s_of_10).max() < 1.0


def test_covariance_grows_and_ages_count_while_both_are_missing_for_3_s(walks):
    tracks = track(walks, 0, not_the_last_3_s_of_10, not_the_last_3_s_of_10)
    before, after = tracks[69], tracks[99]
    assert np.trace(after.pos_cov) > 10.0 * np.trace(before.pos_cov)
    assert after.seen_age_s == pytest.approx(3.0)
    assert after.heard_age_s > 3.0


def test_owner_without_phone_is_tracked_by_direction_alone(walks):
    tracker = OwnerTracker()
    for k in range(100):
        tracker.see(k * DECISION_US, walks.sighting(k, 0, has_range=False))
        ray = sighting_axes_ned(walks.sighting(k, 0))[0]
    towards = tracker.at(99 * DECISION_US).pos_ned - walks.camera(99, 0)
    assert np.linalg.norm(np.cross(ray, towards)) < 0.3 * np.linalg.norm(towards)


def still_owner(tracker, decisions, start=0, pos=(5.0, 1.0, -1.0)):
    for k in range(start, start + decisions):
        tracker.hear(k * 100_000, PhoneReport(k * 100_000 - 300_000, pos, (0.0, 0.0, 0.0)))
        tracker.see(k * 100_000, Sighting(0.0, 0.0, 5.0, (pos[0] - 5.0, pos[1], pos[2]), Q_RDF_LEVEL))


def test_wild_sighting_and_wild_report_are_rejected():
    tracker = OwnerTracker()
    still_owner(tracker, 40)
    before = tracker.at(4_000_000)
    assert not tracker.see(4_000_000, Sighting(0.6, 0.0, 5.0, (0.0, 1.0, -1.0), Q_RDF_LEVEL))
    assert not tracker.see(4_000_000, Sighting(0.0, 0.0, 9.0, (0.0, 1.0, -1.0), Q_RDF_LEVEL))
    assert not tracker.hear(4_000_000, PhoneReport(3_700_000, (25.0, 1.0, -1.0), (0.0, 0.0, 0.0)))
    after = tracker.at(4_000_000)
    assert after.pos_ned.tobytes() == before.pos_ned.tobytes()


def test_sightings_that_insist_are_believed():
    tracker = OwnerTracker()
    still_owner(tracker, 40)
    for k in range(40, 60):
        tracker.see(k * 100_000, Sighting(0.0, 0.0, 5.0, (0.0, 6.0, -1.0), Q_RDF_LEVEL))
    np.testing.assert_allclose(tracker.at(6_000_000).pos_ned, [5.0, 6.0, -1.0], atol=0.3)


def test_late_reports_of_a_moving_owner_do_not_lag():
    tracker = OwnerTracker()
    for k in range(40):
        valid_s = 0.5 * k
        tracker.hear(
            int(1e6 * (valid_s + 0.3)), PhoneReport(int(1e6 * valid_s), (3.0 * valid_s, 0.0, 0.0), (3.0, 0.0, 0.0))
        )
    at = tracker.at(20_000_000)
    np.testing.assert_allclose(at.pos_ned, [60.0, 0.0, 0.0], atol=0.3)
    np.testing.assert_allclose(at.vel_ned, [3.0, 0.0, 0.0], atol=0.1)


def test_camera_teaches_the_error_of_the_phone():
    tracker = OwnerTracker()
    for k in range(60):
        tracker.hear(k * 100_000, PhoneReport(k * 100_000, (7.0, 3.0, -2.0), (0.0, 0.0, 0.0)))
        tracker.see(k * 100_000, Sighting(0.0, 0.0, 5.0, (0.0, 1.0, -1.0), Q_RDF_LEVEL))
    for k in range(60, 90):  # hidden, and off to the north
        tracker.hear(k * 100_000, PhoneReport(k * 100_000, (7.0 + 0.1 * (k - 60), 3.0, -2.0), (1.0, 0.0, 0.0)))
    np.testing.assert_allclose(tracker.at(8_900_000).pos_ned, [7.9, 1.0, -1.0], atol=0.3)


def test_same_inputs_give_the_same_track_however_often_it_is_asked(walks):
    asked, unasked = OwnerTracker(), OwnerTracker()
    for k in range(50):
        sighting = walks.sighting(k, 0)
        asked.see(k * DECISION_US, sighting)
        unasked.see(k * DECISION_US, sighting)
        for part in range(3):
            asked.at(k * DECISION_US + 30_000 * part)
    first, second = asked.at(5_000_000), unasked.at(5_000_000)
    assert first.pos_ned.tobytes() == second.pos_ned.tobytes()
    assert first.pos_cov.tobytes() == second.pos_cov.tobytes()


def test_nothing_is_known_before_the_first_measurement():
    tracker = OwnerTracker()
    assert not tracker.at(1_000_000).is_known
    still_owner(tracker, 1, start=10)
    assert tracker.at(1_000_000).is_known


def test_what_is_not_a_number_is_never_believed():
    tracker = OwnerTracker()
    still_owner(tracker, 20)
    for k in range(20, 40):
        assert not tracker.see(k * 100_000, Sighting(np.nan, 0.0, 5.0, (0.0, 1.0, -1.0), Q_RDF_LEVEL))
        assert not tracker.hear(k * 100_000, PhoneReport(k * 100_000, (np.nan, 0.0, 0.0), (0.0, 0.0, 0.0)))
    assert np.isfinite(tracker.at(4_000_000).pos_ned).all()


def test_reports_without_velocity_tell_it_by_their_places():
    tracker = OwnerTracker()
    for k in range(30):
        tracker.hear(k * 500_000, PhoneReport(k * 500_000, (0.75 * k, 0.0, 0.0), None))
    np.testing.assert_allclose(tracker.at(14_500_000).vel_ned, [1.5, 0.0, 0.0], atol=0.2)


def test_a_minute_without_a_call_leaves_nothing_but_the_ages():
    tracker = OwnerTracker()
    still_owner(tracker, 20)
    track = tracker.at(100_000_000)
    assert np.trace(track.pos_cov) > 1e6
    assert track.seen_age_s == pytest.approx(98.1)
    still_owner(tracker, 10, start=1001)
    np.testing.assert_allclose(tracker.at(101_000_000).pos_ned, [5.0, 1.0, -1.0], atol=0.2)
