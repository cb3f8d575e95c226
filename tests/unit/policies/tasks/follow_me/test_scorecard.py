"""The scorecard: figures of tracks whose answers are known by construction."""

import math

import numpy as np
import pytest

from policies.tasks.follow_me.scorecard import lines, scorecard
from policies.tasks.follow_me.track import Ranges, Track, losses

COUNT = 600  # decisions of 0.1 s
RANGES = Ranges()


def track(distance=2.0, count=COUNT, *, hidden=(), collided=(), bearing=0.0, speed=2.0, trees=100.0):
    """One episode: the owner hidden in, and the vehicle colliding at, some samples."""
    is_in_view = np.ones(count, dtype=np.bool_)
    for first, end in hidden:
        is_in_view[first:end] = False
    is_collided = np.zeros(count, dtype=np.bool_)
    is_collided[list(collided)] = True
    return Track(
        np.arange(1, count + 1) * 0.1,
        np.broadcast_to(np.asarray(distance, dtype=np.float64), count).copy(),
        np.full(count, bearing),
        is_in_view,
        is_collided,
        60.0,
        trees,
        speed,
    )


def test_perfect_follower_scores_full():
    card = scorecard([track(), track()])
    fractions = [card.success.value, card.tracking.value, card.in_band.value, card.in_view.value]
    assert fractions == [1.0, 1.0, 1.0, 1.0]
    assert (card.collision.value, card.distance_rmse_m.value, card.losses_per_minute.value) == (0.0, 0.0, 0.0)
    assert card.minutes == pytest.approx(2.0, rel=1e-3)
    assert card.distance_median_m.value == pytest.approx(2.0)


def test_too_near_counts_against_the_band_but_is_tracking():
    distance = np.full(COUNT, 2.0)
    distance[:150] = 0.8
    card = scorecard([track(distance)])
    assert card.in_band.value == pytest.approx(0.75)
    assert card.tracking.value == 1.0


def test_time_after_a_collision_counts_as_not_followed():
    card = scorecard([track(count=150, collided=[149])])
    assert card.in_band.value == pytest.approx(0.25)
    assert card.tracking.value == pytest.approx(0.25)
    assert (card.success.value, card.collision.value) == (0.0, 1.0)


def test_an_episode_of_one_decision_was_not_followed_for_the_rest():
    card = scorecard([track(count=1)])
    assert card.success.value == 0.0
    assert card.in_band.value == pytest.approx(1.0 / COUNT)


def test_nearer_than_half_a_metre_is_a_collision():
    distance = np.full(COUNT, 2.0)
    distance[300] = 0.45
    card = scorecard([track(distance)])
    assert (card.collision.value, card.success.value) == (1.0, 0.0)


def test_success_needs_the_owner_in_view_and_in_the_band_at_the_end():
    distance = np.full(COUNT, 2.0)
    distance[-1] = 3.2
    assert scorecard([track(distance)]).success.value == 0.0
    assert scorecard([track(hidden=[(COUNT - 1, COUNT)])]).success.value == 0.0


def test_losses_are_counted_measured_and_made_good():
    hidden = [(100, 120), (200, 260), (300, 303)]  # 2 s, 6 s, and too short to count
    card = scorecard([track(hidden=hidden)])
    assert card.losses_per_minute.value == pytest.approx(2.0, rel=1e-3)
    assert card.loss_s.value == pytest.approx(4.0)
    assert card.reacquired.value == 0.5
    assert card.in_view.value == pytest.approx(1.0 - 83 / COUNT)


def test_farther_than_four_metres_is_a_loss_though_in_view():
    distance = np.full(COUNT, 2.0)
    distance[10:40] = 4.5
    (loss,) = losses(track(distance), RANGES)
    assert (loss.start_s, loss.length_s, loss.is_reacquired) == pytest.approx((1.1, 3.0, True))


def test_loss_that_time_runs_out_on_decides_nothing():
    card = scorecard([track(hidden=[(580, 600)])])
    assert card.losses_per_minute.value == pytest.approx(1.0, rel=1e-3)
    assert math.isnan(card.reacquired.value)


def test_loss_that_ends_in_a_crash_was_not_made_good():
    assert scorecard([track(count=300, hidden=[(280, 300)], collided=[299])]).reacquired.value == 0.0


def test_rmse_is_to_the_middle_of_the_band():
    assert scorecard([track(2.5), track(1.5)]).distance_rmse_m.value == pytest.approx(0.5)


def test_bearing_error_is_in_degrees_without_sign():
    card = scorecard([track(bearing=math.radians(-10.0)), track(bearing=math.radians(20.0))])
    assert card.bearing_error_deg.value == pytest.approx(15.0)


def test_intervals_hold_the_figure_and_shrink_with_episodes():
    generator = np.random.default_rng(3)
    tracks = [track(generator.uniform(1.0, 4.0, COUNT) + generator.normal(0.0, 0.3)) for _ in range(80)]
    few, many = scorecard(tracks[:10]), scorecard(tracks)
    for card in (few, many):
        assert card.in_band.low < card.in_band.value < card.in_band.high
    assert many.in_band.high - many.in_band.low < few.in_band.high - few.in_band.low


def test_order_of_episodes_does_not_matter():
    tracks = [track(d) for d in (1.2, 2.0, 3.5)]
    assert scorecard(tracks).in_band.value == scorecard(tracks[::-1]).in_band.value


def test_lines_of_one_flight_have_no_intervals():
    shown = dict(lines(scorecard([track(2.5)])))
    assert shown["success (SR)"] == "100.0 %"
    assert shown["distance RMSE to 2 m"] == "0.50 m"
    assert " to " in dict(lines(scorecard([track(), track()])))["success (SR)"]


def test_no_episode_is_refused():
    with pytest.raises(ValueError, match="needs an episode"):
        scorecard([])


def test_arrays_of_different_length_are_refused():
    with pytest.raises(ValueError, match="one entry per sample"):
        Track(np.ones(2), np.zeros(3), np.zeros(2), np.zeros(2, bool), np.zeros(2, bool), 60.0)


def test_a_sample_at_the_very_start_is_refused():
    with pytest.raises(ValueError, match="first sample"):
        Track(np.arange(2.0), np.zeros(2), np.zeros(2), np.zeros(2, bool), np.zeros(2, bool), 60.0)
