"""What the tests of published flight behaviours share: a flight in lockstep, judged frame by frame in truth."""

import numpy as np

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from mission.client import Client
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

OPEN_GROUND = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)
E7 = 1e7
CMD_TAKEOFF, CMD_SET_MODE, CMD_ARM = 22, 176, 400
GUIDED = 4  # COPTER_MODE


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
        return fly_to_end(self.flight, script(self.flight.drone), self._note, seconds)

    def _note(self, flight):
        body = self.body
        self.rows.append((flight.time_us * 1e-6, *body["pos_ned"], *body["vel_ned"]))

    @property
    def body(self):
        return self.flight.rig.rows["truth"][0]

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


def fly_to_end(flight, script, on_frame, seconds):
    """Flies until a script of the flight's own client is done; returns what it returned."""
    running = flight.drone.start(script)
    end_us = int(seconds * 1e6)
    flight.run(lambda flight: running.is_done or flight.time_us > end_us, on_frame=on_frame)
    assert running.is_done, "not finished in time"
    if running.error is not None:
        raise running.error
    flight.close()
    return running.result


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


class Station:
    """A ground station that speaks ArduPilot's dialect with a vehicle; `run` flies a script of its own.

    Args:
        arguments: of Flown.
    """

    def __init__(self, **arguments):
        vehicle_end, client_end = memory_pair(LinkRole.GROUND)
        config = {"dialect": "ardupilot", **arguments.pop("config", {})}
        links = [vehicle_end, *arguments.pop("links", ())]
        self.flown = Flown(config=config, links=links, **arguments)
        self.client = Client(client_end)

    def run(self, script, seconds=600.0):
        """Flies `script(client)` to its end."""
        running = self.client.start(script(self.client))

        async def wait(drone):
            while not running.is_done:
                self.client.frame(drone.time_us)
                await drone.sleep(0.02)

        self.flown.run(wait, seconds)
        if running.error is not None:
            raise running.error
        return running.result

    async def mode(self, number):
        await self.client.command(CMD_SET_MODE, 1.0, float(number), name="mode")
        await self.client.until(lambda: self.client.latest("HEARTBEAT").custom_mode == number, 3.0, "mode")

    async def airborne(self, height_m=10.0):
        """Takes off in Guided, as ArduPilot's users do."""
        client, state = self.client, self.flown.state
        await client.until(lambda: state.is_ready_to_arm, 60.0, "ready")
        await self.mode(GUIDED)
        await client.command(CMD_ARM, 1.0, name="arm")
        await client.command(CMD_TAKEOFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height_m, name="takeoff")
        await client.until(lambda: abs(self.flown.pos[2] + height_m) < 1.5, 60.0, "at the height")
        await client.sleep(3.0)
