"""External setpoints: SET_POSITION_TARGET_LOCAL_NED, SET_POSITION_TARGET_GLOBAL_INT and SET_ATTITUDE_TARGET.

In: MAVLink's frames and type masks (a bit set = ignore). Out: one setpoint in our frames, NaN where free. An element
that is NaN counts as ignored. What cannot be flown is refused with a text, at most every 10 s.
"""

from collections.abc import Mapping
from math import cos, isfinite, isnan, nan, sin
from typing import Any

from autopilot.interface.client_requests import OffboardSetpoint
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.wire.altitude_frames import alt_amsl_m
from autopilot.mavlink.wire.convert import (
    degrees_from_e7,
    is_position,
    quat_from_wxyz,
)
from autopilot.mavlink.wire.number_bounds import (
    ACCEL_MAX_M_S2,
    ANGLE_MAX_RAD,
    POSITION_MAX_M,
    RATE_MAX_RAD_S,
    SPEED_MAX_M_S,
    is_within,
)
from autopilot.ports import (
    POSITION_VALID,
    SETPOINT_ATTITUDE,
    SETPOINT_RATE,
    SETPOINT_TRAJECTORY,
    YAW_ALIGNED,
)
from common.geodesy import ned_from_geodetic

Triple = tuple[float, float, float]

LOCAL_NED = 1  # MAV_FRAME
LOCAL_OFFSET_NED = 7
# Axes turn with the heading and positions count from the vehicle. BODY_NED is read as ArduPilot reads it.
HEADING_FRAMES = frozenset({8, 9, 12})  # BODY_NED, BODY_OFFSET_NED, BODY_FRD

# POSITION_TARGET_TYPEMASK
POSITION_BIT, VELOCITY_BIT, ACCELERATION_BIT = 1, 8, 64  # first of three
FORCE_BIT = 512
YAW_BIT = 1024
YAW_RATE_BIT = 2048
# ATTITUDE_TARGET_TYPEMASK
BODY_RATE_BITS = (1, 2, 4)
THRUST_BODY_BIT = 32
THROTTLE_BIT = 64
ATTITUDE_BIT = 128

FREE: Triple = (nan, nan, nan)


class RefusedSetpointError(Exception):
    """A setpoint that cannot be flown; the text says why."""


