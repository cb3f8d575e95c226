"""Standard trials of what drives: missions, returns, holds, speeds, headings, and driving on without GNSS.

Each goes over MAVLink in lockstep, on hills without trees; figures come from the recorded history, after the drive.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, nan, pi
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.interface.item_lists import MissionItem
from common.geodesy import geodetic_from_ned
from mission.flight import Flight, FlightConfig
from mission.log.flight_recorder import History
from mission.script import Drone, Script, ScriptError
from sim.faults import set_fault
from sim.world.world import WorldConfig

Rows = npt.NDArray[Any]
Place = tuple[float, float]  # north, east [m]
SQUARE: tuple[Place, ...] = ((50.0, 0.0), (50.0, 50.0), (0.0, 50.0), (0.0, 0.0))
OPEN_HILLS = WorldConfig(trees_per_ha=0.0, clearing_radius_m=5.0, clearing_blend_m=40.0)
START_M, CORNER_M = 5.0, 4.0  # of each leg, that are not judged as straight
CMD_WAYPOINT, CMD_CHANGE_SPEED = 16, 178
FRAME_RELATIVE, FRAME_MISSION = 3, 2
SPEED_LIMIT = "RO_SPEED_LIM"


@dataclass(frozen=True, slots=True)
class MissionFigures:
    """Of a mission [m]; distances by the estimate, which is what the vehicle can act on."""

    cross_track_p95_m: float  # on straights
    overshoot_m: float  # outside of the next leg, behind a corner
    stop_miss_m: float  # from the place where it was to stop, the worst
    stop_miss_true_m: float
    speed_max_m_s: float


@dataclass(frozen=True, slots=True)
class LossFigures:
    """Of a drive without GNSS."""

    way_m: float
    error_m: float  # by which the estimate has gone away from the truth meanwhile

    @property
    def fraction(self) -> float:
        return self.error_m / self.way_m


def drive_items(config: FlightConfig, corners: Sequence[Place], speed_m_s: float, stop_s: float) -> list[MissionItem]:
    """A mission over corners at a speed; at each it stops for `stop_s` seconds."""
    items = [
        MissionItem(0, FRAME_MISSION, CMD_CHANGE_SPEED, (1.0, speed_m_s, -1.0, 0.0), 0.0, 0.0, 0.0, autocontinue=True)
    ]
    for north, east in corners:
        lat_deg, lon_deg, _ = geodetic_from_ned(north, east, 0.0, config.home)
        stop = (stop_s, 0.0, 0.0, nan)
        items.append(
            MissionItem(len(items), FRAME_RELATIVE, CMD_WAYPOINT, stop, lat_deg, lon_deg, 0.0, autocontinue=True)
        )
    return items


def driven(flight: Flight, script: Script, seconds: float) -> tuple[Any, History]:
    """Runs a script to its end: its result, and the history.

    Raises:
        ScriptError: it failed, or did not end in time.
    """
    running = flight.fly(script, seconds=seconds)
    history = flight.close()
    if running.error is not None:
        raise running.error
    return running.result, history


def square_trial(config: FlightConfig, speed_m_s: float, stop_s: float = 0.0) -> MissionFigures:
    """A square of 50 m, from power-on until it has stood at its end for 5 s.

    Raises:
        ScriptError: it was not finished.
    """
    items = drive_items(config, SQUARE, speed_m_s, stop_s)
    flight = Flight(config)

    async def script(drone: Drone) -> None:
        await drone.wait_ready()
        await drone.set_parameter(SPEED_LIMIT, 1.2 * speed_m_s)
        await drone.upload(items)
        await drone.start_mission()
        await drone.wait_mission_finished(len(items) - 1)
        await drone.sleep(5.0)

    _, history = driven(flight, script, 90.0 + 300.0 / speed_m_s + 10.0 * stop_s)
    return _judged(history)


def _judged(history: History) -> MissionFigures:
    here, truth = history.pos_ned_est[:, :2].astype(float), history.pos_ned_true[:, :2].astype(float)
    speed = np.hypot(*history.vel_ned_true[:, :2].astype(float).T)
    across: list[float] = []
    overshoot = 0.0
    start = here[history.is_armed & (history.mission_seq == 1)][0]  # where it took itself to be
    came_from: Rows | None = None
    for i_leg, corner in enumerate(SQUARE):
        end = np.array(corner)
        length = float(np.hypot(*(end - start)))
        ahead = (end - start) / length
        right = np.array([-ahead[1], ahead[0]])
        frames = history.is_armed & (history.mission_seq == i_leg + 1)
        along, aside = (here[frames] - start) @ ahead, (here[frames] - start) @ right
        straight = (along > START_M) & (along < length - CORNER_M)
        across += np.abs(aside[straight]).tolist()
        if came_from is not None:  # outside is where the leg before went on
            outside = aside * float(np.sign(came_from @ right))
            overshoot = max(overshoot, float(outside[along < 0.5 * length].max(initial=0.0)))
        start, came_from = end, ahead
    still = speed < 0.05
    last = history.is_armed & still & (history.mission_seq == len(SQUARE))
    miss, miss_true = (float(np.hypot(*(place[last][-1] - start))) for place in (here, truth))
    return MissionFigures(float(np.percentile(across, 95.0)), overshoot, miss, miss_true, float(speed.max()))


def return_trial(config: FlightConfig, from_m: Place = (40.0, 30.0)) -> tuple[float, float]:
    """Distance to home where it is disarmed by itself, and how far it ran past home on the way, by the estimate [m]."""
    flight = Flight(config)

    async def script(drone: Drone) -> float:
        await drone.wait_ready()
        await drone.arm()
        await drone.goto_ned(*from_m, 0.0)
        begin_us = flight.time_us
        await drone.return_home()
        await drone.wait_disarmed()
        return begin_us

    begin_us, history = driven(flight, script, 200.0)
    here = history.pos_ned_est[history.time_us >= begin_us, :2].astype(float)
    home = history.pos_ned_est[0, :2].astype(float)
    way = home - here[0]
    ahead = way / np.hypot(*way)
    return float(np.hypot(*(here[-1] - home))), float(((here - home) @ ahead).max())


def hold_trial(config: FlightConfig, place: Place = (30.0, 30.0)) -> float:
    """Largest distance [m] to a place that it was sent to by Offboard setpoints, from 60 s after the first on, 10 s."""
    flight = Flight(config)

    async def script(drone: Drone) -> None:
        await drone.wait_ready()
        await drone.arm()
        drone.offboard_position(*place, 0.0)
        await drone.start_offboard()
        await drone.sleep(70.0)

    _, history = driven(flight, script, 120.0)
    late = history.time_us >= history.time_us[-1] - 10_000_000
    return float(np.hypot(*(history.pos_ned_est[late, :2].astype(float) - place).T).max())


def speed_trial(config: FlightConfig, speed_m_s: float, course_rad: float = 0.5 * pi) -> tuple[float, float]:
    """Largest errors of speed [m/s] and of heading [deg] over 10 s, of a velocity asked for by Offboard setpoints."""
    flight = Flight(config)
    north, east = speed_m_s * np.cos(course_rad), speed_m_s * np.sin(course_rad)

    async def script(drone: Drone) -> None:
        await drone.wait_ready()
        await drone.set_parameter(SPEED_LIMIT, 1.2 * speed_m_s)
        await drone.arm()
        drone.offboard_velocity(float(north), float(east), 0.0)
        await drone.start_offboard()
        await drone.sleep(18.0)

    _, history = driven(flight, script, 60.0)
    late = history.time_us >= history.time_us[-1] - 10_000_000
    speed = np.linalg.norm(history.vel_ned_true[late].astype(float), axis=1)  # along the slope
    x, y, z, w = history.q_true[late].astype(float).T
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    error = np.abs((yaw - course_rad + pi) % (2.0 * pi) - pi)
    return float(np.abs(speed - speed_m_s).max()), float(np.degrees(error.max()))


def loss_trial(config: FlightConfig, speed_m_s: float = 3.0, lost_s: float = 30.0) -> LossFigures:
    """A mission at a speed, the GNSS receiver silent for `lost_s` seconds of it.

    Raises:
        ScriptError: the vehicle did not go on with its mission.
    """
    items = drive_items(config, ((60.0, 0.0), (60.0, 40.0), (0.0, 40.0), (0.0, 0.0)), speed_m_s, 0.0)
    flight = Flight(config)

    async def script(drone: Drone) -> None:
        await drone.wait_ready()
        await drone.upload(items)
        await drone.start_mission()
        await drone.sleep(12.0)
        set_fault(flight.rig.rows["faults"][0], "gnss", "off")
        await drone.sleep(lost_s)
        if flight.controller.state.mode.name != "MISSION":
            raise ScriptError(f"it has left its mission: {drone.texts[-2:]}")

    _, history = driven(flight, script, 120.0)
    lost = history.time_us >= history.time_us[-1] - int(lost_s * 1e6)
    error = (history.pos_ned_est - history.pos_ned_true)[lost, :2].astype(float)
    way = float(np.hypot(*history.vel_ned_true[lost, :2].astype(float).T).sum() * 0.02)
    return LossFigures(way, hypot(*(error[-1] - error[0])))
