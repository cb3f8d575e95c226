"""Positions from outside: what motion capture and visual odometry measure, as PX4 takes it.

In: positions, velocities and attitudes in MAVLink's frames, with covariances. Out: reports in ned, or in a frame whose
heading is its own. What is not finite is refused with a text, and so is a frame that is not known.
"""

from collections.abc import Mapping, Sequence
from math import inf, isnan, nan, pi, sqrt
from typing import Any

from autopilot.inputs.external_position import ExternalReport, Vector
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import AUTOPILOT_COMPONENT, Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.wire.convert import quat_from_wxyz
from autopilot.mavlink.wire.number_bounds import ANGLE_MAX_RAD, POSITION_MAX_M, SPEED_MAX_M_S, is_within
from common.attitude import Quat, rotated, yaw_of

# MAV_FRAME
LOCAL_NED = 1
BODY_NED, BODY_FRD = 8, 12
LOCAL_FRD = 20
# MOCAP_NED, which MAVSDK sends, is a hall's frame that was aligned with north. VISION_NED and ESTIM_NED, older names of
# LOCAL_FRD, began wherever the camera looked.
NORTH_FRAMES = frozenset({LOCAL_NED, 14})
FREE_FRAMES = frozenset({LOCAL_FRD, 16, 18})
QUALITY_FAILED = -1
_POS_STD_MAX_M, _VEL_STD_MAX_M_S, _YAW_STD_MAX_RAD = 1.0e3, 1.0e2, pi  # wider says nothing
_UNKNOWN: Vector = (nan, nan, nan)


class RefusedPositionError(Exception):
    """A position that cannot be used; the text says why."""


