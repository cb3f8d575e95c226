"""What the vehicle may follow, circle or land on: FOLLOW_TARGET, GLOBAL_POSITION_INT of others, LANDING_TARGET, orbits.

In: reports of others. Out: targets in our frames, given to the vehicle. What is reported counts from when it arrives:
the clocks of senders are not known.
"""

from collections.abc import Mapping, Sequence
from math import isfinite, isnan, nan, radians, sqrt, tan
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import LandingTargetReport, OrbitRequest, TargetReport
from autopilot.interface.vehicle_state import Reply, Severity
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Command, CommandHandler, Handler, Service, denied
from autopilot.mavlink.wire.altitude_frames import command_alt_amsl_m
from autopilot.mavlink.wire.convert import (
    INT32_MAX,
    UINT16_MAX,
    degrees_from_e7,
    is_position,
    quat_from_wxyz,
    whole,
)
from autopilot.mavlink.wire.number_bounds import POSITION_MAX_M, SPEED_MAX_M_S, is_known
from autopilot.ports import POSITION_VALID
from common.attitude import rotated, yaw_of
from common.geodesy import ned_from_geodetic

HAS_POSITION, HAS_VELOCITY, HAS_ATTITUDE = 1, 2, 8  # FOLLOW_TARGET.est_capabilities
_POS_STD_M = 1.0  # of a phone's receiver, if it does not say; guess
_VEL_STD_M_S = 0.3  # guess
_POS_STD_MIN_M = 0.1
_STATION_SILENT_US = 10_000_000  # a station's position is not used while another was used less than that ago
_WIDEST_RAD = radians(80.0)  # at which a camera may see a landing target
_YAW_BEHAVIOURS = range(6)  # ORBIT_YAW_BEHAVIOUR
_LOCAL_NED, _BODY_FRAMES = 1, frozenset({8, 12, 20})  # LOCAL_NED; BODY_NED, BODY_FRD, LOCAL_FRD


