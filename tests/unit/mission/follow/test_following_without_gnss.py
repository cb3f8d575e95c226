"""GNSS lost while it follows: for a moment it goes on by inertial navigation, then it lands; later it flies again."""

from types import SimpleNamespace

import pytest

from autopilot.interface.failure_requests import Failure, Unit
from mission.script import take_off
from policies.companion.engagement import Phase
from tests.unit.mission.follow.follow_flight import advance, following


@pytest.fixture(scope="module")
def seen():
    """One flight: an outage of two seconds, one that lasts, and GNSS back; what was seen of the companion."""
    flight, companion = following(numbers={"phone_error": 0.0, "owner_stop_share": 1.0})
    seen = SimpleNamespace()

    def switch_gnss(failure):
        flight.injector.inject(Unit.GNSS, failure, 0)

    switch_gnss(Failure.OFF)
    advance(flight, 2.0)
    seen.after_two_seconds = companion.phase
    switch_gnss(Failure.OK)
    advance(flight, 2.0)
    seen.after_its_return = companion.phase
    switch_gnss(Failure.OFF)
    advance(flight, 30.0, lambda: not flight.controller.state.is_armed)
    seen.is_armed, seen.is_crashed, seen.trouble = (
        flight.controller.state.is_armed,
        flight.is_crashed,
        companion.trouble,
    )
    switch_gnss(Failure.OK)
    advance(flight, 15.0, lambda: flight.controller.state.is_ready_to_arm and companion.phase is Phase.READY)
    flight.fly(take_off, seconds=40.0)
    flight.fly(lambda drone: drone.let_companion_fly(), seconds=5.0)
    advance(flight, 5.0, lambda: companion.phase is Phase.FLYING)
    seen.in_the_end = companion.phase
    flight.close()
    return seen


def test_it_goes_on_through_an_outage_of_two_seconds(seen):
    assert (seen.after_two_seconds, seen.after_its_return) == (Phase.FLYING, Phase.FLYING)


def test_without_gnss_for_longer_it_lands_and_says_why(seen):
    assert not seen.is_armed
    assert not seen.is_crashed
    assert "position" in seen.trouble


def test_when_gnss_is_back_it_can_be_sent_up_and_let_fly_again(seen):
    assert seen.in_the_end is Phase.FLYING
