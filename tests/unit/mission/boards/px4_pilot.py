"""A stand-in PX4 that holds its place or goes to one, with its MAVLink, in a thread; and a flight that it flies."""

from contextlib import closing

from bench.standins.pilots import COPTER, PX4_LOITER, ROVER, Carrier, Motion, Pilot, Voice
from bench.standins.px4 import Px4StandIn
from common.geodesy import DEFAULT_HOME
from mission.boards.board_flight import BoardFlight
from mission.boards.peers import PEERS
from mission.flight_config import FlightConfig
from sim.boards.outside import wait_for


class Px4:
    """An instance, until the simulator has gone.

    Args:
        instance: its number.
        is_rover: it drives, answers seldom, and while armed only.
        control: its controls; None: the pilot's.
    """

    def __init__(self, instance, *, is_rover=False, control=None):
        self.instance, self.is_rover = instance, is_rover
        self.pilot = Pilot(ROVER if is_rover else COPTER, PX4_LOITER)
        home = (DEFAULT_HOME.lat_deg, DEFAULT_HOME.lon_deg, DEFAULT_HOME.alt_m)
        self.voice = Voice(self.pilot, instance + 1, home, is_ardupilot=False)
        self.links = [Carrier(14280 + instance, 14030 + instance), Carrier(14580 + instance, 14540 + instance)]
        self._control = control or (lambda: self.pilot.commands(0.004))
        self.exchange = None

    def work(self):
        exchange = Px4StandIn(4560 + self.instance, lambda _: self._control(), is_rover=self.is_rover)
        with closing(exchange) as self.exchange:
            while exchange.step():
                self._look(exchange)
        for link in self.links:
            link.close()

    def _look(self, exchange):
        truth, sensor = exchange.truth, exchange.sensor
        if truth is not None and sensor is not None:
            place = self.voice.there(truth.lat * 1e-7, truth.lon * 1e-7, truth.alt * 1e-3)
            velocity = (truth.vx * 1e-2, truth.vy * 1e-2, truth.vz * 1e-2)
            gyro = (sensor.xgyro, sensor.ygyro, sensor.zgyro)
            self.pilot.motion = Motion(place, velocity, tuple(truth.attitude_quaternion), gyro)
            self.voice.frame(exchange.time_us, self.links)
        exchange.is_armed = self.pilot.is_armed or not self.is_rover


def flight_of(instance, **settings):
    return BoardFlight(FlightConfig(**settings), PEERS["px4"], wait_for(5.0, "PX4"), instance=instance)
