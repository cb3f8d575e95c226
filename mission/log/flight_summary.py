"""A flight judged after it: mission result, path and estimator errors, clearance and battery.

Everything here may look at the truth: nothing of it goes back into the flight.
"""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

import numpy as np
import numpy.typing as npt

from autopilot.interface.vehicle_state import Mode
from common.geodesy import GeoPoint, ned_from_geodetic
from common.kernels import FRAME_US, TICK_US
from mission.log.flight_recorder import History
from mission.plan.plan_file import Plan
from sim.world.world import WorldMap

Rows = npt.NDArray[Any]
LEG_MIN_M = 1.0  # horizontally; a shorter way is a climb or a descent
CLEARANCE_EVERY_FRAMES = 10
LEVEL = np.array([1.0, 1.0, 0.0])  # what drives keeps to a line on the map: the ground has the height
CMD_RETURN_TO_LAUNCH, CMD_LAND, CMD_TAKEOFF = 20, 21, 22
PLACES = (16, 17, 18, 19, 31, 82, CMD_LAND, CMD_TAKEOFF)  # mission commands that lead to a place
NOT_STRAIGHT = (18, 31, 82)  # of these, turns, changes of height, splines: no line to keep to


@dataclass(frozen=True, slots=True)
class Summary:
    """The figures of one flight; NaN where the flight had none. `p95` is the 95th percentile."""

    result: str
    is_success: bool
    simulated_s: float
    armed_s: float
    ready_s: float  # power-on to ready to arm
    cross_track_p95_m: float  # truth to the planned path, in mode MISSION; of what drives, horizontal
    landing_error_true_m: float  # horizontal, to the planned landing point, or to where what drives shall park
    landing_error_est_m: float
    pos_h_rms_m: float  # estimator error per horizontal axis, while armed
    pos_v_rms_m: float
    vel_rms_m_s: float  # worst axis
    tilt_rms_deg: float
    yaw_rms_deg: float
    clearance_min_m: float  # to trees and walls
    battery_remaining: float
    innovations_in_band: dict[str, float]  # share of normalised innovations within 1.96 sigma, per source

    def as_json(self) -> dict[str, Any]:
        """JSON values; null for what is not finite."""
        figures = asdict(self)
        figures["innovations_in_band"] = _finite(self.innovations_in_band)
        return _finite(figures)


def _finite(figures: dict[str, Any]) -> dict[str, Any]:
    return {key: None if isinstance(value, float) and not isfinite(value) else value for key, value in figures.items()}


@dataclass(frozen=True, slots=True)
class EstimatorErrors:
    """RMS errors over the given frames."""

    pos_ned_m: tuple[float, float, float]
    vel_ned_m_s: tuple[float, float, float]
    tilt_deg: float
    yaw_deg: float


def estimator_errors(history: History, frames: Rows) -> EstimatorErrors:
    """RMS of estimate minus truth, over the frames where `frames` is True; NaN where there is none."""
    if not frames.any():
        nan = float("nan")
        return EstimatorErrors((nan, nan, nan), (nan, nan, nan), nan, nan)
    pos = history.pos_ned_est[frames].astype(float) - history.pos_ned_true[frames]
    vel = history.vel_ned_est[frames].astype(float) - history.vel_ned_true[frames]
    error_ned = rotation_error_ned(history.q_est[frames].astype(float), history.q_true[frames].astype(float))
    return EstimatorErrors(
        tuple(_rms(pos)),
        tuple(_rms(vel)),
        float(np.degrees(np.sqrt(np.mean(np.sum(error_ned[:, :2] ** 2, axis=1))))),
        float(np.degrees(_rms(error_ned[:, 2]))),
    )


def cross_track_m(
    pos_ned: Rows, seq: Rows, path_ned: Sequence[tuple[int, Rows]], curved: AbstractSet[int] = frozenset()
) -> Rows:
    """Distance of each position to the legs flown then: the leg to the current item, and the one flown before.

    A leg starts at the item that was current before: jumps are followed. Take-off and landing are no legs: NaN there.

    Args:
        pos_ned: [m], shape (frames, 3).
        seq: current item, shape (frames,).
        path_ned: (seq, point) of each item with a position, beginning with the take-off point.
        curved: items that are not flown to in a straight line: NaN there.
    """
    distance = np.full(len(pos_ned), np.nan)
    positions = dict(path_ned)
    here, leg_before = path_ned[0][1] if path_ned else np.zeros(3), None
    for frames in np.split(np.arange(len(seq)), np.flatnonzero(np.diff(seq)) + 1):
        there = positions.get(int(seq[frames[0]])) if len(frames) else None
        if there is None:
            continue
        if int(seq[frames[0]]) in curved:
            here, leg_before = there, None
            continue
        leg = (here, there)
        if np.hypot(*(there - here)[:2]) >= LEG_MIN_M:
            legs = [leg] if leg_before is None else [leg, leg_before]
            distance[frames] = np.min([segment_distance_m(pos_ned[frames], *ends) for ends in legs], axis=0)
        here, leg_before = there, leg
    return distance


def segment_distance_m(points: Rows, start: Rows, end: Rows) -> Rows:
    """Distance of points, shape (n, 3), to the segment from start to end."""
    leg = np.asarray(end, float) - start
    length_sq = float(leg @ leg)
    fraction = np.clip((points - start) @ leg / length_sq, 0.0, 1.0) if length_sq > 0.0 else np.zeros(len(points))
    distance: Rows = np.linalg.norm(points - (start + fraction[:, None] * leg), axis=1)
    return distance


