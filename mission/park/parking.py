"""To have a companion drive into a pose: what a script asks of it over MAVLink, and how that ended, by the truth."""

from dataclasses import dataclass
from math import atan2, degrees, hypot, pi, remainder

from common.geodesy import geodetic_from_ned
from mission.flight import Flight
from mission.script import CMD_REPOSITION, FRAME_GLOBAL, Drone, ScriptTimeout
from mission.view.pose_goals import Pose
from policies.companion.companion import Companion
from policies.companion.engagement import Phase
from policies.companion.vehicle_link import COMPONENT

REACH_M, ALIGN_DEG, STOP_M_S = 0.3, 10.0, 0.3  # that count as there, as of the task
FIXED = 5  # GPS_FIX_TYPE: RTK, float or fixed
FIX_S, ENGAGE_S, REST_S = 30.0, 3.0, 2.0
DRIVE_S = 120.0  # and no longer


@dataclass(frozen=True, slots=True)
class Arrival:
    """How a drive ended, by the truth."""

    outcome: str  # "there", "touched" something, "missed" the pose
    distance_m: float  # from the pose
    turn_deg: float
    seconds: float
    why: str = ""  # the companion gave up

    @property
    def is_there(self) -> bool:
        return self.outcome == "there"


async def get_ready(drone: Drone) -> None:
    """Armed, its place known to centimetres."""
    await drone.wait_ready()
    await drone.until(lambda: _fix_type(drone) >= FIXED, FIX_S, "corrections of the base station")
    if not drone.is_armed:
        await drone.arm()


async def ask(drone: Drone, pose: Pose) -> None:
    """Sends the companion to a pose; returns when it has accepted that.

    Raises:
        CommandRefused: it has not; the message says why.
    """
    lat_deg, lon_deg, alt_amsl_m = geodetic_from_ned(pose[0], pose[1], 0.0, drone.origin)
    place = round(lat_deg * 1e7), round(lon_deg * 1e7), alt_amsl_m
    yaw = remainder(pose[2], 2.0 * pi)
    await drone.command_int(
        CMD_REPOSITION, FRAME_GLOBAL, (-1.0, 0.0, 0.0, yaw), *place, name="goto", component=COMPONENT
    )


async def drive(drone: Drone, flight: Flight, companion: Companion, pose: Pose) -> Arrival:
    """Drives into a pose, or to wherever it ends, and rests there.

    Raises:
        CommandRefused: the companion does not go there.
        ScriptTimeout: it has not begun to.
    """
    flight.rig.forget_impacts()
    begun_us = drone.time_us
    await ask(drone, pose)
    await drone.until(lambda: companion.phase is Phase.FLYING, ENGAGE_S, "the companion's taking over")
    why = ""
    try:
        await drone.until(lambda: companion.phase is not Phase.FLYING or _impact_m_s(flight) > 0.0, DRIVE_S, "the way")
    except ScriptTimeout:
        why = f"not there within {DRIVE_S:g} s"
    seconds = (drone.time_us - begun_us) * 1e-6
    if companion.phase is Phase.FLYING:
        await drone.hold()
    elif not companion.trouble.endswith("reached"):
        why = companion.trouble
    await drone.sleep(REST_S)
    return judged(flight, pose, seconds, why)


def judged(flight: Flight, pose: Pose, seconds: float, why: str = "") -> Arrival:
    """How a drive to a pose stands now."""
    truth = flight.rig.rows["truth"][0]
    x, y, z, w = (float(value) for value in truth["q_ned_from_frd"])
    yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    north, east = (float(value) for value in truth["pos_ned"][:2])
    distance_m = hypot(pose[0] - north, pose[1] - east)
    turn_deg = abs(degrees(remainder(pose[2] - yaw, 2.0 * pi))) if pose[2] == pose[2] else 0.0
    is_standing = hypot(*(float(value) for value in truth["vel_ned"])) < STOP_M_S
    is_in = distance_m < REACH_M and turn_deg < ALIGN_DEG and is_standing
    outcome = "touched" if _impact_m_s(flight) > 0.0 else "there" if is_in else "missed"
    return Arrival(outcome, distance_m, turn_deg, seconds, why)


def _impact_m_s(flight: Flight) -> float:
    return float(flight.rig.rows["truth"][0]["impact_speed"])


def _fix_type(drone: Drone) -> int:
    fix = drone.latest("GPS_RAW_INT")
    return 0 if fix is None else int(fix.fix_type)
