"""A flight with its live page, and a Chromium that looks at it."""

import threading
import time

from mission.flight import Flight, FlightConfig
from mission.view.live import LiveView
from mission.view.page import PageServer
from sim.world.world import WorldConfig
from tests.browser import Browser

WORLD = WorldConfig(size_m=64.0, trees_per_ha=60.0, clearing_radius_m=5.0)  # little to draw: Chromium has no GPU here


class Shown:
    """A flight in real time on a thread of its own, its page, and a browser that looks at it."""

    def __init__(self, profile, width=1000, height=500):
        self.browser = Browser(profile, width, height)
        self.flight = Flight(FlightConfig(world=WORLD))
        self.server = PageServer(0, "Honeyguide")
        self.view = LiveView(self.flight, self.server, speed=3.0)
        self._is_over = False
        self._thread = threading.Thread(target=self._fly)
        self._thread.start()
        self.browser.open(self.server.url)

    def _fly(self):
        self.flight.run(lambda _: self._is_over, speed=3.0, on_frame=lambda _: self.view.frame())

    def wait(self, condition, timeout_s=60.0):
        end_s = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < end_s, "not in time"
            time.sleep(0.2)

    def stop(self):
        """The flight flies on no more; its page is still there."""
        self._is_over = True
        self._thread.join()

    def close(self):
        self.browser.close()
        self.stop()
        self.view.close()
        self.flight.close()
