"""A flight and MAVSDK in one process, joined by memory: no socket, no start-up of a process.

The vehicle flies in a thread of its own, a few times faster than real time. Waits count the vehicle's clock.
"""

import time

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig
from tests.system.mavsdk.raw_mavsdk import RawMavsdk

FRAME_WALL_S = 0.004  # five times real time
OPEN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
FRAMES_AT_ONCE = 4
PATIENCE_S = 30.0  # wall clock
STALL_S = 60.0  # wall clock; a wait that the vehicle's clock does not end has lost the vehicle


class RawVehicle(RawMavsdk):
    """A vehicle that flies as long as the `with` block lasts, and MAVSDK's plugins for it.

    Args:
        config: of the flight.
        flight: further arguments of `Flight`.
    """

    def __init__(self, config=None, **flight):
        other_end, self._other = memory_pair(LinkRole.GROUND)
        self._reader = FrameReader()
        self.overheard = []  # texts that reach a link besides MAVSDK's and the script's

        def make_turn(link):
            self.flight = Flight(config or FlightConfig(world=OPEN), links=[link, other_end], **flight)
            return self._frame

        super().__init__(make_turn, frame_wall_s=FRAME_WALL_S)

    def _frame(self):
        self.flight.frame()
        for data in self._other.receive():
            messages = map(decode, self._reader.feed(data))
            self.overheard += [each.fields.text for each in messages if each.name == "STATUSTEXT"]

    @property
    def state(self):
        return self.flight.controller.state

    def until(self, condition, seconds, what):
        """Waits until something is so, for at most so long on the vehicle's clock."""
        end_us = self.flight.time_us + int(seconds * 1e6)
        end_wall_s = time.monotonic() + STALL_S
        while not condition():
            assert self.failure is None, self.failure
            assert self.flight.time_us < end_us, f"not {what} within {seconds} s"
            assert time.monotonic() < end_wall_s, f"stalled while not {what}"
            time.sleep(0.01)

    def pause(self, seconds):
        """Lets the vehicle's clock run."""
        end_us = self.flight.time_us + int(seconds * 1e6)
        self.until(lambda: self.flight.time_us >= end_us, seconds + 1.0, "later")

    def airborne(self, action, height_m=10.0):
        """Arms and takes off."""
        self.until(lambda: self.state.is_ready_to_arm, 30.0, "ready")
        action.set_takeoff_altitude(height_m)
        action.arm()
        action.takeoff()
        self.until(lambda: abs(self._height_m() - height_m) < 0.3, 40.0, "at the height")

    def _height_m(self):
        return self.state.home_ned[2] - self.state.estimate.pos_ned[2]

    def __exit__(self, *_):
        super().__exit__()
        self.flight.close()


class QuickFlight:
    """A flight that is ready when MAVSDK meets it, and flies several frames at once: 40 times real time.

    Args:
        config: of the flight.
        flight: further arguments of `Flight`.
    """

    def __init__(self, config, **flight):
        self.flight = None
        self._config, self._arguments = config, flight

    def make_turn(self, link):
        """For `RawMavsdk`."""
        self.flight = Flight(self._config, links=[link], **self._arguments)
        self.flight.run(lambda flight: flight.controller.state.is_ready_to_arm and flight.time_us >= 3_000_000)

        def turn():
            for _ in range(FRAMES_AT_ONCE):
                self.flight.frame()

        return turn

    @property
    def state(self):
        return self.flight.controller.state

    def place(self):
        return self.state.estimate.pos_ned

    def until(self, condition, what):
        deadline_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline_s, f"{what}; at {self.place()} in {self.state.mode}"
            time.sleep(0.01)
