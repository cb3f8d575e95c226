"""A rover driven by sticks: when Hold is asked for at the end, and when no more."""

from types import SimpleNamespace

import pytest

from policies.companion.engagement import Wish
from policies.companion.stick_control import CENTRED_US, StickControl
from policies.companion.telemetry import NEVER_US


@pytest.fixture
def vehicle():
    wishes = []
    return SimpleNamespace(
        is_flown=True,
        wishes=wishes,
        ask_for=wishes.append,
        listen=lambda *_: None,
        own=SimpleNamespace(heartbeat_us=NEVER_US),
    )


def test_hold_is_asked_for_once_when_the_sticks_have_been_in_the_middle(vehicle):
    sticks = StickControl(vehicle)
    sticks.hold(0)
    sticks.hold(CENTRED_US // 2)
    sticks.frame(CENTRED_US - 1)
    assert vehicle.wishes == []
    sticks.frame(CENTRED_US)
    sticks.frame(2 * CENTRED_US)
    assert vehicle.wishes == [Wish.HOLD]


def test_hold_is_not_asked_for_after_a_pilot_has_taken_over(vehicle):
    sticks = StickControl(vehicle)
    sticks.hold(0)
    vehicle.is_flown = False
    sticks.frame(CENTRED_US // 2)
    vehicle.is_flown = True
    sticks.frame(2 * CENTRED_US)
    assert vehicle.wishes == []
