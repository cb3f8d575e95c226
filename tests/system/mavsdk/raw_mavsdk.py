"""MAVSDK in this process, joined to a MAVLink server by `raw://`: its real plugins, without sockets and flight.

A thread turns the server's frames, faster than real time, while the plugins' calls wait for their answers.
"""

import threading
from time import sleep

from mavsdk import ComponentType, Configuration, ConnectionResult, Mavsdk

from autopilot.mavlink.transport.links import LinkRole, memory_pair

FRAME_US = 20_000
FRAME_WALL_S = 0.002  # ten times real time
START_UP_S = 20.0


class RawMavsdk:
    """A context manager; `system` is what plugins are made from.

    Args:
        make_turn: gets the vehicle's end of the link and returns what runs one frame of the server.
        is_lost: asked for every message to MAVSDK, by its bytes; True loses it.
        frame_wall_s: wall-clock time between frames; MAVSDK's timers run on it.
    """

    def __init__(self, make_turn, is_lost=lambda _: False, frame_wall_s=FRAME_WALL_S):
        self._frame_wall_s = frame_wall_s
        self._plugins = {}
        self._is_lost = is_lost
        vehicle_end, self._link = memory_pair(LinkRole.ONBOARD)
        self._turn = make_turn(vehicle_end)
        self._mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        assert self._mavsdk.add_any_connection("raw://") == ConnectionResult.SUCCESS
        self._mavsdk.subscribe_raw_bytes_to_be_sent(self._link.send)
        self._is_over = False
        self.failure = None
        self._thread = threading.Thread(target=self._run)

    def _run(self):
        try:
            while not self._is_over:
                self._turn()
                for data in self._link.receive():
                    if self._is_lost(data):
                        continue
                    self._mavsdk.pass_received_raw_bytes(data)
                sleep(self._frame_wall_s)
        except BaseException as error:
            self.failure = error
            raise

    def plugin(self, kind):
        """MAVSDK's plugin of a kind for the vehicle; one, kept, because a plugin must not go while messages come."""
        if kind not in self._plugins:
            self._plugins[kind] = kind(self.system)
        return self._plugins[kind]

    def __enter__(self):
        self._thread.start()
        self.system = self._mavsdk.first_autopilot(START_UP_S)
        assert self.system is not None, "no heartbeat"
        return self

    def __exit__(self, *_):
        self._is_over = True
        self._thread.join()
        self._mavsdk.destroy()
        assert self.failure is None


def served(vehicle):
    """The turns of a server for a vehicle of tests/unit/autopilot/mavlink/rig.py."""
    from autopilot.mavlink.server import MavlinkServer

    def make_turn(link):
        server = MavlinkServer(vehicle, [link])

        def turn():
            vehicle.state.time_us += FRAME_US
            server.frame(vehicle.state.time_us)

        return turn

    return make_turn


class Outcome:
    """Waits for the last of a plugin's progress reports."""

    def __init__(self, running):
        self._running = running
        self._done = threading.Event()
        self.result = None

    def __call__(self, result, *_):
        if result != self._running:
            self.result = result
            self._done.set()

    def wait(self, seconds=20.0):
        assert self._done.wait(seconds), "no end"
        return self.result