def clearance_min_m(history: History, world: WorldMap) -> float:
    """Least distance to a tree, wall or box [m] while armed, sampled at 5 Hz; infinite in an empty world."""
    points = history.pos_ned_true[history.is_armed][::CLEARANCE_EVERY_FRAMES].astype(float)
    if len(points) == 0:
        return float("nan")
    if not world.boxes.rows["period_ticks"].any():
        return float(np.min(world.obstacle_distance(points)))
    ticks = history.time_us[history.is_armed][::CLEARANCE_EVERY_FRAMES] // TICK_US
    return min(float(world.obstacle_distance(point, int(tick))) for point, tick in zip(points, ticks, strict=True))


def _rms(errors: Rows) -> Any:
    return np.sqrt(np.mean(np.square(errors), axis=0))


def rotation_error_ned(q_est: Rows, q_true: Rows) -> Rows:
    """Rotation vectors [rad] in ned that turn the true attitude into the estimated one; (x, y, z, w) rows."""
    ex, ey, ez, ew = q_est.T
    tx, ty, tz, tw = (-q_true[:, 0], -q_true[:, 1], -q_true[:, 2], q_true[:, 3])
    vector = np.stack(
        [
            ew * tx + ex * tw + ey * tz - ez * ty,
            ew * ty - ex * tz + ey * tw + ez * tx,
            ew * tz + ex * ty - ey * tx + ez * tw,
        ],
        axis=1,
    )
    scalar = ew * tw - ex * tx - ey * ty - ez * tz
    result: Rows = 2.0 * vector * np.where(scalar < 0.0, -1.0, 1.0)[:, None]
    return result


def planned_path(plan: Plan, home: GeoPoint, start_ne_m: tuple[float, float] = (0.0, 0.0)) -> list[tuple[int, Any]]:
    """(seq, ned point) of each item with a position, behind the take-off point, to which a return leads."""
    start_ned = np.array([*start_ne_m, 0.0])
    path: list[tuple[int, Any]] = [(-1, start_ned)]
    for item in plan.items:
        ned = start_ned if item.command == CMD_RETURN_TO_LAUNCH else item_ned(item, home, path[-1][1])
        if ned is not None:
            path.append((item.seq, ned))
    return path


def curved_items(plan: Plan) -> frozenset[int]:
    """Numbers of the items that are not flown to in a straight line."""
    return frozenset(item.seq for item in plan.items if item.command in NOT_STRAIGHT)


def item_ned(item: Any, origin: GeoPoint, previous: Any) -> Any:
    """Where an item leads [m], or None for items that are no place."""
    if item.command not in PLACES:
        return None
    alt_amsl_m = item.z + (origin.alt_m if item.frame in (3, 6) else 0.0)
    has_position = np.isfinite(item.x) and np.isfinite(item.y) and (item.x, item.y) != (0.0, 0.0)
    north, east, down = ned_from_geodetic(
        item.x if has_position else origin.lat_deg, item.y if has_position else origin.lon_deg, alt_amsl_m, origin
    )
    if item.command == CMD_TAKEOFF or not has_position:  # climbs and lands where it is
        north, east = previous[:2] if not has_position else (north, east)
    if item.command == CMD_LAND:
        down = min(down, 0.0)
    return np.array([north, east, down])


def summarise(
    flight: Any,
    history: History,
    running: Any,
    path_ned: Sequence[tuple[int, Rows]],
    curved: AbstractSet[int] = frozenset(),
) -> Summary:
    """Judges a finished flight.

    Args:
        flight: the `mission.flight.Flight`.
        history: its recorder's history.
        running: the script that flew, or None.
        path_ned: the planned path, as `cross_track_m` takes it; empty when there was no plan.
        curved: the same.
    """
    armed = history.is_armed
    in_mission = armed & (history.mode == Mode.MISSION)
    drives = flight.drives
    line_ned = [(seq, point * LEVEL) for seq, point in path_ned] if drives else path_ned
    way_ned = history.pos_ned_true[in_mission] * (LEVEL if drives else 1.0)
    cross = cross_track_m(way_ned, history.mission_seq[in_mission], line_ned, curved)
    errors = estimator_errors(history, armed)
    result, is_success = _result(flight, running)
    end_true, end_est = history.pos_ned_true[-1], history.pos_ned_est[-1]
    has_landed = armed.any() and not armed[-1]
    target = path_ned[-1][1] if path_ned and has_landed else np.full(3, np.nan)
    return Summary(
        result=result,
        is_success=is_success,
        simulated_s=float(history.time_us[-1] * 1e-6),
        armed_s=float(np.count_nonzero(armed) * FRAME_US * 1e-6),  # none of them is left out of a history
        ready_s=flight.ready_s,
        cross_track_p95_m=float(np.nanpercentile(cross, 95.0)) if np.isfinite(cross).any() else np.nan,
        landing_error_true_m=float(np.hypot(*(end_true - target)[:2])),
        landing_error_est_m=float(np.hypot(*(end_est - target)[:2])),
        pos_h_rms_m=max(errors.pos_ned_m[:2]),
        pos_v_rms_m=errors.pos_ned_m[2],
        vel_rms_m_s=max(errors.vel_ned_m_s),
        tilt_rms_deg=errors.tilt_deg,
        yaw_rms_deg=errors.yaw_deg,
        clearance_min_m=clearance_min_m(history, flight.world),
        battery_remaining=float(history.battery_remaining[-1]),
        innovations_in_band=flight.recorder.innovations_in_band(),
    )


def _result(flight: Any, running: Any) -> tuple[str, bool]:
    if flight.end_reason:
        return f"failed: {flight.end_reason}{' (crashed)' if flight.is_crashed else ''}", False
    if flight.is_crashed:
        return "crashed", False
    if running is None:
        return "no mission", True
    if running.error is not None:
        return f"failed: {running.error}", False
    return ("mission completed", True) if running.is_done else ("mission not finished", False)
