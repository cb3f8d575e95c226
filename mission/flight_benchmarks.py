"""Standard trials: the flights by which control and estimation are judged, each over MAVLink in lockstep.

They are the flights that ArduPilot's simulator was measured with: a hold, steps of 5 m by offboard position setpoints,
a square of 20 m at 5 m/s, and the default mission. Figures come from the recorded history, after the flight.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.interface.item_lists import MissionItem
from common.geodesy import geodetic_from_ned
from mission.flight import Flight, FlightConfig
from mission.log.flight_summary import Summary, planned_path, segment_distance_m, summarise
from mission.plan.plan_file import DEFAULT_PLAN, read_plan
from mission.script import Drone, ScriptError, fly_plan
from sim.faults import set_fault

Rows = npt.NDArray[Any]
HEIGHT_M = 10.0
SETTLE_S = 10.0
SQUARE_M = 20.0
UPRIGHT_COSINE = 0.9  # a vehicle on its feet, on any slope of the hills
CORNER_M = 5.0  # nearer to a corner than this, the square is not judged
STEP_M = 5.0
STEP_BAND_M = 0.3
CMD_WAYPOINT, CMD_TAKEOFF, CMD_CHANGE_SPEED = 16, 22, 178
FRAME_RELATIVE, FRAME_MISSION = 3, 2


@dataclass(frozen=True, slots=True)
class HoldFigures:
    """Distances to the point held [m], 95th percentiles."""

    true_h_m: float
    true_v_m: float
    est_h_m: float
    est_v_m: float


@dataclass(frozen=True, slots=True)
class StepFigures:
    """Of several steps: median time until within 0.3 m for good [s], and largest overshoot [m]."""

    inside_s: float
    overshoot_m: float


def mission_trial(config: FlightConfig) -> Summary:
    """The default mission, from power-on to disarmed."""
    flight = Flight(config)
    plan = read_plan(DEFAULT_PLAN)
    running = flight.fly(lambda drone: fly_plan(drone, plan), seconds=600.0)
    return summarise(flight, flight.close(), running, planned_path(plan, config.home))


def hold_trial(config: FlightConfig, seconds: float = 120.0) -> HoldFigures:
    """A hold of the point 10 m above home, to which the vehicle was sent."""

    async def script(drone: Drone) -> float:
        await _climb(drone)
        start_s = drone.time_us * 1e-6
        await drone.sleep(seconds)
        return start_s

    flight, start_s = _flown(config, script)
    held = np.array([0.0, 0.0, -HEIGHT_M])
    history = flight.close()
    frames = history.time_us * 1e-6 > start_s
    true, est = history.pos_ned_true[frames] - held, history.pos_ned_est[frames] - held
    return HoldFigures(_p95_h(true), _p95_v(true), _p95_h(est), _p95_v(est))


def step_trial(config: FlightConfig, count: int = 6) -> StepFigures:
    """Steps of 5 m to and fro by offboard position setpoints, judged by the true position."""
    starts_s: list[float] = []

    async def script(drone: Drone) -> float:
        await _climb(drone)
        drone.offboard_position(0.0, 0.0, -HEIGHT_M, 0.0)
        await drone.start_offboard()
        await drone.sleep(5.0)
        for index in range(count):
            starts_s.append(drone.time_us * 1e-6)
            drone.offboard_position(STEP_M * ((index + 1) % 2), 0.0, -HEIGHT_M, 0.0)
            await drone.sleep(10.0)
        return starts_s[0]

    flight, _ = _flown(config, script)
    history = flight.close()
    time_s = history.time_us * 1e-6
    inside_s, overshoots_m = [], []
    for index, start_s in enumerate(starts_s):
        frames = (time_s > start_s) & (time_s <= start_s + 10.0)
        target_m = STEP_M * ((index + 1) % 2)
        error = history.pos_ned_true[frames] - np.array([target_m, 0.0, -HEIGHT_M])
        outside = np.flatnonzero(np.hypot(error[:, 0], error[:, 1]) > STEP_BAND_M)
        inside_s.append(float(time_s[frames][outside[-1]] - start_s) if len(outside) else 0.0)
        direction = 1.0 if target_m > 0.0 else -1.0
        overshoots_m.append(float(np.max(direction * error[:, 0])))
    return StepFigures(float(np.median(inside_s)), max(overshoots_m))


def square_trial(config: FlightConfig, laps: int = 2) -> float:
    """95 % cross-track error [m], in truth and horizontally, of a 20 m square at 5 m/s away from its corners."""
    corners = [(0.0, 0.0), (SQUARE_M, 0.0), (SQUARE_M, SQUARE_M), (0.0, SQUARE_M)]
    points = [corners[index % 4] for index in range(1, 4 * laps + 1)]

    async def script(drone: Drone) -> float:
        await drone.wait_ready()
        items = [_item(0, CMD_TAKEOFF, (0.0, 0.0), config), _speed_item(1, 5.0)]
        items += [_item(seq, CMD_WAYPOINT, point, config) for seq, point in enumerate([corners[0], *points], start=2)]
        await drone.upload(items)
        await drone.start_mission()
        await drone.until(lambda: 2 in drone.reached, 60.0, "first corner")
        start_s = drone.time_us * 1e-6
        await drone.wait_mission_finished(items[-1].seq, 300.0)
        return start_s

    flight, start_s = _flown(config, script)
    history = flight.close()
    frames = history.time_us * 1e-6 > start_s
    pos = history.pos_ned_true[frames][:, :2].astype(float)
    legs = [(np.array(a), np.array(b)) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    distances = np.stack([segment_distance_m(pos, a, b) for a, b in legs])
    to_corner = np.min([np.linalg.norm(pos - corner, axis=1) for corner in np.array(corners)], axis=0)
    return float(np.percentile(distances.min(axis=0)[to_corner > CORNER_M], 95.0))


@dataclass(frozen=True, slots=True)
class FaultFigures:
    """How a flight with a failed sensor ended."""

    is_disarmed_upright: bool
    is_mission_finished: bool
    tilt_max_deg: float  # true, while armed
    drift_m: float  # horizontal, from where the sensor failed to where it stands


def fault_trial(config: FlightConfig, sensor: str, mode: str, at_item: int = 2) -> FaultFigures:
    """The default mission with a sensor that fails when item `at_item` becomes current, until it is disarmed."""
    flight = Flight(config)
    plan = read_plan(DEFAULT_PLAN)
    faults = flight.rig.rows["faults"]
    truth = flight.rig.rows["truth"]
    failed_at_ned = np.zeros(3)

    async def script(drone: Drone) -> float:
        mission = drone.start(fly_plan(drone, plan))
        await drone.until(lambda: flight.controller.state.mission_current >= at_item, 120.0, f"item {at_item}")
        failed_at_ned[:] = truth["pos_ned"][0]
        set_fault(faults[0], sensor, mode)
        await drone.until(lambda: not drone.is_armed, 400.0, "the end of the flight")
        await drone.sleep(2.0)
        mission.cancel()
        return 0.0

    running = flight.fly(script, seconds=600.0)
    is_finished = plan.items[-1].seq in flight.drone.reached
    history = flight.close()
    upright = _cos_tilt(history.q_true)
    is_standing = upright[-1] > UPRIGHT_COSINE and not bool(truth["is_crashed"][0])
    drift = history.pos_ned_true[-1] - failed_at_ned
    return FaultFigures(
        is_disarmed_upright=running.error is None and is_standing,
        is_mission_finished=is_finished and is_standing,
        tilt_max_deg=float(np.degrees(np.arccos(upright[history.is_armed].min()))),
        drift_m=float(np.hypot(drift[0], drift[1])),
    )


def _cos_tilt(quaternions: Rows) -> Rows:
    """Cosine of the angle between body down and down; (x, y, z, w) rows."""
    x, y = quaternions[:, :2].astype(float).T
    cosines: Rows = np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)
    return cosines


async def _climb(drone: Drone) -> None:
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(HEIGHT_M)
    await drone.goto_ned(0.0, 0.0, -HEIGHT_M, yaw_rad=0.0)
    await drone.sleep(SETTLE_S)


def _flown(config: FlightConfig, script: Callable[[Drone], Any]) -> tuple[Flight, float]:
    """The flight after its script, and what the script returned.

    Raises:
        ScriptError: the script failed.
    """
    flight = Flight(config)
    running = flight.fly(script, seconds=900.0)
    if running.error is not None:
        raise running.error
    if not running.is_done:
        raise ScriptError("the trial did not end")
    return flight, running.result


def _item(seq: int, command: int, north_east: tuple[float, float], config: FlightConfig) -> MissionItem:
    lat_deg, lon_deg, _ = geodetic_from_ned(*north_east, 0.0, config.home)
    return MissionItem(seq, FRAME_RELATIVE, command, (0.0, 0.0, 0.0, nan), lat_deg, lon_deg, HEIGHT_M)


def _speed_item(seq: int, speed_m_s: float) -> MissionItem:
    return MissionItem(seq, FRAME_MISSION, CMD_CHANGE_SPEED, (1.0, speed_m_s, -1.0, 0.0), 0.0, 0.0, 0.0)


def _p95_h(error: Rows) -> float:
    return float(np.percentile(np.hypot(error[:, 0], error[:, 1]), 95.0))


def _p95_v(error: Rows) -> float:
    return float(np.percentile(np.abs(error[:, 2]), 95.0))