class OffboardService(Service):
    """Turns setpoint messages into the vehicle's setpoints."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._drives = not endpoint.vehicle.leaves_ground  # it has reverse, and may turn where it stands

    def messages(self) -> Mapping[str, Handler]:
        return {
            "SET_POSITION_TARGET_LOCAL_NED": self.local_received,
            "SET_POSITION_TARGET_GLOBAL_INT": self.global_received,
            "SET_ATTITUDE_TARGET": self.attitude_received,
            "SET_ACTUATOR_CONTROL_TARGET": self.actuators_received,
        }

    def local_received(self, _: Sender, fields: Any) -> None:
        """Takes a setpoint in a local frame; flown in mode Offboard."""
        try:
            setpoint = self._local_setpoint(fields)
        except RefusedSetpointError as refusal:
            self._endpoint.text_once(Severity.WARNING, f"Offboard: {refusal}")
            return
        self._endpoint.vehicle.request(setpoint)

    def global_received(self, _: Sender, fields: Any) -> None:
        """Takes a setpoint in a global frame; flown in mode Offboard."""
        try:
            setpoint = self._global_setpoint(fields)
        except RefusedSetpointError as refusal:
            self._endpoint.text_once(Severity.WARNING, f"Offboard: {refusal}")
            return
        self._endpoint.vehicle.request(setpoint)

    def attitude_received(self, _: Sender, fields: Any) -> None:
        """Takes an attitude or body rates with a thrust; flown in mode Offboard."""
        try:
            setpoint = attitude_setpoint(fields, self._endpoint.time_us, drives=self._drives)
        except RefusedSetpointError as refusal:
            self._endpoint.text_once(Severity.WARNING, f"Offboard: {refusal}")
            return
        self._endpoint.vehicle.request(setpoint)

    def actuators_received(self, _sender: Sender, _fields: Any) -> None:
        """Refused with a text: the motors belong to the control allocation."""
        self._endpoint.text_once(Severity.WARNING, "Offboard: direct actuator control is not supported")

    def _local_setpoint(self, fields: Any) -> OffboardSetpoint:
        mask, frame = fields.type_mask, fields.coordinate_frame
        pos = masked((fields.x, fields.y, fields.z), mask, POSITION_BIT)
        vel = masked((fields.vx, fields.vy, fields.vz), mask, VELOCITY_BIT)
        accel = masked((fields.afx, fields.afy, fields.afz), mask, ACCELERATION_BIT)
        state = self._endpoint.vehicle.state
        if frame in HEADING_FRAMES:
            if not state.estimate.flags & YAW_ALIGNED:
                raise RefusedSetpointError(f"frame {frame} needs a heading")
            pos, vel, accel = (turned(triple, state.yaw_rad) for triple in (pos, vel, accel))
        elif frame not in (LOCAL_NED, LOCAL_OFFSET_NED):
            raise RefusedSetpointError(f"frame {frame} is not supported")
        if frame != LOCAL_NED and not all(isnan(element) for element in pos):
            if not state.estimate.flags & POSITION_VALID:
                raise RefusedSetpointError("an offset needs a position")
            north, east, down = state.estimate.pos_ned
            pos = (pos[0] + north, pos[1] + east, pos[2] + down)
        return self._trajectory_setpoint(fields, pos, vel, accel)

    def _global_setpoint(self, fields: Any) -> OffboardSetpoint:
        mask = fields.type_mask
        lat_deg, lon_deg, alt_m = masked(
            (degrees_from_e7(fields.lat_int), degrees_from_e7(fields.lon_int), fields.alt), mask, POSITION_BIT
        )
        if isnan(lat_deg) != isnan(lon_deg):
            raise RefusedSetpointError("latitude and longitude must be set together")
        if not is_position(lat_deg, lon_deg):
            raise RefusedSetpointError("there is no such latitude and longitude")
        origin = self._endpoint.vehicle.state.origin
        amsl_m, refusal = alt_amsl_m(self._endpoint.vehicle.state, fields.coordinate_frame, alt_m)
        if refusal is not None:
            raise RefusedSetpointError(refusal.reason)
        north, east, down = nan, nan, origin.alt_m - amsl_m
        if not isnan(lat_deg):
            level_m = origin.alt_m if isnan(amsl_m) else amsl_m
            north, east, level_down = ned_from_geodetic(lat_deg, lon_deg, level_m, origin)
            down = nan if isnan(amsl_m) else level_down
        vel = masked((fields.vx, fields.vy, fields.vz), mask, VELOCITY_BIT)
        accel = masked((fields.afx, fields.afy, fields.afz), mask, ACCELERATION_BIT)
        return self._trajectory_setpoint(fields, (north, east, down), vel, accel)

    def _trajectory_setpoint(self, fields: Any, pos: Triple, vel: Triple, accel: Triple) -> OffboardSetpoint:
        if fields.type_mask & FORCE_BIT and any(isfinite(element) for element in accel):
            raise RefusedSetpointError("forces are not supported")
        yaw = nan if fields.type_mask & YAW_BIT else fields.yaw
        yaw_rate = nan if fields.type_mask & YAW_RATE_BIT else fields.yaw_rate
        require_within("position", POSITION_MAX_M, *pos)
        require_within("velocity", SPEED_MAX_M_S, *vel)
        require_within("acceleration", ACCEL_MAX_M_S2, *accel)
        require_within("heading", ANGLE_MAX_RAD, yaw)
        require_within("yaw rate", RATE_MAX_RAD_S, yaw_rate)
        turns = (yaw, yaw_rate) if self._drives else ()
        if not any(isfinite(element) for element in (*pos, *vel, *accel, *turns)):
            raise RefusedSetpointError("position, velocity and acceleration are all ignored")
        return OffboardSetpoint(
            self._endpoint.time_us,
            SETPOINT_TRAJECTORY,
            pos_ned=pos,
            vel_ned=vel,
            accel_ned=accel,
            yaw=yaw,
            yaw_rate=yaw_rate,
        )


def require_within(what: str, limit: float, *values: float) -> None:
    """Lets free elements and sizes that there are pass.

    Raises:
        RefusedSetpointError: a value is infinite or larger than any vehicle can mean.
    """
    if not is_within(limit, *values):
        raise RefusedSetpointError(f"the {what} is out of range")


def masked(triple: Triple, mask: int, first_bit: int) -> Triple:
    """The elements, NaN where their bit of the mask says ignore."""
    if mask & first_bit * 7 == first_bit * 7:
        return FREE
    x, y, z = triple
    return (
        nan if mask & first_bit else x,
        nan if mask & first_bit * 2 else y,
        nan if mask & first_bit * 4 else z,
    )


def turned(triple: Triple, yaw_rad: float) -> Triple:
    """A vector in the heading-levelled body frame, in ned axes.

    Raises:
        RefusedSetpointError: only one of its horizontal elements is set.
    """
    forward, right, down = triple
    if isnan(forward) and isnan(right):
        return triple
    if isnan(forward) or isnan(right):
        raise RefusedSetpointError("in a body frame x and y must be set together")
    cos_yaw, sin_yaw = cos(yaw_rad), sin(yaw_rad)
    return (cos_yaw * forward - sin_yaw * right, sin_yaw * forward + cos_yaw * right, down)


def attitude_setpoint(fields: Any, time_us: int, *, drives: bool = False) -> OffboardSetpoint:
    """The setpoint in a SET_ATTITUDE_TARGET.

    Args:
        fields: of the message.
        time_us: now.
        drives: a vehicle on the ground: a negative thrust is backwards, and without an attitude a yaw rate is enough.

    Raises:
        RefusedSetpointError: thrust is missing, or neither the attitude nor all three body rates are given.
    """
    mask = fields.type_mask
    if mask & THRUST_BODY_BIT:
        raise RefusedSetpointError("a thrust vector is not supported")
    if mask & THROTTLE_BIT or not isfinite(fields.thrust):
        raise RefusedSetpointError("an attitude needs a thrust")
    thrust = min(max(fields.thrust, -1.0 if drives else 0.0), 1.0)
    given = (fields.body_roll_rate, fields.body_pitch_rate, fields.body_yaw_rate)
    rates = [nan if mask & bit else rate for rate, bit in zip(given, BODY_RATE_BITS, strict=True)]
    require_within("body rate", RATE_MAX_RAD_S, *rates)
    if drives and mask & ATTITUDE_BIT:
        rates[:2] = (0.0, 0.0)
    if mask & ATTITUDE_BIT:
        if any(isnan(rate) for rate in rates):
            raise RefusedSetpointError("without an attitude all three body rates are needed")
        omega_frd = (rates[0], rates[1], rates[2])
        return OffboardSetpoint(time_us, SETPOINT_RATE, omega_frd=omega_frd, thrust=thrust)
    norm = sum(element * element for element in fields.q) ** 0.5
    if not 0.5 < norm < 2.0:  # also false for NaN; clients send unit quaternions in single precision
        raise RefusedSetpointError("the attitude quaternion is not of unit length")
    w, x, y, z = (element / norm for element in fields.q)
    return OffboardSetpoint(
        time_us,
        SETPOINT_ATTITUDE,
        yaw_rate=rates[2],
        q_ned_from_frd=quat_from_wxyz((w, x, y, z)),
        thrust=thrust,
    )