class TargetService(Service):
    """Turns reports about others into targets."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._source: tuple[int, bool] | None = None  # system followed, and whether by FOLLOW_TARGET
        self._source_us = 0

    def messages(self) -> Mapping[str, Handler]:
        return {
            "FOLLOW_TARGET": self.follow_target_received,
            "GLOBAL_POSITION_INT": self.station_position_received,
            "LANDING_TARGET": self.landing_target_received,
        }

    def commands(self) -> Mapping[int, CommandHandler]:
        return {mavlink.MAV_CMD_DO_ORBIT: self._orbit}

    # Follow

    def follow_target_received(self, sender: Sender, fields: Any) -> None:
        """Takes position, velocity and heading of the target that mode Follow follows; ignored without a position."""
        if not fields.est_capabilities & HAS_POSITION or not self._is_chosen(sender.sysid, is_follow_target=True):
            return
        pos_ned = self._pos_ned(fields.lat, fields.lon, fields.alt)
        if pos_ned is None:
            return
        vel_ned = None
        if fields.est_capabilities & HAS_VELOCITY and not any(map(isnan, fields.vel)):
            vel_ned = known_triple(SPEED_MAX_M_S, fields.vel)
            if vel_ned is None:
                self._endpoint.text_once(Severity.WARNING, "Follow: the target's velocity is out of range")
                return
        stds = [sqrt(var) for var in fields.position_cov[:2] if 0.0 < var <= POSITION_MAX_M]
        course_rad = heading_of(fields.attitude_q) if fields.est_capabilities & HAS_ATTITUDE else nan
        pos_std = max([*stds, _POS_STD_MIN_M]) if stds else _POS_STD_M
        self._endpoint.vehicle.request(TargetReport(pos_ned, vel_ned, pos_std, _VEL_STD_M_S, course_rad))

    def station_position_received(self, sender: Sender, fields: Any) -> None:
        """Takes the position of a ground station or of another vehicle as the target that mode Follow follows."""
        if sender.sysid == self._endpoint.sysid or not self._is_chosen(sender.sysid, is_follow_target=False):
            return
        pos_ned = self._pos_ned(fields.lat, fields.lon, fields.alt * 1.0e-3)
        if pos_ned is None:
            return
        vel_ned = (fields.vx * 0.01, fields.vy * 0.01, fields.vz * 0.01)
        course_rad = radians(fields.hdg * 0.01) if fields.hdg != UINT16_MAX else nan
        self._endpoint.vehicle.request(TargetReport(pos_ned, vel_ned, _POS_STD_M, _VEL_STD_M_S, course_rad))

    def _is_chosen(self, sysid: int, *, is_follow_target: bool) -> bool:
        """One target at a time: another takes over when it is silent, and FOLLOW_TARGET at once from a position."""
        now_us = self._endpoint.time_us
        source = (sysid, is_follow_target)
        is_better = self._source is not None and is_follow_target and not self._source[1]
        if self._source not in (None, source) and not is_better and now_us - self._source_us < _STATION_SILENT_US:
            return False
        self._source, self._source_us = source, now_us
        return True

    def _pos_ned(self, lat_e7: int, lon_e7: int, alt_amsl_m: float) -> tuple[float, float, float] | None:
        lat_deg, lon_deg = degrees_from_e7(lat_e7), degrees_from_e7(lon_e7)
        is_nowhere = lat_e7 in (0, INT32_MAX) and lon_e7 in (0, INT32_MAX)
        if is_nowhere or not is_position(lat_deg, lon_deg) or not abs(alt_amsl_m) < 20_000.0:
            return None
        return ned_from_geodetic(lat_deg, lon_deg, alt_amsl_m, self._endpoint.vehicle.state.origin)

    # Landing target

    def landing_target_received(self, _: Sender, fields: Any) -> None:
        """Takes where the target of a precision landing is: a position, or the angles under which a camera sees it."""
        state = self._endpoint.vehicle.state
        if not state.estimate.flags & POSITION_VALID:
            return
        if fields.position_valid:
            pos = known_triple(POSITION_MAX_M, (fields.x, fields.y, fields.z))
            if pos is None:
                self._refuse_landing_target("the position is out of range")
            elif fields.frame == _LOCAL_NED:
                self._endpoint.vehicle.request(LandingTargetReport(pos))
            elif fields.frame in _BODY_FRAMES:
                self._report_offset(pos)
            else:
                self._refuse_landing_target(f"frame {fields.frame} is not supported")
            return
        if not (abs(fields.angle_x) < _WIDEST_RAD and abs(fields.angle_y) < _WIDEST_RAD):  # also for NaN
            return
        # the camera looks down with its upper edge ahead: the image's x is right, its y is back
        ray = (-tan(fields.angle_y), tan(fields.angle_x), 1.0)
        if fields.distance > POSITION_MAX_M:
            self._refuse_landing_target("the distance is out of range")
            return
        if fields.distance > 0.0:
            scale = fields.distance / sqrt(sum(element * element for element in ray))
            self._report_offset((ray[0] * scale, ray[1] * scale, ray[2] * scale))
            return
        turned = rotated(state.estimate.q_ned_from_frd, ray)
        height_m = state.estimate.terrain_d - state.estimate.pos_ned[2]
        if turned[2] > 0.1 and height_m > 0.0:
            scale = height_m / turned[2]
            north, east, down = state.estimate.pos_ned
            pos = (north + turned[0] * scale, east + turned[1] * scale, down + height_m)
            self._endpoint.vehicle.request(LandingTargetReport(pos))

    def _refuse_landing_target(self, reason: str) -> None:
        self._endpoint.text_once(Severity.WARNING, f"Landing target: {reason}")

    def _report_offset(self, offset_frd: tuple[float, float, float]) -> None:
        estimate = self._endpoint.vehicle.state.estimate
        offset = rotated(estimate.q_ned_from_frd, offset_frd)
        north, east, down = estimate.pos_ned
        self._endpoint.vehicle.request(LandingTargetReport((north + offset[0], east + offset[1], down + offset[2])))

    # Orbit

    def _orbit(self, command: Command) -> Reply:
        """Goes round a point until another mode is chosen, or for a number of turns.

        Params: p1 radius [m], positive is clockwise, NaN: the usual one; p2 speed [m/s], negative turns the other way,
        NaN: 5 or what the circle allows, of a rover its own; p3 heading: 0 to the centre, 1 as it was, 2 free, 3 along
        the circle, 4 by the yaw stick, 5 as before, of a rover always 3; p4 turns [rad], 0 or NaN: for ever; p5, p6
        centre, NaN: here, or the present centre, of a rover a radius ahead; p7 altitude above sea level, in frames
        relative to home too (PX4), NaN: as it is.
        Refused: TEMPORARILY_REJECTED for what flies and is on the ground, and without a position; DENIED for a radius
        or speed that it cannot keep, and for a heading that is none of these.
        """
        if not is_position(command.x, command.y):
            return denied("there is no such latitude and longitude")
        yaw = whole(command.p3, 0)
        if yaw not in _YAW_BEHAVIOURS:
            return denied(f"heading behaviour {yaw} is not supported")
        altitude_m, reply = command_alt_amsl_m(self._endpoint.vehicle.state, command)
        if reply is not None:
            return reply
        turns_rad = command.p4 if isfinite(command.p4) else 0.0
        request = OrbitRequest(command.p1, command.p2, yaw, turns_rad, command.x, command.y, altitude_m)
        return self._endpoint.vehicle.request(request)


def known_triple(limit: float, values: Sequence[float]) -> tuple[float, float, float] | None:
    """The three numbers, None if one is not set or out of range."""
    x, y, z = values
    return (x, y, z) if is_known(limit, x, y, z) else None


def heading_of(q_wxyz: Sequence[float]) -> float:
    """Heading [rad] of an attitude; NaN if it is none."""
    if not 0.5 < sum(element * element for element in q_wxyz) < 2.0:
        return nan
    return yaw_of(quat_from_wxyz(q_wxyz))
