"""GNSS lost while it follows: for a moment it goes on by inertial navigation, then it lands.

GNSS back before it is down, it follows again by itself; later somebody has to send it up.
"""

from types import SimpleNamespace

import pytest

from autopilot.interface.failure_requests import Failure, Unit
from autopilot.interface.vehicle_state import LandedState, Mode
from mission.script import take_off
from policies.companion.engagement import Phase
from tests.unit.mission.follow.follow_flight import advance, following, lose


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
    seen.is_armed, seen.is_crashed, seen.trouble, seen.texts = (
        flight.controller.state.is_armed,
        flight.is_crashed,
        companion.trouble,
        list(flight.drone.texts),
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
    assert "Companion: landed by failsafe: stays down" in seen.texts


def test_when_gnss_is_back_it_can_be_sent_up_and_let_fly_again(seen):
    assert seen.in_the_end is Phase.FLYING


def landing_without_gnss(**changed):
    """A flight that the failsafe has begun to land, and GNSS is back in the same moment."""
    flight, companion = following(numbers={"phone_error": 0.0, "owner_stop_share": 1.0}, **changed)
    advance(flight, 5.0)
    flight.injector.inject(Unit.GNSS, Failure.OFF, 0)
    advance(flight, 15.0, lambda: flight.controller.state.mode is Mode.LAND)
    assert flight.controller.state.is_failsafe
    advance(flight, 0.5)
    flight.injector.inject(Unit.GNSS, Failure.OK, 0)
    return flight, companion


@pytest.mark.parametrize("dialect", ["px4", "ardupilot"])
def test_with_gnss_back_before_it_is_down_it_holds_and_follows_again(dialect):
    flight, companion = landing_without_gnss(dialect=dialect)
    advance(flight, 2.0, lambda: companion.phase is Phase.REGAINING)
    advance(flight, 0.3)
    held_us = flight.time_us
    assert flight.controller.state.mode in (Mode.HOLD, Mode.BRAKE)
    if dialect == "px4":  # the other's script hears no companion
        assert "Companion: position is back: hold" in flight.drone.texts
    advance(flight, 5.0, lambda: companion.phase is Phase.FLYING)
    assert companion.phase is Phase.FLYING
    assert flight.time_us - held_us > 2_000_000  # it has waited for the position to be steady
    advance(flight, 10.0)
    assert companion.phase is Phase.FLYING
    assert not flight.is_crashed


def test_a_pilot_who_says_land_again_is_not_overridden():
    flight, companion = landing_without_gnss()
    flight.drone.send("COMMAND_LONG", target_system=1, target_component=1, command=21)
    advance(flight, 20.0, lambda: not flight.controller.state.is_armed)
    assert not flight.controller.state.is_armed
    assert "Companion: position is back: hold" not in flight.drone.texts
    assert companion.phase is not Phase.FLYING


def test_a_pilot_who_takes_it_out_of_the_landing_is_not_overridden():
    flight, companion = landing_without_gnss()
    advance(flight, 1.0, lambda: flight.controller.commander.has_position)
    flight.fly(lambda drone: drone.hold(), seconds=2.0)
    advance(flight, 10.0)
    assert flight.controller.state.mode is Mode.HOLD
    assert flight.controller.state.landed_state is LandedState.IN_AIR
    assert companion.phase is Phase.READY


def test_without_a_time_set_for_it_it_lands_though_gnss_is_back():
    flight, _ = landing_without_gnss(settings={"resume_s": 0.0})
    advance(flight, 20.0, lambda: not flight.controller.state.is_armed)
    assert not flight.controller.state.is_armed


def test_a_low_battery_lands_though_gnss_is_back():
    flight, companion = landing_without_gnss()
    lose(companion, "BATTERY_STATUS")
    companion.vehicle.own.is_battery_low = True  # as the last one said
    advance(flight, 20.0, lambda: not flight.controller.state.is_armed)
    assert not flight.controller.state.is_armed
