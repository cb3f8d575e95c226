"""What the tests of published flight behaviours share: a flight in lockstep, judged frame by frame in truth."""

import numpy as np

from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

OPEN_GROUND = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
E7 = 1e7


class Flown:
    """A flight; `track` is its true path: time [s], position [m] and velocity [m/s] of each frame.

    Args:
        config: further fields of FlightConfig.
        links: besides the script's own.
        parameters: of the flight controller.
    """

    def __init__(self, *, config=None, links=(), **parameters):
        fields = {"seed": 1, "world": OPEN_GROUND, **(config or {})}
        self.flight = Flight(FlightConfig(parameters=parameters, **fields), links=list(links))
        self.rows = []

    def run(self, script, seconds=600.0):
        """Flies `script(drone)` to its end and returns what it returned."""
        running = self.flight.drone.start(script(self.flight.drone))
        end_us = int(seconds * 1e6)
        self.flight.run(lambda flight: running.is_done or flight.time_us > end_us, on_frame=self._note)
        assert running.is_done, "not finished in time"
        if running.error is not None:
            raise running.error
        self.flight.close()
        return running.result

    def _note(self, flight):
        body = self.body
        self.rows.append((flight.time_us * 1e-6, *body["pos_ned"], *body["vel_ned"]))

    @property
    def body(self):
        return self.flight.rig.arrays.body.numpy()[0]

    @property
    def faults(self):
        return self.flight.rig.arrays.faults.numpy()[0]

    @property
    def state(self):
        return self.flight.controller.state

    @property
    def now_s(self):
        return self.flight.time_us * 1e-6

    @property
    def pos(self):
        return np.array(self.body["pos_ned"], float)

    @property
    def vel(self):
        return np.array(self.body["vel_ned"], float)

    @property
    def home_distance_m(self):
        return float(np.hypot(*self.pos[:2]))

    def since(self, time_s):
        """The rows after a time."""
        table = np.array(self.rows)
        return table[table[:, 0] > time_s]

    def said(self, part):
        """Whether a text with these words was sent."""
        return any(part in text for text in self.flight.drone.texts)


async def airborne(drone, height_m=10.0):
    """Takes off and holds."""
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(height_m)


class Sticks:
    """A joystick that a script holds: it sends from now on, 50 times a second."""

    def __init__(self, drone):
        self._drone = drone
        self.is_sending = True
        self.middle()
        drone.start(self._send())

    def middle(self):
        self.axes = {"x": 0, "y": 0, "z": 500, "r": 0}

    async def hold(self, seconds, **axes):
        """Holds the sticks there for a while, then lets them go."""
        self.axes |= axes
        await self._drone.sleep(seconds)
        self.middle()

    async def _send(self):
        while True:
            if self.is_sending:
                self._drone.send("MANUAL_CONTROL", target=1, buttons=0, **self.axes)
            await self._drone.sleep(0.02)