class ExternalService(Service):
    """Hands what clients measure to the estimator."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def messages(self) -> Mapping[str, Handler]:
        return {
            "VISION_POSITION_ESTIMATE": self.position_received,
            "GLOBAL_VISION_POSITION_ESTIMATE": self.global_position_received,
            "VISION_SPEED_ESTIMATE": self.speed_received,
            "ATT_POS_MOCAP": self.mocap_received,
            "ODOMETRY": self.odometry_received,
        }

    def position_received(self, sender: Sender, fields: Any) -> None:
        """Takes position [m, ned from where the vehicle booted] and heading for the estimator (EKF2_EV_CTRL)."""
        self._take(sender, pose("VISION_POSITION_ESTIMATE", fields.usec, fields, fields.yaw, fields.reset_counter))

    def global_position_received(self, sender: Sender, fields: Any) -> None:
        """Takes position and heading as VISION_POSITION_ESTIMATE does."""
        kind = "GLOBAL_VISION_POSITION_ESTIMATE"
        self._take(sender, pose(kind, fields.usec, fields, fields.yaw, fields.reset_counter))

    def speed_received(self, sender: Sender, fields: Any) -> None:
        """Takes velocity [m/s, ned] for the estimator."""
        report = ExternalReport(
            "VISION_SPEED_ESTIMATE",
            fields.usec,
            vel=(fields.x, fields.y, fields.z),
            vel_std=deviation(_VEL_STD_MAX_M_S, fields.covariance, 0, 4, 8),
            reset_counter=fields.reset_counter,
        )
        self._take(sender, report)

    def mocap_received(self, sender: Sender, fields: Any) -> None:
        """Takes position [m, ned from where the vehicle booted] and heading for the estimator."""
        try:
            yaw = _heading(attitude(fields.q))
        except RefusedPositionError as refusal:
            self._refuse(str(refusal))
            return
        self._take(sender, pose("ATT_POS_MOCAP", fields.time_usec, fields, yaw, 0))

    def odometry_received(self, sender: Sender, fields: Any) -> None:
        """Takes position, velocity and heading for the estimator; frames LOCAL_NED, LOCAL_FRD, velocity BODY_FRD, too.

        A frame without north is turned so that its heading is the vehicle's when it is first heard, or after a reset.
        """
        try:
            self._check_quality(fields.quality)
            report = self._odometry(fields)
        except RefusedPositionError as refusal:
            self._refuse(str(refusal))
            return
        self._take(sender, report)

    def _check_quality(self, quality: int) -> None:
        least = int(self._endpoint.vehicle.params["EKF2_EV_QMIN"])
        if quality == QUALITY_FAILED:
            raise RefusedPositionError("the odometry has failed")
        if quality < least:
            raise RefusedPositionError(f"quality {quality} %, {least} % needed")

    def _odometry(self, fields: Any) -> ExternalReport:
        frame, child = fields.frame_id, fields.child_frame_id
        if frame not in NORTH_FRAMES and frame not in FREE_FRAMES:
            raise RefusedPositionError(f"frame {frame} is not supported")
        q_frame_from_frd = attitude(fields.q)
        vel: Vector = (fields.vx, fields.vy, fields.vz)
        if not is_within(SPEED_MAX_M_S, *vel):  # before a turn makes it unknown
            raise RefusedPositionError("the velocity is not one")
        if child in (BODY_FRD, BODY_NED):
            vel = rotated(q_frame_from_frd, vel) if q_frame_from_frd else _UNKNOWN
        elif child != frame:
            raise RefusedPositionError(f"velocity in frame {child} is not supported")
        return ExternalReport(
            "ODOMETRY",
            fields.time_usec,
            (fields.x, fields.y, fields.z),
            vel,
            _heading(q_frame_from_frd),
            *pose_deviations(fields.pose_covariance),
            vel_std=deviation(_VEL_STD_MAX_M_S, fields.velocity_covariance, 0, 6, 11),
            reset_counter=fields.reset_counter,
            is_north_known=frame in NORTH_FRAMES,
        )

    def _take(self, sender: Sender, report: ExternalReport) -> None:
        if sender.compid == AUTOPILOT_COMPONENT and sender.sysid != self._endpoint.sysid:
            return  # another vehicle telling where it is itself
        if not is_within(POSITION_MAX_M, *report.pos):
            self._refuse("the position is not one")
        elif not is_within(SPEED_MAX_M_S, *report.vel):
            self._refuse("the velocity is not one")
        elif not is_within(ANGLE_MAX_RAD, report.yaw):
            self._refuse("the heading is not one")
        elif reason := self._endpoint.vehicle.external.report(report):
            self._refuse(reason)

    def _refuse(self, reason: str) -> None:
        self._endpoint.text_once(Severity.WARNING, f"External position: {reason}")


def attitude(wxyz: Sequence[float]) -> Quat | None:
    """Our order, of length 1; None if it is not told.

    Raises:
        RefusedPositionError: the quaternion has another length than 1.
    """
    if any(isnan(value) for value in wxyz):
        return None
    length = sqrt(sum(value * value for value in wxyz))
    if not 0.9 < length < 1.1:
        raise RefusedPositionError("the attitude is not a quaternion of length 1")
    x, y, z, w = quat_from_wxyz(wxyz)
    return (x / length, y / length, z / length, w / length)


def _heading(q_frame_from_frd: Quat | None) -> float:
    """[rad] NaN if the attitude is not told."""
    return nan if q_frame_from_frd is None else yaw_of(q_frame_from_frd)


def pose(kind: str, time_us: int, fields: Any, yaw: float, reset_counter: int) -> ExternalReport:
    """The report of a message that holds x, y, z and their covariance."""
    pos_h_std, pos_v_std, yaw_std = pose_deviations(fields.covariance)
    return ExternalReport(
        kind,
        time_us,
        (fields.x, fields.y, fields.z),
        yaw=yaw,
        pos_h_std=pos_h_std,
        pos_v_std=pos_v_std,
        yaw_std=yaw_std,
        reset_counter=reset_counter,
    )


def pose_deviations(covariance: Sequence[float]) -> tuple[float, float, float]:
    """Horizontal, vertical, heading, from the upper triangle of a 6 x 6 matrix of x, y, z, roll, pitch, yaw."""
    level_std = deviation(_POS_STD_MAX_M, covariance, 0, 6)
    return level_std, deviation(_POS_STD_MAX_M, covariance, 11), deviation(_YAW_STD_MAX_RAD, covariance, 20)


def deviation(limit: float, covariance: Sequence[float], *diagonal: int) -> float:
    """The largest of some standard deviations; NaN if they are not known (the first element says so for all).

    Infinite beyond the limit: so wide a guess says nothing, and its variance would drown what single precision knows.
    """
    variances = [covariance[i] for i in diagonal]
    if isnan(covariance[0]) or any(isnan(variance) or variance < 0.0 for variance in variances):
        return nan
    largest = max(variances)
    return sqrt(largest) if largest <= limit * limit else inf
