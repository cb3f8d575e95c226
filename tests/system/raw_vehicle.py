"""A vehicle and MAVSDK in one process, joined by memory: no socket, no start-up of a process.

The vehicle flies in a thread of its own, a few times faster than real time, because MAVSDK's timers run on the wall
clock. Waits count the vehicle's clock.
"""

import threading
import time

from mavsdk import ComponentType, Configuration, Mavsdk

from autopilot.mavlink.codec import FrameReader, decode
from autopilot.mavlink.links import LinkRole, memory_pair
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

SPEED = 5.0  # times real time
OPEN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
STALL_S = 60.0  # wall clock; a wait that the vehicle's clock does not end has lost the vehicle


class RawVehicle:
    """A vehicle that flies until it is closed, and MAVSDK's system for it.

    Args:
        config: of the flight.
        speed: times real time.
        flight: further arguments of `Flight`.
    """

    def __init__(self, config=None, *, speed=SPEED, **flight):
        vehicle_end, self._client_end = memory_pair(LinkRole.ONBOARD)
        second_end, self._listener = memory_pair(LinkRole.GROUND)
        self._reader = FrameReader()
        self.overheard = []  # texts that reach a link besides MAVSDK's and the script's
        self.flight = Flight(config or FlightConfig(world=OPEN), links=[vehicle_end, second_end], **flight)
        self._speed = speed
        self._is_over = threading.Event()
        self._error = None
        self._plugins = {}
        self._mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        self._sending = self._mavsdk.subscribe_raw_bytes_to_be_sent(lambda data, *_: self._client_end.send(bytes(data)))
        self._mavsdk.add_any_connection("raw://")
        self._thread = threading.Thread(target=self._fly, daemon=True)
        self._thread.start()
        self.system = self._mavsdk.first_autopilot(30.0)
        assert self.system is not None, "MAVSDK has not found the vehicle"

    def _fly(self):
        def carry(_):
            for data in self._client_end.receive():
                self._mavsdk.pass_received_raw_bytes(data)
            for data in self._listener.receive():
                messages = map(decode, self._reader.feed(data))
                self.overheard += [each.fields.text for each in messages if each.name == "STATUSTEXT"]

        try:
            self.flight.run(lambda _: self._is_over.is_set(), speed=self._speed, on_frame=carry)
        except BaseException as error:
            self._error = error
            raise

    def plugin(self, kind):
        """MAVSDK's plugin of a kind for the vehicle; one, kept, because a plugin must not go while messages come."""
        if kind not in self._plugins:
            self._plugins[kind] = kind(self.system)
        return self._plugins[kind]

    @property
    def state(self):
        return self.flight.controller.state

    @property
    def texts(self):
        """What every client has been told."""
        return self.flight.drone.texts

    def until(self, condition, seconds, what):
        """Waits until something is so, for at most so long on the vehicle's clock."""
        end_us = self.flight.time_us + int(seconds * 1e6)
        end_wall_s = time.monotonic() + STALL_S
        while not condition():
            if self._error is not None:
                raise self._error
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
        height = lambda: self.state.home_ned[2] - self.state.estimate.pos_ned[2]  # noqa: E731
        self.until(lambda: abs(height() - height_m) < 0.3, 40.0, "at the height")

    def close(self):
        self._is_over.set()
        self._thread.join()
        self._mavsdk.unsubscribe_raw_bytes_to_be_sent(self._sending)
        self._mavsdk.destroy()
        self.flight.close()
        if self._error is not None:
            raise self._error

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
