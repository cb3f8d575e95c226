"""Telemetry of the gimbal manager: what the gimbal can do, who has control, and where the camera points."""

from math import degrees

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.telemetry.motion import boot_ms
from autopilot.mavlink.wire.codec import known_type
from autopilot.payload.gimbal.gimbal import PITCH_MAX, PITCH_MIN, YAW_MAX, YAW_MIN
from autopilot.payload.gimbal.gimbal_control import AUTOPILOT, DEVICE_ID, Client, Flag, GimbalControl
from common.attitude import wrapped

DEVICE_ABILITIES = (
    mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_NEUTRAL
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_ROLL_LOCK
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_AXIS
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_LOCK
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_AXIS
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_FOLLOW
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK
    | mavlink.GIMBAL_MANAGER_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME
)

_information = known_type("GIMBAL_MANAGER_INFORMATION").pack
_status = known_type("GIMBAL_MANAGER_STATUS").pack
_orientation = known_type("MOUNT_ORIENTATION").pack


def gimbal_manager_information(state: VehicleState) -> bytes:
    """What the gimbal can do; asking for it starts the gimbal's status and attitude on this link."""
    return _information(
        time_boot_ms=boot_ms(state.time_us),
        cap_flags=DEVICE_ABILITIES | mavlink.GIMBAL_MANAGER_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL,
        gimbal_device_id=DEVICE_ID,
        pitch_min=PITCH_MIN,
        pitch_max=PITCH_MAX,
        yaw_min=YAW_MIN,
        yaw_max=YAW_MAX,
    )


def gimbal_manager_status(control: GimbalControl, sysid: int, state: VehicleState) -> bytes:
    """Who has control of the gimbal; at 5 Hz on links that have asked for its information."""
    primary, secondary = (_ids(client, sysid) for client in (control.control.primary, control.control.secondary))
    return _status(boot_ms(state.time_us), manager_flags(control), DEVICE_ID, *primary, *secondary)


def mount_orientation(control: GimbalControl, state: VehicleState) -> bytes:
    """Where the camera points (the old message)."""
    gimbal = control.gimbal
    gimbal.update()
    absolute_deg = degrees(wrapped(gimbal.yaw + state.yaw_rad))
    return _orientation(boot_ms(state.time_us), 0.0, degrees(gimbal.pitch), degrees(gimbal.yaw), absolute_deg)


def manager_flags(control: GimbalControl) -> int:
    """GIMBAL_MANAGER_FLAGS as of now: roll and pitch are always kept level."""
    aim = control.gimbal.aim
    is_locked = aim.is_yaw_locked or aim.roi_ned is not None
    yaw = Flag.YAW_LOCK | Flag.YAW_IN_EARTH_FRAME if is_locked else Flag.YAW_IN_VEHICLE_FRAME
    return int(Flag.ROLL_LOCK | Flag.PITCH_LOCK | yaw)


def _ids(client: Client, sysid: int) -> Client:
    return (sysid, 1) if client == AUTOPILOT else client
