"""How well a plane flies: a circuit of four waypoints in wind, and a landing, seed by seed.

`python -m bench.flying.plane [--airframe NAME] [--seeds FIRST-LAST]` prints a row per seed: errors along the legs
once each has settled, and where it touched down.
"""

from argparse import ArgumentParser
from dataclasses import dataclass, field
from math import atan2, cos, degrees, hypot, pi, sin
from typing import Any

import numpy as np

from autopilot.interface.client_requests import ChangeMode
from autopilot.interface.item_lists import ListKind, MissionItem
from autopilot.interface.vehicle_state import LandedState, Mode
from autopilot.navigator.mission.item_commands import Command
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.flight import Flight, FlightConfig
from mission.flight_config import AIRFIELD

CORNERS = ((450.0, 0.0), (450.0, 350.0), (-450.0, 350.0), (-450.0, 0.0))  # [m] north, east
HEIGHT_M = 35.0
SETTLED_S = 10.0  # after the turn to a leg: a period of the guidance, NPFG_PERIOD
LONGEST_S = 600.0


@dataclass
class Circuit:
    """What a flight was like; errors as lists over the settled legs."""

    course_deg: list[float] = field(default_factory=list)
    height_m: list[float] = field(default_factory=list)
    airspeed_m_s: list[float] = field(default_factory=list)
    cross_m: list[float] = field(default_factory=list)
    touchdown_m: float = float("nan")  # from the place asked for
    along_m: float = float("nan")  # the same, beyond it on the way of the landing
    sink_m_s: float = float("nan")  # at the touchdown
    rest_m: float = float("nan")
    is_landed: bool = False


def circuit_items() -> list[MissionItem]:
    """Take-off, the four corners, down over the last, and a landing at home."""
    rows: list[tuple[int, tuple[float, float, float, float], tuple[float, float], float]] = [
        (Command.TAKEOFF, (0.0, 0.0, 0.0, float("nan")), (150.0, 0.0), 30.0),
        *((Command.WAYPOINT, (0.0, 0.0, 0.0, float("nan")), corner, HEIGHT_M) for corner in CORNERS),
        (Command.LAND, (0.0, 0.0, 0.0, float("nan")), (0.0, 0.0), 0.0),
    ]
    items = []
    for seq, (command, params, (north, east), height_m) in enumerate(rows):
        lat_deg, lon_deg, _ = geodetic_from_ned(north, east, 0.0, DEFAULT_HOME)
        items.append(MissionItem(seq, 3, int(command), params, lat_deg, lon_deg, height_m))
    return items


def fly_circuit(seed: int, wind_m_s: float = 3.0, wind_from_deg: float = 270.0, airframe: str = "plane") -> Circuit:
    """Flies it once, in turbulence that goes with the wind."""
    flight = Flight(
        FlightConfig(airframe=airframe, world=AIRFIELD, seed=seed, wind_m_s=wind_m_s, wind_from_deg=wind_from_deg)
    )
    out, since_s, leg = Circuit(), 0.0, -1
    try:
        _begin(flight)
        state = flight.controller.state
        while flight.time_us < LONGEST_S * 1e6 and not (state.takeoff_us and not state.is_armed):
            flight.frame()
            if state.mission_current != leg:
                leg, since_s = state.mission_current, flight.time_us * 1e-6
            truth = flight.rig.rows["truth"][0]
            if 2 <= leg <= len(CORNERS) and flight.time_us * 1e-6 - since_s > SETTLED_S and state.mode is Mode.MISSION:
                _judge(flight, out, truth, leg)
            if leg == len(CORNERS) + 1 and truth["is_on_ground"] and out.touchdown_m != out.touchdown_m:
                out.touchdown_m = hypot(*truth["pos_ned"][:2])
                out.along_m = float(truth["pos_ned"][:2] @ truth["vel_ned"][:2] / hypot(*truth["vel_ned"][:2]))
                out.sink_m_s = float(truth["impact_speed"])
        out.rest_m = hypot(*flight.rig.rows["truth"][0]["pos_ned"][:2])
        out.is_landed = state.landed_state is LandedState.ON_GROUND and not flight.is_crashed
    finally:
        flight.close()
    return out


def _begin(flight: Flight) -> None:
    controller = flight.controller
    while not controller.state.is_ready_to_arm and flight.time_us < 30e6:
        flight.frame()
    refusal = controller.lists.load(ListKind.MISSION, circuit_items())
    assert refusal is None, refusal
    while controller.request(ChangeMode(Mode.MISSION)).reason and flight.time_us < 30e6:
        flight.frame()
    controller.arm(force=False)


def _judge(flight: Flight, out: Circuit, truth: Any, leg: int) -> None:
    """The errors of this frame, on the way to corner `leg` (from 1)."""
    (n0, e0), (n1, e1) = CORNERS[leg - 2], CORNERS[leg - 1]
    along = atan2(e1 - e0, n1 - n0)
    north, east, down = (float(x) for x in truth["pos_ned"])
    vel_n, vel_e, _ = (float(x) for x in truth["vel_ned"])
    course = (atan2(vel_e, vel_n) - along + pi) % (2.0 * pi) - pi
    out.course_deg.append(abs(degrees(course)))
    out.cross_m.append(abs((east - e0) * cos(along) - (north - n0) * sin(along)))
    out.height_m.append(abs(-down - HEIGHT_M - float(flight.controller.state.home_ned[2])))
    out.airspeed_m_s.append(
        abs(float((2.0 * max(truth["pitot_pa"], 0.0) / 1.225) ** 0.5) - float(flight.params["FW_AIRSPD_TRIM"]))
    )


def main() -> None:
    """Prints the table: 95 % of the absolute errors."""
    parser = ArgumentParser(description=main.__doc__)
    parser.add_argument("--seeds", default="1-5", help="first and last")
    parser.add_argument("--airframe", default="plane")
    given = parser.parse_args()
    first, last = map(int, given.seeds.split("-"))
    print("seed  course  cross  height  airspeed  touchdown  sink  rest  landed")
    for seed in range(first, last + 1):
        c = fly_circuit(seed, airframe=given.airframe)
        parts = (np.percentile(x or [float("nan")], 95) for x in (c.course_deg, c.cross_m, c.height_m, c.airspeed_m_s))
        course, cross, height, airspeed = parts
        print(
            f"{seed:4d} {course:5.2f} deg {cross:4.1f} m {height:4.1f} m {airspeed:5.2f} m/s "
            f"{c.touchdown_m:6.1f} m {c.sink_m_s:4.1f} m/s {c.rest_m:5.1f} m {c.is_landed}"
        )


if __name__ == "__main__":
    main()
