"""To fly or drive to a goal by a companion, over MAVLink in lockstep, watched over by the truth.

In: a flight with a companion on board, and a goal. Out: how it ended, how fast it went, what the guard changed.
"""

from dataclasses import dataclass
from math import dist, nan

import numpy as np

from autopilot.mavlink.wire.convert import degrees_e7
from common.attitude import Vector
from common.geodesy import geodetic_from_ned
from mission.benchmark.benchmark import changed_per_min
from mission.flight import Flight
from policies.companion.companion import Companion
from policies.companion.engagement import Phase
from policies.companion.vehicle_link import COMPONENT

GOAL_RADIUS_M, CEILING_M, SLOWEST_M_S = 3.0, 4.0, 3.0  # of the task Navigate
REST_S = 4.0  # after it has been handed back
_DO_REPOSITION = 192


@dataclass(frozen=True, slots=True)
class Crossing:
    """What one flight came to."""

    seed: int
    outcome: str  # "arrived", "collision", "over the forest" or "other"
    speed_m_s: float  # way flown over time, from the goto to the end; NaN: it has not been handed back
    miss_m: float  # from the goal at the end, by the truth
    detail: str
    interventions_per_min: float = 0.0  # decisions that the guard has changed
    ended_s: float = nan  # from the goto to the end


def crossed(
    flight: Flight, companion: Companion, goal_ned: Vector, seed: int, slowest_m_s: float = SLOWEST_M_S
) -> Crossing:
    """Flies to the goal, or to wherever it ends, and waits a little after it has been handed back."""
    truth = flight.rig.rows["truth"][0]
    begun_us, way_m, speed = flight.time_us, 0.0, nan
    last_ned = _place(truth)
    nearest_m = dist(last_ned, goal_ned)
    over_us = begun_us + round(nearest_m / slowest_m_s * 1e6)
    has_flown = is_back = False
    outcome = ""
    while not outcome and flight.time_us < over_us:
        flight.frame()
        pos_ned = _place(truth)
        nearest_m = min(nearest_m, dist(pos_ned, goal_ned))
        way_m += dist(pos_ned, last_ned)
        last_ned = pos_ned
        has_flown |= companion.phase is Phase.FLYING
        if float(truth["impact_speed"]) > 0.0:
            outcome = "collision"
        elif float(truth["height_agl_m"]) > CEILING_M:
            outcome = "over the forest"
        elif not is_back and has_flown and companion.phase is not Phase.FLYING:
            is_back, speed = True, way_m / (flight.time_us - begun_us) * 1e6
            over_us = flight.time_us + round(REST_S * 1e6)
    if not outcome:
        outcome = "arrived" if is_back and nearest_m < GOAL_RADIUS_M else "other"
    state = f"{companion.phase.value}: {companion.trouble}" if companion.trouble else companion.phase.value
    ended_s = (flight.time_us - begun_us) * 1e-6
    detail = f"{state}, nearest {nearest_m:.1f} m"
    changes = changed_per_min(companion.skill.interventions, ended_s)
    return Crossing(seed, outcome, speed, dist(last_ned, goal_ned), detail, changes, ended_s)


def send_goto(flight: Flight, goal_ned: Vector) -> None:
    """Sends the companion to a place."""
    lat_deg, lon_deg, alt_amsl_m = geodetic_from_ned(*goal_ned, flight.config.home)
    flight.drone.send(
        "COMMAND_INT",
        target_system=1,
        target_component=COMPONENT,
        command=_DO_REPOSITION,
        frame=0,
        param1=-1.0,
        param4=nan,
        x=degrees_e7(lat_deg),
        y=degrees_e7(lon_deg),
        z=alt_amsl_m,
    )


def advance(flight: Flight, seconds: float) -> None:
    """Lets time pass."""
    end_us = flight.time_us + round(seconds * 1e6)
    flight.run(lambda _: flight.time_us >= end_us)


def _place(truth: np.void) -> Vector:
    north, east, down = (float(element) for element in truth["pos_ned"])
    return north, east, down
