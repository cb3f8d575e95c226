"""The live page's buttons, clicked without a browser; tests/system/test_live_page.py clicks in one."""

import pytest

from mission.flight import Flight, FlightConfig
from mission.view.live import LiveView
from mission.view.page import PageServer
from policies.companion.engagement import Phase
from sim.world.world import WorldConfig
from tests.unit.mission.follow_flight import advance, following

PLAIN = WorldConfig(size_m=64.0, trees_per_ha=0.0)


def buttons(server):
    """What clicks each button, by its label."""
    handles = server.gui._gui_input_handle_from_uuid.values()
    return {handle.label: lambda handle=handle: [call(None) for call in handle._impl.update_cb] for handle in handles}


@pytest.fixture
def page():
    server = PageServer(0, "Honeyguide")
    yield server
    server.stop()


def test_after_the_pilot_has_taken_over_a_button_follows_again(page):
    flight, companion = following()
    view = LiveView(flight, page)

    def fly(seconds, is_enough=lambda: False):
        end_us = flight.time_us + round(seconds * 1e6)
        flight.run(lambda _: is_enough() or flight.time_us >= end_us, on_frame=lambda _: view.frame())

    buttons(page)["Hold"]()
    fly(2.0, lambda: companion.phase is Phase.RELEASED)
    assert companion.phase is Phase.RELEASED
    buttons(page)["Follow"]()  # while the companion is still silent
    fly(6.0, lambda: companion.phase is Phase.FLYING)
    assert companion.phase is Phase.FLYING
    fly(1.0)
    assert view._controls.lines[-1] == "Follow: done"


def test_a_companion_that_is_not_ready_is_told_on_the_page(page):
    flight, companion = following()
    view = LiveView(flight, page)
    flight.onboard._sinks.clear()  # no pictures from now on
    advance(flight, 3.0)
    buttons(page)["Follow"]()
    end_us = flight.time_us + 10_000_000
    flight.run(lambda _: flight.time_us >= end_us, on_frame=lambda _: view.frame())
    assert companion.phase is Phase.WAITING
    assert view._controls.lines[-1].startswith("Follow: offboard refused")


def test_without_an_owner_there_is_nobody_to_follow(page):
    flight = Flight(FlightConfig(world=PLAIN))
    LiveView(flight, page)
    assert "Follow" not in buttons(page)
    flight.close()
