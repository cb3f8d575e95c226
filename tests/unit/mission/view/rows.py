"""Recordings made by hand: a vehicle that hovers behind somebody who stands."""

import numpy as np

from autopilot.interface.vehicle_state import Mode
from mission.flight import FlightConfig
from mission.flight_config import OwnerConfig
from mission.view.flight_snapshot import MOMENT
from mission.view.replay_file import Recording
from sim.world.world import WorldConfig

WORLD = WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=0.0)
CONFIG = FlightConfig(world=WORLD, owner=OwnerConfig())


def hovering(seconds=2.0, *, mode=Mode.OFFBOARD, distance_m=2.0):
    """The vehicle at home, 1.4 m up, level, to the north; the owner so far north of it."""
    rows = np.zeros(round(50 * seconds), MOMENT)
    rows["time_s"] = 10.0 + 0.02 * np.arange(len(rows))
    rows["pos_ned"] = (0.0, 0.0, -1.4)
    rows["q_ned_from_frd"] = (0.0, 0.0, 0.0, 1.0)
    rows["rotor_speed"][:, :4] = 600.0
    rows["height_m"] = 1.4
    rows["mode"] = mode
    rows["goal_ned"] = np.nan
    rows["owner"]["pos_ned"] = (distance_m, 0.0, 0.0)
    rows["owner"]["heading_rad"] = np.pi
    rows["owner"]["stature_m"] = 1.75
    return Recording(CONFIG, rows, np.zeros((0, 3), np.float32))
