"""A flight in lockstep with what each of its frames showed, and the mission items that its tests upload."""

from dataclasses import dataclass, field
from math import nan

import numpy as np

from autopilot.interface.item_lists import MissionItem
from common.geodesy import geodetic_from_ned
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig
from tests.system.published.published_rules import fly_to_end

WAYPOINT, TURNS, RETURN, LAND, TAKEOFF, SPLINE, JUMP, SPEED = 16, 18, 20, 21, 22, 82, 177, 178
OPEN_GROUND = WorldConfig(trees_per_ha=0.0)
GROUND_SPEED = 1.0


@dataclass
class Flown:
    """A flight, and what each frame of it showed."""

    flight: Flight
    rows: list = field(default_factory=list)

    def frame(self, flight):
        state = flight.controller.state
        estimate = state.estimate
        self.rows.append(
            (state.time_us * 1e-6, *estimate.pos_ned, *estimate.vel_ned, state.mission_current, state.mode)
        )

    def since(self, time_s, until_s=1e9):
        table = np.array(self.rows)
        return table[(table[:, 0] > time_s) & (table[:, 0] <= until_s)]

    def speed(self, time_s, until_s=1e9):
        rows = self.since(time_s, until_s)
        return np.hypot(rows[:, 4], rows[:, 5])

    @property
    def now_s(self):
        return self.flight.time_us * 1e-6

    @property
    def mode(self):
        return self.flight.controller.state.mode

    @property
    def pos(self):
        return np.array(self.flight.controller.state.estimate.pos_ned)

    @property
    def vel(self):
        return np.array(self.flight.controller.state.estimate.vel_ned)

    def home_error(self):
        home = self.flight.controller.state.home_ned
        return float(np.hypot(self.pos[0] - home[0], self.pos[1] - home[1]))


def fly(script, seconds=600.0, wind_m_s=0.0, **parameters):
    """Runs `script(drone, flown)` to its end."""
    flown = Flown(Flight(FlightConfig(world=OPEN_GROUND, wind_m_s=wind_m_s, parameters=parameters)))
    fly_to_end(flown.flight, script(flown.flight.drone, flown), flown.frame, seconds)
    return flown


def item(flown, seq, command, north=nan, east=nan, height=10.0, params=(0.0, 0.0, 0.0, nan)):
    lat, lon = nan, nan
    if north == north:
        lat, lon, _ = geodetic_from_ned(north, east, 0.0, flown.flight.config.home)
    return MissionItem(seq, 6, command, tuple(map(float, params)), lat, lon, height)


def do(seq, command, *params):
    return MissionItem(seq, 2, command, (*map(float, params), 0.0, 0.0, 0.0, 0.0)[:4], 0.0, 0.0, 0.0)


def speed_item(seq, speed_m_s):
    return do(seq, SPEED, GROUND_SPEED, speed_m_s, -1.0)
